//! The limits of force and currents.

use glam::Vec3;

use super::{Blockers, Fault, Guard, GuardOutputs, Limits, Mode, SMALL_FORCE_N};
use crate::scalar::{clamp_length, is_finite};

impl Guard {
    /// Returns the force for the motors: clamped to the device's limit, reduced if the tip is too
    /// fast, ramped up and faded out, and rate-limited; zero unless the amplifiers are on.
    #[must_use]
    pub fn limit_force(&mut self, target_n: Vec3) -> Vec3 {
        if !is_finite(target_n) {
            self.trip(Fault::NotANumber);
        }
        match self.mode() {
            Mode::Disarmed | Mode::Requested => return Vec3::ZERO,
            Mode::Confirming => {
                self.confirm(target_n);
                return Vec3::ZERO;
            }
            Mode::Fading => {
                self.limits |= Limits::FADING;
                self.arming.advance_on();
                self.force_n = self.fade_from_n * self.arming.gain;
            }
            Mode::Ramping | Mode::Armed => self.follow_force(target_n),
        }
        self.force_n
    }

    fn confirm(&mut self, target_n: Vec3) {
        let small = target_n.length_squared() <= SMALL_FORCE_N * SMALL_FORCE_N;
        self.arming.confirm(small);
        self.blockers.set(Blockers::FORCE_TOO_LARGE, !small);
    }

    fn follow_force(&mut self, target_n: Vec3) {
        let mut limited_n = clamp_length(target_n, self.max_force_n);
        if limited_n != target_n {
            self.limits |= Limits::FORCE_CLAMPED;
        }
        if self.mode() == Mode::Ramping {
            self.limits |= Limits::RAMPING;
            self.arming.advance_on();
            limited_n *= self.arming.gain;
        }
        let share = self.speed.share;
        if share < 1.0 {
            self.limits |= Limits::SPEED_LIMITED;
            limited_n *= share;
        }
        let change = limited_n - self.force_n;
        let step = clamp_length(change, self.max_slew_n);
        self.force_n = if step == change {
            // Exact to the bit, so that a replay renders the same force.
            limited_n
        } else {
            self.limits |= Limits::SLEW_LIMITED;
            self.force_n + step
        };
    }

    /// Returns a tick's currents of the active jog, A; `None` without a jog. Ends a jog whose time
    /// is over.
    #[must_use]
    pub fn jog_currents_a(&mut self) -> Option<Vec3> {
        let (mode, gain) = (self.mode(), self.arming.gain);
        let jog = self.jog.as_mut()?;
        let currents_a = jog.currents_a(self.motors.continuous_a, gain);
        if mode == Mode::Armed && jog.count_hold_tick() {
            self.disarm();
        }
        Some(currents_a)
    }

    /// Returns the amplifiers' currents for the next tick: all scaled down together so that none
    /// exceeds its motor's present limit; off unless the amplifiers may be on.
    #[must_use]
    pub fn limit_currents(&mut self, target_a: Vec3) -> GuardOutputs {
        if !is_finite(target_a) {
            self.trip(Fault::NotANumber);
        }
        if !self.mode().is_driving() {
            return GuardOutputs::default();
        }
        let allowed_a = self.motors.allowed_a;
        let load = target_a.abs();
        self.currents_a = if load.cmple(allowed_a).all() {
            target_a
        } else {
            self.limits |= match load.cmple(self.motors.peak_a).all() {
                true => Limits::THERMAL_DERATED,
                false => Limits::CURRENT_LIMITED,
            };
            let excess = (load / allowed_a).max_element();
            (target_a / excess).clamp(-allowed_a, allowed_a)
        };
        // An amplifier may drive more than its command; only a monitor shows that.
        self.motors.heat(match self.feedback.has_monitors() {
            true => self.currents_a.abs().max(self.feedback.measured_a()),
            false => self.currents_a,
        });
        GuardOutputs {
            currents_a: self.currents_a,
            enabled: true,
            held: Vec3::ZERO,
        }
    }
}
