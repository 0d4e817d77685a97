//! Record of one tick, from its own report.

use hapterra_core::contact::ContactState;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Limits;
use hapterra_core::scene::TickRecord;
use hapterra_tests::invariants::surface::Patch;

use super::vector::{Vector, minus};
use crate::grid::Grid;

/// A tick's report, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EffectTick {
    /// Haptic interface point, cells.
    pub hip: Vector,
    /// Proxy, cells.
    pub proxy: Vector,
    /// Force, N.
    pub force_n: Vector,
    /// True if the proxy is on the surface and nothing limits the scene's force.
    pub whole: bool,
}

/// Limits that change the scene's force.
const FORCE_LIMITS: Limits = Limits::FORCE_CLAMPED
    .union(Limits::SLEW_LIMITED)
    .union(Limits::SPEED_LIMITED)
    .union(Limits::RAMPING)
    .union(Limits::FADING)
    .union(Limits::TERRAIN_MISSING)
    .union(Limits::EDGE_FADING);

impl EffectTick {
    pub(super) fn of(sample: &TickRecord) -> Self {
        let touches = sample.state == ContactState::Touching;
        Self {
            hip: wide(&sample.hip),
            proxy: wide(&sample.proxy),
            force_n: sample.force_n.to_array().map(f64::from),
            whole: touches && !sample.limits.intersects(FORCE_LIMITS),
        }
    }

    /// Returns the spring's displacement, from the HIP to the proxy, cells.
    pub(super) fn spring(&self) -> Vector {
        minus(self.proxy, self.hip)
    }

    /// Returns the slopes of the proxy's patch; `None` on its border, where patches meet.
    pub(super) fn slopes(&self, grid: &Grid) -> Option<[f64; 2]> {
        const BORDER: f64 = 2e-3;
        let [x, y, _] = self.proxy;
        let inside = |c: f64| (BORDER..1.0 - BORDER).contains(&(c - c.floor()));
        let patch = Patch::at(grid, [x.floor() as i32, y.floor() as i32])?;
        (inside(x) && inside(y)).then(|| patch.slopes(x, y))
    }
}

fn wide(point: &GridPoint) -> Vector {
    let (cell, frac) = (point.cell(), point.frac().to_array());
    [0, 1, 2].map(|i| f64::from(cell[i]) + f64::from(frac[i]))
}
