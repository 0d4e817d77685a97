//! Which decoder a file is for: its content decides, then its extension.

use std::path::Path;

use super::guard::guarded;
use super::input::Input;
use super::{Decoded, Fault, OpenOptions};
use super::{archive, asc, hgt, netcdf, npy, png, raw, tiff, usgs_dem};

/// Enough of a file to tell every format with a signature.
const HEAD_BYTES: u64 = 1024;

/// Decodes a file.
pub(super) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, Fault> {
    let input = Input::open(path)?;
    if let Some(layout) = options.raw {
        return raw::decode(&input, layout);
    }
    decode_input(&input, options, Packing::Allowed)
}

/// Whether what is at hand may be an archive: archives inside archives are not
/// opened, so that unpacking ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    /// A file on disk.
    Allowed,
    /// Something that was already unpacked.
    Unpacked,
}

/// Decodes bytes, which may be packed.
pub(super) fn decode_input(
    input: &Input,
    options: &OpenOptions,
    packing: Packing,
) -> Result<Decoded, Fault> {
    let head = input.head(HEAD_BYTES)?;
    if head.is_empty() {
        return Err(Fault::Truncated("it is empty".into()));
    }
    let format = recognise(&head, &input.extension()).ok_or(Fault::UnknownFormat)?;
    tracing::debug!(?format, name = input.name(), "recognised");
    match format {
        Format::Tiff => guarded("TIFF", || tiff::decode(input)),
        Format::Png => guarded("PNG", || png::decode(input, options.png_channel)),
        Format::NetCdf => guarded("NetCDF", || netcdf::decode(input)),
        Format::Npy => guarded("NumPy", || npy::decode_npy(input)),
        Format::Asc => asc::decode(input),
        Format::UsgsDem => usgs_dem::decode(input),
        Format::Hgt => hgt::decode(input),
        Format::Zip | Format::Gzip if packing == Packing::Unpacked => Err(Fault::Unsupported {
            format: "archive",
            feature: "an archive inside an archive".into(),
        }),
        Format::Zip => guarded("ZIP", || archive::decode_zip(input, options)),
        Format::Gzip => guarded("gzip", || archive::decode_gzip(input, options)),
        Format::RawWithoutLayout => Err(Fault::RawSizeMissing),
        Format::NotWhatItIsNamed(name) => Err(Fault::damaged(format!(
            "its name says {name}, its content does not begin like one"
        ))),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Tiff,
    Png,
    NetCdf,
    Npy,
    Zip,
    Gzip,
    Asc,
    UsgsDem,
    Hgt,
    RawWithoutLayout,
    NotWhatItIsNamed(&'static str),
}

fn recognise(head: &[u8], extension: &str) -> Option<Format> {
    let signatures: [(&[u8], Format); 13] = [
        (b"II*\0", Format::Tiff),
        (b"MM\0*", Format::Tiff),
        (b"II+\0", Format::Tiff),
        (b"MM\0+", Format::Tiff),
        (b"\x89PNG\r\n\x1a\n", Format::Png),
        (b"CDF\x01", Format::NetCdf),
        (b"CDF\x02", Format::NetCdf),
        (b"CDF\x05", Format::NetCdf),
        (b"\x89HDF\r\n\x1a\n", Format::NetCdf),
        (b"\x93NUMPY", Format::Npy),
        (b"PK\x03\x04", Format::Zip),
        (b"PK\x05\x06", Format::Zip),
        (b"\x1f\x8b", Format::Gzip),
    ];
    let by_signature = signatures
        .iter()
        .find(|(signature, _)| head.starts_with(signature))
        .map(|&(_, format)| format);
    if by_signature.is_some() {
        return by_signature;
    }
    if asc::looks_like_header(head) {
        return Some(Format::Asc);
    }
    if usgs_dem::looks_like_header(head) {
        return Some(Format::UsgsDem);
    }
    Some(match extension {
        "hgt" => Format::Hgt,
        "asc" => Format::Asc,
        "dem" => Format::UsgsDem,
        "tif" | "tiff" => Format::NotWhatItIsNamed("TIFF"),
        "png" => Format::NotWhatItIsNamed("PNG"),
        "nc" => Format::NotWhatItIsNamed("NetCDF"),
        "raw" | "bin" | "r16" | "r32" => Format::RawWithoutLayout,
        _ => return None,
    })
}
