//! Tiles made on demand from a raster.

mod tile_samples;

use std::sync::OnceLock;

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::{GridPoint, MAX_CELL};
use hapterra_core::scene::{Scene, Source};
use hapterra_core::terrain::packed::{HeightStep, MAX_PACKED, pack};
use hapterra_core::terrain::{FieldSize, MAX_STEP_CELLS, TILE_CELLS, TILE_SAMPLES, TileKey};
use hapterra_core::wire::materials::TileMaterials;
use hapterra_core::wire::message::Heights;

use hapterra_touch::tile_heights;
use hapterra_touch::tip::{self, Ball, TipError};

use super::steps::steps;
use super::{HapticCells, HapticGrid, Scale, ScaleError, identity};
use crate::materials::MaterialBuffer;
use heightfield::{Raster, ReadStatus, ReadTracker, Wait};

/// Interpolated heights, which are not in the file, are rounded to multiples of this, cells. Single
/// precision has this resolution 64 cells above a tile's base, and heights that are not rounded
/// cannot be compressed for the link.
pub const INTERPOLATED_STEP: f64 = 1.0 / (1 << 17) as f64;

/// Bytes of a tile's samples.
const TILE_BYTES: usize = 4 * TILE_SAMPLES * TILE_SAMPLES;

/// A raster at a scale and a level of detail.
#[derive(Clone)]
pub struct Terrain<'r> {
    grid: HapticGrid<'r>,
    /// Scale of level 0.
    scale_of_level_0: Scale,
    /// Scale of haptic cells.
    scale: Scale,
    level: u8,
    /// Haptic cells along the side of a cell of the level: 1 for a point.
    parts: u32,
    /// Haptic patches, east and north.
    size: [i32; 2],
    top: i32,
    /// Ball at the tip, if there is one: heights are then those of its centre.
    ball: Option<Ball>,
    fingerprint: OnceLock<u64>,
    /// Set after the warning that a tile is too steep.
    steep: OnceLock<()>,
}

/// Reason why a raster cannot be rendered at a scale.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// The scale is invalid.
    #[error(transparent)]
    Scale(#[from] ScaleError),
    /// Heights beyond the range of positions.
    #[error(
        "heights reach {cells:.4e} cells at {} mm a unit and {} mm a cell; at most ±{MAX_CELL} can be rendered",
        scale.height_mm_per_unit(), scale.cell_mm()
    )]
    TooTall {
        /// The largest height, in cells.
        cells: f64,
        /// The scale that causes it.
        scale: Scale,
    },
    /// A tip that is no ball, or a ball too large for the duration of a tile.
    #[error(
        "a tip of {} mm: {:.1} cells of level {level}, where 0 to {} can be rendered",
        tip.tip_mm, tip.cells, tip::MAX_CELLS
    )]
    Tip {
        /// The tip.
        tip: TipError,
        /// The level.
        level: u8,
    },
    /// More cells than positions can count.
    #[error("{0} samples in a row or column; at most {MAX_CELL} can be rendered")]
    TooLarge(u32),
    /// A level that leaves no patch.
    #[error("level {level} leaves nothing of {columns} × {rows} samples")]
    NoSuchLevel {
        /// The requested level.
        level: u8,
        /// Samples of the grid, west to east.
        columns: u32,
        /// Samples of the grid, south to north.
        rows: u32,
    },
}

/// Buffer for one tile's samples, reused for each tile.
pub struct TileBuffer {
    pub(super) heights: Box<[f64; TILE_SAMPLES * TILE_SAMPLES]>,
    /// Heights above the tile's base.
    singles: Box<[f32; TILE_SAMPLES * TILE_SAMPLES]>,
    bytes: Box<[u8; TILE_BYTES]>,
}

impl Default for TileBuffer {
    fn default() -> Self {
        Self {
            heights: Box::new([f64::NAN; TILE_SAMPLES * TILE_SAMPLES]),
            singles: Box::new([f32::NAN; TILE_SAMPLES * TILE_SAMPLES]),
            bytes: Box::new([0; TILE_BYTES]),
        }
    }
}

