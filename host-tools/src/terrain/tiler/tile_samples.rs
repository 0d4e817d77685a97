//! Samples of a tile: heights of the ground in cells, or of the centre of the tip's ball over it.

use hapterra_core::grid::MAX_CELL;
use hapterra_core::terrain::{TILE_CELLS, TILE_SAMPLES, TileKey};
use hapterra_touch::tip::{Ball, CENTRE_STEP, Nodes, Samples};
use heightfield::ReadTracker;

use super::super::steps::BinaryUnit;
use super::{INTERPOLATED_STEP, Terrain};

impl Terrain<'_> {
    /// Returns a height in cells; NaN if it exceeds the range of positions.
    pub(super) fn within(&self, cells: f64) -> f64 {
        match cells.abs() <= f64::from(MAX_CELL) {
            true => cells,
            false => f64::NAN,
        }
    }

    /// Returns the step to which heights are rounded, cells, if they differ from those of the file.
    pub(super) const fn step(&self) -> Option<f64> {
        match (&self.ball, self.grid.is_resampled()) {
            (Some(_), _) => Some(CENTRE_STEP),
            (None, true) => Some(INTERPOLATED_STEP),
            (None, false) => None,
        }
    }

    /// Copies the tile's samples, in cells; NaN in no-data and off the data. Returns the unit of
    /// which the heights are multiples, in the file's vertical unit.
    pub(super) fn read(
        &self,
        key: TileKey,
        heights: &mut [f64; TILE_SAMPLES * TILE_SAMPLES],
        reads: &ReadTracker,
    ) -> BinaryUnit {
        let first = |index: i32| index as u32 * TILE_CELLS as u32;
        let (west, south) = (first(key.index.col), first(key.index.row));
        if let Some(ball) = &self.ball {
            let (samples, nodes) = self.samples(ball, [west, south], TILE_SAMPLES, reads);
            for (height, centre) in heights.iter_mut().zip(ball.centres(&samples, nodes)) {
                *height = self.rounded(self.within(centre));
            }
            return BinaryUnit::ANY;
        }
        let mut unit = BinaryUnit::ANY;
        for (row, line) in (south..).zip(heights.chunks_exact_mut(TILE_SAMPLES)) {
            reads.add(self.grid.read_row(self.level, row, west, line));
            for height in line {
                unit = unit.with(*height);
                // If not all heights were read before, one may exceed the range of a tile.
                *height = self.rounded(self.within(self.scale.height_cells(*height)));
            }
        }
        unit
    }

    /// Returns the samples of the level on which a ball's nodes depend, `side` in each direction
    /// from a rendered sample, in haptic cells, NaN in no-data and off the data; and the positions
    /// of the nodes.
    pub(super) fn samples(
        &self,
        ball: &Ball,
        first: [u32; 2],
        side: usize,
        reads: &ReadTracker,
    ) -> (Samples, Nodes) {
        let ([west, south], along, nodes) = ball.samples_for(first, side);
        let mut heights = vec![f64::NAN; along * along];
        // West of the raster there are no columns to read.
        let skipped = west.min(0).unsigned_abs() as usize;
        for (row, line) in (south..).zip(heights.chunks_exact_mut(along)) {
            let (Ok(row), Some(line)) = (u32::try_from(row), line.get_mut(skipped..)) else {
                continue;
            };
            let west = west.max(0) as u32;
            reads.add(self.grid.read_row(self.level, row, west, line));
            for height in line {
                *height = self.within(self.scale.height_cells(*height));
            }
        }
        let samples = Samples {
            columns: along,
            rows: along,
            heights,
        };
        (samples, nodes)
    }

    /// Rounds a height in cells for the device.
    pub(super) fn rounded(&self, cells: f64) -> f64 {
        match self.step() {
            Some(step) => (cells / step).round() * step,
            None => cells,
        }
    }
}
