//! The haptic grid: square cells over the samples of a raster.
//!
//! A patch is a square. If a file's cells are not square (an arc second away from the equator, 10 m
//! by 30 m, a skewed transform), the finer of its two axes keeps its samples and the other is
//! interpolated, sample by sample, when a tile is made.

use std::hash::{Hash, Hasher};

use super::{Scale, ScaleError};
use crate::materials::Materials;
use heightfield::{CellSize, Raster, ReadStatus, ReadTracker, Sides, Wait, around, bilinear};

/// Relative difference of its sides below which a cell counts as square and keeps its exact
/// samples.
const SQUARE: f64 = 1e-3;

/// Relative difference of a side from its measured size above which cells are measured again.
/// Together with half of [`SQUARE`], the error of cells that keep their samples, it is less than
/// the 0.1 % to which slopes are true.
const MEASURED: f64 = 2.5e-4;

/// The cells of a file that are rendered.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    clap::ValueEnum,
    serde::Serialize,
    serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum HapticCells {
    /// As the file stores them, rendered as squares whatever their shape
    Stored,
    /// Square on the ground: true to scale in every direction
    #[default]
    Square,
}

/// Samples of square cells over a raster. Column 0 is the westernmost, row 0 the southernmost.
#[derive(Clone, Copy, Debug)]
pub struct HapticGrid<'r> {
    raster: &'r Raster,
    cells: HapticCells,
    /// A cell of the file at `measured_at`.
    cell: Option<CellSize>,
    /// Place at which the cell was measured, in the file's coordinates; `None` for the middle.
    measured_at: Option<[f64; 2]>,
    columns: u32,
    rows: u32,
    /// Side of a haptic cell on the ground, metres, if the file states it.
    side_m: Option<f64>,
    /// Position of the samples in the file; `None` if they are the file's own.
    resampling: Option<Resampling>,
    /// Materials of the ground, if there are several.
    materials: Option<&'r Materials>,
    /// Radius of the ball at the tip, device millimetres; 0 for a point.
    tip_mm: f64,
    /// Behaviour of reads.
    wait: Wait,
}

/// Position of haptic sample (u, v) in the file: column `first + u · column_step + v · lean`, row
/// `v · row_step`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Resampling {
    first: f64,
    column_step: f64,
    lean: f64,
    row_step: f64,
}

impl<'r> HapticGrid<'r> {
    /// Creates the haptic grid of a raster, with cells of the size in its middle.
    #[must_use]
    pub fn new(raster: &'r Raster, cells: HapticCells) -> Self {
        Self::of_cell(raster, cells, raster.cell())
    }

    /// Creates the haptic grid of a raster, with cells of the size at a place, in the file's
    /// coordinates: cells in degrees get narrower towards the poles, and a map's scale is true in
    /// few places.
    #[must_use]
    pub fn at(raster: &'r Raster, cells: HapticCells, ground: [f64; 2]) -> Self {
        Self {
            measured_at: Some(ground),
            ..Self::of_cell(raster, cells, raster.georeference().cell_at(ground))
        }
    }

    /// Returns the grid with these materials, or without.
    #[must_use]
    pub const fn with_materials(self, materials: Option<&'r Materials>) -> Self {
        Self { materials, ..self }
    }

    /// Returns the grid with reads that wait or do not wait.
    #[must_use]
    pub const fn with_wait(self, wait: Wait) -> Self {
        Self { wait, ..self }
    }

    /// Returns the behaviour of its reads.
    #[must_use]
    pub const fn wait(&self) -> Wait {
        self.wait
    }

    /// Returns the grid for a ball of a radius in device millimetres; 0 for a point.
    #[must_use]
    pub const fn with_tip(self, tip_mm: f64) -> Self {
        Self { tip_mm, ..self }
    }

    /// Returns the radius of the ball at the tip, device millimetres; 0 for a point.
    #[must_use]
    pub const fn tip_mm(&self) -> f64 {
        self.tip_mm
    }

