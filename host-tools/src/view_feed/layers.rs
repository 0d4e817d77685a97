//! A terrain at coarse levels, for a picture of the whole.

use hapterra_core::terrain::{TILE_SAMPLES, TileIndex};
use hapterra_view_stream::{Layer, TILE_POSTS, Tile};

use crate::terrain::Terrain;

/// Max cells along the side of a layer.
const CELLS: i32 = 1024;
/// Max cells between the samples of the finest layer: the viewer uses every fourth sample for its
/// mesh, whose cells then are not larger than a tile of any level.
const FINEST_STEP: i32 = 8;
/// Maximum ratio of the spacings of two layers.
const RATIO: i32 = 16;
/// Max spacing of the mesh in the viewer, in samples of a layer.
const MESH: i32 = 4;

/// The samples of a layer, in cells of level 0: a later placement may have any level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    step: i32,
    /// West, south, east, north.
    cells: [i32; 4],
}

impl Extent {
    /// Returns true if a position (cells) lies in its middle half, along both sides.
    pub(super) fn is_around(&self, place: [f64; 2]) -> bool {
        let [west, south, east, north] = self.cells.map(f64::from);
        let is_between = |at: f64, low: f64, high: f64| {
            let margin = 0.25 * (high - low);
            (low + margin..=high - margin).contains(&at)
        };
        is_between(place[0], west, east) && is_between(place[1], south, north)
    }
}

/// Returns the layers of a terrain around `home` (cells), coarsest first: the whole terrain and, if
/// it is large, the surroundings of `home` in finer layers.
pub(super) fn around(terrain: &Terrain<'_>, home: [f64; 2]) -> Vec<Extent> {
    let grid = terrain.grid();
    let cells = |samples: u32| i32::try_from(samples.saturating_sub(1)).unwrap_or(i32::MAX);
    extents([cells(grid.columns()), cells(grid.rows())], home)
}

fn extents([columns, rows]: [i32; 2], home: [f64; 2]) -> Vec<Extent> {
    let mut extents = Vec::new();
    let mut step = 1;
    while columns.max(rows) / step > CELLS {
        step *= 2;
    }
    extents.push(Extent {
        step,
        cells: [0, 0, columns / step * step, rows / step * step],
    });
    while step > FINEST_STEP {
        let finer = FINEST_STEP.max(step / RATIO);
        let (low, high) = (
            [0, 1].map(|i| home[i].clamp(0.0, 5e8) as i32),
            [columns, rows],
        );
        let around = |axis: usize| {
            // Aligned to the cells of the coarser mesh, which is cut at this layer's border.
            let (grain, half) = (step * MESH, CELLS * finer / 2);
            let first = (low[axis] - half).max(0) / grain * grain;
            let last = first.saturating_add(2 * half).min(high[axis]);
            // At the raster's border the coarser mesh has a smaller cell, or ends before it.
            let grain = if last == high[axis] { finer } else { grain };
            (first, last / grain * grain)
        };
        let ((west, east), (south, north)) = (around(0), around(1));
        if west >= east || south >= north {
            break;
        }
        step = finer;
        extents.push(Extent {
            step,
            cells: [west, south, east, north],
        });
    }
    extents
}

/// A layer that is being read.
#[derive(Debug)]
pub(super) struct Reading {
    layer: Layer,
    /// Final number of rows.
    rows: u32,
}

impl Reading {
    /// Begins without rows.
    pub(super) fn new(number: usize, extent: &Extent) -> Self {
        let [west, south, east, north] = extent.cells;
        let count = |from: i32, to: i32| ((to - from) / extent.step) as u32 + 1;
        let (columns, rows) = (count(west, east), count(south, north));
        let layer = Layer {
            number: number as u32,
            first: [west, south],
            step: extent.step,
            columns,
            rows: 0,
            heights: Vec::with_capacity(columns as usize * rows as usize),
        };
        Self { layer, rows }
    }

    /// Reads at most `rows` more available rows; returns true if others remain.
    pub(super) fn read(&mut self, terrain: &Terrain<'_>, rows: u32) -> bool {
        let layer = &mut self.layer;
        let level = layer.step.ilog2() as u8;
        let [west, south] = layer.first.map(|cell| (cell / layer.step) as u32);
        let mut line = vec![f64::NAN; layer.columns as usize];
        for _ in 0..rows.min(self.rows - layer.rows) {
            let grid = terrain.grid();
            let status = grid.read_row(level, south + layer.rows, west, &mut line);
            if !status.is_complete() {
                // The row is being read; a later call finds it.
                return true;
            }
            let heights = line.iter().map(|height| *height as f32);
            layer.heights.extend(heights);
            layer.rows += 1;
        }
        layer.rows < self.rows
    }

