//! What has to hold in every tick, whatever goes wrong.

use hapterra_core::guard::{Drive, Mode, Sense, WORKING_SHARE};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::message::Sample;

use super::arm::Arm;

/// Largest change of force in a tick, N: the guard's slew limit at 1 kHz.
const SLEW_N: f32 = 1.0;
/// The winding of a virtual motor may get this hot, °C. The guard trips at
/// 110 °C by its own, more careful model.
const HOTTEST_C: f64 = 112.0;
/// Room for rounding in comparisons of f32.
const ROUNDING: f32 = 1e-4;
/// The largest that was seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Force told by the device, N.
    pub force_n: f64,
    /// Force worked out from the currents, N.
    pub motor_force_n: f64,
    /// Current of a motor, A.
    pub current_a: f64,
    /// Change of force from one tick to the next, N.
    pub slew_n: f64,
    /// Temperature of a winding of the virtual arm, °C.
    pub winding_c: f64,
}

impl Extremes {
    /// The larger of each.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            force_n: self.force_n.max(other.force_n),
            motor_force_n: self.motor_force_n.max(other.motor_force_n),
            current_a: self.current_a.max(other.current_a),
            slew_n: self.slew_n.max(other.slew_n),
            winding_c: self.winding_c.max(other.winding_c),
        }
    }
}

/// Watches one segment.
pub struct Watch {
    record: Calibration,
    last: Option<Sample>,
    /// The largest so far.
    pub extremes: Extremes,
}

impl Watch {
    /// For a device with this calibration.
    #[must_use]
    pub fn new(record: Calibration) -> Self {
        Self {
            record,
            last: None,
            extremes: Extremes::default(),
        }
    }

    /// Looks at what the amplifiers got in a tick, and at what the device was
    /// told by its switches.
    ///
    /// # Errors
    /// What must not be.
    pub fn drive(&mut self, drive: &Drive, sense: &Sense, arm: &Arm<'_>) -> Result<(), String> {
        let currents = drive.currents_a;
        let largest = currents.abs().max_element();
        if !currents.is_finite() {
            return Err(format!("a current is not a number: {currents}"));
        }
        if !drive.enabled && largest != 0.0 {
            return Err(format!("{largest} A commanded with the amplifiers off"));
        }
        if currents.abs().cmpgt(self.record.peak_current_a).any() {
            return Err(format!("{currents} A is above the peak current"));
        }
        let unsafe_input = !sense.dead_man || sense.emergency_stop || sense.hardware_failed;
        if drive.enabled && unsafe_input {
            return Err(format!("amplifiers on with {sense:?}"));
        }
        self.extremes.current_a = self.extremes.current_a.max(f64::from(largest));
        let hottest = arm.plant().winding_c().into_iter().fold(0.0, f64::max);
        self.extremes.winding_c = self.extremes.winding_c.max(hottest);
        if hottest > HOTTEST_C {
            return Err(format!("a winding of the arm is at {hottest:.1} °C"));
        }
        if drive.enabled {
            self.motor_force(drive, arm)?;
        }
        Ok(())
    }

    fn motor_force(&mut self, drive: &Drive, arm: &Arm<'_>) -> Result<(), String> {
        let [_, q2, q3] = arm.plant().q_rad();
        let weight = [
            0.0,
            f64::from(self.record.gravity_2_nm) * libm::cos(q2),
            f64::from(self.record.gravity_3_nm) * libm::sin(q3),
        ];
        let currents = drive.currents_a.to_array().map(f64::from);
        let Some(force) = arm.force_n(currents, weight) else {
            return Ok(());
        };
        self.extremes.motor_force_n = self.extremes.motor_force_n.max(force);
        let most = f64::from(self.record.max_force_n);
        match force <= most {
            true => Ok(()),
            false => Err(format!("the motors make {force:.3} N at the tip")),
        }
    }

    /// Looks at what the device told of a tick.
    ///
    /// # Errors
    /// What must not be.
    pub fn sample(&mut self, sample: &Sample, law_n: f32) -> Result<(), String> {
        let force = sample.force_n.length();
        if !force.is_finite() {
            return Err(format!("a force is not a number: {sample:?}"));
        }
        let off = sample.fault.is_some() || !sample.mode.drives();
        if off && force != 0.0 {
            return Err(format!("{force} N with the amplifiers off: {sample:?}"));
        }
        let clamp = (WORKING_SHARE * self.record.max_force_n).min(law_n);
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

    /// The mode that the device told last.
    #[must_use]
    pub fn latest(&self) -> Option<Mode> {
        self.last.map(|sample| sample.mode)
    }

    /// The next sample follows from nothing before.
    pub fn forget(&mut self) {
        self.last = None;
    }
}
