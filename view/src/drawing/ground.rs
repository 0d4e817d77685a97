//! Conversion of the tip's millimetres to the picture's metres.

use hapterra_view_stream::{Layer, Scene, TILE_CELLS};

/// Coordinates of the picture: metres on the ground, or millimetres of the tip in the first
/// placement if the terrain's size is unknown. The origin is at the home position of the first
/// placement, at height zero, so that single precision is finest near the hand.
///
/// Another placement of the terrain has other millimetres. In the picture the terrain stays where
/// it is, and data in those millimetres is converted to it. Heights are drawn as they are rendered,
/// with their exaggeration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    /// The picture's origin, from the south-west sample.
    origin: [f64; 2],
    home_mm: [f64; 3],
    /// The rendered level.
    level: u8,
    /// Side of a cell of level 0.
    cell: f64,
    /// Size of a vertical unit of the file.
    relief: f64,
    /// Radius of the ball at the tip; 0 for a point.
    pub(super) ball: f64,
    /// Size of a device millimetre, horizontal and vertical.
    pub(super) per_mm: f64,
    up_per_mm: f64,
    /// Half the side of the area in front of the arm and near the hand. It determines the distance
    /// of the eye.
    pub(super) near: f64,
}

/// Extent of the terrain that is visible at first, mm: a palm's width around the tip.
const NEAR_MM: f64 = 70.0;
/// Max difference of the heights of two placements with the same terrain, as a share.
const SAME: f64 = 1e-6;

impl Ground {
    /// Creates the ground of the first placement.
    pub(super) fn new(scene: &Scene) -> Self {
        let per_mm = scene.ground_m_per_mm.unwrap_or(1.0);
        let [x, y, _] = scene.home_mm;
        Self::placed(scene, per_mm, [x * per_mm, y * per_mm])
    }

    /// Creates the ground of another placement, after this one.
    pub(super) fn after(&self, scene: &Scene) -> Self {
        // Millimetres of the first placement, if the ground's size is unknown.
        let per_mm = scene.ground_m_per_mm.unwrap_or(self.cell / scene.cell_mm);
        Self::placed(scene, per_mm, self.origin)
    }

    fn placed(scene: &Scene, per_mm: f64, origin: [f64; 2]) -> Self {
        let [west, south, east, north] = scene.fitted_mm;
        let half_side = 0.5 * (east - west).max(north - south);
        Self {
            origin,
            home_mm: scene.home_mm,
            level: scene.level,
            cell: scene.cell_mm * per_mm,
            relief: scene.mm_per_unit * per_mm,
            ball: scene.tip_mm * per_mm,
            per_mm,
            up_per_mm: per_mm,
            near: half_side.clamp(1e-3, NEAR_MM) * per_mm,
        }
    }

    /// Returns this placement over the terrain of another one, with its heights: for a recording,
    /// whose terrain is drawn once.
    pub(super) fn over(self, terrain: &Self) -> Self {
        let ratio = terrain.relief / self.relief;
        let up_per_mm = match ratio.is_finite() {
            true => self.per_mm * ratio,
            false => self.per_mm,
        };
        Self { up_per_mm, ..self }
    }

    /// Returns true if the terrain has the same heights in the picture in both placements.
    pub(super) fn has_heights_of(&self, other: &Self) -> bool {
        (self.relief - other.relief).abs() <= SAME * self.relief.abs()
    }

    /// Returns a position in the picture.
    pub(super) fn at(&self, [x, y, z]: [f64; 3]) -> [f32; 3] {
        let [east, north] = self.origin;
        let place = [x * self.per_mm - east, y * self.per_mm - north];
        [place[0], place[1], z * self.up_per_mm].map(|units| units as f32)
    }

    /// Returns a sample in the picture; `cell` counts in cells of level 0, `up` in the picture's
    /// units.
    pub(super) fn sample(&self, cell: [f64; 2], up: f32) -> [f32; 3] {
        let [east, north] = self.origin;
        let [x, y] = cell.map(|cells| cells * self.cell);
        [(x - east) as f32, (y - north) as f32, up]
    }

    /// Returns the home position at the height of the tip.
    pub(super) fn home(&self) -> [f32; 3] {
        self.at(self.home_mm)
    }

    /// Returns a position of the picture in cells of level 0 from the south-west sample.
    pub(super) fn cells(&self, place: [f64; 2]) -> [f64; 2] {
        place.map(|at| at / self.step(1))
    }

    /// Returns the distance in the picture of `cells` cells of level 0.
    pub(super) fn step(&self, cells: i32) -> f64 {
        f64::from(cells) * self.cell
    }

    /// Converts heights in vertical units of the file.
    pub(super) fn heights_of(&self, units: &[f32]) -> Vec<f32> {
        units.iter().map(|unit| unit * self.relief as f32).collect()
    }

