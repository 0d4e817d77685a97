//! The terrain file argument and its options, shared by every subcommand that
//! reads one.

use std::path::PathBuf;

use clap::ValueHint;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::cli::failure::Failure;
use crate::cli::terminal::waiting::shown_meanwhile;
use heightfield::disk_cache::DiskCache;
use heightfield::shown::shown;
use heightfield::{
    CellUnit, Certainty, Encoding, Endian, OpenOptions, PngChannel, Raster, RawLayout, SampleType,
    files_read_with, metres_in,
};
use heightfield::{file_name, is_url};

/// Where `--help` lists these options.
const INPUT: &str = "Input";

/// A terrain file, and what the user says about it that it does not say itself.
#[derive(Clone, Debug, clap::Args)]
pub struct TerrainFile {
    /// Terrain file: GeoTIFF, .hgt, .asc, PNG, .flt, .bil, .npy, or raw samples; many as one: a folder
    /// or a quoted pattern ('tiles/*.tif'); one of these at a URL (https, s3, gs, az), in builds with
    /// them; or what GDAL reads, where it is installed: VRT, STAC, NetCDF, DTED, archives and more
    #[arg(value_hint = ValueHint::FilePath)]
    pub file: PathBuf,

    /// What the file does not say itself.
    #[command(flatten)]
    pub reading: ReadingOptions,
}

/// What the user says about a terrain file that it does not say itself.
#[derive(Clone, Debug, clap::Args)]
pub struct ReadingOptions {
    /// The file is raw samples, north row first: WIDTHxHEIGHT
    #[arg(long, value_name = "WxH", value_parser = parse_size, help_heading = INPUT)]
    pub raw_size: Option<(u32, u32)>,

    /// Type of a raw sample
    #[arg(long, value_parser = one_of(SampleType::ALL, SampleType::name), default_value = "i16", requires = "raw_size", help_heading = INPUT)]
    pub raw_type: SampleType,

    /// Byte order of a raw sample
    #[arg(long, value_parser = one_of(Endian::ALL, Endian::name), default_value = "little", requires = "raw_size", help_heading = INPUT)]
    pub raw_endian: Endian,

    /// Stored value that means no data (replaces what the file says)
    #[arg(long, allow_negative_numbers = true, value_name = "VALUE", help_heading = INPUT)]
    pub no_data: Option<f64>,

    /// Band that holds the height, the first being 1
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = INPUT)]
    pub band: Option<u32>,

    /// Which raster of several holds the height: a NetCDF variable, a file of an archive, a STAC asset
    #[arg(long, alias = "asset", value_name = "NAME", help_heading = INPUT)]
    pub variable: Option<String>,

    /// Option of the GDAL driver that opens the file; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_open_option, help_heading = INPUT)]
    pub open_option: Vec<String>,

    /// Side of a cell on the ground in metres, for files that do not state it
    #[arg(long, value_name = "M", value_parser = parse_side, help_heading = INPUT)]
    pub ground_cell_m: Option<f64>,

    /// Unit of the heights, for files that do not state it or state it wrongly: m, ft, us-ft,
    /// or metres in a unit, as 0.01
    #[arg(long, value_name = "UNIT", value_parser = parse_unit, help_heading = INPUT)]
    pub vertical_unit: Option<f64>,

    /// How the colours of a picture (PNG, TIFF, WebP by GDAL) encode heights
    #[arg(long, value_parser = one_of(Encoding::ALL, Encoding::name), conflicts_with = "png_channel", help_heading = INPUT)]
    pub encoding: Option<Encoding>,

    /// Channel of a PNG that holds the height
    #[arg(long, value_parser = one_of(PngChannel::ALL, PngChannel::name), value_name = "CHANNEL", help_heading = INPUT)]
    pub png_channel: Option<PngChannel>,

    /// A terrain whose samples take more megabytes than this stays in its file and is read
    /// where it is touched, if its format allows it (all but .asc and PNG); many files always do
    #[arg(long, value_name = "MB", default_value_t = OpenOptions::IN_MEMORY_MB, help_heading = INPUT)]
    pub in_memory_mb: u32,

    /// Folder for coarse samples and pages of URLs that were read before, and for large strips of a
    /// TIFF that are unpacked while it is used; it may be deleted at any time. Without it: hapterra
    /// in the user's folder for caches, as ~/.cache
    #[arg(long, value_name = "DIR", env = "HAPTERRA_CACHE_DIR", value_hint = ValueHint::DirPath, hide_env_values = true, help_heading = INPUT)]
    pub cache_dir: Option<PathBuf>,

    /// Megabytes that this folder takes at most, besides what is unpacked; 0 keeps and unpacks nothing
    /// there
    #[arg(long, value_name = "MB", env = "HAPTERRA_CACHE_MB", default_value_t = DiskCache::MOST_MB, hide_env_values = true, help_heading = INPUT)]
    pub cache_mb: u32,
}

impl TerrainFile {
    /// Opens the terrain, and notes what the user should know of it.
    ///
    /// # Errors
    /// What is wrong with the file, and what to do next.
    pub fn open(&self) -> Result<Raster, Failure> {
        let raster = self.open_without_remarks()?;
        for remark in raster.remarks() {
            eprintln!("note: {}", shown(remark));
        }
        Ok(raster)
    }

