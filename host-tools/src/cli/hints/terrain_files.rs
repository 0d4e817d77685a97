//! Hints for a terrain file that does not open.
//!
//! `tests/tests/terrain/conversion_hints.rs` runs the commands of other programs if these are installed.

use std::io::ErrorKind;
use std::path::Path;

use heightfield_gdal::Error as GdalError;

use crate::cli::failure::Hint;
use heightfield::is_url;
use heightfield::{Error, RasterError, gdal};

impl Hint for Error {
    fn hint(&self) -> String {
        hint(self.path(), self.fault())
    }
}

fn hint(path: &Path, fault: &RasterError) -> String {
    let hint = match fault {
        RasterError::UnknownFormat => {
            return format!(
                "{}{}; or state the layout of raw samples with --input raw=WxH:i16:le",
                with_gdal(path),
                conversion_command(path, "")
            );
        }
        RasterError::NeedsGdal { .. } => {
            return format!(
                "{}; then this works: hapterra info {}; or {}",
                GdalError::how_to_install(),
                shell_names(path).0,
                conversion_command(path, "")
            );
        }
        RasterError::ByGdal(GdalError::OpenOption { .. }) => {
            "leave that option out, or name one that the driver has"
        }
        RasterError::ByGdal(_) => {
            return format!(
                "see whether GDAL's own program reads it: gdalinfo {}; or try a newer GDAL",
                shell_names(path).0
            );
        }
        RasterError::NeedsVrt { files, .. } => return vrt_command(path, files),
        RasterError::Unsupported { .. } => {
            return with_gdal(path) + &conversion_command(path, PLAIN);
        }
        RasterError::InTile { file, fault } => return hint(file, fault),
        RasterError::TilesDiffer { file, other, .. } => {
            return resampling_command(path, file, other);
        }
        RasterError::SamePlace { .. } => {
            "name the file with the heights, or a pattern of names in quotes that leaves the other out, as '*_dem.tif'"
        }
        RasterError::NoPlace(_) => {
            return format!(
                "leave it out with a pattern of names in quotes, as 'tiles/*.tif'; or bring it onto rows and columns of its map: gdalwarp -r bilinear {} {}",
                shell_names(path).0,
                shell_names(path).1
            );
        }
        RasterError::NoTiles(_) => {
            "name a folder with terrain files, or a pattern in quotes, as 'tiles/*.tif' or 'tiles/**/*.tif'"
        }
        RasterError::AmbiguousAssets { names, .. } if names.is_empty() => {
            "choose a STAC whose items have assets with heights"
        }
        RasterError::AmbiguousAssets { names, .. } => {
            return format!(
                "name the one with the heights, or a pattern in quotes for one of each item: --input variable={}",
                names.join("|")
            );
        }
        // Palettes and single bits are lost in a conversion of the sample type.
        RasterError::NotAHeightField(_) => {
            let one_band = format!("-b 1 {PLAIN}");
            return format!(
                "choose a file with heights; or {}",
                conversion_command(path, &one_band)
            );
        }
        RasterError::NoNumbers(_) => "choose a file with heights",
        RasterError::ColourBands { bands, .. } => {
            return format!(
                "if one of its bands contains heights, name it: --input band=1 to {bands}; if its colours encode heights: --input encoding=terrain-rgb or terrarium"
            );
        }
        RasterError::SeveralHeights { names, .. } => {
            return format!(
                "name the one with the heights: --input variable={}",
                names.join("|")
            );
        }
        RasterError::NoSuchPart { .. } => "name one that is there, or leave that option out",
        RasterError::CellSizeStated(_) => {
            "leave --input cell=… out: it is for files that do not state a cell size"
        }
        RasterError::EncodedPicture(encoding) => {
            let name = encoding.name();
            return format!(
                "if its colours are heights, state the encoding: --input encoding={name} (with --input cell=30m for its scale)"
            );
        }
        RasterError::HeaderMissing(name) => {
            return format!(
                "put {name} beside it; or state the sample layout: --input raw=WxH:f32"
            );
        }
        RasterError::TooLarge { columns, rows, .. } => {
            let (width, height) = (columns.min(&20_000), rows.min(&20_000));
            return crop_command(path, (*width, *height));
        }
        RasterError::DecoderFailed(_) => {
            return format!("get the file again; or {}", conversion_command(path, ""));
        }
        RasterError::Unfamiliar(_) if is_known_to_gdal(path) => {
            return format!(
                "see whether GDAL reads it whole: gdalinfo -checksum {}; or {}",
                shell_names(path).0,
                conversion_command(path, "")
            );
        }
        RasterError::Unfamiliar(_) => {
            return format!("get the file again; or {}", conversion_command(path, ""));
        }
        RasterError::Unreadable(_) => "check the path and that you may read the file",
        RasterError::Remote(error) => remote_hint(path, error),
        RasterError::RawSizeMissing => "state the sample layout: --input raw=WxH:i16:le",
        RasterError::AmbiguousChannels(_) => {
            "state which channel contains the height: --input channel=red|green|blue|alpha|grey"
        }
        RasterError::TooSmall { .. } => "choose a larger part of the terrain",
        RasterError::AllNoData { .. } => {
            "check that the file covers your area, or name another no-data value with --input no-data=VALUE"
        }
        // `gdalinfo -checksum` works only for formats that GDAL reads.
        RasterError::AbsurdSize(_) | RasterError::Damaged(_) | RasterError::Truncated(_)
            if !is_known_to_gdal(path) =>
        {
            "get the file again"
        }
        _ => {
            return format!(
                "get the file again; at its source, this shows whether it is complete: gdalinfo -checksum {}",
                shell_names(path).0
            );
        }
    };
    hint.into()
}

