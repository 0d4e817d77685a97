//! What every terrain format tells about itself.

use super::input::FileBytes;
use super::{BadRaster, Decoded, OpenOptions};

/// A format that can be read. Each file or folder of `formats` declares one.
pub(super) struct Format {
    /// Name in messages.
    pub(super) name: &'static str,
    /// Whether a file that begins with these bytes (its first kibibyte, or all of a
    /// shorter one) is of this format.
    pub(super) begins: fn(head: &[u8]) -> bool,
    /// Extensions in lower case. Inside an archive, a file with one of them is a terrain.
    pub(super) extensions: &'static [(&'static str, Claim)],
    /// Reads the heights of a file.
    pub(super) decode: fn(&FileBytes, &OpenOptions) -> Result<Decoded, BadRaster>,
}

/// What an extension says about a file whose beginning says nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Claim {
    /// The file is of this format.
    Decides,
    /// The file should be of this format, and is damaged.
    Promises,
    /// Nothing: other formats use the extension, too.
    Suggests,
}

impl Format {
    /// What an extension says, if it is one of this format's.
    pub(super) fn claim(&self, extension: &str) -> Option<Claim> {
        let own = self.extensions.iter().find(|(own, _)| *own == extension);
        own.map(|(_, claim)| *claim)
    }
}

/// Whether a file begins with one of some signatures.
pub(super) fn starts_with_any(head: &[u8], signatures: &[&[u8]]) -> bool {
    signatures
        .iter()
        .any(|signature| head.starts_with(signature))
}
