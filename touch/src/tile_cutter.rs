//! Cutting of tiles from a height field where it is touched.

use alloc::vec;
use alloc::vec::Vec;

use hapterra_core::grid::MAX_CELL;
use hapterra_core::terrain::{MAX_STEP_CELLS, TILE_CELLS, TILE_SAMPLES, Tile, TileKey};

use crate::checks::TerrainError;
use crate::heights::{Block, Unread};
use crate::scale::Scale;
use crate::terrain::Terrain;
use crate::tile_heights;
use crate::tip::{self, Ball, Nodes, Samples};

/// Reason why a tile could not be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CutError {
    Unread(Unread),
    Step,
}

impl Terrain {
    /// Returns the height of the surface at a position, mm: of the ground, or of a ball's centre
    /// over it ([`Self::with_tip`]). `None` for no-data, outside the terrain, and if it cannot be
    /// read.
    #[must_use]
    pub fn height_mm(&self, east_mm: f64, north_mm: f64) -> Option<f64> {
        let (size, cell_mm) = (self.size(), self.haptic_scale().cell_mm());
        let (column, u) = tile_heights::patch_at(east_mm / cell_mm, size[0])?;
        let (row, v) = tile_heights::patch_at(north_mm / cell_mm, size[1])?;
        if let Some(ball) = &self.ball {
            let mut buffer = Vec::new();
            let read = self.samples_around(ball, [column, row], tip::PATCH_NODES, &mut buffer);
            let (samples, nodes) = read.ok()?;
            return Some(ball.between(&samples, nodes, [u, v])? * cell_mm);
        }
        let mut corners = [f64::NAN; 4];
        let block = Block {
            column,
            row,
            columns: 2,
            rows: 2,
        };
        self.heights.read(block, &mut corners).ok()?;
        let mm = corners.map(|height| height * self.scale.height_mm_per_unit());
        let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
        let [sw, se, nw, ne] = mm;
        // A cell without data at any corner is no-data.
        let hole = mm.iter().any(|height| !height.is_finite());
        (!hole).then(|| mix(mix(sw, se, u), mix(nw, ne, u), v))
    }

    /// Returns the haptic cells along the side of a cell of the ground: 1 for a point.
    fn parts(&self) -> u32 {
        self.ball.as_ref().map_or(1, Ball::parts)
    }

    /// Returns the scale of haptic cells: that of the samples, or a whole part of it under a ball.
    pub(crate) fn haptic_scale(&self) -> Scale {
        self.scale.in_parts(self.parts())
    }

    /// Returns the number of haptic patches east and north.
    pub(crate) fn size(&self) -> [i32; 2] {
        let parts = self.parts() as i32;
        // Checked before: at most MAX_CELL of them.
        [self.columns, self.rows].map(|count| (count as i32 - 1) * parts)
    }

    /// Returns a whole height in haptic cells that no sample exceeds.
    pub(crate) fn top(&self) -> i32 {
        let Some(range) = self.range else {
            return MAX_CELL + 1;
        };
        let scale = self.haptic_scale();
        let ends = range.map(|height| scale.height_cells(height));
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let radius = self.ball.as_ref().map_or(0.0, Ball::radius);
        (tile_heights::top(low, high) + libm::ceil(radius) as i32).min(MAX_CELL + 1)
    }

    /// Returns the largest material of the samples; `None` if there is only one material.
    pub(crate) fn last_material(&self) -> Option<u8> {
        let materials = self.materials.as_ref()?;
        materials.samples.iter().copied().max()
    }

    /// Checks that the heights can be touched at this scale. Heights of a callback, and of a ball's
    /// centre, are checked tile by tile.
    pub(crate) fn check_heights(&self) -> Result<(), TerrainError> {
        let scale = self.haptic_scale();
        let cell_mm = scale.cell_mm();
        for height in self.range.into_iter().flatten() {
            let cells = scale.height_cells(height);
            if cells.is_nan() || cells.abs() > f64::from(MAX_CELL) {
                return Err(TerrainError::TooTall { cells, cell_mm });
            }
        }
        if let Some((step, [column, row])) = self.step {
            let cells = scale.height_cells(step).abs();
            if cells > f64::from(MAX_STEP_CELLS) {
                return Err(TerrainError::Step { column, row, cells });
            }
        }
        Ok(())
    }

