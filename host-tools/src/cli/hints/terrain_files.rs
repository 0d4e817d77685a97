//! What to do about a terrain file that does not open.
//!
//! Commands of other programs are tried by `tests/tests/converters.rs` where GDAL is
//! installed.

use std::path::Path;

use crate::cli::failure::Hint;
use crate::raster::{BadRaster, Encoding, Error};

impl Hint for Error {
    fn hint(&self) -> String {
        hint(self.path(), self.fault())
    }
}

fn hint(path: &Path, fault: &BadRaster) -> String {
    let hint = match fault {
        BadRaster::UnknownFormat => {
            return format!(
                "{}; or say how raw samples lie with --raw-size WxH",
                converted(path, "")
            );
        }
        // The same samples in a type and a packing that are read.
        BadRaster::Unsupported { .. } => {
            return converted(path, "-ot Float32 -co COMPRESS=DEFLATE");
        }
        BadRaster::NotAHeightField(_) => {
            return format!("take a file with heights; or {}", converted(path, "-b 1"));
        }
        BadRaster::ColourBands { bands, .. } => {
            return format!("if one of its bands holds heights, name it: --band 1 to {bands}");
        }
        BadRaster::SeveralHeights { names, .. } => {
            return format!(
                "name the one with the heights: --variable {}",
                names.join("|")
            );
        }
        BadRaster::NoSuchPart { .. } => "name one that is there, or leave that option out",
        BadRaster::CellKnown(_) => {
            "leave --ground-cell-m out: it is for files that do not state a cell size"
        }
        BadRaster::EncodedPicture(encoding) => {
            let name = match encoding {
                Encoding::TerrainRgb => "terrain-rgb",
                Encoding::Terrarium => "terrarium",
            };
            return format!(
                "if its colours are heights, say so: --encoding {name} (with --ground-cell-m for its scale)"
            );
        }
        BadRaster::HeaderMissing(name) => {
            return format!(
                "put {name} beside it; or say how the samples lie: --raw-size WxH --raw-type f32"
            );
        }
        BadRaster::TooLarge { columns, rows, .. } => {
            let (width, height) = (columns.min(&20_000), rows.min(&20_000));
            return cut(path, (*width, *height));
        }
        BadRaster::NotANumber { value, .. } => {
            return format!("if that stands for no data, say so: --no-data {value}");
        }
        BadRaster::DecoderFailed(_) => {
            return format!("get the file again; or {}", converted(path, ""));
        }
        BadRaster::Unreadable(_) => "check the path and that you may read the file",
        BadRaster::RawSizeMissing => {
            "say how the samples lie: --raw-size WxH --raw-type i16 --raw-endian little"
        }
        BadRaster::AmbiguousChannels(_) => {
            "say which channel holds the height: --png-channel red|green|blue|alpha|grey"
        }
        BadRaster::TooSmall { .. } => "take a larger part of the terrain",
        BadRaster::AllNoData { .. } => {
            "check that the file covers your area, or name another no-data value with --no-data"
        }
        // What is not an image of GDAL's has no checksum there.
        BadRaster::AbsurdSize(_) | BadRaster::Damaged(_) | BadRaster::Truncated(_)
            if !is_known_to_gdal(path) =>
        {
            "get the file again"
        }
        _ => {
            "get the file again; where it came from, `gdalinfo -checksum` tells whether it is whole"
        }
    };
    hint.into()
}

/// The extension in lower case.
fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}

fn is_known_to_gdal(path: &Path) -> bool {
    let others = [
        "npy", "npz", "las", "laz", "zip", "gz", "raw", "bin", "r16", "r32",
    ];
    !others.contains(&extension(path).as_str())
}

/// The command that makes a GeoTIFF of a file, with GDAL's `options`, or what there is
/// to do where GDAL does not read such files.
fn converted(path: &Path, options: &str) -> String {
    let (from, to) = names(path);
    let space = if options.is_empty() { "" } else { " " };
    match extension(path).as_str() {
        "npy" => format!(
            "store two dimensions of numbers: python3 -c \"import numpy as n; \
             n.save('heights.npy', n.squeeze(n.load('{from}')).astype('f4'))\""
        ),
        "npz" => format!(
            "store one array of two dimensions: python3 -c \"import numpy as n; \
             a = n.load('{from}'); n.save('heights.npy', n.squeeze(a[a.files[0]]).astype('f4'))\""
        ),
        // By PDAL's own pages; its writer takes the options behind its name.
        "las" | "laz" => format!(
            "points are no grid: make one of a metre with PDAL: pdal translate \"{from}\" \"{to}\" \
             --writers.gdal.resolution=1 --writers.gdal.output_type=mean"
        ),
        "zip" => format!("unpack it and name one of its files: python3 -m zipfile -e \"{from}\" ."),
        "gz" => format!("unpack it and name what comes out: gzip -dk \"{from}\""),
        "nc" | "grd" if options.contains("-b") => format!(
            "make a GeoTIFF of one of its variables, by its name for NAME: gdal_translate {options} \
             NETCDF:\"{from}\":NAME \"{to}\""
        ),
        _ => format!("convert it to GeoTIFF: gdal_translate{space}{options} \"{from}\" \"{to}\""),
    }
}

/// The command that cuts a part of so many samples out of a file.
fn cut(path: &Path, (width, height): (u64, u64)) -> String {
    let (from, to) = names(path);
    format!(
        "cut a part out (offsets, then width and height in samples): gdal_translate -srcwin 0 0 \
         {width} {height} \"{from}\" \"{to}\"; or make it coarser: gdal_translate -r average \
         -outsize 10% 10% \"{from}\" \"{to}\""
    )
}

/// The file, and what a converted copy of it in this folder is called.
fn names(path: &Path) -> (String, String) {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    (
        path.display().to_string(),
        format!("{}-converted.tif", stem.to_string_lossy()),
    )
}
