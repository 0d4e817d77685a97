//! Errors of `tiff-reader` as errors of this crate.

use tiff_reader::TiffError;

use crate::RasterError;

/// Converts an error.
pub(super) fn fault(error: TiffError) -> RasterError {
    use TiffError as E;
    match error {
        E::Io(error, _) => RasterError::from_io(error, "the image"),
        E::Truncated { .. } | E::OffsetOutOfBounds { .. } => {
            RasterError::Truncated(format!("TIFF: {error}"))
        }
        E::DecodeOutputTooLarge { .. } | E::DecodeOutputAllocationFailed { .. } => {
            RasterError::AbsurdSize(format!("TIFF: {error}"))
        }
        E::InvalidTagValue { ref reason, .. } if reason.contains("budget") => {
            RasterError::AbsurdSize(format!("TIFF: {error}"))
        }
        E::UnsupportedPredictor(_)
        | E::UnsupportedPlanarConfiguration(_)
        | E::UnsupportedSampleFormat(_)
        | E::UnsupportedBitsPerSample(_)
        | E::UnsupportedCompression(_) => unsupported(format!("this variant ({error})")),
        E::InvalidImageLayout(ref what) if what.contains("not supported") => {
            unsupported(format!("this variant ({error})"))
        }
        error => RasterError::Unfamiliar(format!("TIFF: {error}")),
    }
}

/// Returns the error for an unsupported variant of TIFF.
pub(super) fn unsupported(feature: String) -> RasterError {
    RasterError::Unsupported {
        format: "TIFF",
        feature,
    }
}
