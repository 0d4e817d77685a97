//! The guard, the only path to the amplifiers: every failure sets the currents to zero.
//!
//! A tick calls three functions in this order: [`Guard::watch`] checks the inputs and the measured
//! values, and decides whether anything may be driven at all; [`Guard::limit_force`] limits the
//! force; [`Guard::limit_currents`] limits the currents.
//!
//! [`Fault`]s are latched and switch the amplifiers off. [`Limits`] are the reasons for a reduced
//! force. [`Blockers`] are the reasons why the arm cannot be armed. [`Mode`] is the progress of
//! arming.

mod arming;
mod blockers;
mod checks;
mod driven_faults;
mod fault;
mod feedback;
mod flags;
mod hold;
mod jog;
mod limit;
mod mode;
mod speed;
mod stall;
pub mod thermal;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub(crate) use arming::FADE_MS;
pub use arming::{Decision, SMALL_FORCE_N};
pub use fault::Fault;
pub use feedback::{CURRENT_ROUGHNESS_A, CURRENT_TOLERANCE_A};
pub use flags::{Blockers, Limits};
pub use hold::MAX_HOLD_S;
pub use jog::{JOG_MAX_MS, JOG_SHARE, Jog, MAX_JOG_ROTATION_RAD, MAX_JOG_SPEED_RAD_S};
pub use mode::Mode;
pub use stall::MAX_OTHERS_TRAVEL;

use crate::phantom::{JointLimits, Kinematics, Pose};
pub use crate::rate::MAX_SLEW_N_PER_S;
use crate::rate::TickRate;
use arming::Arming;
use feedback::Feedback;
use hold::OutputHold;
use jog::ActiveJog;
use speed::SpeedMonitor;
use stall::StallDetector;
use thermal::{Motors, Temperatures};

/// Share of the calibration's maximum force that the guard clamps to. An encoder error of twice the
/// permitted jump per tick is some 7 mm at the tip. It changes the levers, and so the force at the
/// tip, by up to 9 %; this share keeps it below the calibration's maximum (tested by a sweep).
pub const WORKING_SHARE: f32 = 0.9;
/// Maximum counts of an encoder in a second: about 3 m/s at the tip of a Premium 1.5.
pub const MAX_COUNTS_PER_S: u32 = 128_000;
/// Tolerance of a joint's limits, rad: stops are compliant, and limits are measured by hand.
pub const LIMIT_MARGIN_RAD: f32 = 0.087;

/// Inputs of the guard: encoders, safety inputs and amplifiers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GuardInputs {
    /// Counts of axes 1 to 3 since power-up.
    pub counts: [i32; 3],
    /// True if the dead-man switch is held.
    pub dead_man: bool,
    /// True if the emergency stop is pressed, or its wire broken.
    pub emergency_stop: bool,
    /// True if the encoder or amplifier hardware reports a failure.
    pub hardware_failed: bool,
    /// True if a converter's settings read back differently from the written ones.
    pub outputs_not_as_set: bool,
    /// True if an amplifier reports that it is not ready, or its wire is broken.
    pub amplifier_not_ready: bool,
    /// Currents in motors 1 to 3, mA, as of the last tick; `None` if the amplifiers have no
    /// monitors.
    pub measured_ma: Option<[i16; 3]>,
    /// True if the clutch input is held in this tick; not debounced.
    pub clutch: bool,
}

/// Conditions of a tick besides the inputs.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The arm and its pose, if there is a calibration.
    pub arm: Option<(&'a Kinematics, &'a Pose)>,
    /// True if the arm has been zeroed.
    pub zeroed: bool,
    /// Kind of the scene.
    pub scene: SceneKind,
    /// True if the watchdog is being fed.
    pub watchdog_live: bool,
}

/// Kind of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// No scene.
    None,
    /// A scene for the arm.
    Arm,
    /// A replay.
    Points,
}

/// Commands to the amplifiers, and held outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GuardOutputs {
    /// Motor currents of the three axes, amperes. Zero unless enabled.
    pub currents_a: Vec3,
    /// True if the amplifiers must be on.
    pub enabled: bool,
    /// Shares of full scale, -1 to 1, at which the outputs are held while the amplifiers are off
    /// ([`Guard::hold`]). Zero while they are on.
    pub held: Vec3,
}

