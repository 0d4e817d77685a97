//! What may reach the amplifiers: every failure ends in zero.
//!
//! A tick asks three things in this order: [`Guard::watch`] looks at the inputs
//! and at what was measured, and decides whether anything may be driven at all;
//! [`Guard::limit_force`] bounds the force; [`Guard::limit_currents`] bounds
//! the currents.
//!
//! [`Fault`]s are latched and switch the amplifiers off. [`Limits`] say why a
//! force is less than what was asked for. [`Blockers`] say why the arm cannot
//! be armed. The way from off to on and back is in [`Mode`].

mod arming;
mod fault;
mod flags;
mod mode;
mod rate;
mod speed;
mod stillness;
pub mod thermal;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use arming::{Decision, SMALL_FORCE_N};
pub use fault::Fault;
pub use flags::{Blockers, Limits};
pub use mode::Mode;
pub use rate::TickRate;
pub use stillness::TRAVEL as TRAVEL_WHILE_ONE_STANDS;

use crate::force::clamp_length;
use crate::phantom::{Mechanism, Pose};
use arming::Arming;
use speed::{Look, Speed};
use stillness::Stillness;
use thermal::Motors;

/// Most that the force may change, newtons a second. A hand at 2 m/s against
/// 0.5 N/mm makes 1 N/ms; what is faster is no hand.
pub const MAX_SLEW_N_PER_S: f32 = 1_000.0;
/// Share of the record's largest force that the guard clamps to. An encoder that
/// is wrong by twice what a tick's jump may be, some 7 mm at the tip, makes the
/// levers, and with them the force at the tip, wrong by up to 9 %; this keeps it
/// within the record's (swept in the tests).
pub const WORKING_SHARE: f32 = 0.9;
/// Most counts an encoder may move in a second: about 3 m/s at the tip of a
/// Premium 1.5.
pub const MAX_COUNTS_PER_S: u32 = 128_000;
/// By this much a joint may read beyond its limits, rad: stops give, and
/// limits are measured by hand.
pub const LIMIT_MARGIN_RAD: f32 = 0.087;

/// What the encoders and the safety inputs say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sense {
    /// Counts of axes 1 to 3 since power-up.
    pub counts: [i32; 3],
    /// Whether the dead-man switch is held.
    pub dead_man: bool,
    /// Whether the emergency stop is pressed, or its wire broken.
    pub emergency_stop: bool,
    /// Whether the encoder or amplifier hardware says that it cannot work.
    pub hardware_failed: bool,
}

/// What the guard is told in a tick besides the inputs.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The arm and its pose, if there is a calibration.
    pub arm: Option<(&'a Mechanism, &'a Pose)>,
    /// Whether the arm has been zeroed.
    pub zeroed: bool,
    /// What there is to feel.
    pub scene: SceneKind,
    /// Whether the watchdog is being fed.
    pub watchdog_live: bool,
}

/// What there is to feel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// Nothing.
    None,
    /// A scene for the arm.
    Arm,
    /// A replay.
    Points,
}

/// What the amplifiers are to be given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Motor currents of the three axes, amperes. Zero unless enabled.
    pub currents_a: Vec3,
    /// Whether the amplifiers are to be on.
    pub enabled: bool,
}

/// Where the guard stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
    /// How far arming has come.
    pub mode: Mode,
    /// What keeps the amplifiers off; nothing while they are on.
    pub blockers: Blockers,
    /// Why the last tick's force was less than asked for.
    pub limits: Limits,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// What became of the last arm command.
    pub decision: Decision,
}

/// The guard's memory.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// Most counts and newtons from one tick to the next.
    max_counts: u32,
    max_slew_n: f32,
    arming: Arming,
    fault: Option<Fault>,
    blockers: Blockers,
    limits: Limits,
    /// Counts at the last tick, once the arm is zeroed.
    counts: Option<[i32; 3]>,
    max_force_n: f32,
    force_n: Vec3,
    /// While fading: the force at full gain.
    held_n: Vec3,
    currents_a: Vec3,
    speed: Speed,
    stillness: Stillness,
    motors: Motors,
}

impl Guard {
    /// Disarmed, with a fault that was found at boot.
    #[must_use]
    pub fn new(rate: TickRate, found_at_boot: Option<Fault>) -> Self {
        Self {
            max_counts: MAX_COUNTS_PER_S.div_ceil(rate.hz()),
            max_slew_n: MAX_SLEW_N_PER_S / rate.hz() as f32,
            arming: Arming::new(rate),
            fault: found_at_boot,
            blockers: Blockers::empty(),
            limits: Limits::empty(),
            counts: None,
            max_force_n: 0.0,
            force_n: Vec3::ZERO,
            held_n: Vec3::ZERO,
            currents_a: Vec3::ZERO,
            speed: Speed::new(rate),
            stillness: Stillness::default(),
            motors: Motors::new(rate),
        }
    }

