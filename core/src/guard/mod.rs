//! What may reach the amplifiers: every failure ends in zero.

pub mod thermal;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::force::clamp_length;
use thermal::{Motors, Rating};

/// A latched fault. The numbers are stable; only an explicit reset clears one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Fault {
    /// A force or current was not a number.
    NotANumber = 1,
    /// A tick took longer than its period.
    TickOverrun = 2,
    /// An encoder moved farther in a tick than the arm can.
    EncoderJump = 3,
    /// The encoder or amplifier hardware did not answer.
    Hardware = 4,
    /// The emergency stop is pressed, or its wire is broken.
    EmergencyStop = 5,
    /// The dead-man switch is not held.
    DeadManReleased = 6,
    /// A motor winding is too hot, in spite of derating.
    MotorTooHot = 7,
}

impl Fault {
    /// The fault's number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}

/// Most that the force may change in a tick, newtons. A hand at 2 m/s against
/// 0.5 N/mm makes 1 N/ms; what is faster is no hand.
pub const MAX_SLEW_N: f32 = 1.0;

/// Most counts an encoder may move in a tick: about 3 m/s at the tip of a
/// Premium 1.5.
pub const MAX_COUNTS_PER_TICK: u32 = 128;

/// What the amplifiers are to be given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Motor currents of the three axes, amperes. Zero unless enabled.
    pub currents_a: Vec3,
    /// Whether the amplifiers are to be on.
    pub enabled: bool,
}

/// The guard's memory: the force last let through, and the latched fault.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guard {
    fault: Option<Fault>,
    force_n: Vec3,
    counts: Option<[i32; 3]>,
    motors: Motors,
}

impl Guard {
    /// The latched fault.
    #[must_use]
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Latches a fault. The first one stays.
    pub fn trip(&mut self, fault: Fault) {
        self.fault = self.fault.or(Some(fault));
    }

    /// Clears the fault; force comes back at the slew limit. How warm the
    /// motors are is not forgotten.
    pub fn clear(&mut self) {
        *self = Self {
            motors: self.motors,
            ..Self::default()
        };
    }

    /// How warm the motors are.
    #[must_use]
    pub const fn motors(&self) -> &Motors {
        &self.motors
    }

    /// Looks at the encoders before they are used.
    pub fn watch(&mut self, counts: [i32; 3]) {
        let jumped = self.counts.is_some_and(|last| {
            last.iter()
                .zip(counts)
                .any(|(a, b)| a.abs_diff(b) > MAX_COUNTS_PER_TICK)
        });
        if jumped {
            self.trip(Fault::EncoderJump);
        }
        self.counts = Some(counts);
    }

    /// The force that may be asked of the motors: slew-limited, zero after a
    /// fault.
    #[must_use]
    pub fn limit_force(&mut self, wanted_n: Vec3) -> Vec3 {
        if !wanted_n.is_finite() {
            self.trip(Fault::NotANumber);
        }
        self.force_n = if self.fault.is_some() {
            Vec3::ZERO
        } else {
            self.force_n + clamp_length(wanted_n - self.force_n, MAX_SLEW_N)
        };
        self.force_n
    }

    /// The currents that may reach the amplifiers for the next `dt_s` seconds:
    /// all scaled down together so that none exceeds what its motor may have
    /// now; off after a fault.
    #[must_use]
    pub fn limit_currents(&mut self, wanted_a: Vec3, rating: Rating, dt_s: f32) -> Drive {
        if !wanted_a.is_finite() {
            self.trip(Fault::NotANumber);
        }
        if self.motors.is_too_hot() {
            self.trip(Fault::MotorTooHot);
        }
        if self.fault.is_some() {
            self.motors.heat(Vec3::ZERO, dt_s);
            return Drive::default();
        }
        let allowed_a = self.motors.allowed_a(rating);
        let excess = (wanted_a.abs() / allowed_a).max_element();
        let currents_a = if excess > 1.0 {
            (wanted_a / excess).clamp(-allowed_a, allowed_a)
        } else {
            wanted_a
        };
        self.motors.heat(currents_a, dt_s);
        Drive {
            currents_a,
            enabled: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATING: Rating = Rating {
        peak_a: 1.0,
        continuous_a: 0.5,
    };

    #[test]
    fn not_a_number_is_latched_and_gives_nothing() {
        let mut guard = Guard::default();
        assert_eq!(guard.limit_force(Vec3::new(0.0, f32::NAN, 0.0)), Vec3::ZERO);
        assert_eq!(guard.limit_force(Vec3::Z), Vec3::ZERO);
        assert_eq!(
            guard.limit_currents(Vec3::X, RATING, 1e-3),
            Drive::default()
        );
        assert_eq!(guard.fault().map(Fault::number), Some(1));
        guard.clear();
        assert_eq!(guard.limit_force(Vec3::Z), Vec3::Z);
    }

    #[test]
    fn force_changes_at_the_slew_limit() {
        let mut guard = Guard::default();
        assert_eq!(guard.limit_force(Vec3::Z * 2.5).z, 1.0 - 2.0 * f32::EPSILON);
        let _ = guard.limit_force(Vec3::Z * 2.5);
        assert!((guard.limit_force(Vec3::Z * 2.5).z - 2.5).abs() < 1e-6);
    }

    #[test]
    fn currents_keep_their_direction() {
        let mut guard = Guard::default();
        let drive = guard.limit_currents(Vec3::new(3.0, -1.5, 0.3), RATING, 1e-3);
        assert!((drive.currents_a - Vec3::new(1.0, -0.5, 0.1)).length() < 1e-6);
        assert!(drive.currents_a.abs().max_element() <= 1.0);
    }

    #[test]
    fn a_jumping_encoder_is_a_fault_and_the_first_reading_is_none() {
        let mut guard = Guard::default();
        guard.watch([100_000, 0, 0]);
        guard.watch([100_100, -100, 0]);
        assert_eq!(guard.fault(), None);
        guard.watch([100_100, 29, 0]);
        assert_eq!(guard.fault(), Some(Fault::EncoderJump));
    }
}
