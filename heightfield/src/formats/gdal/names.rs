//! Names of formats that GDAL reads, for messages on a machine without it.

use std::path::Path;

use super::packed::Packing;
use crate::beside::appended;

/// Formats by first bytes, or by a part of the first kibibyte.
const BEGINNINGS: [(&str, &[u8]); 18] = [
    ("NetCDF", b"CDF\x01"),
    ("NetCDF", b"CDF\x02"),
    ("NetCDF", b"CDF\x05"),
    ("HDF5 (NetCDF-4, BAG)", b"\x89HDF\r\n\x1a\n"),
    ("Erdas Imagine", b"EHFA_HEADER_TAG"),
    ("JPEG 2000", b"\0\0\0\x0cjP  \r\n\x87\n"),
    ("JPEG 2000", b"\xff\x4f\xff\x51"),
    ("GeoPackage", b"SQLite format 3\0"),
    ("PDS", b"PDS_VERSION_ID"),
    ("DTED", b"UHL1"),
    ("GRIB", b"GRIB"),
    ("WebP", b"RIFF"),
    ("GRASS ASCII", b"north:"),
    ("GRASS ASCII", b"south:"),
    ("GRASS ASCII", b"east:"),
    ("GRASS ASCII", b"west:"),
    ("GRASS ASCII", b"rows:"),
    ("GRASS ASCII", b"cols:"),
];

/// Formats by extension.
const EXTENSIONS: [(&str, &str); 12] = [
    ("dem", "USGS DEM"),
    ("dt0", "DTED"),
    ("dt1", "DTED"),
    ("dt2", "DTED"),
    ("nc", "NetCDF"),
    ("grd", "NetCDF or another grid"),
    ("gpkg", "GeoPackage"),
    ("jp2", "JPEG 2000"),
    ("bag", "BAG"),
    ("lbl", "PDS"),
    ("vrt", "VRT"),
    ("zarr", "Zarr"),
];

/// Returns the format of a file with distinctive first bytes.
pub(crate) fn by_beginning(head: &[u8]) -> Option<&'static str> {
    let mut known = BEGINNINGS.iter();
    let known = known.find(|(_, bytes)| head.starts_with(bytes));
    known.map(|(name, _)| *name)
}

/// Returns the format of a file or folder with some first bytes; `None` if they are not
/// distinctive.
pub(super) fn of(path: &Path, head: &[u8]) -> Option<&'static str> {
    if let Some(packing) = Packing::of(head) {
        return Some(packing.name());
    }
    if let Some(name) = by_beginning(head) {
        return Some(name);
    }
    let text = String::from_utf8_lossy(head);
    if text.contains("<VRTDataset") {
        return Some("VRT");
    }
    if text.trim_start().starts_with('{') {
        return Some("STAC");
    }
    let has_envi_header = [path.with_extension("hdr"), appended(path, "hdr")];
    let is_envi = |header: &Path| std::fs::read(header).is_ok_and(|text| text.starts_with(b"ENVI"));
    if has_envi_header
        .iter()
        .any(|header| header.is_file() && is_envi(header))
    {
        return Some("ENVI");
    }
    let extension = path.extension()?.to_string_lossy().to_lowercase();
    let known = EXTENSIONS.iter().find(|(end, _)| *end == extension);
    known.map(|(_, name)| *name)
}