    /// Opens the terrain, and shows that it takes a while. The caller shows its remarks.
    ///
    /// # Errors
    /// What is wrong with the file, and what to do next.
    pub(in crate::cli) fn open_without_remarks(&self) -> Result<Raster, Failure> {
        let line = || format!("reading {}", self.name());
        let raster = shown_meanwhile(line, || Raster::open(&self.file, &self.reading.options()))?;
        tracing::info!(format = raster.format(), "read {}", self.name());
        if let Some(line) = assumed_unit(&raster) {
            eprintln!("note: {line}");
        }
        Ok(raster)
    }

    /// The file and those beside it that are read with it: no output may be one of them.
    pub fn inputs(&self) -> Vec<PathBuf> {
        files_read_with(&self.file)
    }

    /// The file's name without folders, as it is shown: on a page and in a picture, too.
    pub fn name(&self) -> String {
        if let Some(url) = self.file.to_str().filter(|file| is_url(file)) {
            return shown(file_name(url));
        }
        let name = self.file.file_name().unwrap_or(self.file.as_os_str());
        shown(&name.to_string_lossy())
    }
}

impl ReadingOptions {
    /// Where there is no home folder nothing is kept.
    fn disk_cache(&self) -> DiskCache {
        let folder = self.cache_dir.clone().or_else(DiskCache::usual_folder);
        folder.map_or(DiskCache::off(), |folder| {
            DiskCache::at(&folder, u64::from(self.cache_mb) << 20)
        })
    }

    /// How a raster of classes is opened that lies over the terrain: it says all by itself, and
    /// shares the bounds of memory and disk.
    pub(in crate::cli) fn of_classes(&self) -> OpenOptions {
        OpenOptions {
            classes: true,
            most_in_memory_bytes: u64::from(self.in_memory_mb) << 20,
            disk_cache: self.disk_cache(),
            ..OpenOptions::default()
        }
    }

    /// The same for the library.
    #[must_use]
    pub fn options(&self) -> OpenOptions {
        OpenOptions {
            raw: self.raw_size.map(|(columns, rows)| RawLayout {
                columns,
                rows,
                sample: self.raw_type,
                endian: self.raw_endian,
            }),
            png_channel: self.png_channel,
            no_data: self.no_data,
            band: self.band,
            variable: self.variable.clone(),
            open_options: self.open_option.clone(),
            ground_cell_m: self.ground_cell_m,
            vertical_unit_m: self.vertical_unit,
            encoding: self.encoding,
            most_in_memory_bytes: u64::from(self.in_memory_mb) << 20,
            disk_cache: self.disk_cache(),
            ..OpenOptions::default()
        }
    }
}

/// A note where heights are only assumed to be metres, and the ground is not in metres: feet would be
/// rendered 3.28 times too steep.
#[must_use]
pub fn assumed_unit(raster: &Raster) -> Option<String> {
    let assumed = "the file does not state the unit of its heights: they are taken to be metres";
    if raster.vertical_unit_from() != Certainty::Assumed {
        return None;
    }
    match raster.cell()?.unit {
        CellUnit::Length { metres: 1.0 } => None,
        CellUnit::Length { metres } => {
            let times = 1.0 / metres;
            let feet = if metres > 0.304_800_3 { "us-ft" } else { "ft" };
            let unit = match (metres / 0.3048 - 1.0).abs() < 1e-4 {
                true => feet.to_owned(),
                false => metres.to_string(),
            };
            Some(format!(
                "{assumed}, but the ground is in units of {metres} m; if the heights are too, they are felt {times:.2} times too steep: --vertical-unit {unit} (or --vertical-unit m)"
            ))
        }
        CellUnit::Degree => Some(format!("{assumed} (--vertical-unit ft, if they are feet)")),
    }
}

/// Parses one of some values by its name.
fn one_of<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(all.iter().map(|value| name(*value)));
    names.try_map(move |text| {
        let named = all.iter().find(|value| name(**value) == text);
        named.copied().ok_or("not one of the names")
    })
}

/// A unit of height in metres.
fn parse_unit(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let metres = metres_in(text).or_else(|| text.parse().ok());
    metres
        .filter(|metres| (1e-6..=1e6).contains(metres))
        .ok_or_else(|| "a unit of height is m, ft, us-ft, or metres in a unit, as 0.01".into())
}

/// An option of a GDAL driver.
fn parse_open_option(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((name, _)) if !name.is_empty() => Ok(text.to_owned()),
        _ => Err("an open option is NAME=VALUE, as HONOUR_VALID_RANGE=NO".into()),
    }
}

/// A length of the ground in metres.
fn parse_side(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(side) if (1e-6..=1e7).contains(&side) => Ok(side),
        _ => Err("a side is a length in metres from 0.000001 to 10000000, as 30".into()),
    }
}

/// A size in samples, as `512x400`, or `512` for a square.
///
/// # Errors
/// What a size is.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (parts.0.trim().parse(), parts.1.trim().parse()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err("a size is WIDTHxHEIGHT in samples, as 512x400".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("512x400"), Ok((512, 400)));
        assert_eq!(parse_size("7"), Ok((7, 7)));
        assert!(parse_size("0x4").is_err());
        assert!(parse_size("4x").is_err());
        for (unit, metres) in [
            ("m", 1.0),
            ("ft", 0.3048),
            ("us-ft", 1200.0 / 3937.0),
            ("0.01", 0.01),
        ] {
            assert_eq!(parse_unit(unit), Ok(metres));
        }
        for unit in ["", "furlong", "0", "-1", "nan", "inf"] {
            assert!(parse_unit(unit).is_err(), "{unit}");
        }
        assert_eq!(parse_side("0.5"), Ok(0.5));
        for side in ["0", "-3", "nan", "inf", "1e9", "x"] {
            assert!(parse_side(side).is_err(), "{side}");
        }
    }
}
