//! Failures of updates, and whether the board still has its program.

use std::error::Error;
use std::{fmt, io};

/// Reason for which the loader did not write an image.
#[derive(Debug, thiserror::Error)]
pub enum UpdateError {
    /// Nothing to update is plugged in.
    #[error("no board to update: looked for {looked_for} on USB")]
    Nothing {
        /// Device that was sought.
        looked_for: String,
    },
    /// Several could be meant.
    #[error("several boards could be updated: {}", .0.join(", "))]
    Several(Vec<String>),
    /// The image is for another board than the one that is plugged in.
    #[error("the image is for {image}, and the board on USB runs {running}")]
    OtherBoard {
        /// The board that the image is for.
        image: &'static str,
        /// The board that the running firmware names.
        running: String,
    },
    /// The loader did not show up.
    #[error("the board has left its program, and no loader has appeared on USB")]
    NoLoader,
    /// The loader's description of its flash is unknown.
    #[error("the loader describes its flash in a way that is not understood: {0:?}")]
    Layout(String),
    /// The loader's flash is not that of the board's chip.
    #[error("the loader is not that of {board}: it reports the flash {said:?}")]
    OtherChip {
        /// The board that the image is for.
        board: &'static str,
        /// Description by the loader.
        said: String,
    },
    /// The loader cannot write, or not read back.
    #[error("the loader cannot {0}")]
    Cannot(&'static str),
    /// The image would take the place of the calibrations.
    #[error("the image reaches to {end:#010x}, into the flash that keeps the calibrations")]
    Calibrations {
        /// The address past its last byte.
        end: u64,
    },
    /// The image has nothing where the chip looks for its vectors.
    #[error("the image has no vectors at {0:#010x}")]
    NoVectors(u64),
    /// The loader went away or does not answer.
    #[error("the loader is gone, while it was to {doing}")]
    Gone {
        /// Step that failed.
        doing: &'static str,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// The loader refused something.
    #[error("the loader refused to {doing}: {why} (status {status}, state {state})")]
    Refused {
        /// Step that failed.
        doing: &'static str,
        /// Meaning of its status.
        why: &'static str,
        /// The status it gave.
        status: u8,
        /// The state it is in.
        state: u8,
    },
    /// The loader never comes to an end.
    #[error("the loader did not finish: {0}")]
    Endless(&'static str),
    /// The read-back differs from the image.
    #[error("flash at {0:#010x} does not read back as it was written")]
    Differs(u64),
}

/// A failed update.
#[derive(Debug)]
pub struct UpdateFailure {
    /// Its reason.
    pub error: UpdateError,
    /// True if anything was erased: the board has then no whole program.
    pub erased: bool,
}

impl fmt::Display for UpdateFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl Error for UpdateFailure {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.error.source()
    }
}
