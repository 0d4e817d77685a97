//! Positions of a later placement in the cells of the first one.
//!
//! The viewer draws the terrain of a recording once, in the cells of the first placement. If the
//! cells of another placement were measured elsewhere on the globe, it has other millimetres for
//! the same ground.

use crate::replay::Record;
use crate::terrain::{Scale, Terrain};

/// Converts positions of a placement to the cells of the first one.
pub(super) struct ToFirstPlacement<'t> {
    view: Terrain<'t>,
    /// The placement's terrain in the cells of the first one, equally large in device millimetres.
    in_first_cells: Terrain<'t>,
}

impl<'t> ToFirstPlacement<'t> {
    /// Creates the conversion of a placement; `None` if its cells are those of the first one, or
    /// cannot be converted.
    pub(super) fn new(first: &Terrain<'t>, view: &Terrain<'t>) -> Option<Self> {
        let (grid, scale) = (first.grid(), view.scale_of_level_0());
        if grid.has_samples_of(view.grid()) {
            return None;
        }
        let cell_mm = scale.cell_mm() * (grid.side_m()? / view.grid().side_m()?);
        let scale = Scale::new(cell_mm, scale.height_mm_per_unit()).ok()?;
        Some(Self {
            view: view.clone(),
            in_first_cells: first.with_grid(*grid, scale, view.level()).ok()?,
        })
    }

    /// Returns the terrain of the placement in the cells of the first one.
    pub(super) const fn terrain(&self) -> &Terrain<'t> {
        &self.in_first_cells
    }

    /// Converts a position, mm: the same ground and height.
    pub(super) fn place(&self, [east, north, up]: [f64; 3]) -> [f64; 3] {
        let (from, to) = (
            self.view.scale_of_level_0(),
            self.in_first_cells.scale_of_level_0(),
        );
        let cells = [east, north].map(|mm| mm / from.cell_mm());
        let ground = self.view.grid().to_ground(cells);
        let [east, north] = self.in_first_cells.grid().of_ground(ground);
        [east * to.cell_mm(), north * to.cell_mm(), up]
    }

    /// Converts the positions of a row.
    pub(super) fn record(&self, record: &Record) -> Record {
        Record {
            hip_mm: self.place(record.hip_mm),
            proxy_mm: self.place(record.proxy_mm),
            ..*record
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{HapticCells, HapticGrid};
    use heightfield::{CellSize, CellUnit, Raster};

    #[test]
    fn ground_is_mapped_to_the_first_placement() {
        let raster = Raster::from_fn(41, 41, |column, row| (3 * column + row) as f32);
        let raster = raster.expect("raster");
        let cell = |east| CellSize {
            east,
            north: 10.0,
            unit: CellUnit::Length { metres: 1.0 },
            ..raster.cell().expect("metres")
        };
        let [first, later] = [20.0, 8.0].map(|east| raster.clone().with_cell(cell(east)));
        let scale = |mm| Scale::new(mm, 0.1).expect("scale");
        let terrain = |raster, mm| {
            let grid = HapticGrid::new(raster, HapticCells::Square);
            Terrain::over(grid, scale(mm), 0).expect("terrain")
        };
        // Cells of 10 m, and of 8 m.
        let (first, view) = (terrain(&first, 0.5), terrain(&later, 0.8));
        assert!(ToFirstPlacement::new(&first, &first).is_none());
        let standing = ToFirstPlacement::new(&first, &view).expect("other cells");
        // The sample of column 5 and row 4, at 10 m for each millimetre.
        let [east, north, up] = standing.place([5.0 * 0.8, 5.0 * 0.8, 3.0]);
        assert!((east - 10.0).abs() < 1e-9 && (north - 4.0).abs() < 1e-9);
        let ground = |terrain: &Terrain<'_>, x, y| terrain.height_mm(x, y).expect("ground");
        let (here, there) = (
            ground(&view, 4.0, 4.0),
            ground(standing.terrain(), east, north),
        );
        assert!((here - there).abs() < 1e-9, "{here} {there}");
        assert_eq!(up, 3.0);
    }
}
