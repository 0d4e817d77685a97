//! The index of files that share a grid: the header of each is read, or what a STAC says instead,
//! and nothing else.

use std::path::{Path, PathBuf};

use super::super::blocks::Part;
use super::super::decoded::{Decoded, sides};
use super::super::ground_map::GroundMap;
use super::super::samples::SampleType;
use super::super::{BadRaster, OpenOptions, ReferenceSystem};
use super::grid::{Grid, Spot, unwrap_turns};
use super::pool::{options_for_tiles, whole_bytes};
use super::reader::Mosaic;
use super::source::{Axis, Source, Values};
use super::tile_file;

/// A file of a terrain, before it is looked into.
pub(super) struct File {
    /// The file.
    pub(super) path: PathBuf,
    /// The name of the item that it is the file of.
    pub(super) item: Option<String>,
    /// What is known of it, so that its header is not read.
    pub(super) stated: Option<Stated>,
}

/// What an index says of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stated {
    /// Columns and rows.
    pub(super) size: (u32, u32),
    /// Where they lie.
    pub(super) map: GroundMap,
    /// Code of the reference system.
    pub(super) code: u16,
}

impl From<PathBuf> for File {
    fn from(path: PathBuf) -> Self {
        Self {
            path,
            item: None,
            stated: None,
        }
    }
}

impl Stated {
    /// The same as of a file whose heights are those of the first one; `None` where the reference
    /// system is not known. The type of its samples may be any.
    fn outline(&self, first: &Decoded) -> Option<Decoded> {
        let held = first.system.as_ref();
        let held = held.filter(|system| system.code() == Some(self.code));
        let system = held
            .cloned()
            .or_else(|| ReferenceSystem::from_code(self.code))?;
        let name = "STAC item".to_owned();
        let mut outline = Decoded::new(name, self.size, SampleType::F64.none());
        outline.system = Some(system);
        outline.metres_per_vertical_unit = first.metres_per_vertical_unit;
        outline.vertical_datum = first.vertical_datum.clone();
        outline.lay_out(self.map, None);
        Some(outline)
    }
}

/// A file as it is on the grid.
struct Tile {
    path: PathBuf,
    bytes: u64,
    is_east_first: bool,
    is_south_up: bool,
}

/// What is known of all files.
struct Index {
    grid: Grid,
    tiles: Vec<Tile>,
    spots: Vec<Spot>,
    /// Whether single floats hold all samples.
    is_single: bool,
}

/// A terrain of files: where they overlap the last one with a height counts.
pub(super) fn decoded(files: Vec<File>, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let mut index = Index::read(files, options)?;
    if let Some(around) = index.grid.columns_around() {
        unwrap_turns(&mut index.spots, around);
    }
    index.decoded(options)
}

impl Index {
    fn read(files: Vec<File>, options: &OpenOptions) -> Result<Self, BadRaster> {
        let options = options_for_tiles(options);
        let mut index: Option<Self> = None;
        let mut empty = 0;
        for File { path, item, stated } in files {
            // The first file is looked into: it tells what no index does.
            let known = index.as_ref().zip(stated);
            let known = known.and_then(|(index, stated)| stated.outline(&index.grid.first));
            let outline = match known.map_or_else(|| outline(&path, &options), Ok) {
                Ok(outline) => outline,
                // All of it is holes.
                Err(BadRaster::AllNoData { samples }) => {
                    empty += samples;
                    continue;
                }
                Err(fault) => return Err(BadRaster::in_tile(&path, fault)),
            };
            let index = match &mut index {
                Some(index) => index,
                none => none.insert(Self {
                    grid: Grid::of(&path, outline.clone())?,
                    tiles: Vec::new(),
                    spots: Vec::new(),
                    is_single: true,
                }),
            };
            let is_first = index.tiles.is_empty();
            if is_first && let Some(stated) = stated {
                index.check_stated(&path, &stated, &outline)?;
            }
            let added = index.add(path, &outline);
            added.map_err(|fault| of_item(fault, item.as_deref()))?;
        }
        index.ok_or(BadRaster::AllNoData { samples: empty })
    }

    /// Whether a file lies where an index says that it does.
    fn check_stated(&self, path: &Path, stated: &Stated, file: &Decoded) -> Result<(), BadRaster> {
        let Some(stated) = stated.outline(&self.grid.first) else {
            return Ok(());
        };
        let spots = [&stated, file].map(|outline| self.grid.spot(path, outline));
        match spots {
            [Ok(stated), Ok(found)] if stated == found => Ok(()),
            _ => Err(BadRaster::in_tile(
                path,
                BadRaster::damaged("it does not lie where its STAC item says"),
            )),
        }
    }