/// Returns the hint for a file at a URL.
fn remote_hint(path: &Path, error: &std::io::Error) -> &'static str {
    const NO_URLS: &str = "build it with them: cargo build --release --features remote (cargo xtask demo URL does); or fetch the file and name that";
    let url = path.to_str().unwrap_or_default().to_ascii_lowercase();
    let scheme = url.split_once("://").map(|(scheme, _)| scheme);
    let [key, server] = match scheme {
        Some("s3" | "s3a") => [
            "set the server's variables: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_SKIP_SIGNATURE=true for a public bucket; AWS_REGION; AWS_ENDPOINT_URL where it is not Amazon's (and AWS_ALLOW_HTTP=true for http)",
            "check the network, and AWS_ENDPOINT_URL where the server is not Amazon's; and try again",
        ],
        Some("gs") => [
            "set the server's variables: GOOGLE_APPLICATION_CREDENTIALS to the key file of an account that may read it, or GOOGLE_SKIP_SIGNATURE=true for a public bucket; GOOGLE_BASE_URL where it is not Google's",
            "check the network, and GOOGLE_BASE_URL where the server is not Google's; and try again",
        ],
        Some("az" | "azure" | "abfs" | "abfss" | "adl") => [
            "set the server's variables: AZURE_STORAGE_ACCOUNT_NAME; AZURE_STORAGE_ACCOUNT_KEY, AZURE_STORAGE_SAS_TOKEN, or AZURE_SKIP_SIGNATURE=true for a public container; AZURE_STORAGE_ENDPOINT where it is not Microsoft's (and AZURE_ALLOW_HTTP=true for http)",
            "check the network, AZURE_STORAGE_ACCOUNT_NAME, and AZURE_STORAGE_ENDPOINT where the server is not Microsoft's; and try again",
        ],
        _ => [
            "check the URL; append a key as ?KEY=VALUE",
            "check the URL and the line, and try again",
        ],
    };
    match error.kind() {
        ErrorKind::Unsupported if !cfg!(feature = "remote") => NO_URLS,
        ErrorKind::Unsupported => "fetch the file with another program and name that",
        ErrorKind::NotFound => "check the URL",
        ErrorKind::PermissionDenied | ErrorKind::InvalidInput => key,
        _ => server,
    }
}

/// Returns the extension in lower case.
fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}

/// Returns the hint for GDAL, if GDAL is missing and may read the file unchanged.
fn with_gdal(path: &Path) -> String {
    match is_known_to_gdal(path) && gdal().is_err() {
        true => format!(
            "{}, and name the file again; or ",
            GdalError::how_to_install()
        ),
        false => String::new(),
    }
}

fn is_known_to_gdal(path: &Path) -> bool {
    let others = [
        "npy", "npz", "las", "laz", "zip", "gz", "tar", "tgz", "raw", "bin", "r16", "r32",
    ];
    !others.contains(&extension(path).as_str())
}

/// GDAL's options for a sample type and compression that can be read.
const PLAIN: &str = "-ot Float32 -co COMPRESS=DEFLATE";

/// Stores the last two dimensions of an array's first layer in a readable sample type.
const FROM_NPY: &str = "import sys, numpy as n; a = n.squeeze(n.load(sys.argv[1])); \
    n.save('heights.npy', a.reshape(-1, *a.shape[-2:])[0].astype('f4'))";
/// The same for the first of several arrays.
const FROM_NPZ: &str = "import sys, numpy as n; f = n.load(sys.argv[1]); a = n.squeeze(f[f.files[0]]); \
    n.save('heights.npy', a.reshape(-1, *a.shape[-2:])[0].astype('f4'))";