    /// Returns the materials of the ground, if there are several.
    #[must_use]
    pub const fn materials(&self) -> Option<&'r Materials> {
        self.materials
    }

    /// Returns the grid with cells of the size at a place in haptic cells, if a cell there differs
    /// from the rendered ones in size or shape by more than a quarter of 0.1 %. A place outside the
    /// raster counts as the nearest one in it.
    ///
    /// Returns `None` if the cells agree, or if there would be too many square cells to count.
    #[must_use]
    pub fn remeasured_at(&self, haptic: [f64; 2]) -> Option<Self> {
        let last = self.last();
        let inside = [0, 1].map(|axis| haptic[axis].clamp(0.0, last[axis]));
        let ground = self.to_ground(inside);
        let (now, there) = (self.cell?, self.raster.georeference().cell_at(ground)?);
        if is_alike(&now, &there) {
            return None;
        }
        let remeasured = Self::at(self.raster, self.cells, ground);
        let remeasured = remeasured
            .with_materials(self.materials)
            .with_tip(self.tip_mm);
        let remeasured = remeasured.with_wait(self.wait);
        (self.cells == HapticCells::Stored || !remeasured.is_distorted()).then_some(remeasured)
    }

    /// Returns true if the grid has the same samples as another over the same raster.
    #[must_use]
    pub fn has_samples_of(&self, other: &Self) -> bool {
        let what = |grid: &Self| (grid.columns, grid.rows, grid.resampling);
        what(self) == what(other)
    }

    /// Returns the smallest rectangle around a rectangle (west, south, east, north) given in cells
    /// of another grid over the same raster.
    pub(crate) fn around_sides_of(&self, other: &Self, sides: Sides) -> Sides {
        if self.has_samples_of(other) {
            return sides;
        }
        let [west, south, east, north] = sides;
        let corners = [[west, south], [east, south], [west, north], [east, north]];
        let here = corners.map(|corner| self.of_ground(other.to_ground(corner)));
        let [west, south, east, north] = around(here);
        let [columns, rows] = self.last();
        [
            west.max(0.0),
            south.max(0.0),
            east.min(columns),
            north.min(rows),
        ]
    }

    /// Returns column and row of the last haptic sample.
    fn last(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|count| f64::from(count) - 1.0)
    }

    fn of_cell(raster: &'r Raster, cells: HapticCells, cell: Option<CellSize>) -> Self {
        let stored = Self {
            raster,
            cells,
            cell,
            measured_at: None,
            columns: raster.columns(),
            rows: raster.rows(),
            side_m: cell.map(|cell| cell.square_metres()),
            resampling: None,
            materials: None,
            tip_mm: 0.0,
            wait: Wait::UntilRead,
        };
        match (cells, cell) {
            (HapticCells::Square, Some(cell)) if is_square(&cell) => {
                let (east, north) = cell.ground_metres();
                Self {
                    side_m: Some((east * north).sqrt()),
                    ..stored
                }
            }
            (HapticCells::Square, Some(cell)) => stored.squared(&cell).unwrap_or(stored),
            _ => stored,
        }
    }

    /// Lays square cells, as large as the smaller side of the file's, over the raster; returns
    /// `None` if there are too many to count.
    ///
    /// With columns `e` apart and rows `n` apart that lean by the cosine `c` of the
    /// angle between them (`k` its sine), haptic sample (u, v) of side `s` is on row
    /// `s v / (n k)` and column `(s u + west − s v c / k) / e`.
    fn squared(self, cell: &CellSize) -> Option<Self> {
        let ((east, north), cosine) = (cell.ground_metres(), cell.lean);
        let sine = (1.0 - cosine * cosine).sqrt();
        let side = east.min(north);
        let last = |samples: u32| f64::from(samples - 1);
        let leaning = cosine * north * last(self.rows);
        let size = [
            east * last(self.columns) + leaning.abs(),
            north * sine * last(self.rows),
        ];
        let samples = |length: f64| {
            let cells = (length / side + bilinear::ON_SAMPLE).floor();
            (cells >= 1.0 && cells < f64::from(u32::MAX)).then_some(cells as u32 + 1)
        };
        Some(Self {
            columns: samples(size[0])?,
            rows: samples(size[1])?,
            side_m: Some(side),
            resampling: Some(Resampling {
                first: leaning.min(0.0) / east,
                column_step: side / east,
                lean: -side * cosine / (sine * east),
                row_step: side / (north * sine),
            }),
            ..self
        })
    }

    /// Returns the raster under the grid.
    #[must_use]
    pub const fn raster(&self) -> &'r Raster {
        self.raster
    }

    /// Returns the requested shape of cells.
    #[must_use]
    pub const fn cells(&self) -> HapticCells {
        self.cells
    }

    /// Returns true if cells are rendered as squares although they are not square on the ground.
    #[must_use]
    pub fn is_distorted(&self) -> bool {
        !self.is_resampled() && self.cell.is_some_and(|cell| !is_square(&cell))
    }

    /// Returns the place, in the file's coordinates, where the file's cells have the rendered size;
    /// `None` for the middle of the raster.
    #[must_use]
    pub const fn measured_at(&self) -> Option<[f64; 2]> {
        self.measured_at
    }

    /// Returns the number of haptic samples from west to east.
    #[must_use]
    pub const fn columns(&self) -> u32 {
        self.columns
    }

    /// Returns the number of haptic samples from south to north.
    #[must_use]
    pub const fn rows(&self) -> u32 {
        self.rows
    }

    /// Returns true if heights are interpolated because the file's cells are not square.
    #[must_use]
    pub const fn is_resampled(&self) -> bool {
        self.resampling.is_some()
    }

    /// Returns the side of a haptic cell on the ground in metres, if the file states it. Cells
    /// rendered as stored count as squares of the same area.
    #[must_use]
    pub const fn side_m(&self) -> Option<f64> {
        self.side_m
    }

    /// Returns the height of one vertical unit in cells at true proportions, if the file states its
    /// cell size: with `cell_mm` device millimetres for each cell, the true height of a unit is
    /// `cell_mm` times this.
    #[must_use]
    pub fn cells_per_vertical_unit(&self) -> Option<f64> {
        let metres = self.raster.metres_per_vertical_unit();
        self.side_m.map(|side| metres / side)
    }

    /// Returns the scale of `cell_mm` device millimetres for each cell, with heights at the file's
    /// true proportions, or 1 mm for each unit if the file does not state its cell size.
    ///
    /// # Errors
    /// As [`Scale::new`].
    pub fn true_scale(&self, cell_mm: f64) -> Result<Scale, ScaleError> {
        let cells = self.cells_per_vertical_unit();
        Scale::new(cell_mm, cells.map_or(1.0, |cells| cells * cell_mm))
    }

    /// Returns the ratio of heights at a scale to true proportions, to nine digits; `None` if the
    /// file does not state its cell size.
    #[must_use]
    pub fn exaggeration(&self, scale: &Scale) -> Option<f64> {
        let true_cells = self.cells_per_vertical_unit()?;
        let times = scale.height_cells(1.0) / true_cells;
        let rounded = (times * 1e9).round() / 1e9;
        times.is_finite().then_some(rounded)
    }

    /// Converts a position in haptic cells from the south-west sample to the file's coordinates.
    #[must_use]
    pub fn to_ground(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let sample = match &self.resampling {
            None => [u, v],
            Some(places) => places.in_file(u, v),
        };
        self.raster.georeference().transform().to_ground(sample)
    }

    /// Converts coordinates of the file, also outside the raster, to a position in haptic cells.
    #[must_use]
    pub fn of_ground(&self, ground: [f64; 2]) -> [f64; 2] {
        let [column, row] = self.raster.georeference().transform().to_samples(ground);
        match &self.resampling {
            None => [column, row],
            Some(places) => {
                let v = row / places.row_step;
                [
                    (column - places.first - v * places.lean) / places.column_step,
                    v,
                ]
            }
        }
    }

    /// Returns the columns and rows of the file for one haptic cell to the east, and to the north.
    pub(super) fn steps_in_file(&self) -> [[f64; 2]; 2] {
        match &self.resampling {
            None => [[1.0, 0.0], [0.0, 1.0]],
            Some(places) => [[places.column_step, 0.0], [places.lean, places.row_step]],
        }
    }

    /// Returns the height of the bilinear surface at a position in haptic cells, in the file's
    /// vertical unit; `None` in no-data and outside the raster.
    #[must_use]
    pub fn surface(&self, place: [f64; 2]) -> Option<f64> {
        self.read_surface(place).0
    }

    /// Returns the height of [`HapticGrid::surface`], and whether it is known.
    pub fn read_surface(&self, place: [f64; 2]) -> (Option<f64>, ReadStatus) {
        let reads = ReadTracker::default();
        let height = bilinear::at(place, |column, row| {
            reads.record(self.read_height(0, column, row))
        });
        (
            Some(height).filter(|height| !height.is_nan()),
            reads.status(),
        )
    }

    /// Returns the height at a haptic sample in the file's vertical unit; NaN in no-data and
    /// outside the raster.
    #[must_use]
    pub fn height(&self, column: u32, row: u32) -> f64 {
        self.height_of_level(0, column, row)
    }

    /// Returns the height at a sample of level *L*, the grid with every 2ᴸ-th sample; column and
    /// row count in that grid.
    #[must_use]
    pub fn height_of_level(&self, level: u8, column: u32, row: u32) -> f64 {
        self.read_height(level, column, row).0
    }

    /// Returns the height of [`HapticGrid::height_of_level`], and whether it is known.
    pub fn read_height(&self, level: u8, column: u32, row: u32) -> (f64, ReadStatus) {
        let whole = |index: u32| u64::from(index).checked_mul(1_u64.checked_shl(level.into())?);
        let (Some(column), Some(row)) = (whole(column), whole(row)) else {
            return (f64::NAN, ReadStatus::Complete);
        };
        // Both are below 2^32, or outside the raster.
        self.height_at_level(level, [column as f64, row as f64])
    }

    /// Returns the file's height at a level of detail, at a position in haptic cells; NaN in
    /// no-data and outside the raster. Also returns whether it is known.
    pub(super) fn height_at_level(&self, level: u8, [u, v]: [f64; 2]) -> (f64, ReadStatus) {
        let [last_column, last_row] = self.last();
        if u > last_column || v > last_row {
            return (f64::NAN, ReadStatus::Complete);
        }
        let place = match &self.resampling {
            None => [u, v],
            Some(places) => places.in_file(u, v),
        };
        self.raster.read_surface(level, place, self.wait)
    }

    /// Prefetches the missing samples between two positions of level *L*, both included and in
    /// cells of that level: [`Raster::prefetch`].
    pub fn prefetch(&self, level: u8, from: [i32; 2], to: [i32; 2]) {
        let step = f64::from(level).exp2();
        let corners = [from, [to[0], from[1]], [from[0], to[1]], to].map(|[column, row]| {
            let (u, v) = (f64::from(column) * step, f64::from(row) * step);
            match &self.resampling {
                None => [u, v],
                Some(places) => places.in_file(u, v),
            }
        });
        let along = |axis: usize| {
            let places = || corners.iter().map(|corner| corner[axis]);
            let first = places().fold(f64::INFINITY, f64::min).floor();
            let last = places().fold(f64::NEG_INFINITY, f64::max).ceil();
            // Negative indices have no sample; `Raster::prefetch` cuts at the other border.
            [first as u32, last as u32]
        };
        self.raster.prefetch(level, along(0), along(1));
    }

    /// Copies heights of a row from `first_column` eastwards, one for each place in
    /// `heights`: the same values as [`HapticGrid::height_of_level`].
    pub fn read_row(
        &self,
        level: u8,
        row: u32,
        first_column: u32,
        heights: &mut [f64],
    ) -> ReadStatus {
        if self.resampling.is_none() {
            let raster = self.raster;
            return raster.read_row(level, row, first_column, heights, self.wait);
        }
        let reads = ReadTracker::default();
        for (column, height) in (first_column..).zip(heights) {
            *height = reads.record(self.read_height(level, column, row));
        }
        reads.status()
    }
}

