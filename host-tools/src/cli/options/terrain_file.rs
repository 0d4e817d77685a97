//! The terrain file argument and its options, shared by every subcommand that
//! reads one.

use std::path::PathBuf;

use clap::ValueHint;

use super::input::{self, InputSetting};
use crate::cli::failure::{Failure, OrHint};
use crate::cli::terminal::waiting::shown_meanwhile;
use crate::terrain::HapticCells;
use heightfield::disk_cache::DiskCache;
use heightfield::printable_text::printable;
use heightfield::{CellUnit, Certainty, OpenOptions, Raster, files_read_with};
use heightfield::{file_name, is_url};

/// Heading of these options in `--help`.
const INPUT: &str = "Input";
/// Environment variable for the folder of the disk cache.
const FOLDER_VARIABLE: &str = "HAPTERRA_CACHE_DIR";
/// Environment variable for the size of the disk cache, megabytes.
const LIMIT_VARIABLE: &str = "HAPTERRA_CACHE_MB";

/// A terrain file, and the user's statements about it that it does not contain.
#[derive(Clone, Debug, clap::Args)]
pub struct TerrainFile {
    /// Terrain: a file, a folder, a quoted pattern ('tiles/*.tif') or a URL
    ///
    /// GeoTIFF, .hgt, .asc, PNG, .flt, .bil, .npy or raw samples; many files as one; one of these at a
    /// URL (https, s3, gs, az), in builds with URLs; what GDAL reads, if it is installed: VRT, STAC,
    /// NetCDF, DTED, archives and more.
    #[arg(value_hint = ValueHint::FilePath)]
    pub file: PathBuf,

    /// Properties that the file does not state.
    #[command(flatten)]
    pub reading: ReadingOptions,
}

/// Statements of the user about a terrain file.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ReadingOptions {
    /// Statement about the file, such as no-data=-9999, band=2 or cell=30m
    ///
    /// May be repeated. raw=512x400:i16:le: raw samples, north row first, their type and byte order;
    /// no-data=VALUE: the stored value without a height; fill=N: samples without data get heights from
    /// data at most N samples away, 1 to 64; band=N: the band with the heights; variable=NAME: which
    /// raster of several (a NetCDF variable, a file of an archive, a STAC asset);
    /// cell=30m: side of a cell on the ground, where the file states none; height-unit=m|ft|us-ft or
    /// metres in a unit; encoding=terrarium|terrain-rgb: how colours are heights; channel=red|green|
    /// blue|alpha|grey: of a PNG; cells=square|stored: which cells are rendered; in-memory=64MB: a
    /// larger terrain stays in its file, if its format allows it; gdal:NAME=VALUE: option of the GDAL
    /// driver.
    #[arg(long, value_name = "KEY=VALUE", help_heading = INPUT)]
    pub input: Vec<InputSetting>,

    /// Folder for what was read before from URLs and large files, or off
    ///
    /// [default: hapterra in the user's folder for caches, as ~/.cache] It may be deleted at any time.
    /// HAPTERRA_CACHE_MB limits its size in megabytes, besides what is unpacked while it is used; 0 is
    /// off.
    #[arg(long, value_name = "DIR|off", env = FOLDER_VARIABLE, value_hint = ValueHint::DirPath,
          hide_env_values = true, hide_short_help = true, help_heading = INPUT)]
    pub cache: Option<PathBuf>,
}

impl TerrainFile {
    /// Opens the terrain and prints remarks about it.
    ///
    /// # Errors
    /// The fault of the file, and its remedy.
    pub fn open(&self) -> Result<Raster, Failure> {
        let raster = self.open_without_remarks()?;
        for remark in raster.remarks() {
            eprintln!("note: {}", printable(remark));
        }
        Ok(raster)
    }

    /// Opens the terrain with a progress message. Callers print its remarks.
    ///
    /// # Errors
    /// The fault of the file, and its remedy.
    pub(in crate::cli) fn open_without_remarks(&self) -> Result<Raster, Failure> {
        let options = self.reading.options()?;
        let line = || format!("reading {}", self.name());
        let raster = shown_meanwhile(line, || Raster::open(&self.file, &options))?;
        tracing::info!(format = raster.format(), "read {}", self.name());
        if let Some(line) = assumed_unit(&raster) {
            eprintln!("note: {line}");
        }
        Ok(raster)
    }

    /// Returns the file and those read with it, none of which may be an output.
    pub fn inputs(&self) -> Vec<PathBuf> {
        files_read_with(&self.file)
    }

    /// Returns the file's name without folders, as displayed, also on a page and in a picture.
    pub fn name(&self) -> String {
        if let Some(url) = self.file.to_str().filter(|file| is_url(file)) {
            return printable(file_name(url));
        }
        let name = self.file.file_name().unwrap_or(self.file.as_os_str());
        printable(&name.to_string_lossy())
    }
}

impl ReadingOptions {
    /// Returns the kind of cells to render.
    #[must_use]
    pub fn cells(&self) -> HapticCells {
        let mut cells = self.input.iter().filter_map(InputSetting::cells);
        cells.next().unwrap_or_default()
    }

    /// The cache is off if there is no home folder or the user disabled it.
    fn disk_cache(&self) -> Result<DiskCache, Failure> {
        let folder = self.cache.clone().or_else(DiskCache::usual_folder);
        let folder = folder.filter(|folder| folder.as_os_str() != "off");
        let limit = std::env::var_os(LIMIT_VARIABLE).filter(|limit| !limit.is_empty());
        let limit_mb = match limit
            .as_deref()
            .map(|limit| limit.to_str().map(str::parse::<u32>))
        {
            None => DiskCache::MAX_MB,
            Some(Some(Ok(limit_mb))) => limit_mb,
            Some(_) => {
                return Err(format!("{LIMIT_VARIABLE} is no number of megabytes")).or_hint(
                    format!("set {LIMIT_VARIABLE} to a whole number, or to nothing"),
                );
            }
        };
        Ok(folder.map_or(DiskCache::off(), |folder| {
            DiskCache::at(&folder, u64::from(limit_mb) << 20)
        }))
    }

    /// Returns the options for a raster of classes over the terrain. The file states everything
    /// itself; the limits of memory and disk are shared.
    pub(in crate::cli) fn of_classes(&self) -> Result<OpenOptions, Failure> {
        let terrain = self.options()?;
        Ok(OpenOptions {
            classes: true,
            max_in_memory_bytes: terrain.max_in_memory_bytes,
            disk_cache: terrain.disk_cache,
            ..OpenOptions::default()
        })
    }

    /// Returns the library's options.
    ///
    /// # Errors
    /// Two settings contradict each other.
    pub fn options(&self) -> Result<OpenOptions, Failure> {
        Ok(OpenOptions {
            disk_cache: self.disk_cache()?,
            ..input::open_options(&self.input)?
        })
    }
}

/// Returns a note if heights are assumed to be in metres and the ground is not in metres: heights
/// in feet would be rendered 3.28 times too steep.
#[must_use]
pub fn assumed_unit(raster: &Raster) -> Option<String> {
    let assumed = "the file does not state the unit of its heights: they are assumed to be metres";
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
                "{assumed}, but the ground is in units of {metres} m; if the heights are too, they are rendered {times:.2} times too steep: --input height-unit={unit} (or height-unit=m)"
            ))
        }
        CellUnit::Degree => Some(format!(
            "{assumed} (--input height-unit=ft, if they are feet)"
        )),
    }
}