    fn add(&mut self, path: PathBuf, outline: &Decoded) -> Result<(), BadRaster> {
        self.spots.push(self.grid.spot(&path, outline)?);
        self.is_single &= is_single(outline);
        let bytes = std::fs::metadata(&path).map_or(0, |metadata| metadata.len());
        self.tiles.push(Tile {
            path,
            bytes,
            is_east_first: outline.east_first,
            is_south_up: outline.south_up,
        });
        Ok(())
    }

    fn decoded(self, options: &OpenOptions) -> Result<Decoded, BadRaster> {
        let ends = |low: fn(&Spot) -> i64, high: fn(&Spot) -> i64| {
            let (lows, highs) = (self.spots.iter().map(low), self.spots.iter().map(high));
            (lows.min().unwrap_or(0), highs.max().unwrap_or(0))
        };
        let (west, east) = ends(|it| it.column, |it| it.column + i64::from(it.columns));
        let (south, north) = ends(|it| it.row, |it| it.row + i64::from(it.rows));
        let size = sides((east - west) as u64, (north - south) as u64)?;
        let first = &self.grid.first;
        let format = format!(
            "{} files as one, the first {}",
            self.tiles.len(),
            first.format
        );
        let sources = self.tiles.iter().zip(&self.spots);
        let sources = sources.map(|(tile, spot)| source(tile, spot, [west, south]));
        let sample = match self.is_single {
            true => SampleType::F32,
            false => SampleType::F64,
        };
        let mosaic = Mosaic::new(size, sources.collect(), sample, options);
        let mut decoded = Decoded::new(format, size, mosaic);
        decoded.system = first.system.clone();
        decoded.system_from = first.system_from;
        decoded.metres_per_vertical_unit = first.metres_per_vertical_unit;
        decoded.vertical_unit_from = first.vertical_unit_from;
        decoded.vertical_datum = first.vertical_datum.clone();
        let ([x, y], [east, north]) = (self.grid.corner_of(west, south), self.grid.step);
        let map = GroundMap::new([x, east, 0.0], [y, 0.0, north]);
        let map = map.ok_or_else(|| BadRaster::damaged("its files lie nowhere"))?;
        decoded.lay_out(map, first.ground_unit());
        Ok(decoded)
    }
}

/// The same fault, with the name of the item whose file it is.
fn of_item(fault: BadRaster, item: Option<&str>) -> BadRaster {
    match (fault, item) {
        (BadRaster::TilesDiffer { file, other, why }, Some(item)) => BadRaster::TilesDiffer {
            file,
            other,
            why: format!("{why} (the STAC item {item})"),
        },
        (fault, _) => fault,
    }
}

/// What the header of a file says, which is to be small enough to be opened later.
fn outline(path: &Path, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let outline = tile_file::outline(path, options)?;
    whole_bytes(&outline)?;
    Ok(outline)
}

/// Whether single floats hold all heights of a file.
fn is_single(outline: &Decoded) -> bool {
    let is_plain = (outline.scale, outline.offset) == (1.0, 0.0);
    let is_turned = (outline.scale, outline.offset) == (-1.0, 0.0);
    let sample = outline.storage.sample_type();
    let fits = !matches!(sample, SampleType::F64 | SampleType::I32 | SampleType::U32);
    fits && (is_plain || is_turned)
}

fn source(tile: &Tile, spot: &Spot, [west, south]: [i64; 2]) -> Source {
    // Both fit: they are inside the terrain.
    let (column, row) = ((spot.column - west) as u32, (spot.row - south) as u32);
    let axis = |first: u32, count: u32, is_turned: bool| match is_turned {
        false => Axis {
            start: -f64::from(first),
            step: 1.0,
        },
        true => Axis {
            start: f64::from(first) + f64::from(count),
            step: -1.0,
        },
    };
    Source {
        path: tile.path.clone(),
        bytes: tile.bytes,
        band: None,
        covers: Part {
            column,
            row,
            columns: spot.columns,
            rows: spot.rows,
        },
        axes: [
            axis(column, spot.columns, tile.is_east_first),
            axis(row, spot.rows, !tile.is_south_up),
        ],
        size: Some((spot.columns, spot.rows)),
        values: Values::Heights,
    }
}