impl TileBuffer {
    /// Returns the heights in their shortest form for the link; `low` and `high` are the lowest and
    /// the highest of them.
    pub(super) fn above(&mut self, low: f64, high: f64, steps: &[HeightStep]) -> Heights<'_> {
        let base = tile_heights::base(low, high);
        for (single, height) in self.singles.iter_mut().zip(self.heights.iter()) {
            *single = tile_heights::height_above(base, *height);
        }
        self.packed(base, steps)
    }

    /// Returns the tile in its shortest form for the link.
    fn packed(&mut self, base: i32, steps: &[HeightStep]) -> Heights<'_> {
        let room = &mut self.bytes[..MAX_PACKED];
        if let Some(length) = pack(&self.singles, base, steps, room).map(<[u8]>::len) {
            let bytes = &self.bytes[..length];
            return Heights::Packed { base, bytes };
        }
        for (to, height) in self.bytes.chunks_exact_mut(4).zip(self.singles.iter()) {
            to.copy_from_slice(&height.to_le_bytes());
        }
        Heights::Samples {
            base,
            bytes: self.bytes.as_slice(),
        }
    }
}

/// Returns a sample that differs from its neighbour to the east or north by more than
/// [`MAX_STEP_CELLS`], and the difference.
fn steep_step(heights: &[f64; TILE_SAMPLES * TILE_SAMPLES]) -> Option<(usize, f64)> {
    let step = |at: usize, to: usize| {
        let step = heights.get(to)? - heights.get(at)?;
        (step.abs() > f64::from(MAX_STEP_CELLS)).then_some((at, step.abs()))
    };
    let east = |at: usize| {
        (at % TILE_SAMPLES + 1 < TILE_SAMPLES)
            .then(|| step(at, at + 1))
            .flatten()
    };
    (0..heights.len()).find_map(|at| east(at).or_else(|| step(at, at + TILE_SAMPLES)))
}

impl<'r> Terrain<'r> {
    /// Creates the terrain of a raster at `scale`, with every `2^level`-th sample.
    ///
    /// # Errors
    /// [`TerrainError`] if its heights or its size exceed the range of positions, or the level
    /// leaves no patch.
    pub fn new(raster: &'r Raster, scale: Scale, level: u8) -> Result<Self, TerrainError> {
        Self::over(
            HapticGrid::new(raster, HapticCells::default()),
            scale,
            level,
        )
    }