    /// Takes the bounds of an arm.
    pub fn configure(&mut self, mechanism: &Mechanism) {
        self.max_force_n = WORKING_SHARE * mechanism.calibration().max_force_n;
        self.speed.configure(mechanism);
        self.motors.configure(mechanism.calibration());
    }

    /// The latched fault.
    #[must_use]
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// How far arming has come.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.arming.mode()
    }

    /// Why the last tick's force was less than asked for.
    #[must_use]
    pub const fn limits(&self) -> Limits {
        self.limits
    }

    /// Share of force and weight that is let through.
    #[must_use]
    pub const fn gain(&self) -> f32 {
        self.arming.gain()
    }

    /// Where the guard stands.
    #[must_use]
    pub const fn report(&self) -> Report {
        Report {
            mode: self.arming.mode(),
            blockers: self.blockers,
            limits: self.limits,
            fault: self.fault,
            decision: self.arming.decision(),
        }
    }

    /// How warm the motors are.
    #[must_use]
    pub const fn motors(&self) -> &Motors {
        &self.motors
    }

    /// Latches a fault and switches off. The first fault stays.
    pub fn trip(&mut self, fault: Fault) {
        self.fault = self.fault.or(Some(fault));
        self.off(Blockers::FAULT_LATCHED);
    }

    /// Clears the fault. Arming begins from the start, and how warm the motors
    /// are is not forgotten.
    pub fn clear(&mut self) {
        self.fault = None;
        self.stop();
    }

    /// The host asks to arm.
    pub fn arm(&mut self) {
        self.arming.request();
    }

    /// Switches off after force has gone out.
    pub fn disarm(&mut self) {
        let gain = self.arming.gain();
        if self.mode().drives() && self.mode() != Mode::Fading {
            // At the gain that there is, this is the force that there is.
            self.held_n = if gain > 0.0 {
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
        self.force_n = Vec3::ZERO;
        self.currents_a = Vec3::ZERO;
        self.stillness = Stillness::default();
    }

    /// These counts follow from nothing before.
    pub fn restart_counts(&mut self) {
        self.counts = None;
    }

    /// Looks at everything before anything is driven. Returns whether the
    /// encoders lost counts, so that the arm has to be zeroed again.
    pub fn watch(&mut self, sense: &Sense, around: &Surroundings<'_>) -> bool {
        self.limits = Limits::empty();
        // Before the arm is zeroed its position means nothing, nor does a jump.
        let jumped = around.zeroed && self.follow(sense.counts);
        if jumped {
            self.trip(Fault::EncoderJump);
        }
        if !around.zeroed || jumped {
            self.counts = None;
        }
        if self.motors.is_too_hot() {
            self.trip(Fault::MotorTooHot);
        }
        if self.mode().drives() {
            self.watch_driven(sense, around);
        }
        if !self.mode().drives() {
            self.watch_undriven(sense, around);
        }
        jumped
    }

    /// Whether an encoder moved farther than it can.
    fn follow(&mut self, counts: [i32; 3]) -> bool {
        let most = self.max_counts;
        let jumped = self.counts.is_some_and(|last| {
            let mut axes = last.iter().zip(counts);
            axes.any(|(a, b)| a.abs_diff(b) > most)
        });
        self.counts = Some(counts);
        jumped
    }

    fn watch_driven(&mut self, sense: &Sense, around: &Surroundings<'_>) {
        if let Some(fault) = self.found(sense, around) {
            return self.trip(fault);
        }
        if !sense.dead_man {
            match self.mode() {
                // The host let go first.
                Mode::Fading => self.stop(),
                _ => self.trip(Fault::DeadManReleased),
            }
        }
    }

    /// What must not be while the amplifiers are on.
    fn found(&mut self, sense: &Sense, around: &Surroundings<'_>) -> Option<Fault> {
        let Some((mechanism, pose)) = around.arm else {
            return Some(Fault::CalibrationCorrupt);
        };
        if sense.emergency_stop {
            return Some(Fault::EmergencyStop);
        }
        if sense.hardware_failed {
            return Some(Fault::Hardware);
        }
        if !around.watchdog_live {
            return Some(Fault::TaskStalled);
        }
        let limits = &mechanism.calibration().limits;
        if !limits.each_allows(pose.angles(), LIMIT_MARGIN_RAD) {
            return Some(Fault::JointLimit);
        }
        if !limits.linkage_allows(pose.angles(), LIMIT_MARGIN_RAD) {
            return Some(Fault::Linkage);
        }
        match self.speed.look(sense.counts, mechanism, pose) {
            Look::NotYet => None,
            Look::TooFast => Some(Fault::TooFast),
            Look::Moved(moved) => {
                let bearable = self.motors.continuous_a();
                let in_vain = self.stillness.look(moved, self.currents_a, bearable);
                in_vain.then_some(Fault::NoMotion)
            }
        }
    }

    fn watch_undriven(&mut self, sense: &Sense, around: &Surroundings<'_>) {
        self.motors.heat(Vec3::ZERO);
        self.speed.restart(sense.counts);
        let in_the_way = self.in_the_way(sense, around);
        self.arming.wait(in_the_way, sense.dead_man);
        self.blockers = in_the_way | self.arming.by_hand(sense.dead_man);
    }

    /// What keeps the arm from being armed, besides the user's hand.
    fn in_the_way(&self, sense: &Sense, around: &Surroundings<'_>) -> Blockers {
        let outside = around.arm.is_some_and(|(mechanism, pose)| {
            let limits = &mechanism.calibration().limits;
            !limits.allow(pose.angles(), LIMIT_MARGIN_RAD)
        });
        let bits = [
            (around.arm.is_none(), Blockers::NO_CALIBRATION),
            (!around.zeroed, Blockers::NOT_ZEROED),
            (around.scene == SceneKind::None, Blockers::NO_SCENE),
            (around.scene == SceneKind::Points, Blockers::REPLAY),
            (self.fault.is_some(), Blockers::FAULT_LATCHED),
            (sense.emergency_stop, Blockers::EMERGENCY_STOP),
            (sense.hardware_failed, Blockers::HARDWARE),
            (outside, Blockers::OUTSIDE_LIMITS),
            (!around.watchdog_live, Blockers::WATCHDOG_NOT_LIVE),
        ];
        let set = bits.into_iter().filter(|(is, _)| *is);
        set.fold(Blockers::empty(), |all, (_, bit)| all | bit)
    }

    /// The force that may be asked of the motors: no longer than the device
    /// may make, less where the tip is too fast, coming in and going out
    /// gently, slew-limited; zero unless the amplifiers are on.
    #[must_use]
    pub fn limit_force(&mut self, wanted_n: Vec3) -> Vec3 {
        if !wanted_n.is_finite() {
            self.trip(Fault::NotANumber);
        }
        match self.mode() {
            Mode::Disarmed | Mode::Requested => return Vec3::ZERO,
            Mode::Confirming => {
                self.confirm(wanted_n);
                return Vec3::ZERO;
            }
            Mode::Fading => {
                self.limits |= Limits::FADING;
                self.arming.drive();
                self.force_n = self.held_n * self.arming.gain();
            }
            Mode::Ramping | Mode::Armed => self.follow_force(wanted_n),
        }
        self.force_n
    }

    fn confirm(&mut self, wanted_n: Vec3) {
        let small = wanted_n.length_squared() <= SMALL_FORCE_N * SMALL_FORCE_N;
        self.arming.confirm(small);
        self.blockers.set(Blockers::FORCE_TOO_LARGE, !small);
    }

    fn follow_force(&mut self, wanted_n: Vec3) {
        let mut aim = clamp_length(wanted_n, self.max_force_n);
        if aim != wanted_n {
            self.limits |= Limits::FORCE_CLAMPED;
        }
        if self.mode() == Mode::Ramping {
            self.limits |= Limits::RAMPING;
            self.arming.drive();
            aim *= self.arming.gain();
        }
        let share = self.speed.share();
        if share < 1.0 {
            self.limits |= Limits::SPEED_LIMITED;
            aim *= share;
        }
        let change = aim - self.force_n;
        let step = clamp_length(change, self.max_slew_n);
        if step != change {
            self.limits |= Limits::SLEW_LIMITED;
        }
        self.force_n += step;
    }

    /// The currents that may reach the amplifiers for the next tick: all
    /// scaled down together so that none exceeds what its motor may have now;
    /// off unless the amplifiers may be on.
    #[must_use]
    pub fn limit_currents(&mut self, wanted_a: Vec3) -> Drive {
        if !wanted_a.is_finite() {
            self.trip(Fault::NotANumber);
        }
        if !self.mode().drives() {
            return Drive::default();
        }
        let allowed_a = self.motors.allowed_a();
        let load = wanted_a.abs();
        self.currents_a = if load.cmple(allowed_a).all() {
            wanted_a
        } else {
            self.limits |= match load.cmple(self.motors.peak_a()).all() {
                true => Limits::THERMAL_DERATED,
                false => Limits::CURRENT_LIMITED,
            };
            let excess = (load / allowed_a).max_element();
            (wanted_a / excess).clamp(-allowed_a, allowed_a)
        };
        self.motors.heat(self.currents_a);
        Drive {
            currents_a: self.currents_a,
            enabled: true,
        }
    }
}

#[cfg(test)]
mod tests;
