//! Invariants of every tick under any fault.
//!
//! The currents have three bounds, each computed in f64 from the currents alone:
//! - with the levers of the encoders' pose, the force is always within the guard's clamp;
//! - with the arm's true levers, it is within the record's largest force while no encoder is off by
//!   more than [`OFF_COUNTS`];
//! - while one is, the true levers cannot be computed: that force is recorded.

use hapterra::phantom::{Encoder, PhantomModel};
use hapterra_core::Vec3;
use hapterra_core::guard::{GuardInputs, GuardOutputs, Mode, WORKING_SHARE};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::TickRecord;

use super::maxima::{Maxima, Misled, OFF_COUNTS};
use super::motor_forces::{Levers, torques_nm};

/// Largest change of force in a tick, N: the guard's slew limit at 1 kHz.
const SLEW_N: f32 = 1.0;
/// Highest temperature of a virtual motor's winding, °C. The guard trips at 110 °C by its own, more
/// careful model.
const MAX_WINDING_C: f64 = 112.0;
/// Largest excess of a winding's temperature over the device's estimate, K: the virtual motors and
/// the device's model use different formulas.
const MAX_COLDER_K: f64 = 1.0;
/// Bound of the stored energy, mJ (docs/explanation/effects.md).
const MAX_CREATED_MJ: f32 = 2.0;
/// Allowance for rounding in comparisons of f32.
const ROUNDING: f32 = 1e-4;

/// True state of the arm in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Joint angles, rad.
    pub q_rad: [f64; 3],
    /// Counts of faultless encoders in this pose.
    pub counts: [i32; 3],
    /// Temperatures of the windings, °C.
    pub winding_c: [f64; 3],
}

/// Checks the ticks of one segment.
pub struct TickChecks {
    record: Calibration,
    model: PhantomModel,
    last: Option<TickRecord>,
    /// True if the host has requested held outputs with the amplifiers off.
    pub may_hold: bool,
    /// The largest values up to now.
    pub extremes: Maxima,
}

impl TickChecks {
    /// Creates the checks for a device with this calibration on an arm of this model.
    #[must_use]
    pub fn new(record: Calibration, model: PhantomModel) -> Self {
        Self {
            record,
            model,
            last: None,
            may_hold: false,
            extremes: Maxima::default(),
        }
    }

