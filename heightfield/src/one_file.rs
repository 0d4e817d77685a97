//! From one file to decoded samples: finds the format and decodes.

use super::beside::{Notes, remark_unread};
use super::decoder_panic::guarded;
use super::format::{Claim, Format};
use super::formats::{FORMATS, flt_bil, gdal, raw};
use super::input::FileBytes;
use super::{Decoded, OpenOptions, RasterError};

/// Enough bytes of a file to recognise every format by its beginning.
const HEAD_BYTES: u64 = 1024;

/// Decodes a file, with GDAL if no format here reads it.
pub(super) fn decode(input: &FileBytes, options: &OpenOptions) -> Result<Decoded, RasterError> {
    if let Some(layout) = options.raw {
        check_no_open_options("raw samples", options)?;
        return with_notes(input, options, |options| {
            raw::decode(input, layout, options)
        });
    }
    let head = input.head(HEAD_BYTES)?;
    if head.is_empty() {
        return Err(RasterError::Truncated("it is empty".into()));
    }
    let decoded = with_notes(input, options, |options| decode_here(input, &head, options));
    or_by_gdal(decoded, input, options)
}

/// Decodes a file with GDAL's notes beside it.
fn with_notes(
    input: &FileBytes,
    options: &OpenOptions,
    decode: impl FnOnce(&OpenOptions) -> Result<Decoded, RasterError>,
) -> Result<Decoded, RasterError> {
    let notes = Notes::read(input, options.band.unwrap_or(1))?;
    let mut decoded = decode(&OpenOptions {
        no_data: options.no_data.or(notes.no_data),
        ..options.clone()
    })?;
    notes.apply(&mut decoded);
    if !input.is_outline() {
        remark_unread(input, &mut decoded);
    }
    Ok(decoded)
}

/// Decodes a file without GDAL.
fn decode_here(
    input: &FileBytes,
    head: &[u8],
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    if let Some(format) = by_content(head) {
        return decode_as(format, input, options);
    }
    // A header beside a file is more specific than the file's extension.
    if !flt_bil::is_of_another_kind(head)
        && let Some(decoded) = guarded("raw", || flt_bil::decode_by_header(input, options))?
    {
        check_no_open_options("plain samples with a header", options)?;
        return Ok(decoded);
    }
    let format = match gdal::by_beginning(head) {
        Some(_) => return Err(RasterError::UnknownFormat),
        None => by_extension(input.extension())?,
    };
    decode_as(format, input, options)
}

/// Opens formats that are unknown or not supported here with GDAL.
fn or_by_gdal(
    decoded: Result<Decoded, RasterError>,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    use RasterError::{ByGdal, HeaderMissing, UnknownFormat, Unsupported};
    let (fault, path) = match (decoded, input.path()) {
        (Err(fault @ (HeaderMissing(_) | UnknownFormat | Unsupported { .. })), Some(path))
            if options.gdal =>
        {
            (fault, path)
        }
        (decoded, _) => return decoded,
    };
    match (gdal::decode(path, options), fault) {
        (Ok(decoded), _) => Ok(decoded),
        (Err(by_gdal), UnknownFormat) => Err(by_gdal),
        (Err(by_gdal @ RasterError::NeedsGdal { .. }), HeaderMissing(_)) => Err(by_gdal),
        // This crate's fault is more specific than these errors of GDAL, but not than others.
        (Err(UnknownFormat | ByGdal(_) | RasterError::NeedsGdal { .. }), fault) => Err(fault),
        (Err(by_gdal), _) => Err(by_gdal),
    }
}

fn decode_as(
    format: &Format,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    tracing::debug!(format.name, name = input.name(), "recognised");
    format.check_choice(options)?;
    check_no_open_options(format.name, options)?;
    guarded(format.name, || (format.decode)(input, options))
}

/// Checks that no open option is set for a file that is read without GDAL.
fn check_no_open_options(format: &str, options: &OpenOptions) -> Result<(), RasterError> {
    match &options.open_options[..] {
        [] => Ok(()),
        [first, ..] => Err(RasterError::NoSuchPart {
            requested: format!("open option {first}"),
            available: format!("the file is {format}, which is read without GDAL"),
        }),
    }
}

fn by_content(head: &[u8]) -> Option<&'static Format> {
    FORMATS.iter().find(|format| (format.begins)(head))
}

fn by_extension(extension: &str) -> Result<&'static Format, RasterError> {
    let mut claims = FORMATS
        .iter()
        .filter_map(|format| Some((format, format.claim(extension)?)));
    match claims.next() {
        Some((format, Claim::Certain)) => Ok(format),
        Some((format, Claim::Expected)) => Err(RasterError::Unfamiliar(format!(
            "its name is that of {}, its content does not begin like one",
            format.name
        ))),
        _ if raw::EXTENSIONS.contains(&extension) => Err(RasterError::RawSizeMissing),
        _ => Err(RasterError::UnknownFormat),
    }
}
