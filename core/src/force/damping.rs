//! Damping along the force, by a scene's choice and by the passivity controller.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::passivity::{DampingCoefficients, MAX_MJ, Motion, Passivity, PassivityInputs};
use super::{EffectContext, SurfaceParams, clamp_length};
use crate::scalar::{larger, smaller};

/// Energy that a shaded force may release before an edge, and absorb beyond it, before its turn is
/// reduced. It is a fraction of the force times the sum of a cell and the depth. An edge releases a
/// quarter of its bend times the part of a cell on which the force turns ([`super::shading`]): this
/// much at 23°, twice as much at 45°, the maximum.
const EDGE_ENERGY_SHARE: f32 = 0.1;
/// Speed across the force up to which a motion is not damped, mm/s: a resting hand, or an arm in a
/// limit cycle. They create little energy, and late damping would make them unstable.
const SLOW_MM_S: f32 = 30.0;
/// Additional created energy that causes no reduction of the turn, mJ.
const FREE_MJ: f32 = 0.1;

/// Damping of a surface: it dissipates energy of a motion against the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Damping {
    /// Newtons per metre a second along the force. The damping force never exceeds the spring's
    /// force: it starts from zero with the depth, and never pulls.
    pub ns_per_m: f32,
    /// Dissipation of the energy leak of the sampled wall.
    pub controller: Controller,
}

/// The passivity controller, on or off: it dissipates the energy that a sampled spring creates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Controller {
    /// Active wherever a current can flow. Settings of earlier versions also use `auto`.
    #[default]
    #[serde(alias = "auto")]
    On,
    /// Never.
    Off,
}

impl Damping {
    /// Maximum damping of a scene, N·s/m.
    pub const MAX_NS_PER_M: f32 = 20.0;
    /// No damping, with the controller on.
    pub const NONE: Self = Self {
        ns_per_m: 0.0,
        controller: Controller::On,
    };

    /// Returns true if this is the default.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns true if the number is in its valid range.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        (0.0..=Self::MAX_NS_PER_M).contains(&self.ns_per_m)
    }
}

/// The damping of one scene at one rate, and the effects that its controller limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damper {
    params: SurfaceParams,
    controller: Option<Passivity>,
}

impl Damper {
    /// Creates the damper of a scene, or `None` without damping. A replay has no hand that could
    /// receive energy.
    // Not inlined: it has two callers, and runs once for a scene.
    #[inline(never)]
    pub(crate) fn of(params: &SurfaceParams, context: &EffectContext) -> Option<Self> {
        let is_controlled = context.arm && params.is_controlled();
        let controller = is_controlled.then(|| Passivity::new(context));
        (controller.is_some() || params.damping.ns_per_m > 0.0).then_some(Self {
            params: *params,
            controller,
        })
    }

    /// Changes the surface from this tick on; the controller stays.
    pub(crate) const fn set_params(&mut self, params: &SurfaceParams) {
        self.params = *params;
    }

    /// Returns the energy that was created and not dissipated yet, mJ; zero without a controller.
    pub(crate) fn created_mj(&self) -> f32 {
        self.controller.as_ref().map_or(0.0, Passivity::created_mj)
    }

    /// Returns the share of a shaded force's turn that is rendered at a depth.
    ///
    /// A turned force is not that of a spring: around a closed path it can release energy, and
    /// damping along the force does not dissipate energy from motion across it. The force absorbs
    /// beyond an edge the energy that it releases before it, so the full turn is rendered until
    /// more energy was created than an edge releases.
    pub(crate) fn turn_share(&self, depth_mm: f32, cell_mm: f32) -> f32 {
        let spring_n = smaller(
            depth_mm * self.params.stiffness_n_per_mm,
            self.params.max_force_n,
        );
        // At twice this energy nothing is left of the turn. The observer never records more than
        // `MAX_MJ`.
        let edge_mj = smaller(
            EDGE_ENERGY_SHARE * spring_n * (cell_mm + depth_mm) + FREE_MJ,
            0.5 * MAX_MJ,
        );
        let over = self.created_mj() / edge_mj - 1.0;
        smaller(larger(1.0 - over, 0.0), 1.0)
    }

    /// Resets the controller while no force, or less than the spring's force, is rendered: energy
    /// created before is discarded.
    pub(crate) fn reset(&mut self) {
        if let Some(controller) = &mut self.controller {
            controller.reset();
        }
    }

    /// Records the energy since the last tick.
    pub(crate) fn observe(&mut self, now: &PassivityInputs) {
        if let Some(controller) = &mut self.controller {
            controller.observe(&self.params, now);
        }
    }

    /// Returns the force of a tick: the spring's force, softened and damped.
    #[cold]
    #[inline(never)]
    pub(crate) fn force_n(&self, spring_n: Vec3, velocity_mm_s: Vec3) -> Vec3 {
        let share = self.controller.as_ref().map_or(1.0, Passivity::share);
        let spring_n = spring_n * share;
        // Component along the force, times its size: positive if the tip moves with the force.
        let along = velocity_mm_s.dot(spring_n);
        let share = along / spring_n.length_squared();
        // NaN or infinite without a force.
        if !share.is_finite() {
            return spring_n;
        }
        let across_mm_s = beyond(velocity_mm_s - spring_n * share, SLOW_MM_S);
        let mut damping =
            self.controller
                .as_ref()
                .map_or_else(DampingCoefficients::default, |it| {
                    it.damping_ns_per_mm(&Motion {
                        along,
                        along_squared: along * share,
                        across_squared: across_mm_s.length_squared(),
                    })
                });
        if !(self.params.shading.is_none() && self.params.texture.is_none()) {
            // Such a force does not point to the proxy: damping across it could pull.
            damping.across = 0.0;
        }
        damping.along += 1e-3 * self.params.damping.ns_per_m;
        let along_n = spring_n * (1.0 - (damping.along * share).clamp(-1.0, 1.0));
        let max_n = smaller(2.0 * spring_n.length(), self.params.max_force_n);
        clamp_length(along_n - across_mm_s * damping.across, max_n)
    }
}

/// Returns the part of a vector beyond a length; zero for NaN.
fn beyond(v: Vec3, length: f32) -> Vec3 {
    let share = 1.0 - length / v.length();
    if share > 0.0 { v * share } else { Vec3::ZERO }
}

#[cfg(test)]
#[path = "damping_tests.rs"]
mod tests;