    /// Cuts a tile of the terrain into a buffer, with its materials if the table has any. `buffer`
    /// is memory for its samples.
    pub(crate) fn cut(
        &self,
        key: TileKey,
        materials: usize,
        buffer: &mut Vec<f64>,
        tile: &mut Tile,
    ) -> Result<(), CutError> {
        let index = [key.index.col, key.index.row];
        let first = index.map(|index| index.max(0) as u32 * TILE_CELLS as u32);
        let width = self.read_haptic(first, buffer).map_err(CutError::Unread)?;
        let base = base(buffer);
        let filled = tile.fill(key, base, |col, row| {
            let cells = (col < width)
                .then(|| buffer.get(row * width + col))
                .flatten();
            cells.map_or(f32::NAN, |cells| tile_heights::height_above(base, *cells))
        });
        filled.map_err(|_| CutError::Step)?;
        if materials > 0
            && let Some(of) = &self.materials
        {
            let part = 1.0 / f64::from(self.parts());
            // The sample under the middle of a ball.
            let under = |haptic: u32| libm::floor(f64::from(haptic) * part + 0.5) as u32;
            let [column, row] = first;
            let samples = (0..TILE_SAMPLES as u32).flat_map(|v| {
                let line = of.row(under(row + v));
                let at = move |u| line.get(under(column + u) as usize);
                (0..TILE_SAMPLES as u32).map(move |u| at(u).copied().unwrap_or(0))
            });
            // Checked when they were set.
            let set = tile.set_materials(materials, samples);
            set.map_err(|_| CutError::Step)?;
        }
        Ok(())
    }

    /// Reads the rendered heights of a tile, in haptic cells, row by row: NaN for no-data. Returns
    /// the number of heights in a row.
    fn read_haptic(&self, first: [u32; 2], buffer: &mut Vec<f64>) -> Result<usize, Unread> {
        let Some(ball) = &self.ball else {
            let end = [self.columns, self.rows].map(i64::from);
            let from = first.map(i64::from);
            let to = [0, 1].map(|axis| (from[axis] + TILE_SAMPLES as i64).min(end[axis]));
            let block = self.read_cells(from, to, buffer)?;
            if self.height_step > 0.0 {
                for height in buffer.iter_mut() {
                    *height = libm::round(*height / self.height_step) * self.height_step;
                }
            }
            return Ok(block.columns as usize);
        };
        let (samples, nodes) = self.samples_around(ball, first, TILE_SAMPLES, buffer)?;
        *buffer = ball.centres(&samples, nodes);
        for height in buffer.iter_mut() {
            *height = tip::round_centre(nan_beyond_range(*height));
        }
        Ok(TILE_SAMPLES)
    }

    /// Reads the samples on which a ball's nodes depend, for `side` nodes in each direction from a
    /// rendered sample, in haptic cells: NaN for no-data and outside the field.
    fn samples_around(
        &self,
        ball: &Ball,
        first: [u32; 2],
        side: usize,
        buffer: &mut Vec<f64>,
    ) -> Result<(Samples, Nodes), Unread> {
        let (from, along, nodes) = ball.samples_for(first, side);
        let end = [self.columns, self.rows].map(i64::from);
        let to = [0, 1].map(|axis| (from[axis] + along as i64).min(end[axis]));
        let block = self.read_cells(from.map(|first| first.max(0)), to, buffer)?;
        let mut heights = vec![f64::NAN; along * along];
        let beside = from.map(|first| first.min(0).unsigned_abs() as usize);
        let rows = heights.chunks_exact_mut(along).skip(beside[1]);
        for (row, read) in rows.zip(buffer.chunks_exact(block.columns.max(1) as usize)) {
            for (height, cells) in row.iter_mut().skip(beside[0]).zip(read) {
                *height = *cells;
            }
        }
        let samples = Samples {
            columns: along,
            rows: along,
            heights,
        };
        Ok((samples, nodes))
    }

    /// Reads the samples of the field from `from` to before `to`, in haptic cells: NaN for no-data.
    fn read_cells(
        &self,
        from: [i64; 2],
        to: [i64; 2],
        buffer: &mut Vec<f64>,
    ) -> Result<Block, Unread> {
        // Both are within the field.
        let count = |axis: usize| (to[axis] - from[axis]).max(0) as u32;
        let block = Block {
            column: from[0] as u32,
            row: from[1] as u32,
            columns: count(0),
            rows: count(1),
        };
        buffer.clear();
        buffer.resize(block.columns as usize * block.rows as usize, f64::NAN);
        self.heights.read(block, buffer)?;
        let scale = self.haptic_scale();
        for height in buffer.iter_mut() {
            *height = nan_beyond_range(scale.height_cells(*height));
        }
        Ok(block)
    }
}

/// Returns a height in cells; NaN beyond the range of positions.
fn nan_beyond_range(cells: f64) -> f64 {
    match cells.abs() <= f64::from(MAX_CELL) {
        true => cells,
        false => f64::NAN,
    }
}

/// Returns the whole height that is the base of a tile; 0 if all is no-data.
fn base(cells: &[f64]) -> i32 {
    let known = cells.iter().copied().filter(|cells| !cells.is_nan());
    let range = known.fold(None, |range: Option<(f64, f64)>, h| {
        let (low, high) = range.unwrap_or((h, h));
        Some((low.min(h), high.max(h)))
    });
    let Some((low, high)) = range else {
        return 0;
    };
    tile_heights::base(low, high)
}
