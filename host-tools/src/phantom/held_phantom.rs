//! A virtual Phantom in a hand: a device's whole environment. The hand follows a script over a
//! terrain.

use hapterra_core::guard::GuardInputs;

use super::amplifier::AmplifierFault;
use super::arm_frame::{ArmFrame, OutOfReach};
use super::hand::HandModel;
use super::model::PhantomModel;
use super::plant::Plant;
use super::script::Script;

/// Time of the dead-man press by a hand that waits for arming, s.
const PRESS_S: f64 = 0.5;
/// A scripted hand on a virtual Phantom over a placed terrain.
#[derive(Clone, Debug)]
pub struct HeldPhantom {
    plant: Plant,
    placement: ArmFrame,
    script: Script,
    /// Start of the script, s.
    begin_s: f64,
    t_s: f64,
    /// Readings of the current monitors in the step before: a board reads the values converted in
    /// the tick before.
    measured_ma: [i16; 3],
}

impl HeldPhantom {
    /// Puts the tip, and the hand on it, at the script's first point.
    ///
    /// [`OutOfReach`] names the first corner of the script that is beyond the links or the stops.
    /// the links or the stops.
    pub fn new(
        model: PhantomModel,
        hand: HandModel,
        placement: ArmFrame,
        script: Script,
    ) -> Result<Self, OutOfReach> {
        placement.check(&model, &script)?;
        let start_mm = script.target(0.0).position_mm;
        let q = placement.joints_at(&model, start_mm)?;
        Ok(Self {
            plant: Plant::new(model, q).with_hand(hand),
            placement,
            script,
            begin_s: 0.0,
            t_s: 0.0,
            measured_ma: [0; 3],
        })
    }

    /// Lets the device arm first: the hand rests at the script's first point, presses the dead-man
    /// switch after half a second and holds it, and begins its script [`Self::ARMED_S`] after the
    /// start.
    #[must_use]
    pub fn arming(self) -> Self {
        self.arming_for(Self::ARMED_S)
    }

    /// As [`Self::arming`], with another start of the script, s. Before [`Self::ARMED_S`] the force
    /// is not fully ramped up.
    #[must_use]
    pub fn arming_for(mut self, begin_s: f64) -> Self {
        self.begin_s = begin_s;
        self
    }

    /// Returns the start of the script, s.
    #[must_use]
    pub fn begin_s(&self) -> f64 {
        self.begin_s
    }

    /// Repeats the script `times` times.
    #[must_use]
    pub fn repeated(mut self, times: u32) -> Self {
        self.script = self.script.repeated(times);
        self
    }

    /// Time at which the force begins to ramp up, s: the device has detected the press and
    /// confirmed.
    pub const RAMPS_S: f64 = PRESS_S + 0.1;

    /// Start of a script after arming, s: the device has confirmed and the force is ramped up.
    pub const ARMED_S: f64 = 3.0;

    /// Returns the duration of the script, s.
    #[must_use]
    pub fn script_s(&self) -> f64 {
        self.script.duration_s()
    }

    /// Returns the present readings of encoders, switches and amplifiers.
    #[must_use]
    pub fn guard_inputs(&self) -> GuardInputs {
        GuardInputs {
            counts: self.plant.counts(),
            dead_man: self.begin_s > 0.0 && self.t_s >= PRESS_S,
            emergency_stop: false,
            hardware_failed: false,
            outputs_not_as_set: false,
            amplifier_not_ready: !self.plant.amplifiers_are_ready(),
            measured_ma: Some(self.measured_ma),
            clutch: false,
        }
    }

    /// Applies current commands (A) for `dt_s` seconds while the hand follows its script; returns
    /// the encoder counts at the end.
    pub fn step(&mut self, currents_a: [f64; 3], dt_s: f64) -> [i32; 3] {
        let target = self.script.target(self.t_s - self.begin_s);
        let at_m = self
            .placement
            .to_device_m(self.plant.model(), target.position_mm);
        let speed_m_s = ArmFrame::turn_to_device(target.speed_mm_s).map(|v| v * 1e-3);
        self.plant.set_target(at_m, speed_m_s);
        self.t_s += dt_s;
        self.measured_ma = self.plant.monitors_ma();
        self.plant.step(currents_a, dt_s)
    }

    /// Sets or removes a fault of the amplifier of an axis (0 to 2).
    pub fn set_amplifier_fault(&mut self, axis: usize, fault: Option<AmplifierFault>) {
        self.plant.set_amplifier_fault(axis, fault);
    }

    /// Returns the arm and its hand.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }
}

#[cfg(test)]
#[path = "held_phantom_tests.rs"]
mod tests;