    /// As [`Self::new`], with a given haptic grid.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn over(grid: HapticGrid<'r>, scale: Scale, level: u8) -> Result<Self, TerrainError> {
        let (columns, rows) = (grid.columns(), grid.rows());
        let larger = columns.max(rows);
        if i64::from(larger) > i64::from(MAX_CELL) {
            return Err(TerrainError::TooLarge(larger));
        }
        let patches = |samples: u32| (samples - 1).checked_shr(level.into()).unwrap_or(0) as i32;
        let size = [patches(columns), patches(rows)];
        if size.contains(&0) {
            return Err(TerrainError::NoSuchLevel {
                level,
                columns,
                rows,
            });
        }
        let of_level = scale.at_level(level);
        let ball = Ball::new(grid.tip_mm(), of_level.cell_mm());
        let ball = ball.map_err(|tip| TerrainError::Tip { tip, level })?;
        let higher = ball.as_ref().map_or(0, |ball| ball.radius().ceil() as i32);
        let parts = ball.as_ref().map_or(1, Ball::parts);
        let size = size.map(|patches| patches.checked_mul(parts as i32));
        let [Some(east), Some(north)] = size.map(|patches| patches.filter(|n| *n < MAX_CELL))
        else {
            return Err(TerrainError::TooLarge(larger));
        };
        let scale_of_level_0 = scale;
        let scale = of_level.in_parts(parts);
        Ok(Self {
            grid,
            scale_of_level_0,
            scale,
            level,
            parts,
            size: [east, north],
            top: (top(grid.raster(), &scale)? + higher).min(MAX_CELL + 1),
            ball,
            fingerprint: OnceLock::new(),
            steep: OnceLock::new(),
        })
    }

    /// Returns the radius of the ball at the tip, in haptic cells; 0 for a point.
    #[must_use]
    pub fn tip_cells(&self) -> f64 {
        self.ball.as_ref().map_or(0.0, Ball::radius)
    }

    /// Returns the terrain over another haptic grid of the same raster, at a scale of level 0 and a
    /// level.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_grid(
        &self,
        grid: HapticGrid<'r>,
        scale: Scale,
        level: u8,
    ) -> Result<Self, TerrainError> {
        Ok(Self {
            // The heights, and so their hash, are the same.
            fingerprint: self.fingerprint.clone(),
            ..Self::over(grid.with_wait(self.grid.wait()), scale, level)?
        })
    }

    /// Returns the terrain with reads that do not wait: a height that is not in memory is read in
    /// the background, and is [`ReadStatus::Pending`] until then.
    #[must_use]
    pub fn non_blocking(&self) -> Self {
        Self {
            grid: self.grid.with_wait(Wait::Never),
            ..self.clone()
        }
    }

    /// Returns true if another terrain of the same raster has the same tiles: the same samples at
    /// the same heights in cells.
    #[must_use]
    pub fn has_tiles_of(&self, other: &Self) -> bool {
        let height = |terrain: &Self| terrain.scale.height_cells(1.0);
        let (ours, theirs) = (height(self), height(other));
        self.level == other.level
            && self.tip_cells() == other.tip_cells()
            && self.grid.has_samples_of(&other.grid)
            && (ours - theirs).abs() <= f64::from(f32::EPSILON) * 1e-3 * ours.abs()
    }

    /// Returns the raster.
    #[must_use]
    pub const fn raster(&self) -> &'r Raster {
        self.grid.raster()
    }

    /// Returns the grid of its level 0.
    #[must_use]
    pub const fn grid(&self) -> &HapticGrid<'r> {
        &self.grid
    }

    /// Returns its level of detail: every `2^level`-th sample of the grid.
    #[must_use]
    pub const fn level(&self) -> u8 {
        self.level
    }

    /// Returns the scale of haptic cells: `2^level` times the grid's, divided by [`Self::parts`]
    /// with a ball.
    #[must_use]
    pub const fn scale(&self) -> &Scale {
        &self.scale
    }

    /// Returns the number of haptic cells along the side of a cell of the level: 1 for a point.
    #[must_use]
    pub const fn parts(&self) -> u32 {
        self.parts
    }

    /// Returns the length of a haptic cell in cells of the grid.
    #[must_use]
    pub fn cells_of_grid(&self) -> f64 {
        f64::from(self.level).exp2() / f64::from(self.parts)
    }

    /// Returns the scale of the finest level, whose cells are the grid's own.
    #[must_use]
    pub const fn scale_of_level_0(&self) -> Scale {
        self.scale_of_level_0
    }

    /// Returns the hash of all heights of the raster: equal terrains have the same hash, and a
    /// changed file has another. It is computed once, from the samples in memory, or from the
    /// file's index and the heights read at its opening if the raster stays in its file.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let print = || identity::fingerprint(self.raster());
        *self.fingerprint.get_or_init(print)
    }

    /// Returns the size in haptic patches, east and north.
    #[must_use]
    pub const fn size(&self) -> [i32; 2] {
        self.size
    }

    /// Returns a whole height in cells that no sample exceeds: the largest possible one if the
    /// raster stays in its file and not all heights are known.
    #[must_use]
    pub const fn top(&self) -> i32 {
        self.top
    }

    /// Returns the extent east and north from the south-west sample, device millimetres.
    #[must_use]
    pub fn size_mm(&self) -> [f64; 2] {
        self.size.map(|s| f64::from(s) * self.scale.cell_mm())
    }

    /// Returns the scene of this terrain for the device. Its epoch is a hash of the heights and of
    /// all its other fields.
    #[must_use]
    pub fn scene(&self, params: SurfaceParams, source: Source, home: GridPoint) -> Scene {
        let mut scene = Scene {
            epoch: 0,
            level: self.level,
            size: FieldSize::new(self.size[0], self.size[1]),
            top: self.top,
            fallback: None,
            cell_mm: self.scale.cell_mm() as f32,
            home,
            params,
            source,
            hold_clock: true,
            materials: (self.grid.materials()).map(|materials| materials.table().check_sum()),
        };
        scene.epoch = identity::epoch(self.fingerprint(), &self.grid, &self.scale, &scene);
        scene
    }

    /// Returns the height of the rendered surface at a position, all in device millimetres, in
    /// `f64`: bilinear between samples, or between the heights of a ball's centre at samples.
    /// `None` in no-data and off the data.
    #[must_use]
    pub fn height_mm(&self, east_mm: f64, north_mm: f64) -> Option<f64> {
        self.read_height_mm(east_mm, north_mm).0
    }

    /// Returns the height of [`Terrain::height_mm`], and whether it is known.
    pub fn read_height_mm(&self, east_mm: f64, north_mm: f64) -> (Option<f64>, ReadStatus) {
        let reads = ReadTracker::default();
        let height = self.height_by([east_mm, north_mm], &reads);
        (height, reads.status())
    }

    fn height_by(&self, [east_mm, north_mm]: [f64; 2], reads: &ReadTracker) -> Option<f64> {
        let Some(ball) = &self.ball else {
            return self.ground_mm(self.level, [east_mm, north_mm], reads);
        };
        let cell_mm = self.scale.cell_mm();
        let (column, u) = tile_heights::patch_at(east_mm / cell_mm, self.size[0])?;
        let (row, v) = tile_heights::patch_at(north_mm / cell_mm, self.size[1])?;
        let (samples, nodes) = self.samples(ball, [column, row], tip::PATCH_NODES, reads);
        let height = ball.between(&samples, nodes, [u, v])?;
        Some(height * cell_mm)
    }

    /// Returns the height of the ground for a picture with points `apart_mm` apart, mm: for a
    /// raster that stays in its file, at a level that is quick to read.
    #[must_use]
    pub fn picture_height_mm(&self, east_mm: f64, north_mm: f64, apart_mm: f64) -> Option<f64> {
        let cells = apart_mm / self.scale_of_level_0().cell_mm();
        let level = self.raster().level_for(cells).max(self.level);
        self.ground_mm(level, [east_mm, north_mm], &ReadTracker::default())
    }

    /// Returns the height of the surface for the plan of a hand's path, with points `apart_mm`
    /// apart, mm: [`Self::height_mm`] for a raster in memory; for one that stays in its file
    /// [`Self::picture_height_mm`], with a ball's centre over flat ground. A plan covers the whole terrain,
    /// but must not read all of it.
    #[must_use]
    pub fn plan_height_mm(&self, east_mm: f64, north_mm: f64, apart_mm: f64) -> Option<f64> {
        if self.raster().is_summary_complete() {
            return self.height_mm(east_mm, north_mm);
        }
        let ground = self.picture_height_mm(east_mm, north_mm, apart_mm)?;
        Some(ground + self.tip_cells() * self.scale.cell_mm())
    }

    /// Returns the height of the bilinear ground at a position.
    fn ground_mm(
        &self,
        level: u8,
        [east_mm, north_mm]: [f64; 2],
        reads: &ReadTracker,
    ) -> Option<f64> {
        let coarser = level - self.level;
        let cell_mm = self.scale_of_level_0.at_level(level).cell_mm();
        let size = self
            .size
            .map(|patches| (patches / self.parts as i32) >> coarser.min(31));
        let (column, u) = tile_heights::patch_at(east_mm / cell_mm, size[0])?;
        let (row, v) = tile_heights::patch_at(north_mm / cell_mm, size[1])?;
        let at = |dx: u32, dy: u32| {
            let height = reads.record(self.grid.read_height(level, column + dx, row + dy));
            height * self.scale.height_mm_per_unit()
        };
        let (south, north) = ([at(0, 0), at(1, 0)], [at(0, 1), at(1, 1)]);
        let mix = |[a, b]: [f64; 2], t: f64| a * (1.0 - t) + b * t;
        // A patch with no-data at one corner is no-data.
        let has_no_data = south.iter().chain(&north).any(|h| h.is_nan());
        (!has_no_data).then(|| mix([mix(south, u), mix(north, u)], v))
    }

    /// Returns true if the tile exists.
    #[must_use]
    pub fn has(&self, key: TileKey) -> bool {
        let last = self.size.map(|s| (s - 1) / TILE_CELLS as i32);
        key.level == self.level
            && (0..=last[0]).contains(&key.index.col)
            && (0..=last[1]).contains(&key.index.row)
    }

    /// Returns the heights of a tile as they are sent, with samples in `buffer`; `None` if the tile
    /// does not exist.
    #[must_use]
    pub fn tile<'b>(
        &self,
        key: TileKey,
        buffer: &'b mut TileBuffer,
    ) -> Option<(Heights<'b>, ReadStatus)> {
        let reads = ReadTracker::default();
        let heights = self.heights_of(key, buffer, &reads)?;
        Some((heights, reads.status()))
    }

    /// Returns the heights of a tile, by tracked reads.
    pub(super) fn heights_of<'b>(
        &self,
        key: TileKey,
        buffer: &'b mut TileBuffer,
        reads: &ReadTracker,
    ) -> Option<Heights<'b>> {
        if !self.has(key) {
            return None;
        }
        let unit = self.read(key, &mut buffer.heights, reads);
        if let Some(step) = steep_step(&buffer.heights) {
            self.warn_of_step(key, step);
            return Some(Heights::NoData);
        }
        let Some((low, high, known)) = range(buffer.heights.as_slice()) else {
            return Some(Heights::NoData);
        };
        if low == high && known == self.samples_in(key) {
            let base = tile_heights::base(low, high);
            let height = tile_heights::height_above(base, low);
            return Some(Heights::Flat { base, height });
        }
        let steps = match self.step() {
            Some(step) => vec![HeightStep::Cells(step)],
            None => steps(unit, self.scale.height_cells(1.0)).collect(),
        };
        Some(buffer.above(low, high, &steps))
    }

    /// Warns once if neighbouring samples differ by more than an exact contact allows.
    fn warn_of_step(&self, key: TileKey, (sample, cells): (usize, f64)) {
        if self.steep.set(()).is_err() {
            return;
        }
        let first = key.index.first_cell();
        let (column, row) = (
            first.x as usize + sample % TILE_SAMPLES,
            first.y as usize + sample / TILE_SAMPLES,
        );
        tracing::warn!(
            "sample {column}, {row} of level {}, from the south-west, differs from a neighbour by {cells:.3e} cells, at most {MAX_STEP_CELLS} can be rendered: \
             its tile, and each that is as steep, is no-data; scale the heights down with --exaggeration, or fill the sample",
            self.level
        );
    }

    /// Returns the materials of a tile as they are sent, and whether they are complete; `None` if
    /// the tile does not exist or the terrain has none.
    #[must_use]
    pub fn materials_of<'b>(
        &self,
        key: TileKey,
        buffer: &'b mut MaterialBuffer,
    ) -> Option<(TileMaterials<'b>, ReadStatus)> {
        let materials = self.grid.materials().filter(|_| self.has(key))?;
        let haptic = (&self.grid, self.size, self.cells_of_grid());
        Some(materials.tile(haptic, key.index, buffer))
    }

    /// Checks that every earlier read that waited was complete ([`Raster::check_complete`]).
    ///
    /// # Errors
    /// The reason why a height or class could not be read.
    pub fn check_complete(&self) -> Result<(), heightfield::Error> {
        self.raster().check_complete()?;
        let of_classes = self.grid.materials().map(|materials| materials.classes());
        of_classes.map_or(Ok(()), Raster::check_complete)
    }

    /// Returns the file's height of the ground at a haptic sample, at a level of detail, in the
    /// file's vertical unit; NaN if there is none. Also returns whether it is known.
    pub(crate) fn ground_at_level(&self, level: u8, [column, row]: [u32; 2]) -> (f64, ReadStatus) {
        let place = [column, row].map(|index| f64::from(index) * self.cells_of_grid());
        self.grid.height_at_level(level, place)
    }

    /// Returns the same height in cells, or that of a ball's centre on flat ground there; NaN if
    /// there is none that can be rendered.
    pub(super) fn cells_at(&self, level: u8, haptic: [u32; 2], reads: &ReadTracker) -> f64 {
        let height = reads.record(self.ground_at_level(level, haptic));
        self.within(self.scale.height_cells(height)) + self.tip_cells()
    }

    /// Prefetches the missing samples between two positions in haptic cells, both included.
    pub(crate) fn prefetch(&self, from: [i32; 2], to: [i32; 2]) {
        let parts = self.parts as i32;
        let halo = self.ball.as_ref().map_or(0, |ball| ball.halo() as i32);
        let from = from.map(|haptic| haptic.div_euclid(parts).saturating_sub(halo));
        let to = to.map(|haptic| haptic.div_euclid(parts).saturating_add(halo));
        self.grid.prefetch(self.level, from, to);
    }

    /// Returns the number of the tile's samples inside the raster.
    fn samples_in(&self, key: TileKey) -> usize {
        let inside = |index: i32, size: i32| {
            let first = index * TILE_CELLS as i32;
            (size + 1 - first).min(TILE_SAMPLES as i32) as usize
        };
        inside(key.index.col, self.size[0]) * inside(key.index.row, self.size[1])
    }
}

/// Returns the lowest and highest height and the number of heights; `None` without heights.
pub(super) fn range(heights: &[f64]) -> Option<(f64, f64, usize)> {
    let known = heights.iter().copied().filter(|h| !h.is_nan());
    known.fold(None, |range, h| {
        let (low, high, count) = range.unwrap_or((h, h, 0));
        Some((low.min(h), high.max(h), count + 1))
    })
}

fn top(raster: &Raster, scale: &Scale) -> Result<i32, TerrainError> {
    let summary = raster.summary();
    let ends = [summary.lowest, summary.highest].map(|h| scale.height_cells(h));
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let cells = if -low > high { low } else { high };
    if cells.is_nan() || cells.abs() > f64::from(MAX_CELL) {
        return Err(TerrainError::TooTall {
            cells,
            scale: *scale,
        });
    }
    if !raster.is_summary_complete() {
        return Ok(MAX_CELL + 1);
    }
    Ok(tile_heights::top(low, high))
}

#[cfg(test)]
#[path = "tiler_tests.rs"]
pub(super) mod tests;