impl HapticGrid<'_> {
    /// Hashes the grid except the samples of its raster.
    pub(super) fn hash_shape<H: Hasher>(&self, hasher: &mut H) {
        (self.columns, self.rows).hash(hasher);
        if let Some(materials) = self.materials {
            materials.fingerprint().hash(hasher);
        }
        if self.tip_mm > 0.0 {
            self.tip_mm.to_bits().hash(hasher);
        }
        if let Some(places) = &self.resampling {
            let numbers = [
                places.first,
                places.column_step,
                places.lean,
                places.row_step,
            ];
            numbers.map(f64::to_bits).hash(hasher);
        }
    }
}

impl Resampling {
    /// Returns column and row of the file at a haptic sample or between two.
    fn in_file(&self, u: f64, v: f64) -> [f64; 2] {
        [
            self.first + u * self.column_step + v * self.lean,
            v * self.row_step,
        ]
    }
}

/// Returns true if two cells have the same size and lean, within [`MEASURED`].
fn is_alike(one: &CellSize, other: &CellSize) -> bool {
    let (a, b) = (one.ground_metres(), other.ground_metres());
    let is_near = |a: f64, b: f64| (a - b).abs() <= MEASURED * a;
    let leans_alike = (one.lean - other.lean).abs() <= MEASURED;
    is_near(a.0, b.0) && is_near(a.1, b.1) && leans_alike
}

