//! Esri's `.flt`, `.bil`, `.bip` and `.bsq`: raw samples with a text file beside them as header.

mod esri;
mod layout;

#[cfg(test)]
mod tests;

use crate::decoded::Decoded;
use crate::format::{Claim, Format, Parts};
use crate::input::FileBytes;
use crate::{OpenOptions, RasterError, beside};
use layout::Layout;

/// Such data, by extension. A header also decides for files with other extensions.
pub(super) const FORMAT: Format = Format {
    name: "raster with a .hdr",
    begins: |_| false,
    extensions: &[
        ("flt", Claim::Certain),
        ("bil", Claim::Certain),
        ("bip", Claim::Certain),
        ("bsq", Claim::Certain),
    ],
    parts: Parts::Bands,
    decode: |input, options| {
        let decoded = decode_by_header(input, options)?;
        decoded.ok_or_else(|| RasterError::HeaderMissing(header_name(input)))
    },
};

/// Returns true if a file begins like a kind without plain samples: a header of the same name
/// belongs to another file.
pub(crate) fn is_of_another_kind(head: &[u8]) -> bool {
    const BEGINNINGS: [&[u8]; 7] = [
        b"SQLite format 3\0",
        b"EHFA_HEADER_TAG",
        b"PK\x03\x04",
        b"%PDF-",
        b"\xff\xd8\xff\xe0",
        b"\xff\xd8\xff\xe1",
        b"\x1f\x8b\x08",
    ];
    BEGINNINGS
        .iter()
        .any(|beginning| head.starts_with(beginning))
}

/// Setter of the metadata in a header, besides the layout of the samples.
type Describe = Box<dyn FnOnce(&mut Decoded) -> Result<(), RasterError>>;

/// Content of a header.
struct Header {
    format: &'static str,
    layout: Layout,
    /// Setter of the metadata besides the layout.
    describe: Describe,
}

/// Decodes a file by the header beside it; `None` if there is no header.
pub(crate) fn decode_by_header(
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Option<Decoded>, RasterError> {
    let Some((text, name)) = beside::text(input, "hdr")? else {
        return Ok(None);
    };
    let band = options.band.unwrap_or(1);
    if !esri::is_header(&text) {
        return Ok(None);
    }
    let header = esri::read(&text, input.extension(), input.len())
        .map_err(|fault| in_header(fault, &name))?;
    FORMAT.check_choice(options)?;
    header.layout.check(band, input.len(), &name)?;
    let storage = header.layout.plain(band)?.storage(input, options)?;
    let name_of_type = storage.sample_type().none().type_name();
    let bands = match header.layout.bands {
        1 => String::new(),
        bands => format!(", band {band} of {bands}"),
    };
    let format = format!("{}, {}{bands}", header.format, name_of_type);
    let mut decoded = Decoded::new(format, (header.layout.columns, header.layout.rows), storage);
    decoded.file_layout.bands = header.layout.bands;
    beside::reference_system(input, &mut decoded)?;
    (header.describe)(&mut decoded).map_err(|fault| in_header(fault, &name))?;
    if header.layout.bands > 1 && options.band.is_none() {
        decoded.remarks.push(format!(
            "it has {} bands: the first is used as the height (--input band=N)",
            header.layout.bands
        ));
    }
    Ok(Some(decoded))
}

/// Names the header in the error if the damage is there.
fn in_header(fault: RasterError, name: &str) -> RasterError {
    match fault {
        RasterError::Damaged(what) => RasterError::Damaged(format!("{name} beside it: {what}")),
        RasterError::Unfamiliar(what) => {
            RasterError::Unfamiliar(format!("{name} beside it: {what}"))
        }
        RasterError::AbsurdSize(what) => {
            RasterError::AbsurdSize(format!("{name} beside it: {what}"))
        }
        other => other,
    }
}

fn header_name(input: &FileBytes) -> String {
    let name = input.name();
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    format!("{stem}.hdr")
}
