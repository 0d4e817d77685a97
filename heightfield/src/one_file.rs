//! From one file to decoded samples: unpacks, tells the format, decodes.

use super::archive::{self, Zip};
use super::format::{Claim, Format, Parts};
use super::formats::{FORMATS, claim_of, gdal, headered, npy, raw};
use super::guard::guarded;
use super::input::{Data, FileBytes};
use super::{BadRaster, Decoded, OpenOptions};

/// Enough of a file to tell every format by its beginning.
const HEAD_BYTES: u64 = 1024;

/// Decodes a file, which may be packed.
pub(super) fn decode(input: &FileBytes, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    if let Some(layout) = options.raw {
        return raw::decode(input, layout, options);
    }
    let head = input.head(HEAD_BYTES)?;
    if archive::is_zip(&head) {
        let mut zip = guarded("ZIP", || Zip::open(input))?;
        if zip.is_numpy(input.extension()) {
            Parts::Variables.check_choice("a NumPy archive", options)?;
            return guarded("NumPy", || npy::decode_npz(&mut zip, options));
        }
        let unpacked = guarded("ZIP", || zip.only_entry(claim_of))?;
        let unpacked = unpacked.in_outline(input.is_outline());
        decode_packed("ZIP", &unpacked, options)
    } else if archive::is_gzip(&head) {
        let unpacked = guarded("gzip", || archive::unpack_gzip(input))?;
        let unpacked = unpacked.in_outline(input.is_outline());
        decode_packed("gzip", &unpacked, options)
    } else {
        decode_plain(input, &head, options)
    }
}

/// Archives inside archives are not opened, so that unpacking ends.
fn decode_packed(
    packing: &str,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    let head = input.head(HEAD_BYTES)?;
    if archive::is_zip(&head) || archive::is_gzip(&head) {
        return Err(BadRaster::Unsupported {
            format: "archive",
            feature: "an archive inside an archive".into(),
        });
    }
    let mut decoded = decode_plain(input, &head, options)?;
    decoded.format = format!("{} in {packing}", decoded.format);
    Ok(decoded)
}

fn decode_plain(
    input: &FileBytes,
    head: &[u8],
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    if head.is_empty() {
        return Err(BadRaster::Truncated("it is empty".into()));
    }
    if let Some(format) = by_content(head) {
        return or_by_gdal(decode_as(format, input, options), input, options);
    }
    // A header beside a file tells more than the file's extension.
    if !headered::is_of_another_kind(head)
        && let Some(decoded) = guarded("raw", || headered::decode_by_header(input, options))?
    {
        return Ok(decoded);
    }
    let format = by_extension(input.extension());
    let decoded = format.and_then(|format| decode_as(format, input, options));
    or_by_gdal(decoded, input, options)
}

/// What is not known or not supported here is given to GDAL, where there is a libgdal.
pub(super) fn or_by_gdal(
    decoded: Result<Decoded, BadRaster>,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    use BadRaster::{HeaderMissing, UnknownFormat, Unsupported};
    match (decoded, input.data()) {
        (decoded, _) if !options.gdal => decoded,
        (Err(fault @ (HeaderMissing(_) | Unsupported { .. })), Data::File(_, path)) => {
            // Where GDAL fails, too, what is missing here is the better thing to say.
            gdal::decode(path, options).ok().flatten().ok_or(fault)
        }
        (Err(fault @ UnknownFormat), Data::File(_, path)) => {
            gdal::decode(path, options)?.ok_or(fault)
        }
        (decoded, _) => decoded,
    }
}

fn decode_as(
    format: &Format,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    tracing::debug!(format.name, name = input.name(), "recognised");
    format.check_choice(options)?;
    guarded(format.name, || (format.decode)(input, options))
}

fn by_content(head: &[u8]) -> Option<&'static Format> {
    FORMATS.iter().find(|format| (format.begins)(head))
}

fn by_extension(extension: &str) -> Result<&'static Format, BadRaster> {
    let mut claims = FORMATS
        .iter()
        .filter_map(|format| Some((format, format.claim(extension)?)));
    match claims.next() {
        Some((format, Claim::Decides)) => Ok(format),
        Some((format, Claim::Promises)) => Err(BadRaster::Unfamiliar(format!(
            "its name says {}, its content does not begin like one",
            format.name
        ))),
        _ if raw::EXTENSIONS.contains(&extension) => Err(BadRaster::RawSizeMissing),
        _ => Err(BadRaster::UnknownFormat),
    }
}
