//! Terrain packed in a ZIP or gzip file, as SRTM tiles are handed out.

use std::io::Read;

use flate2::bufread::GzDecoder;
use zip::ZipArchive;

use super::input::{Input, ReadSeek};
use super::open::{Packing, decode_input};
use super::{Decoded, Fault, OpenOptions, npy};

/// Deflate packs at most this many bytes into one.
pub(super) const DEFLATE_RATIO: u64 = 1040;

/// No packed terrain is unpacked past this: unpacking is in memory.
const LARGEST_UNPACKED: u64 = 1 << 30;

/// Extensions of what an archive may hold.
const TERRAIN_EXTENSIONS: [&str; 10] = [
    "hgt", "tif", "tiff", "asc", "png", "dem", "nc", "grd", "npy", "txt",
];

/// The one terrain in a ZIP archive, or a NumPy `.npz`.
pub(super) fn decode_zip(input: &Input, options: &OpenOptions) -> Result<Decoded, Fault> {
    let mut archive = ZipArchive::new(input.reader()?).map_err(|error| zip_fault(&error))?;
    let names: Vec<String> = archive
        .file_names()
        .filter_map(|name| Some(name.ok()?.into_owned()))
        .collect();
    if input.extension() == "npz" || names.iter().any(|name| name.ends_with(".npy")) {
        return npy::decode_npz(&mut archive, &names);
    }
    let terrain: Vec<&String> = names.iter().filter(|name| is_terrain(name)).collect();
    let name = match terrain.as_slice() {
        [name] => *name,
        [] => {
            return Err(Fault::NotAHeightField(
                "the archive holds no terrain file".into(),
            ));
        }
        [first, second, ..] => {
            return Err(Fault::NotAHeightField(format!(
                "the archive holds several terrain files, {first} and {second} among them"
            )));
        }
    };
    let bytes = unpack_entry(&mut archive, name)?;
    decode_unpacked(name, bytes, options, "ZIP")
}

/// The terrain in a gzip file; its name is the file's without `.gz`.
pub(super) fn decode_gzip(input: &Input, options: &OpenOptions) -> Result<Decoded, Fault> {
    let name = input.name();
    let name = match name
        .len()
        .checked_sub(3)
        .and_then(|end| name.split_at_checked(end))
    {
        Some((stem, extension)) if extension.eq_ignore_ascii_case(".gz") => stem,
        _ => name,
    };
    let limit = LARGEST_UNPACKED.min(input.len().saturating_mul(DEFLATE_RATIO));
    let mut decoder = GzDecoder::new(input.reader()?);
    let bytes = read_limited(&mut decoder, limit)?;
    decode_unpacked(name, bytes, options, "gzip")
}

fn decode_unpacked(
    name: &str,
    bytes: Vec<u8>,
    options: &OpenOptions,
    packing: &str,
) -> Result<Decoded, Fault> {
    let input = Input::unpacked(name, bytes);
    let mut decoded = decode_input(&input, options, Packing::Unpacked)?;
    decoded.format = format!("{} in {packing}", decoded.format);
    Ok(decoded)
}

fn is_terrain(name: &str) -> bool {
    let extension = name
        .rsplit_once('.')
        .map(|(_, extension)| extension.to_lowercase());
    extension.is_some_and(|extension| TERRAIN_EXTENSIONS.contains(&extension.as_str()))
}

/// Unpacks an entry into memory, never more than its packed size can hold.
pub(super) fn unpack_entry<R: ReadSeek>(
    archive: &mut ZipArchive<R>,
    name: &str,
) -> Result<Vec<u8>, Fault> {
    let mut entry = archive.by_name(name).map_err(|error| zip_fault(&error))?;
    let packed = entry.compressed_size();
    let limit = LARGEST_UNPACKED.min(packed.saturating_mul(DEFLATE_RATIO));
    if entry.size() > limit {
        return Err(Fault::AbsurdSize(format!(
            "{} unpacked bytes from {packed} packed ones in {name}",
            entry.size()
        )));
    }
    read_limited(&mut entry, limit)
}

fn read_limited(reader: &mut dyn Read, limit: u64) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    reader
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| Fault::from_io(error, "the packed data"))?;
    if bytes.len() as u64 > limit {
        return Err(Fault::AbsurdSize(format!(
            "more than {limit} unpacked bytes"
        )));
    }
    Ok(bytes)
}

fn zip_fault(error: &zip::result::ZipError) -> Fault {
    use zip::result::ZipError;
    match error {
        ZipError::UnsupportedArchive(what) => Fault::Unsupported {
            format: "ZIP",
            feature: (*what).to_string(),
        },
        _ => Fault::damaged(format!("ZIP: {error}")),
    }
}
