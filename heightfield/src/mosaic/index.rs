//! The index of files on a grid, from the header of each.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::super::blocks::Part;
use super::super::decoded::{Decoded, sides};
use super::super::ground_map::GroundMap;
use super::super::samples::SampleType;
use super::super::{OpenOptions, RasterError};
use super::grid::{Grid, Spot, unwrap_turns};
use super::layers;
use super::pool::{options_for_tiles, whole_bytes};
use super::reader::Mosaic;
use super::source::Source;
use super::tile_file;

/// A file on the grid.
struct Tile {
    path: PathBuf,
    sample: SampleType,
    bytes: u64,
    is_east_first: bool,
    is_south_up: bool,
}

/// The headers of all files.
struct Index {
    grid: Grid,
    tiles: Vec<Tile>,
    spots: Vec<Spot>,
    /// True if single floats can store all samples.
    is_single: bool,
}

/// Returns a terrain of files: in overlaps, the last file with a height is used.
pub(super) fn decoded(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let mut index = Index::read(files, options)?;
    let layers = index.remove_layers(options)?;
    if let Some(around) = index.grid.columns_around() {
        unwrap_turns(&mut index.spots, around);
    }
    let mut decoded = index.decoded(options)?;
    decoded.remarks.extend(layers::remark_ignored(&layers));
    Ok(decoded)
}

impl Index {
    fn read(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Self, RasterError> {
        let options = options_for_tiles(options);
        let mut index: Option<Self> = None;
        let mut empty = 0;
        for path in files {
            let outline = match outline(&path, &options) {
                Ok(outline) => outline,
                // All of it is no-data.
                Err(RasterError::AllNoData { samples }) => {
                    empty += samples;
                    continue;
                }
                Err(fault) => return Err(RasterError::in_tile(&path, fault)),
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
            index.add(path, &outline)?;
        }
        index.ok_or(RasterError::AllNoData { samples: empty })
    }

    fn add(&mut self, path: PathBuf, outline: &Decoded) -> Result<(), RasterError> {
        self.spots.push(self.grid.spot(&path, outline)?);
        self.is_single &= is_single(outline);
        let bytes = std::fs::metadata(&path).map_or(0, |metadata| metadata.len());
        self.tiles.push(Tile {
            path,
            sample: outline.storage.sample_type(),
            bytes,
            is_east_first: outline.east_first,
            is_south_up: outline.south_up,
        });
        Ok(())
    }

    /// Removes layers that lie on the same samples as heights, and returns their files.
    fn remove_layers(&mut self, options: &OpenOptions) -> Result<Vec<PathBuf>, RasterError> {
        let mut at_spots: HashMap<Spot, Vec<usize>> = HashMap::new();
        for (number, spot) in self.spots.iter().enumerate() {
            at_spots.entry(*spot).or_default().push(number);
        }
        let mut is_layer = vec![false; self.tiles.len()];
        for numbers in at_spots.values().filter(|numbers| numbers.len() > 1) {
            let named = |number: &usize| {
                let tile = &self.tiles[*number];
                (tile.path.as_path(), tile.sample)
            };
            let files: Vec<_> = numbers.iter().map(named).collect();
            if let Some(heights) = layers::heights_among(&files) {
                for (at, number) in numbers.iter().enumerate() {
                    is_layer[*number] = at != heights;
                }
            }
        }
        let mut each = is_layer.iter();
        self.spots.retain(|_| each.next() == Some(&false));
        let tiles = std::mem::take(&mut self.tiles).into_iter().zip(&is_layer);
        let (layers, tiles): (Vec<_>, Vec<_>) = tiles.partition(|(_, is_layer)| **is_layer);
        self.tiles = tiles.into_iter().map(|(tile, _)| tile).collect();
        if is_layer.first() == Some(&true) {
            self.grid.first = outline(&self.tiles[0].path, &options_for_tiles(options))?;
        }
        Ok(layers.into_iter().map(|(tile, _)| tile.path).collect())
    }

    fn decoded(self, options: &OpenOptions) -> Result<Decoded, RasterError> {
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
        let remarks = mosaic.remark_differences()?;
        let mut decoded = Decoded::new(format, size, mosaic);
        decoded.remarks = remarks;
        decoded.remarks.extend(first.remarks.iter().cloned());
        decoded.file_layout = first.file_layout.clone();
        decoded.system = first.system.clone();
        decoded.system_from = first.system_from;
        decoded.metres_per_vertical_unit = first.metres_per_vertical_unit;
        decoded.vertical_unit_from = first.vertical_unit_from;
        decoded.vertical_datum = first.vertical_datum.clone();
        let ([x, y], [east, north]) = (self.grid.corner_of(west, south), self.grid.step);
        let map = GroundMap::new([x, east, 0.0], [y, 0.0, north]);
        let map = map.ok_or_else(|| RasterError::damaged("the place of its files is invalid"))?;
        decoded.set_layout(map, first.ground_unit());
        Ok(decoded)
    }
}

/// Reads the header of a file, and checks that it can be opened later within the memory bound.
fn outline(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let outline = tile_file::outline(path, options)?;
    whole_bytes(&outline)?;
    Ok(outline)
}

/// Returns true if single floats can store all heights of a file.
fn is_single(outline: &Decoded) -> bool {
    let is_plain = (outline.scale, outline.offset) == (1.0, 0.0);
    let is_turned = (outline.scale, outline.offset) == (-1.0, 0.0);
    let sample = outline.storage.sample_type();
    let fits = !matches!(sample, SampleType::F64 | SampleType::I32 | SampleType::U32);
    fits && (is_plain || is_turned)
}

fn source(tile: &Tile, spot: &Spot, [west, south]: [i64; 2]) -> Source {
    // Both fit: the file is inside the terrain.
    let (column, row) = ((spot.column - west) as u32, (spot.row - south) as u32);
    Source {
        path: tile.path.clone(),
        bytes: tile.bytes,
        covers: Part {
            column,
            row,
            columns: spot.columns,
            rows: spot.rows,
        },
        turned: [tile.is_east_first, !tile.is_south_up],
    }
}
