//! Errors of updates, and whether the board still has its program.

use std::error::Error;
use std::{fmt, io};

/// Error of writing an image through the loader.
#[derive(Debug, thiserror::Error)]
pub enum UpdateError {
    /// No board or loader is connected.
    #[error("no board to update: looked for {searched_for} on USB")]
    Nothing {
        /// The device sought.
        searched_for: String,
    },
    /// Several devices match.
    #[error("several boards could be updated: {}", .0.join(", "))]
    Several(Vec<String>),
    /// The image is for another board than the connected one.
    #[error("the image is for {image}, and the board on USB runs {running}")]
    OtherBoard {
        /// The board that the image is for.
        image: &'static str,
        /// The board that the running firmware names.
        running: String,
    },
    /// The loader did not appear on USB.
    #[error("the board has left its program, and no loader has appeared on USB")]
    NoLoader,
    /// The loader describes its flash in an unsupported way.
    #[error("the loader's description of its flash is not understood: {0:?}")]
    Layout(String),
    /// The loader's flash differs from the board's chip.
    #[error("the loader is not that of {board}: it reports the flash {description:?}")]
    OtherChip {
        /// The board that the image is for.
        board: &'static str,
        /// The loader's description.
        description: String,
    },
    /// The loader cannot write or cannot read back.
    #[error("the loader cannot {0}")]
    Cannot(&'static str),
    /// The image would overwrite the calibrations.
    #[error("the image reaches to {end:#010x}, into the flash that keeps the calibrations")]
    Calibrations {
        /// The address past the image's last byte.
        end: u64,
    },
    /// The image has no vectors where the chip reads them.
    #[error("the image has no vectors at {0:#010x}")]
    NoVectors(u64),
    /// The loader was disconnected or does not respond.
    #[error("the loader disconnected during the request to {operation}")]
    Disconnected {
        /// Step that failed.
        operation: &'static str,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// The loader refused a request.
    #[error("the loader refused to {operation}: {why} (status {status}, state {state})")]
    Refused {
        /// Step that failed.
        operation: &'static str,
        /// Meaning of the loader's status.
        why: &'static str,
        /// The loader's status.
        status: u8,
        /// The loader's state.
        state: u8,
    },
    /// The loader does not finish an operation.
    #[error("the loader did not finish: {0}")]
    Endless(&'static str),
    /// The read-back differs from the image.
    #[error("flash at {0:#010x} does not read back as it was written")]
    Differs(u64),
}

/// A failed update.
#[derive(Debug)]
pub struct UpdateFailure {
    /// Reason of the failure.
    pub error: UpdateError,
    /// True if anything was erased: then the board has no complete program.
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