    /// Returns the layer that was read.
    pub(super) fn into_layer(self) -> Layer {
        self.layer
    }
}

/// Returns all layers around `home` (cells).
pub(super) fn of(terrain: &Terrain<'_>, home: [f64; 2]) -> Vec<Layer> {
    let extents = around(terrain, home);
    let whole = |(number, extent)| {
        let mut reading = Reading::new(number, extent);
        reading.read(terrain, u32::MAX);
        reading.into_layer()
    };
    extents.iter().enumerate().map(whole).collect()
}

/// Returns a tile with the samples around it.
pub(super) fn tile(terrain: &Terrain<'_>, index: TileIndex, slot: u32) -> Tile {
    const AROUND: usize = TILE_POSTS - TILE_SAMPLES;
    let per_unit = terrain.scale().height_mm_per_unit();
    let first = index.first_cell();
    let mut heights_mm = Vec::with_capacity(TILE_POSTS * TILE_POSTS);
    let mut line = [f64::NAN; TILE_POSTS];
    // There is nothing to copy west and south of the raster.
    let skipped = usize::from(first.x <= 0);
    for row in (first.y - AROUND as i32 / 2..).take(TILE_POSTS) {
        line.fill(f64::NAN);
        let column = (first.x - AROUND as i32 / 2).max(0) as u32;
        if let (Ok(row), Some(rest)) = (u32::try_from(row), line.get_mut(skipped..)) {
            // A pending height is drawn when its tile is sent again.
            let _ = terrain.grid().read_row(terrain.level(), row, column, rest);
        }
        heights_mm.extend(line.map(|height| (height * per_unit) as f32));
    }
    Tile {
        slot,
        index: [index.col, index.row],
        heights_mm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Scale;
    use heightfield::Raster;

    #[test]
    fn layers_are_bounded_nested_and_end_fine() {
        for size in [
            [1, 1],
            [1200, 1200],
            [40, 9000],
            [8192, 8192],
            [20_000, 9_000],
        ] {
            check(size, [0.5, 0.5]);
        }
        check([3_000_000, 2_000_000], [0.01, 0.99]);
        check([1 << 29, 1 << 29], [1.0, 0.3]);
    }

    fn check(size: [i32; 2], share: [f64; 2]) {
        let home = [0, 1].map(|i| share[i] * f64::from(size[i]));
        let extents = extents(size, home);
        for pair in extents.windows(2) {
            let [outer, inner] = [pair[0], pair[1]];
            let grain = outer.step * MESH;
            assert!(inner.step < outer.step);
            for (i, cell) in inner.cells.iter().enumerate() {
                let is_last = i >= 2 && size[i - 2] - cell < inner.step;
                assert!(cell % grain == 0 || is_last, "{size:?} {extents:?}");
                assert!((0..=size[i % 2]).contains(cell));
            }
        }
        for extent in &extents {
            let [west, south, east, north] = extent.cells;
            let widest = (east - west).max(north - south);
            assert!(widest / extent.step <= CELLS, "{size:?} {extent:?}");
        }
        let finest = extents.last().expect("there is one");
        assert!(finest.step <= FINEST_STEP, "{size:?}: {extents:?}");
    }

    #[test]
    fn tiles_and_layers_have_the_terrain_heights() {
        let raster = Raster::from_fn(70, 70, |x, y| (x + 100 * y) as f32);
        let raster = raster.expect("raster");
        let terrain = Terrain::new(&raster, Scale::new(0.5, 2.0).expect("scale"), 0);
        let terrain = terrain.expect("terrain");
        for (index, slot) in [((0, 0), 3), ((1, 0), 4), ((2, 2), 5)] {
            let tile = tile(&terrain, TileIndex::new(index.0, index.1), slot);
            assert_eq!((tile.slot, tile.index), (slot, [index.0, index.1]));
            for (i, height) in tile.heights_mm.iter().enumerate() {
                let column = 32 * index.0 - 1 + (i % TILE_POSTS) as i32;
                let row = 32 * index.1 - 1 + (i / TILE_POSTS) as i32;
                let inside = (0..70).contains(&column) && (0..70).contains(&row);
                let expected = 2.0 * (column + 100 * row) as f32;
                assert_eq!(height.is_nan(), !inside, "{column} {row}");
                assert!(!inside || *height == expected, "{column} {row}: {height}");
            }
        }
        let layers = of(&terrain, [3.0, 3.0]);
        assert_eq!((layers.len(), layers[0].number), (1, 0));
        assert_eq!(
            (layers[0].columns, layers[0].rows, layers[0].step),
            (70, 70, 1)
        );
        assert_eq!(layers[0].heights[70 * 5 + 3], 503.0);
    }
}
