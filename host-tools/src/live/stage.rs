//! A terrain in front of the arm, and a hand that tours it.

use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::GridPoint;
use hapterra_core::wire::message::{Scene, Source};

use crate::phantom::{HandModel, OutOfReach, PhantomModel, Rig, Tour, TourPlan};
use crate::terrain::Terrain;

/// Force of the hand's slide, N; it presses with twice as much.
const PUSH_N: f64 = 1.0;
/// Rest after the tour, s.
const REST_S: f64 = 0.25;

/// A terrain, how it feels, and where it lies.
pub struct Stage<'t> {
    terrain: &'t Terrain<'t>,
    law: ForceLaw,
    rule: Rule,
    model: PhantomModel,
    hand: HandModel,
    tour: Tour,
    home: GridPoint,
}

/// Why a terrain cannot be put in front of the arm.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StageError {
    /// No part of it is within the arm's reach.
    #[error("the terrain is too tall for the arm: {0}")]
    OutOfReach(#[from] OutOfReach),
    /// The place to touch is farther out than can be addressed.
    #[error("the place to touch, ({:.0}, {:.0}, {:.0}) mm, is too far from the origin", .0[0], .0[1], .0[2])]
    FarAway([f64; 3]),
}

impl<'t> Stage<'t> {
    /// Finds the place with the fewest holes and enough relief and puts it in
    /// the middle of the arm's reach.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn set(terrain: &'t Terrain<'t>, law: ForceLaw, rule: Rule) -> Result<Self, StageError> {
        let (model, hand) = (PhantomModel::premium_1_5(), HandModel::default());
        let surface = |east: f64, north: f64| terrain.height_mm(east, north);
        let tour = TourPlan {
            surface: &surface,
            size_mm: terrain.size_mm(),
            model,
            hand,
            wall_n_per_mm: f64::from(law.stiffness_n_per_mm).max(0.01),
            push_n: PUSH_N,
        }
        .plan()?;
        let home_mm = tour.placement.home_mm;
        let home = terrain
            .scale()
            .to_grid(home_mm)
            .ok_or(StageError::FarAway(home_mm))?;
        Ok(Self {
            terrain,
            law,
            rule,
            model,
            hand,
            tour,
            home,
        })
    }

    /// The terrain.
    #[must_use]
    pub const fn terrain(&self) -> &'t Terrain<'t> {
        self.terrain
    }

    /// The scene that the arm feels.
    #[must_use]
    pub fn scene(&self) -> Scene {
        self.terrain
            .scene(self.law, self.rule, Source::Encoders, self.home)
    }

    /// The virtual Phantom with the hand on it, at the beginning of its tour;
    /// it lets the device arm first.
    ///
    /// # Errors
    /// [`StageError::OutOfReach`].
    pub fn rig(&self) -> Result<Rig, StageError> {
        let script = self.tour.script.clone();
        let rig = Rig::new(self.model, self.hand, self.tour.placement, script)?;
        Ok(rig.arming())
    }

    /// How long the tour takes with arming before it and a rest at its end, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        Rig::ARMED_S + self.tour.script.duration_s() + REST_S
    }
}
