//! Turns a panic of a decoder into an error.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::RasterError;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder; a panic inside becomes [`RasterError::DecoderFailed`] and prints nothing.
///
/// The decoders of image and science formats are third-party code that reads arbitrary files. In
/// some, a damaged file causes an overflow or an index out of range. All sizes are checked before a
/// decoder runs; this is for faults that such checks miss. A decoder owns all its data, so no
/// inconsistent state outlives the panic.
pub(super) fn guarded<T>(
    decoder: &'static str,
    decode: impl FnOnce() -> Result<T, RasterError>,
) -> Result<T, RasterError> {
    silence_guarded_panics();
    let outer = GUARDED.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(decode));
    GUARDED.set(outer);
    outcome.unwrap_or(Err(RasterError::DecoderFailed(decoder)))
}

/// Suppresses the messages of guarded decoders' panics; all others are reported as before.
fn silence_guarded_panics() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        let report = take_hook();
        set_hook(Box::new(move |info| {
            if GUARDED.get() {
                tracing::debug!("a decoder panicked: {info}");
            } else {
                report(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panic_in_a_decoder_is_an_error() {
        let outcome: Result<(), RasterError> = guarded("test", || panic!("index out of range"));
        assert!(matches!(outcome, Err(RasterError::DecoderFailed("test"))));
        assert!(!GUARDED.get());
    }
}
