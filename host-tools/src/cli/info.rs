//! `hapterra info`: the content of a terrain file and its tiles.

mod formats;
mod link;
mod place;

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::ValueHint;
use serde::Serialize;

use hapterra_core::terrain::{TILE_CELLS, TILE_SAMPLES};

use super::failure::Failure;
use super::options::placing::off_in_words;
use super::options::terrain_file::{ReadingOptions, TerrainFile};
use super::report::put;
use crate::place::place_in_words;
use crate::quantity::DATA_RATE;
use crate::terrain::{Distortion, HapticGrid};
use heightfield::printable_text::printable_json;
use heightfield::without_key;
use heightfield::{CellSize, CellUnit, Certainty, Fill, RasterType, ReferenceSystem};
use link::LinkFigures;
use place::{Rectangle, Vertical, from, source_text};

/// Arguments of `hapterra info`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Terrain: a file, a folder, a quoted pattern ('tiles/*.tif') or a URL
    #[arg(value_hint = ValueHint::FilePath, required_unless_present = "formats")]
    pub file: Option<PathBuf>,

    /// Properties that the file does not state.
    #[command(flatten)]
    pub reading: ReadingOptions,

    /// List the formats of terrain files that are read on this machine
    #[arg(long, conflicts_with_all = ["file", "link", "json"])]
    pub formats: bool,

    /// Show how fast a link of this rate, such as 200kB/s, carries the tiles [without a rate: 1MB/s]
    ///
    /// Bytes of a tile, tiles a second, and the cells a second that the HIP may move along an axis.
    #[arg(long, value_name = "RATE", num_args = 0..=1, default_missing_value = "1MB/s", value_parser = rate)]
    pub link: Option<f64>,

    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Parses a rate of the link, MB/s.
fn rate(text: &str) -> Result<f64, String> {
    let rate = DATA_RATE.read(text)?;
    let is_above_zero = (rate > 0.0).then_some(rate);
    is_above_zero.ok_or_else(|| "a rate of the link is above zero, such as 200kB/s".into())
}

/// Shows the file's content.
///
/// # Errors
/// The file cannot be opened as a height field, or the output cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    // Clap requires a file unless the list is requested.
    let (false, Some(file)) = (args.formats, &args.file) else {
        return put(&formats::text());
    };
    let terrain = TerrainFile {
        file: file.clone(),
        reading: args.reading.clone(),
    };
    let raster = terrain.open_without_remarks()?;
    let grid = HapticGrid::new(&raster, terrain.reading.cells());
    let link = args.link.map(|rate| LinkFigures::of(&grid, rate));
    let report = FileReport {
        link: link.transpose().map_err(Failure::new)?,
        ..FileReport::new(&terrain, &grid)
    };
    if args.json {
        let json = serde_json::to_string_pretty(&report).map_err(Failure::new)?;
        put(&(printable_json(&json) + "\n"))
    } else {
        put(&report.text())
    }
}

/// Output of the command; its fields have the names of the JSON.
#[derive(Serialize)]
struct FileReport {
    file: String,
    format: String,
    /// Samples from west to east.
    columns: u32,
    /// Samples from south to north.
    rows: u32,
    /// The horizontal reference system, such as `EPSG:26911`, if the file states it.
    crs: Option<String>,
    crs_name: Option<String>,
    /// Source of the reference system.
    crs_from: Option<&'static str>,
    /// Outer edges of the samples' cells, in the file's units.
    bounds: Option<Rectangle>,
    /// The same in degrees of longitude and latitude; in WGS 84 if the conversion is known.
    bounds_lonlat: Option<Rectangle>,
    #[serde(skip)]
    projection_known: bool,
    cell: Option<Cell>,
    /// Metres per vertical unit, if the file states it.
    metres_per_vertical_unit: Option<f64>,
    vertical: Vertical,
    /// Height range in the file's vertical unit.
    lowest: f64,
    highest: f64,
    /// Height = stored value × scale + offset.
    scale: f64,
    offset: f64,
    /// Number of no-data samples among those examined.
    no_data: u64,
    /// Distance in samples within which no-data is filled, if it is.
    filled_within: Option<u32>,
    /// The stored value that means no data.
    no_data_value: Option<f64>,
    /// Number of bands; one of them contains the heights.
    bands: u32,
    /// Columns and rows of a strip, tile or block.
    block: Option<[u32; 2]>,
    /// Columns and rows of each overview.
    overviews: Vec<[u32; 2]>,
    /// `area` or `point`: the meaning of a sample, if the file states it.
    samples_are: Option<&'static str>,
    /// Number of samples examined for range and no-data: all, or fewer if the raster stays in its
    /// file.
    looked_at: u64,
    /// True if all samples were examined.
    known_whole: bool,
    /// Maximum memory of the samples on the host, bytes.
    bytes: usize,
    levels: Vec<Level>,
    #[serde(skip_serializing_if = "Option::is_none")]
    link: Option<LinkFigures>,
    remarks: Vec<String>,
}