    /// Converts heights in millimetres.
    pub(super) fn heights_of_mm(&self, mm: &[f32]) -> Vec<f32> {
        mm.iter().map(|mm| mm * self.up_per_mm as f32).collect()
    }

    /// Returns the cells of level 0 in a rendered cell, along a side.
    pub(super) fn haptic_cell(&self) -> i32 {
        1_i32.checked_shl(self.level.into()).unwrap_or(i32::MAX)
    }

    /// Returns the cells of level 0 in a tile, along a side.
    pub(super) fn tile_cells(&self) -> i32 {
        TILE_CELLS.saturating_mul(self.haptic_cell())
    }

    /// Returns the south-west cell of a tile, of level 0.
    pub(super) fn first_cell(&self, index: [i32; 2]) -> [i32; 2] {
        index.map(|index| index.saturating_mul(self.tile_cells()))
    }
}

/// Returns the cell at a column and row of a layer's samples.
pub(super) fn cell_of(layer: &Layer, column: usize, row: usize) -> [i32; 2] {
    let [x, y] = layer.first;
    [
        x.saturating_add(layer.step.saturating_mul(column as i32)),
        y.saturating_add(layer.step.saturating_mul(row as i32)),
    ]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(crate) fn scene() -> Scene {
        Scene {
            title: String::new(),
            facts: vec![],
            is_live: true,
            keeps_tiles: false,
            level: 0,
            cell_mm: 0.5,
            mm_per_unit: 0.01,
            tip_mm: 0.0,
            home_mm: [40.0, 30.0, 12.0],
            fitted_mm: [0.0, 0.0, 80.0, 80.0],
            ground_m_per_mm: Some(60.0),
            height_per_mm: 100.0,
            height_unit: "m".into(),
            coordinates: None,
            tick: None,
        }
    }

    /// Returns the same position of the terrain, in a placement with twice the scale and level 1.
    fn zoomed(ground_m_per_mm: Option<f64>) -> (Scene, Scene) {
        let scene = Scene {
            ground_m_per_mm,
            ..scene()
        };
        let twice = Scene {
            cell_mm: 1.0,
            level: 1,
            mm_per_unit: 0.02,
            home_mm: [80.0, 60.0, 24.0],
            fitted_mm: [0.0, 0.0, 160.0, 160.0],
            ground_m_per_mm: ground_m_per_mm.map(|metres| 0.5 * metres),
            ..scene.clone()
        };
        (scene, twice)
    }

    #[test]
    fn scale_change_leaves_the_terrain_in_place() {
        for ground in [Some(60.0), None] {
            let (scene, twice) = zoomed(ground);
            let before = Ground::new(&scene);
            let after = before.after(&twice);
            assert_eq!(before.home(), [0.0, 0.0, (12.0 * before.per_mm) as f32]);
            assert_eq!(before.home(), after.home(), "{ground:?}");
            assert_eq!(
                before.sample([7.0, 9.0], 1.0),
                after.sample([7.0, 9.0], 1.0)
            );
            assert!(after.has_heights_of(&before));
            // Haptic cells are of another level; the eye moves nearer, or stays if the palm is
            // still smaller than the area.
            assert_eq!((before.tile_cells(), after.tile_cells()), (32, 64));
            assert!(after.near < before.near + 1e-9);
        }
    }

    #[test]
    fn pan_moves_home_and_leaves_the_terrain_in_place() {
        let scene = scene();
        let panned = Scene {
            home_mm: [45.0, 28.0, 12.0],
            ..scene.clone()
        };
        let before = Ground::new(&scene);
        let after = before.after(&panned);
        assert_eq!(
            before.sample([7.0, 9.0], 1.0),
            after.sample([7.0, 9.0], 1.0)
        );
        let [east, north, _] = after.home();
        assert_eq!(
            [east, north],
            [5.0, -2.0].map(|mm| (mm * before.per_mm) as f32)
        );
    }

    #[test]
    fn other_heights_redraw_the_terrain_unless_recorded() {
        let scene = scene();
        let steeper = Scene {
            mm_per_unit: 3.0 * scene.mm_per_unit,
            ..scene.clone()
        };
        let before = Ground::new(&scene);
        let after = before.after(&steeper);
        assert!(!after.has_heights_of(&before));
        let [now, then] = [after, before].map(|ground| ground.heights_of(&[1.0])[0]);
        assert!((now - 3.0 * then).abs() < 1e-5);
        // The hand of a recording is on the terrain of the beginning.
        let [_, _, up] = after.over(&before).at([40.0, 30.0, 9.0]);
        assert!((up - before.at([40.0, 30.0, 3.0])[2]).abs() < 1e-3);
        let level = Scene {
            mm_per_unit: 0.0,
            ..scene
        };
        let level = before.after(&level).over(&before);
        assert!(level.at([0.0; 3]).iter().all(|place| place.is_finite()));
    }
}
