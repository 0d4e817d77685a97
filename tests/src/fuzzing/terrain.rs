//! Arbitrary bytes as a terrain file of each format that is read without GDAL, with a sidecar.

use std::fs;
use std::path::Path;

use heightfield::{OpenOptions, PngChannel, Raster, RasterError, RawLayout, SampleType};

use super::bytes::Bytes;

/// Names of the file and its sidecar.
pub const KINDS: [[&str; 2]; 10] = [
    ["t.tif", "t.tfw"],
    ["t.tif", "t.tif.msk"],
    ["t.tif", "t.prj"],
    ["t.png", "t.pgw"],
    ["t.npy", "t.prj"],
    ["t.asc", "t.prj"],
    ["N45E007.hgt", "N45E007.prj"],
    ["t.flt", "t.hdr"],
    ["t.bil", "t.hdr"],
    ["t.raw", "t.prj"],
];

/// Runs an input. Byte 1 selects the kind, byte 2 the options, bytes 3 and 4 the length of the
/// sidecar; the rest is the file. Returns true if it is a terrain.
pub fn run(data: &[u8]) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let (kind, how, beside, file) = parts(data);
    let [name, neighbour] = KINDS[kind];
    fs::write(folder.path().join(name), file).expect("written");
    if !beside.is_empty() {
        fs::write(folder.path().join(neighbour), beside).expect("written");
    }
    open(&folder.path().join(name), how)
}

/// Returns an input with these parts.
#[must_use]
pub fn of(kind: usize, how: u8, beside: &[u8], file: &[u8]) -> Vec<u8> {
    let length = (beside.len() as u16).to_le_bytes();
    [&[kind as u8, how], &length[..], beside, file].concat()
}

fn parts(data: &[u8]) -> (usize, u8, &[u8], &[u8]) {
    let mut bytes = Bytes(data);
    let (kind, how) = (usize::from(bytes.byte()) % KINDS.len(), bytes.byte());
    let length = usize::from(u16::from_le_bytes([bytes.byte(), bytes.byte()]));
    let (beside, file) = bytes.0.split_at(length.min(bytes.0.len()));
    (kind, how, beside, file)
}

/// Opens the file and reads some heights. Returns true if it is a terrain.
fn open(path: &Path, how: u8) -> bool {
    let is_set = |bit: u8| how & (1 << bit) != 0;
    let raw = RawLayout {
        columns: 7,
        rows: 5,
        sample: SampleType::I16,
        endian: heightfield::Endian::Little,
    };
    let options = OpenOptions {
        gdal: false,
        raw: path
            .extension()
            .is_some_and(|end| end == "raw")
            .then_some(raw),
        max_in_memory_bytes: if is_set(0) { 0 } else { 1 << 20 },
        band: is_set(1).then_some(2),
        png_channel: is_set(2).then_some(PngChannel::Grey),
        classes: is_set(3),
        no_data: is_set(4).then_some(0.0),
        ..OpenOptions::default()
    };
    let raster = match Raster::open(path, &options) {
        Ok(raster) => raster,
        Err(error) => {
            let reported = error.to_string();
            assert!(!reported.contains(char::is_control), "{reported:?}");
            // Third-party decoders may panic; the project's may not.
            assert!(
                !matches!(error.fault(), RasterError::DecoderFailed(name) if !is_anothers(name))
            );
            return false;
        }
    };
    let last = [raster.columns(), raster.rows()].map(|count| f64::from(count) - 1.0);
    for level in [0, 1, 3, 6] {
        for share in [0.0, 0.4, 1.0] {
            let height = raster.surface(level, last.map(|last| share * last));
            assert!(!height.is_infinite(), "{height}");
        }
    }
    true
}

/// Returns true if a third-party library decodes the format.
fn is_anothers(format: &str) -> bool {
    ["TIFF", "PNG"].contains(&format)
}