/// Makes a grid of points: each cell has the mean height of its ground points, or of all its points
/// if none are marked as ground. Cells without points are no-data. The points' reference system is
/// written to a `.prj`.
const FROM_POINTS: &str = r"import sys, laspy, numpy as n; f, t, d = sys.argv[1:]; d = float(d); p = laspy.read(f); g = p.classification == 2; p = p[g] if g.any() else p; x, y, z = (n.array(v) for v in (p.x, p.y, p.z)); e = [d * n.arange(n.floor(v.min() / d), n.floor(v.max() / d) + 2) for v in (y, x)]; s, c = n.histogram2d(y, x, e, weights=z)[0], n.histogram2d(y, x, e)[0]; n.savetxt(t + '.asc', n.where(c > 0, s / n.maximum(c, 1), -9999)[::-1], '%.3f', comments='', header='ncols %d\nnrows %d\nxllcorner %.10g\nyllcorner %.10g\ncellsize %.10g\nnodata_value -9999' % (*c.shape[::-1], e[1][0], e[0][0], d)); r = p.header.parse_crs(); r and open(t + '.prj', 'w').write(r.to_wkt())";

/// Returns the command that converts a file to a readable one, with GDAL's `options` if GDAL reads
/// such files.
fn conversion_command(path: &Path, options: &str) -> String {
    let (from, to) = shell_names(path);
    let space = if options.is_empty() { "" } else { " " };
    match extension(path).as_str() {
        "npy" => format!("store two dimensions of numbers: python3 -c \"{FROM_NPY}\" {from}"),
        "npz" => {
            format!("store one array of two dimensions: python3 -c \"{FROM_NPZ}\" {from}")
        }
        "las" | "laz" => format!(
            "points are no grid: pip install laspy[lazrs] pyproj, and average them in cells, the last number is a cell's side in their unit: python3 -c \"{FROM_POINTS}\" {from} {} 1",
            quoted(&stem(path))
        ),
        "zip" => format!("unpack it and name one of its files: python3 -m zipfile -e {from} ."),
        "gz" => format!("unpack it and name the result: gzip -dk {from}"),
        "tar" | "tgz" => format!("unpack it and name one of its files: tar -xf {from}"),
        _ => format!("convert it to GeoTIFF: gdal_translate{space}{options} {from} {to}"),
    }
}

/// Returns the command that makes a VRT of files.
fn vrt_command(path: &Path, files: &[String]) -> String {
    /// More names would make the command unreadable.
    const MAX_NAMES: usize = 20;
    let each: Vec<_> = files
        .iter()
        .take(MAX_NAMES)
        .map(|file| quoted(file))
        .collect();
    let more = match files.len() {
        0..=MAX_NAMES => String::new(),
        count => format!(" … (all {count} files)"),
    };
    let to = quoted(&format!("{}.vrt", stem(path)));
    format!(
        "combine its files into one terrain, each at its own position: gdalbuildvrt -vrtnodata -32768 {to} {}{more}; and name {to}",
        each.join(" ")
    )
}

/// Returns the command that cuts a part of this size, in samples, out of a file.
fn crop_command(path: &Path, (width, height): (u64, u64)) -> String {
    let (from, to) = shell_names(path);
    format!(
        "cut a part out (offsets, then width and height in samples): gdal_translate -srcwin 0 0 \
         {width} {height} {from} {to}; or make it coarser: gdal_translate -r average \
         -outsize 10% 10% {from} {to}"
    )
}

/// Returns the command that resamples files of different grids to one grid.
fn resampling_command(path: &Path, file: &Path, other: &Path) -> String {
    const ONTO_ONE: &str = "gdalwarp -r bilinear -ot Float32 -dstnodata -9999 -co TILED=YES \
                            -co COMPRESS=DEFLATE -co BIGTIFF=IF_SAFER";
    let name = path.display().to_string();
    if path.is_dir() {
        let files = format!("{}/*.{}", quoted(&name), extension(file));
        return format!(
            "leave it out with a pattern of names in quotes, as 'tiles/*.tif'; or resample all of them to one grid: {ONTO_ONE} {files} one.tif"
        );
    }
    if !name.contains(['*', '?', '[']) || is_url(&name) {
        let files = [other, file].map(|file| shell_names(file).0).join(" ");
        return format!("resample them to one grid: {ONTO_ONE} {files} one.tif");
    }
    let files = name.replace(' ', "\\ ");
    format!(
        "leave it out with a pattern of names in quotes, as 'tiles/*.tif'; or resample all of them to one grid: \
         {ONTO_ONE} {files} one.tif"
    )
}

/// Returns the file and its converted copy in this folder, as shell words.
fn shell_names(path: &Path) -> (String, String) {
    let to = format!("{}.tif", stem(path));
    let from = path.display().to_string();
    // GDAL's name for a file at a URL.
    let from = match from.starts_with("http") && is_url(&from) {
        true => format!("/vsicurl/{from}"),
        false => from,
    };
    (quoted(&from), quoted(&to))
}

/// Returns the name of a converted copy, without its extension.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    format!("{}-converted", stem.to_string_lossy())
}

/// Quotes any name as one shell word.
fn quoted(name: &str) -> String {
    match name.contains(['"', '$', '`', '\\', '!']) && cfg!(unix) {
        false => format!("\"{name}\""),
        true => format!("'{}'", name.replace('\'', r"'\''")),
    }
}