fn is_square(cell: &CellSize) -> bool {
    let (east, north) = cell.ground_metres();
    (east - north).abs() <= SQUARE * east.min(north) && cell.lean.abs() <= SQUARE
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use heightfield::{CellUnit, Certainty, Globe};

    /// Returns a cell in metres, whose columns lean over its rows by an angle with the cosine
    /// `lean`.
    pub(in crate::terrain) fn cell(east: f64, north: f64, lean: f64) -> CellSize {
        CellSize {
            east,
            north,
            lean,
            map_scale: (1.0, 1.0),
            unit: CellUnit::Length { metres: 1.0 },
            latitude: None,
            globe: Globe::EARTH,
            certainty: Certainty::Stated,
        }
    }

    /// Returns a plane, whose height is known everywhere on the ground.
    fn plane(cell: CellSize, [east, north]: [f64; 2]) -> Raster {
        let sine = (1.0 - cell.lean * cell.lean).sqrt();
        let raster = Raster::from_fn(41, 31, |column, row| {
            let (column, row) = (f64::from(column) * cell.east, f64::from(row) * cell.north);
            (east * (column + row * cell.lean) + north * row * sine) as f32
        });
        raster.expect("raster").with_cell(cell)
    }

    #[test]
    fn plane_is_true_to_scale_on_cells_of_any_shape() {
        for (across, along, lean) in [
            (10.0, 30.0, 0.0),
            (30.0, 10.0, 0.0),
            (5.0, 10.0, 0.2),
            (10.0, 10.0, -0.3),
            (10.0, 7.3, 0.0),
        ] {
            let raster = plane(cell(across, along, lean), [1.0, 0.5]);
            let grid = HapticGrid::new(&raster, HapticCells::Square);
            let side = grid.side_m().expect("known");
            assert_eq!(side, f64::min(across, along));
            let mut steps = 0;
            for row in 0..grid.rows() - 1 {
                for column in 0..grid.columns() - 1 {
                    let at = grid.height(column, row);
                    let (east, north) =
                        (grid.height(column + 1, row), grid.height(column, row + 1));
                    if !(at.is_nan() || east.is_nan() || north.is_nan()) {
                        let slopes = [(east - at) / side, (north - at) / side];
                        assert!((slopes[0] - 1.0).abs() < 1e-4, "{slopes:?} east");
                        assert!((slopes[1] - 0.5).abs() < 1e-4, "{slopes:?} north");
                        steps += 1;
                    }
                }
            }
            let ground = 40.0 * across * 30.0 * along * (1.0 - lean * lean).sqrt();
            let haptic = f64::from(steps) * side * side;
            assert!(haptic > 0.8 * ground, "{haptic} of {ground} m²");
        }
    }

    #[test]
    fn square_and_stored_cells_keep_exact_samples() {
        for (cells, east) in [(HapticCells::Square, 10.009), (HapticCells::Stored, 30.0)] {
            let raster = plane(cell(east, 10.0, 0.0), [0.3, 0.7]);
            let grid = HapticGrid::new(&raster, cells);
            assert!(!grid.is_resampled());
            assert_eq!(grid.is_distorted(), cells == HapticCells::Stored);
            assert_eq!((grid.columns(), grid.rows()), (41, 31));
            assert_eq!(grid.height(17, 23), raster.height(17, 23));
        }
    }

    /// Also for a map that is not true to scale, and for columns that lean.
    #[test]
    fn stored_cells_count_as_squares_of_equal_ground_area() {
        for (map_scale, lean) in [((0.5, 0.5), 0.0), ((1.0, 1.0), 0.6), ((0.5, 0.8), -0.6)] {
            let cell = CellSize {
                map_scale,
                ..cell(30.0, 10.0, lean)
            };
            let raster = plane(cell, [0.3, 0.7]);
            let grid = HapticGrid::new(&raster, HapticCells::Stored);
            let area = 300.0 * map_scale.0 * map_scale.1 * (1.0 - lean * lean).sqrt();
            let side = grid.side_m().expect("known");
            assert!((side * side / area - 1.0).abs() < 1e-12, "{side}");
            let metres = grid.cells_per_vertical_unit().expect("known");
            assert!((metres * side - 1.0).abs() < 1e-12, "{metres}");
        }
    }

    #[test]
    fn finer_axis_keeps_samples_and_row_reads_match_single_reads() {
        let raster = plane(cell(10.0, 25.0, 0.0), [0.3, 0.7]);
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        assert_eq!((grid.columns(), grid.rows()), (41, 76));
        // Row 5 of 10 m is the file's row 2 of 25 m.
        assert_eq!(grid.height(7, 5), raster.height(7, 2));
        let mut heights = [0.0; 12];
        let _ = grid.read_row(2, 3, 1, &mut heights);
        for (column, height) in (1..).zip(heights) {
            let single = grid.height(4 * column, 12);
            assert!(height == single || (height.is_nan() && single.is_nan()));
        }
        assert!(heights[10].is_nan(), "east of the field");
        let _ = grid.read_row(40, 1, 0, &mut heights);
        assert!(heights.iter().all(|height| height.is_nan()));
    }

    #[test]
    fn no_data_covers_exactly_the_samples_interpolated_from_it() {
        let raster = Raster::from_fn(9, 9, |column, row| match (column, row) {
            (4, 4) => f32::NAN,
            _ => 1.0,
        });
        let raster = raster.expect("raster").with_cell(cell(10.0, 20.0, 0.0));
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        let holes: Vec<_> = (0..grid.rows())
            .flat_map(|row| (0..grid.columns()).map(move |column| (column, row)))
            .filter(|&(column, row)| grid.height(column, row).is_nan())
            .collect();
        assert_eq!(holes, [(4, 7), (4, 8), (4, 9)]);
    }
}
