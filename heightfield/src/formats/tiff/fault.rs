//! What the decoder's errors say to the user.

use tiff_reader::TiffError;

use crate::BadRaster;

/// The same error in this program's terms.
pub(super) fn fault(error: TiffError) -> BadRaster {
    use TiffError as E;
    match error {
        E::Io(error, _) => BadRaster::from_io(error, "the image"),
        E::Truncated { .. } | E::OffsetOutOfBounds { .. } => {
            BadRaster::Truncated(format!("TIFF: {error}"))
        }
        E::DecodeOutputTooLarge { .. } | E::DecodeOutputAllocationFailed { .. } => {
            BadRaster::AbsurdSize(format!("TIFF: {error}"))
        }
        E::InvalidTagValue { ref reason, .. } if reason.contains("budget") => {
            BadRaster::AbsurdSize(format!("TIFF: {error}"))
        }
        E::UnsupportedPredictor(_)
        | E::UnsupportedPlanarConfiguration(_)
        | E::UnsupportedSampleFormat(_)
        | E::UnsupportedBitsPerSample(_)
        | E::UnsupportedCompression(_) => unsupported(format!("this variant ({error})")),
        E::InvalidImageLayout(ref what) if what.contains("not supported") => {
            unsupported(format!("this variant ({error})"))
        }
        error => BadRaster::Unfamiliar(format!("TIFF: {error}")),
    }
}

/// A variant of TIFF that is not read.
pub(super) fn unsupported(feature: String) -> BadRaster {
    BadRaster::Unsupported {
        format: "TIFF",
        feature,
    }
}