/// The state of the guard after a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
    /// Progress of arming.
    pub mode: Mode,
    /// Reasons why the amplifiers are off; empty while they are on.
    pub blockers: Blockers,
    /// Reasons why the last tick's force was reduced.
    pub limits: Limits,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// Outcome of the last arm command.
    pub decision: Decision,
}

/// The guard between the commanded force and the amplifiers.
///
/// ```
/// use hapterra_core::Vec3;
/// use hapterra_core::guard::{Fault, Guard, Mode, SceneKind, GuardInputs, Surroundings};
/// use hapterra_core::phantom::{Calibration, Kinematics};
/// use hapterra_core::rate::TickRate;
///
/// let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5)?;
/// let pose = mechanism.pose([0; 3], [0; 3]);
/// let mut guard = Guard::new(TickRate::DEFAULT, None);
/// guard.configure(&mechanism);
/// guard.arm();
/// let mut force_n = Vec3::ZERO;
/// for tick in 0..3_000 {
///     // The dead-man switch is pressed after a moment.
///     let sense = GuardInputs { dead_man: tick > 10, ..GuardInputs::default() };
///     let around = Surroundings {
///         arm: Some((&mechanism, &pose)),
///         zeroed: true,
///         scene: SceneKind::Arm,
///         watchdog_live: true,
///     };
///     guard.watch(&sense, &around);
///     // Contact begins when the arm is armed; 20 N are more than the arm may make.
///     let armed = guard.report().mode == Mode::Armed;
///     force_n = guard.limit_force(if armed { Vec3::Z * 20.0 } else { Vec3::ZERO });
///     let _ = guard.limit_currents(Vec3::ZERO);
/// }
/// assert!((force_n.z - 0.9 * 8.5).abs() < 1e-3);
/// guard.trip(Fault::Hardware);
/// assert_eq!(guard.limit_force(Vec3::Z), Vec3::ZERO);
/// # Ok::<(), hapterra_core::phantom::CalibrationError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// Maximum counts and maximum change of force, N, in a tick.
    max_counts: u32,
    max_slew_n: f32,
    /// Joint limits, with [`LIMIT_MARGIN_RAD`].
    stops: JointLimits,
    arming: Arming,
    fault: Option<Fault>,
    blockers: Blockers,
    limits: Limits,
    /// Counts in the last tick, once the arm is zeroed.
    counts: Option<[i32; 3]>,
    max_force_n: f32,
    force_n: Vec3,
    /// The force at full gain, while fading.
    fade_from_n: Vec3,
    currents_a: Vec3,
    speed: SpeedMonitor,
    stall: StallDetector,
    motors: Motors,
    feedback: Feedback,
    hold: OutputHold,
    /// The requested or active jog; `None` while disarmed.
    jog: Option<ActiveJog>,
}

impl Guard {
    /// Creates a disarmed guard, with the fault found at boot, if any.
    #[must_use]
    pub fn new(rate: TickRate, found_at_boot: Option<Fault>) -> Self {
        Self {
            max_counts: MAX_COUNTS_PER_S.div_ceil(rate.hz()),
            max_slew_n: MAX_SLEW_N_PER_S / rate.hz() as f32,
            stops: JointLimits::EMPTY,
            arming: Arming::new(rate),
            fault: found_at_boot,
            blockers: Blockers::empty(),
            limits: Limits::empty(),
            counts: None,
            max_force_n: 0.0,
            force_n: Vec3::ZERO,
            fade_from_n: Vec3::ZERO,
            currents_a: Vec3::ZERO,
            speed: SpeedMonitor::new(rate),
            stall: StallDetector::default(),
            motors: Motors::new(rate),
            feedback: Feedback::new(rate),
            hold: OutputHold::new(rate),
            jog: None,
        }
    }

    /// Applies the limits of an arm.
    pub fn configure(&mut self, mechanism: &Kinematics) {
        self.max_force_n = WORKING_SHARE * mechanism.calibration().max_force_n;
        let limits = &mechanism.calibration().limits;
        self.stops = limits.widened(LIMIT_MARGIN_RAD);
        self.speed.configure(mechanism);
        self.motors.configure(mechanism.calibration());
    }

