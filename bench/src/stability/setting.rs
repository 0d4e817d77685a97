//! Setting of a trial: rate, surface, grasp and delay.

use hapterra_core::force::{Damping, Texture};
use hapterra_core::rate::TickRate;

use super::contact_loop::{self, HOME, LoopSettings};
use super::grasp::Grasp;
use hapterra::phantom::{HeldPhantom, OutOfReach, PhantomModel, Script};

/// A rate, a damping, and the arm's friction as a fraction of the model's.
pub type Column = (TickRate, Damping, f64);

/// Setting of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Tick rate of the loop.
    pub rate: TickRate,
    /// The surface's stiffness, N/mm.
    pub stiffness_n_per_mm: f64,
    /// Its damping, with the passivity controller on or off.
    pub damping: Damping,
    /// Its micro-relief.
    pub texture: Texture,
    /// Grasp of the tip.
    pub grasp: Grasp,
    /// Delay from the encoders to the amplifiers, s.
    pub delay_s: f64,
    /// Friction of the arm's joints, as a fraction of the model's.
    pub arm_friction: f64,
}

impl Setting {
    /// Returns the delay of a force after the start of its tick, with the lag of the amplifiers'
    /// current loops, s.
    pub(super) fn force_delay_s(self) -> f64 {
        self.delay_s + PhantomModel::premium_1_5().drive[0].motor.current_lag_s
    }

    /// Returns rate, damping and the arm's friction.
    pub(super) const fn column(self) -> Column {
        (self.rate, self.damping, self.arm_friction)
    }

    pub(super) fn arm(self, script: Script) -> Result<HeldPhantom, OutOfReach> {
        let model = PhantomModel::premium_1_5().with_friction(self.arm_friction);
        let arm = HeldPhantom::new(model, self.grasp.hand(), HOME, script)?;
        Ok(arm.arming())
    }

    pub(super) fn run(
        self,
        arm: HeldPhantom,
        observe: &mut dyn FnMut(f64, &contact_loop::LoopTick) -> bool,
    ) {
        self.run_with_clutch(arm, None, observe);
    }

    pub(super) fn run_with_clutch(
        self,
        arm: HeldPhantom,
        clutch_s: Option<[f64; 2]>,
        observe: &mut dyn FnMut(f64, &contact_loop::LoopTick) -> bool,
    ) {
        let settings = LoopSettings {
            rate: self.rate,
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            damping: self.damping,
            texture: self.texture,
            delay_s: self.delay_s,
            clutch_s,
        };
        contact_loop::run(&settings, arm, observe);
    }
}
