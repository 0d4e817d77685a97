//! Interface of all terrain formats.

use super::input::FileBytes;
use super::{Decoded, OpenOptions, RasterError};

/// A readable format. Each file or folder of `formats` declares one.
pub(super) struct Format {
    /// Name in messages.
    pub(super) name: &'static str,
    /// Returns true if a file that begins with these bytes (its first kibibyte, or all of a shorter
    /// one) is of this format.
    pub(super) begins: fn(head: &[u8]) -> bool,
    /// Extensions in lower case. Inside an archive, a file with one of them is a terrain.
    pub(super) extensions: &'static [(&'static str, Claim)],
    /// Parts of the file from which the user may choose.
    pub(super) parts: Parts,
    /// Reads the heights of a file.
    pub(super) decode: fn(&FileBytes, &OpenOptions) -> Result<Decoded, RasterError>,
}

/// Parts of a file of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parts {
    /// A single field.
    One,
    /// Numbered bands.
    Bands,
}

/// Meaning of a file's extension if its first bytes are not recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Claim {
    /// The file is of this format.
    Certain,
    /// The file should be of this format, but is damaged.
    Expected,
    /// No conclusion: other formats also use the extension.
    Possible,
}

impl Format {
    /// Checks that the user's choice of a part is one that the format has.
    ///
    /// # Errors
    /// [`RasterError::NoSuchPart`].
    pub(super) fn check_choice(&self, options: &OpenOptions) -> Result<(), RasterError> {
        if options.encoding.is_some() && !["PNG", "TIFF"].contains(&self.name) {
            return Err(RasterError::NoSuchPart {
                requested: "picture with heights in its colours".into(),
                available: format!("the file is {}", self.name),
            });
        }
        let refused = |requested: String| {
            let has = match self.parts {
                Parts::One => "one field of heights",
                Parts::Bands => "bands, chosen by number",
            };
            let available = format!("{} has {has}", self.name);
            Err(RasterError::NoSuchPart {
                requested,
                available,
            })
        };
        match (&options.variable, options.band) {
            (Some(variable), _) => refused(format!("variable {variable}")),
            (_, Some(band)) if band > 1 && self.parts == Parts::One => {
                refused(format!("band {band}"))
            }
            _ => Ok(()),
        }
    }

    /// Returns the meaning of an extension, if this format uses it.
    pub(super) fn claim(&self, extension: &str) -> Option<Claim> {
        let own = self.extensions.iter().find(|(own, _)| *own == extension);
        own.map(|(_, claim)| *claim)
    }
}

/// Returns true if a file begins with one of some signatures.
pub(super) fn starts_with_any(head: &[u8], signatures: &[&[u8]]) -> bool {
    signatures
        .iter()
        .any(|signature| head.starts_with(signature))
}

#[cfg(test)]
mod tests {
    use super::super::formats::FORMATS;
    use super::*;
    use crate::Encoding;

    #[test]
    fn choice_that_a_format_does_not_have_is_refused() {
        let accepting = |options: &OpenOptions| {
            let formats = FORMATS.iter();
            let formats = formats.filter(|format| format.check_choice(options).is_ok());
            formats.map(|format| format.name).collect::<Vec<_>>()
        };
        let mut options = OpenOptions::default();
        assert_eq!(accepting(&options).len(), FORMATS.len());
        options.band = Some(2);
        assert_eq!(accepting(&options), ["TIFF", "raster with a .hdr"]);
        options.band = None;
        options.variable = Some("z".into());
        assert!(accepting(&options).is_empty());
        options.variable = None;
        options.encoding = Some(Encoding::Terrarium);
        assert_eq!(accepting(&options), ["TIFF", "PNG"]);
    }
}