#[derive(Serialize)]
struct Cell {
    east: f64,
    north: f64,
    unit: &'static str,
    /// True if the file states the unit; metres or degrees are assumed if not.
    unit_stated: bool,
    /// Source of the unit: the `file`, the `code` of its reference system, an `option` of this
    /// command, or `assumed`.
    unit_from: &'static str,
    /// Ground length of both sides in metres.
    east_m: f64,
    north_m: f64,
    /// Side of the square haptic cell, m on the ground.
    haptic_cell_m: f64,
    /// True if heights are interpolated because the stored cells are not square.
    resampled: bool,
    /// True if stored cells that are not square are rendered as squares.
    distorted: bool,
    /// Maximum relative error of slopes and lengths, if all cells are rendered like the middle one.
    worst_share: Option<f64>,
    /// Position of the maximum error, in the file's coordinates.
    worst_at: Option<[f64; 2]>,
    #[serde(skip)]
    worst: Option<String>,
}

/// One level of detail: every 2^level-th sample.
#[derive(Serialize)]
struct Level {
    level: u8,
    tile_columns: u32,
    tile_rows: u32,
    tiles: u64,
    /// Bytes of all tiles of the level in single floats.
    bytes: u64,
}

impl FileReport {
    fn new(input: &TerrainFile, grid: &HapticGrid<'_>) -> Self {
        let raster = grid.raster();
        let summary = raster.summary();
        let layout = raster.file_layout();
        let (scale, offset) = raster.scale_and_offset();
        let system = raster.reference_system();
        let code = system.and_then(|system| system.code());
        Self {
            file: without_key(&input.file),
            format: raster.format().to_owned(),
            columns: raster.columns(),
            rows: raster.rows(),
            crs: code.map(|code| format!("EPSG:{code}")),
            crs_name: system.map(|system| system.name().to_owned()),
            crs_from: system.map(|_| from(raster.reference_system_from())),
            bounds: Rectangle::of(raster),
            bounds_lonlat: Rectangle::lonlat(raster),
            projection_known: system.is_none_or(ReferenceSystem::has_lonlat),
            cell: raster.cell().map(|cell| Cell::new(cell, grid)),
            metres_per_vertical_unit: raster.stated_metres_per_vertical_unit(),
            vertical: Vertical::of(raster),
            lowest: summary.lowest,
            highest: summary.highest,
            scale,
            offset,
            no_data: summary.no_data,
            filled_within: raster.fill().map(Fill::samples),
            no_data_value: raster.no_data(),
            bands: layout.bands,
            block: layout.block,
            overviews: layout.overviews.clone(),
            samples_are: layout.raster_type.map(|samples| match samples {
                RasterType::Area => "area",
                RasterType::Point => "point",
            }),
            looked_at: summary.examined,
            known_whole: raster.is_summary_complete(),
            bytes: raster.memory_bytes(),
            levels: levels(grid.columns(), grid.rows()),
            link: None,
            remarks: raster.remarks().to_vec(),
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, value: String| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{name:<9} {value}");
        };
        line("file", self.file.clone());
        line("format", self.format.clone());
        line("size", format!("{} × {} samples", self.columns, self.rows));
        line("crs", self.reference_system());
        let edges = |edges: &Option<Rectangle>| {
            let edges = edges.as_ref().map(Rectangle::text);
            edges.unwrap_or_else(|| "unknown".into())
        };
        line("bounds", edges(&self.bounds));
        line(
            "lon/lat",
            match (&self.bounds_lonlat, self.projection_known) {
                (None, false) => {
                    "unknown: the projection of its reference system is not supported".into()
                }
                (bounds, _) => edges(bounds),
            },
        );
        let cell = self.cell.as_ref();
        line("cell", cell.map_or("unknown".into(), Cell::text));
        if let Some(worst) = cell.and_then(|cell| cell.worst.clone()) {
            line("shape", worst);
        }
        let looked = match self.known_whole {
            true => String::new(),
            false => format!(
                " among {} samples looked at: the rest is read where it is touched",
                self.looked_at
            ),
        };
        line(
            "heights",
            format!("{} to {}{looked}", self.lowest, self.highest),
        );
        line("vertical", self.vertical.text());
        let share = 100.0 * self.no_data as f64 / self.looked_at as f64;
        line(
            "no data",
            format!("{} samples ({share:.2} %){looked}", self.no_data),
        );
        if let Some(samples) = self.filled_within {
            let filled = format!("those within {samples} samples of data are filled from it");
            line("fill", filled);
        }
        for (name, value) in self.stored() {
            line(name, value);
        }
        let at_most = if self.known_whole { "" } else { "at most " };
        line("memory", format!("{at_most}{} bytes", self.bytes));
        for level in &self.levels {
            line(&format!("level {}", level.level), level.text());
        }
        for figures in self.link.iter().flat_map(LinkFigures::lines) {
            line("link", figures);
        }
        for remark in &self.remarks {
            line("remark", remark.clone());
        }
        text
    }

