//! The paper's rule over a terrain, for `hapterra-lab replay --contact paper`.

use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::TickRecord;

use crate::published::{Heights, Paper, Start};
use crate::terrain::Terrain;

/// Max Newton steps in one patch.
const STEPS: u32 = 20;

/// The paper's rule in `f64`, with the spring of surface parameters.
pub(super) struct Published<'t> {
    rule: Paper<InCells<'t>, f64>,
    params: SurfaceParams,
    cell_mm: f32,
}

/// The heights of a terrain in cells.
struct InCells<'t>(Terrain<'t>);

impl InCells<'_> {
    fn all_corners(&self, [x, y]: [i32; 2]) -> Option<[f32; 4]> {
        let [Ok(x), Ok(y)] = [x, y].map(u32::try_from) else {
            return None;
        };
        let terrain = &self.0;
        let scale = terrain.scale();
        let height = |column, row| {
            let height = terrain.grid().height_of_level(terrain.level(), column, row);
            (height * scale.height_mm_per_unit() / scale.cell_mm()) as f32
        };
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[e, n]| height(x + e, y + n));
        corners.iter().all(|z| z.is_finite()).then_some(corners)
    }
}

impl Heights for InCells<'_> {
    fn has(&self, cell: [i32; 2]) -> bool {
        self.all_corners(cell).is_some()
    }

    fn corners(&self, cell: [i32; 2]) -> [f32; 4] {
        self.all_corners(cell).unwrap_or_default()
    }
}

impl<'t> Published<'t> {
    pub(super) fn new(terrain: Terrain<'t>, params: SurfaceParams) -> Self {
        let cell_mm = terrain.scale().cell_mm() as f32;
        Self {
            rule: Paper::new(InCells(terrain), Start::LastPoint, STEPS),
            params,
            cell_mm,
        }
    }

    /// Renders one tick.
    pub(super) fn step(&mut self, hip: GridPoint) -> TickRecord {
        let (cell, frac) = (hip.cell(), hip.frac());
        let wide = [0, 1, 2].map(|axis| f64::from(cell[axis]) + f64::from(frac[axis]));
        let displacement = self.rule.step(wide);
        let state = match displacement {
            Some(_) => ContactState::Touching,
            None => ContactState::Free,
        };
        let displacement = displacement.map_or(Vec3::ZERO, |it| {
            Vec3::from_array(it.map(|cells| cells as f32))
        });
        TickRecord {
            hip,
            proxy: GridPoint::new(cell, frac + displacement),
            force_n: self.params.spring().force_n(displacement * self.cell_mm),
            state,
            ..TickRecord::default()
        }
    }
}