    /// Checks the amplifiers' inputs in a tick in which the device received `inputs`, with `zero` as
    /// the counts of its zero pose.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn check_outputs(
        &mut self,
        drive: &GuardOutputs,
        inputs: &GuardInputs,
        zero: [i32; 3],
        truth: &Truth,
    ) -> Result<(), String> {
        self.outputs(drive, truth)?;
        let reported_unfit = inputs.hardware_failed || inputs.outputs_not_as_set;
        let unsafe_input = !inputs.dead_man || inputs.emergency_stop || reported_unfit;
        if drive.enabled && unsafe_input {
            return Err(format!("amplifiers on with {inputs:?}"));
        }
        if drive.enabled {
            let reported = std::array::from_fn(|i| inputs.counts[i].wrapping_sub(zero[i]));
            let currents = drive.currents_a.to_array().map(f64::from);
            let torque = torques_nm(&self.model, currents);
            self.force_as_read(torque, reported)?;
            self.force_at_the_tip(torque, reported, truth)?;
        }
        Ok(())
    }

    /// Checks the command of a halted core. No tick reads the encoders, so only the true pose
    /// counts.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn check_held(&mut self, drive: &GuardOutputs, truth: &Truth) -> Result<(), String> {
        self.outputs(drive, truth)?;
        let currents = drive.currents_a.to_array().map(f64::from);
        let torque = torques_nm(&self.model, currents);
        self.force_at_the_tip(torque, truth.counts, truth)
    }

    /// Checks the device's estimate of the motors' temperatures, which must not be too low.
    ///
    /// # Errors
    /// If it is lower.
    pub fn check_temperature(&self, believed_c: Vec3, truth: &Truth) -> Result<(), String> {
        for (axis, is_c) in truth.winding_c.into_iter().enumerate() {
            let believed_c = f64::from(believed_c[axis]);
            if believed_c.is_nan() || believed_c < is_c - MAX_COLDER_K {
                return Err(format!(
                    "winding {} is at {is_c:.1} °C, and the device estimates {believed_c:.1} °C",
                    axis + 1
                ));
            }
        }
        Ok(())
    }

    /// Checks the outputs, independently of the inputs.
    fn outputs(&mut self, drive: &GuardOutputs, truth: &Truth) -> Result<(), String> {
        let currents = drive.currents_a;
        let largest = currents.abs().max_element();
        if !currents.is_finite() {
            return Err(format!("a current is not a number: {currents}"));
        }
        if !drive.enabled && largest != 0.0 {
            return Err(format!("{largest} A commanded with the amplifiers off"));
        }
        if drive.enabled && drive.held != Vec3::ZERO {
            return Err(format!("{} held with the amplifiers on", drive.held));
        }
        // No host requests held outputs while a terrain is served.
        if drive.held != Vec3::ZERO && !self.may_hold {
            return Err(format!("{} held without a request", drive.held));
        }
        if drive.held.is_nan() || drive.held.abs().cmpgt(Vec3::ONE).any() {
            return Err(format!("{} held is beyond full scale", drive.held));
        }
        if currents.abs().cmpgt(self.record.peak_current_a).any() {
            return Err(format!("{currents} A is above the peak current"));
        }
        self.extremes.current_a = self.extremes.current_a.max(f64::from(largest));
        let hottest = truth.winding_c.into_iter().fold(0.0, f64::max);
        self.extremes.winding_c = self.extremes.winding_c.max(hottest);
        if hottest > MAX_WINDING_C {
            return Err(format!("a winding of the arm is at {hottest:.1} °C"));
        }
        Ok(())
    }

    /// Checks the force with the levers that the device computes.
    fn force_as_read(&mut self, torque_nm: [f64; 3], reported: [i32; 3]) -> Result<(), String> {
        let angle = |i: usize| Encoder::new(&self.model.drive[i]).angle_rad(reported[i]);
        let q = std::array::from_fn(angle);
        let Some(levers) = Levers::at(&self.model, &self.record, q) else {
            return Ok(());
        };
        let force = levers.force_n(torque_nm);
        self.extremes.read_force_n = self.extremes.read_force_n.max(force);
        let clamp = f64::from(WORKING_SHARE * self.record.max_force_n * (1.0 + ROUNDING));
        match force <= clamp {
            true => Ok(()),
            false => Err(format!("the motors make {force:.4} N by the encoders")),
        }
    }

    /// Checks the force with the arm's true levers.
    fn force_at_the_tip(
        &mut self,
        torque_nm: [f64; 3],
        reported: [i32; 3],
        truth: &Truth,
    ) -> Result<(), String> {
        let off = (0..3).map(|i| reported[i].abs_diff(truth.counts[i]));
        let off_counts = off.fold(0, u32::max);
        let is_misled = off_counts > OFF_COUNTS;
        self.extremes.misled_ticks += u64::from(is_misled);
        let Some(levers) = Levers::at(&self.model, &self.record, truth.q_rad) else {
            self.extremes.singular_ticks += 1;
            return Ok(());
        };
        let force_n = levers.force_n(torque_nm);
        if is_misled {
            let misled = Misled {
                force_n,
                off_counts,
            };
            self.extremes.misled = self.extremes.misled.max(misled);
            return Ok(());
        }
        self.extremes.tip_force_n = self.extremes.tip_force_n.max(force_n);
        match force_n <= f64::from(self.record.max_force_n) {
            true => Ok(()),
            false => Err(format!(
                "the motors make {force_n:.3} N at the tip, the encoders off by {off_counts} counts"
            )),
        }
    }

    /// Checks the device's report on a tick.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn check_sample(&mut self, sample: &TickRecord, max_force_n: f32) -> Result<(), String> {
        let force = sample.force_n.length();
        if !force.is_finite() {
            return Err(format!("a force is not a number: {sample:?}"));
        }
        let off = sample.fault.is_some() || !sample.mode.is_driving();
        if off && force != 0.0 {
            return Err(format!("{force} N with the amplifiers off: {sample:?}"));
        }
        let clamp = (WORKING_SHARE * self.record.max_force_n).min(max_force_n);
        if force > clamp * (1.0 + ROUNDING) {
            return Err(format!("{force} N is above the clamp of {clamp} N"));
        }
        self.extremes.force_n = self.extremes.force_n.max(f64::from(force));
        let last = self.last.replace(*sample);
        let Some(last) = last.filter(|last| last.tick.wrapping_add(1) == sample.tick) else {
            return Ok(());
        };
        if off {
            return Ok(());
        }
        let slew = (sample.force_n - last.force_n).length();
        self.extremes.slew_n = self.extremes.slew_n.max(f64::from(slew));
        match slew <= SLEW_N + ROUNDING {
            true => Ok(()),
            false => Err(format!(
                "the force changed by {slew} N in a tick: {sample:?}"
            )),
        }
    }

    /// Checks the energy that the ticks have created, as the device reports it.
    ///
    /// # Errors
    /// If it is not a valid energy, or above the limit.
    pub fn check_created_energy(&mut self, mj: f32) -> Result<(), String> {
        self.extremes.created_mj = self.extremes.created_mj.max(mj);
        match (0.0..=MAX_CREATED_MJ).contains(&mj) {
            true => Ok(()),
            false => Err(format!("{mj} mJ are to be dissipated")),
        }
    }

    /// Returns the last reported mode.
    #[must_use]
    pub fn latest(&self) -> Option<Mode> {
        self.last.map(|sample| sample.mode)
    }

    /// Forgets the last sample, so that the next one is checked alone.
    pub fn reset(&mut self) {
        self.last = None;
    }
}