    /// Returns the progress of arming.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.arming.mode
    }

    /// Returns the rendered share of force and weight compensation.
    #[must_use]
    pub const fn gain(&self) -> f32 {
        self.arming.gain
    }

    /// Returns the state of the guard after a tick.
    #[must_use]
    pub const fn report(&self) -> Report {
        Report {
            mode: self.arming.mode,
            blockers: self.blockers,
            limits: self.limits,
            fault: self.fault,
            decision: self.arming.decision,
        }
    }

    /// Returns the force of the motors since the last tick, N; zero unless the amplifiers were on.
    #[must_use]
    pub const fn force_n(&self) -> Vec3 {
        self.force_n
    }

    /// Returns the maximum force that the guard permits, N.
    #[must_use]
    pub const fn max_force_n(&self) -> f32 {
        self.max_force_n
    }

    /// Returns the next shares of [`Guard::limit_force`]: those of the ramp and of the speed limit.
    /// `None` while the force does not follow the commanded force: with the amplifiers off, and
    /// during the fade-out.
    #[must_use]
    pub fn shares(&self) -> Option<[f32; 2]> {
        let ramp = self.arming.next_gain()?;
        Some([ramp, self.speed.share])
    }

    /// Adds limits to the tick's report.
    pub(crate) fn add_limits(&mut self, limits: Limits) {
        self.limits |= limits;
    }

    /// Returns the tip's velocity of a driven arm, device frame, mm/s, from the readings of every
    /// millisecond (FOAW).
    #[must_use]
    pub fn tip_velocity_mm_s(&self, mechanism: &Kinematics, pose: &Pose) -> Vec3 {
        self.speed.velocity_mm_s(mechanism, pose)
    }

    /// Returns the temperatures of the motors.
    #[must_use]
    pub const fn motors(&self) -> &Motors {
        &self.motors
    }

    /// Sets the initial motor temperatures; [`Guard::new`] assumes the temperature of the air.
    pub fn set_temperatures(&mut self, temperatures: Temperatures) {
        self.motors.set_temperatures(temperatures);
    }

    /// Latches a fault and switches off. The first fault stays.
    pub fn trip(&mut self, fault: Fault) {
        self.fault = self.fault.or(Some(fault));
        self.off(Blockers::FAULT_LATCHED);
    }

    /// Clears the fault. Arming starts again from off; the motors' temperatures are kept.
    pub fn clear(&mut self) {
        self.fault = None;
        self.stop();
    }

    /// Clears the fault like [`Self::clear`], if it is the one that was shown to the user.
    pub fn clear_if_acknowledged(&mut self, acknowledged: Option<Fault>) {
        if self.fault.is_none() || self.fault == acknowledged {
            self.clear();
        }
    }

    /// Requests arming. An earlier jog that has not driven a motor is cleared; an active one
    /// continues.
    pub fn arm(&mut self) {
        self.hold.end();
        if !self.mode().is_driving() {
            self.jog = None;
        }
        self.arming.request();
    }

    /// Requests arming for a jog. Anything driven before is switched off.
    pub fn jog(&mut self, jog: Jog) {
        self.stop();
        self.arming.request();
        self.jog = Some(ActiveJog::new(jog, self.arming.rate));
    }

    /// Fades the force out, then switches off.
    pub fn disarm(&mut self) {
        self.hold.end();
        let gain = self.arming.gain;
        if self.mode().is_driving() && self.mode() != Mode::Fading {
            // Divided by the gain, so that the fade starts at the present force.
            self.fade_from_n = if gain > 0.0 {
                self.force_n / gain
            } else {
                Vec3::ZERO
            };
        }
        self.arming.fade();
    }

    /// Switches off at once, without a fault.
    pub fn stop(&mut self) {
        self.off(Blockers::HOST_DISARMED);
    }

    fn off(&mut self, why: Blockers) {
        self.arming.stop(why);
        self.hold.end();
        self.force_n = Vec3::ZERO;
        self.currents_a = Vec3::ZERO;
        self.stall = StallDetector::default();
        self.jog = None;
    }

    /// Restarts the counts, unrelated to the earlier ones.
    pub fn restart_counts(&mut self) {
        self.counts = None;
    }
}

#[cfg(test)]
mod tests;
