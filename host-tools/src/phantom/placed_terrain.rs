//! A terrain in front of the arm, with the tour of a scripted hand over it.

use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::{Scene, Source};

use super::{HandModel, HeldPhantom, OutOfReach, PhantomModel, TourPlan};
use crate::terrain::Terrain;

/// Force of the hand's slide, N; presses and taps are 1.5 times as strong.
const PUSH_N: f64 = 1.0;
/// Distance between the points of the plan, mm: a hand cannot follow finer detail.
const PLAN_SPACING_MM: f64 = 0.5;
/// Rest after the tour, s.
const REST_S: f64 = 0.25;

/// A terrain with its surface, and a held Premium 1.5 in whose reach it lies.
pub struct PlacedTerrain<'t> {
    terrain: &'t Terrain<'t>,
    scene: Scene,
    home_mm: [f64; 3],
    arm: HeldPhantom,
    duration_s: f64,
}

/// Reason why a terrain cannot be placed in front of the arm.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlacingError {
    /// No part of it is within the arm's reach.
    #[error("the terrain cannot be toured: {0}")]
    OutOfReach(#[from] OutOfReach),
    /// The place to touch is too far from the origin for its coordinates.
    #[error("the place to touch, ({:.0}, {:.0}, {:.0}) mm, is too far from the origin", .0[0], .0[1], .0[2])]
    FarAway([f64; 3]),
    /// The user has interrupted the command.
    #[error("interrupted")]
    Interrupted,
}

impl<'t> PlacedTerrain<'t> {
    /// Finds the place with the least no-data and enough relief, and puts it in the middle of the
    /// arm's reach.
    ///
    /// # Errors
    /// [`PlacingError`].
    pub fn new(terrain: &'t Terrain<'t>, params: SurfaceParams) -> Result<Self, PlacingError> {
        Self::with_tour(terrain, params, None, &|| true)
    }

    /// Keeps the terrain at its placement, with the point `home_mm` at the tip in the home pose
    /// (device millimetres), and plans a tour of the part that the arm reaches; planning ends if
    /// `should_continue` returns false.
    ///
    /// # Errors
    /// [`PlacingError`].
    pub fn in_view(
        terrain: &'t Terrain<'t>,
        home_mm: [f64; 3],
        params: SurfaceParams,
        should_continue: &dyn Fn() -> bool,
    ) -> Result<Self, PlacingError> {
        Self::with_tour(terrain, params, Some(home_mm), should_continue)
    }

    fn with_tour(
        terrain: &'t Terrain<'t>,
        params: SurfaceParams,
        home_mm: Option<[f64; 3]>,
        should_continue: &dyn Fn() -> bool,
    ) -> Result<Self, PlacingError> {
        let (model, hand) = (PhantomModel::premium_1_5(), HandModel::default());
        // After an interrupt the surface has no heights: the plan ends quickly and is dropped.
        let surface = |east: f64, north: f64| {
            let height = || terrain.plan_height_mm(east, north, PLAN_SPACING_MM);
            should_continue().then(height).flatten()
        };
        let plan = TourPlan {
            surface: &surface,
            size_mm: terrain.size_mm(),
            model,
            hand,
            wall_n_per_mm: f64::from(params.stiffness_n_per_mm).max(0.01),
            push_n: PUSH_N,
            home_mm,
        }
        .plan();
        if !should_continue() {
            return Err(PlacingError::Interrupted);
        }
        let tour = plan?;
        let home_mm = tour.placement.home_mm;
        let home = terrain.scale().to_grid(home_mm);
        let home = home.ok_or(PlacingError::FarAway(home_mm))?;
        let duration_s = HeldPhantom::ARMED_S + tour.script.duration_s() + REST_S;
        Ok(Self {
            terrain,
            scene: terrain.scene(params, Source::Encoders, home),
            home_mm,
            arm: HeldPhantom::new(model, hand, tour.placement, tour.script)?.arming(),
            duration_s,
        })
    }

    /// Repeats the tour `times` times.
    #[must_use]
    pub fn repeated(mut self, times: u32) -> Self {
        self.arm = self.arm.repeated(times);
        self.duration_s = HeldPhantom::ARMED_S + self.arm.script_s() + REST_S;
        self
    }

    /// Returns the placed terrain.
    #[must_use]
    pub const fn terrain(&self) -> &'t Terrain<'t> {
        self.terrain
    }

    /// Returns the scene for the device.
    #[must_use]
    pub const fn scene(&self) -> Scene {
        self.scene
    }

    /// Returns the surface parameters.
    #[must_use]
    pub const fn params(&self) -> SurfaceParams {
        self.scene.params
    }

    /// Returns the point of the terrain at the tip in the arm's home pose, device millimetres.
    #[must_use]
    pub const fn home_mm(&self) -> [f64; 3] {
        self.home_mm
    }

    /// Returns the virtual Phantom, held at the beginning of the tour by a hand that lets the
    /// device arm first.
    #[must_use]
    pub fn held_phantom(&self) -> HeldPhantom {
        self.arm.clone()
    }

    /// Returns the duration of the arming, the tour and the rest after it, s.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use heightfield::Raster;

    use super::*;
    use crate::terrain::Scale;

    #[test]
    fn planning_stops_when_the_user_interrupts() {
        let raster = Raster::from_fn(201, 201, |column, _| column as f32).expect("a raster");
        let scale = Scale::new(1.0, 0.1).expect("a scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
        let home_mm = [100.0, 100.0, 20.0];
        let calls = Cell::new(0);
        let plan = |limit: u32| {
            calls.set(0);
            PlacedTerrain::in_view(&terrain, home_mm, SurfaceParams::PREMIUM, &|| {
                calls.set(calls.get() + 1);
                calls.get() <= limit
            })
            .map(drop)
        };
        assert_eq!(plan(u32::MAX), Ok(()));
        let all = calls.get();
        for limit in [0, 1, all / 2] {
            assert_eq!(
                plan(limit),
                Err(PlacingError::Interrupted),
                "{limit} of {all}"
            );
        }
    }
}
