//! Damping of a scene's choice along the force, and of the passivity controller's.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::passivity::{MAX_MJ, Moment, Motion, Passivity, Takes};
use super::{EffectContext, SurfaceParams, clamp_length};
use crate::scalar::{larger, smaller};

/// Energy that a shaded force may give towards an edge, and take beyond it, before it is turned
/// less, as a part of its size times a cell and the depth. An edge gives a quarter of its bend
/// times the part of a cell on which the force turns ([`super::shading`]): this much at 23°,
/// twice as much at 45°, the most.
const EDGE_GIVES: f32 = 0.1;
/// A motion across the force that is slower is not damped, mm/s: a hand that rests and an arm that
/// hums are. They create little, and damping that comes late would shake them.
const SLOW_MM_S: f32 = 30.0;
/// So much more may have been created before it is turned less, mJ.
const LEAST_MJ: f32 = 0.1;

/// Damping of a surface: dissipation of a motion against it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Damping {
    /// Newtons for a metre a second along the force. What it adds or takes is never more
    /// than the spring's force: it comes in with the depth, and never pulls.
    pub ns_per_m: f32,
    /// Dissipation of the energy leak of the sampled wall.
    pub controller: Controller,
}

/// The passivity controller, on or off: it dissipates the energy that a spring which is sampled
/// in ticks creates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Controller {
    /// Wherever a current may flow. Settings of earlier versions say `auto`, too.
    #[default]
    #[serde(alias = "auto")]
    On,
    /// Never.
    Off,
}

impl Damping {
    /// Most that a scene may ask for, N·s/m.
    pub const MAX_NS_PER_M: f32 = 20.0;
    /// None, and the controller.
    pub const NONE: Self = Self {
        ns_per_m: 0.0,
        controller: Controller::On,
    };

    /// Returns true if this is the default.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns true if its number is one that a loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        (0.0..=Self::MAX_NS_PER_M).contains(&self.ns_per_m)
    }
}

/// The damping of one scene at one rate, and what else its controller has a say in; a scene without
/// any has none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damper {
    params: SurfaceParams,
    controller: Option<Passivity>,
}

impl Damper {
    /// Of a scene. Points have no hand that energy could be given to.
    // A call: it is made by two, once for a scene.
    #[inline(never)]
    pub(crate) fn of(params: &SurfaceParams, context: &EffectContext) -> Option<Self> {
        let is_controlled = context.arm && params.is_controlled();
        let controller = is_controlled.then(|| Passivity::new(context));
        (controller.is_some() || params.damping.ns_per_m > 0.0).then_some(Self {
            params: *params,
            controller,
        })
    }

    /// The surface is another one from this tick on, of the same controller.
    pub(crate) const fn feels(&mut self, params: &SurfaceParams) {
        self.params = *params;
    }

    /// The energy that was created and not taken back yet, mJ, where it is watched.
    pub(crate) fn created_mj(&self) -> f32 {
        self.controller.as_ref().map_or(0.0, Passivity::created_mj)
    }

    /// The share that is left of the turn of a shaded force, so deep.
    ///
    /// Such a force is not that of a spring: round a closed way it gives energy, and no damping
    /// along it takes back what comes across. Towards an edge it gives what it takes beyond, so
    /// all of the turn is left while no more was created than an edge gives.
    pub(crate) fn turn_left(&self, depth_mm: f32, cell_mm: f32) -> f32 {
        let spring_n = smaller(
            depth_mm * self.params.stiffness_n_per_mm,
            self.params.max_force_n,
        );
        // None of the turn is left at twice as much, and more than the book holds is forgotten.
        let gives_mj = smaller(
            EDGE_GIVES * spring_n * (cell_mm + depth_mm) + LEAST_MJ,
            0.5 * MAX_MJ,
        );
        let over = self.created_mj() / gives_mj - 1.0;
        smaller(larger(1.0 - over, 0.0), 1.0)
    }

    /// No force is rendered, or less than the spring's force: what was created before is forgotten.
    pub(crate) fn rest(&mut self) {
        if let Some(controller) = &mut self.controller {
            controller.rest();
        }
    }

    /// Books the energy since the tick before.
    pub(crate) fn observe(&mut self, now: &Moment) {
        if let Some(controller) = &mut self.controller {
            controller.observe(&self.params, now);
        }
    }

    /// The force of a tick: the spring's, damped, and less where the surface yields.
    #[cold]
    #[inline(never)]
    pub(crate) fn force_n(&self, spring_n: Vec3, velocity_mm_s: Vec3) -> Vec3 {
        let share = self.controller.as_ref().map_or(1.0, Passivity::share);
        let spring_n = spring_n * share;
        // Along the force, times its size: positive where the tip gives way to it.
        let along = velocity_mm_s.dot(spring_n);
        let share = along / spring_n.length_squared();
        // No number without a force.
        if !share.is_finite() {
            return spring_n;
        }
        let across_mm_s = beyond(velocity_mm_s - spring_n * share, SLOW_MM_S);
        let mut takes = self.controller.as_ref().map_or_else(Takes::default, |it| {
            it.damping_ns_per_mm(&Motion {
                along,
                along_squared: along * share,
                across_squared: across_mm_s.length_squared(),
            })
        });
        if !(self.params.shading.is_none() && self.params.texture.is_none()) {
            // Such a force is not on the way to the proxy: damping across it could pull.
            takes.across = 0.0;
        }
        takes.along += 1e-3 * self.params.damping.ns_per_m;
        let along_n = spring_n * (1.0 - (takes.along * share).clamp(-1.0, 1.0));
        let most_n = smaller(2.0 * spring_n.length(), self.params.max_force_n);
        clamp_length(along_n - across_mm_s * takes.across, most_n)
    }
}

/// Returns the part of a vector beyond a length; zero for one that is no number.
fn beyond(v: Vec3, length: f32) -> Vec3 {
    let share = 1.0 - length / v.length();
    if share > 0.0 { v * share } else { Vec3::ZERO }
}

#[cfg(test)]
#[path = "damping_tests.rs"]
mod tests;