    /// Returns the format of the stored samples.
    fn stored(&self) -> [(&'static str, String); 4] {
        let sides = |[columns, rows]: [u32; 2]| format!("{columns} × {rows}");
        let no_data = self
            .no_data_value
            .map_or("none".into(), |value| value.to_string());
        let overviews: Vec<_> = self.overviews.iter().map(|size| sides(*size)).collect();
        [
            (
                "stored",
                format!(
                    "no-data value {no_data}, scale {}, offset {}",
                    self.scale, self.offset
                ),
            ),
            (
                "bands",
                match self.block {
                    Some(block) => format!("{}, in blocks of {}", self.bands, sides(block)),
                    None => self.bands.to_string(),
                },
            ),
            (
                "samples",
                self.samples_are
                    .map_or("area or point not stated".into(), |it| {
                        format!("{it} (stated)")
                    }),
            ),
            (
                "overviews",
                match overviews.is_empty() {
                    true => "none".into(),
                    false => overviews.join(", "),
                },
            ),
        ]
    }

    /// Returns text such as `EPSG:26911 NAD83 / UTM zone 11N (stated)`.
    fn reference_system(&self) -> String {
        let from = self.crs_from.map(source_text).unwrap_or_default();
        match (&self.crs, &self.crs_name) {
            (Some(code), Some(name)) => format!("{code} {name} ({from})"),
            (None, Some(name)) => format!("{name} ({from}, without a code)"),
            _ => "not stated".into(),
        }
    }
}

impl Cell {
    fn new(cell: CellSize, grid: &HapticGrid<'_>) -> Self {
        let (east_m, north_m) = cell.ground_metres();
        let last = [grid.columns(), grid.rows()].map(|count| f64::from(count) - 1.0);
        let worst = grid.worst_in([0.0, 0.0, last[0], last[1]]);
        let file = grid.raster().georeference();
        Self {
            east: cell.east,
            north: cell.north,
            unit: match cell.unit {
                CellUnit::Degree => "degree",
                CellUnit::Length { metres: 1.0 } => "metre",
                CellUnit::Length { .. } => "unit of length",
            },
            unit_stated: cell.certainty == Certainty::Stated,
            unit_from: from(cell.certainty),
            east_m,
            north_m,
            haptic_cell_m: grid.side_m().unwrap_or_default(),
            resampled: grid.is_resampled(),
            distorted: grid.is_distorted(),
            worst_share: worst.map(|worst| worst.share),
            worst_at: worst.map(|worst| worst.ground),
            worst: worst.filter(Distortion::is_noticeable).map(|worst| {
                let (off, place) = (off_in_words(&worst), place_in_words(&file, worst.ground));
                match grid.is_distorted() {
                    true => format!("{off}, at {place}"),
                    false => format!(
                        "true in the middle; rendered from there, {off}, at {place}: --at and --bbox measure the cells at a place"
                    ),
                }
            }),
        }
    }

    fn text(&self) -> String {
        let (east_m, north_m, haptic_cell_m) = (self.east_m, self.north_m, self.haptic_cell_m);
        let stored = format!(
            "{} × {} {} ({}), {east_m:.3} east × {north_m:.3} north m on the ground",
            self.east,
            self.north,
            self.unit,
            source_text(self.unit_from)
        );
        let hint = match self.distorted {
            false => "",
            true => " of the same area, not in their true shape (--input cells=square)",
        };
        match self.resampled || self.distorted {
            false => stored,
            true => format!("{stored}, rendered as {haptic_cell_m:.3} m squares{hint}"),
        }
    }
}

impl Level {
    fn text(&self) -> String {
        format!(
            "{} × {} tiles = {} of {TILE_CELLS} × {TILE_CELLS} cells, {} bytes",
            self.tile_columns, self.tile_rows, self.tiles, self.bytes
        )
    }
}

/// Returns the levels of detail, until one tile covers the field, or no whole cell is left in one
/// direction.
fn levels(columns: u32, rows: u32) -> Vec<Level> {
    let tile_bytes = (TILE_SAMPLES * TILE_SAMPLES * size_of::<f32>()) as u64;
    let mut levels = Vec::new();
    for level in 0..=31 {
        if (columns.min(rows) - 1) >> level == 0 {
            break;
        }
        let tiles = |samples: u32| ((samples - 1) >> level).div_ceil(TILE_CELLS as u32);
        let (tile_columns, tile_rows) = (tiles(columns), tiles(rows));
        let tiles = u64::from(tile_columns) * u64::from(tile_rows);
        levels.push(Level {
            level,
            tile_columns,
            tile_rows,
            tiles,
            bytes: tiles * tile_bytes,
        });
        if tiles == 1 {
            break;
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_end_with_one_tile() {
        let counts: Vec<(u32, u32)> = levels(129, 65)
            .iter()
            .map(|level| (level.tile_columns, level.tile_rows))
            .collect();
        assert_eq!(counts, [(4, 2), (2, 1), (1, 1)]);
        assert_eq!(levels(2, 2).len(), 1);
        assert_eq!(levels(34, 2)[0].tile_columns, 2);
        assert_eq!(levels(5000, 2).len(), 1);
    }
}
