//! The hand that holds the tip: a mass pulled to a target by the arm's muscles
//! and coupled to the tip by the grip.
//!
//! ```text
//! target ─[ arm k, b ]─ hand mass ─[ grip k, b ]─ tip
//! ```
//!
//! The five-parameter structure is that of Speich, Shao and Goldfarb,
//! "Modeling the human hand as it interacts with a telemanipulation system"
//! (Mechatronics, 2005), also fitted on a Premium 1.5 by Fu and Çavuşoğlu
//! (IEEE Trans. SMC-B, 2012).

use glam::DVec3;

/// Masses, springs and dampers of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandModel {
    /// Mass that moves with the fingers, kg.
    pub mass_kg: f64,
    /// Stiffness towards the target, N/m.
    pub arm_n_per_m: f64,
    /// Damping towards the target, N·s/m.
    pub arm_ns_per_m: f64,
    /// Stiffness of the grip on the tip, N/m.
    pub grip_n_per_m: f64,
    /// Damping of the grip, N·s/m.
    pub grip_ns_per_m: f64,
}

impl Default for HandModel {
    /// Returns a relaxed precision grip, not a fit to one person. The values are chosen inside the
    /// ranges that identification studies report for fingers and wrists on a stylus (0.1-0.3 kg,
    /// 200-500 N/m, 5-10 N·s/m towards the target; a grip several times stiffer).
    fn default() -> Self {
        Self {
            mass_kg: 0.15,
            arm_n_per_m: 300.0,
            arm_ns_per_m: 8.0,
            grip_n_per_m: 2000.0,
            grip_ns_per_m: 10.0,
        }
    }
}

impl HandModel {
    /// Returns the compliance of arm and grip, m/N: the tip's lag behind the target for each
    /// newton.
    #[must_use]
    pub fn compliance_m_per_n(&self) -> f64 {
        1.0 / self.arm_n_per_m + 1.0 / self.grip_n_per_m
    }
}

/// A hand in motion, device frame, metres and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    model: HandModel,
    pub(super) at: DVec3,
    pub(super) speed: DVec3,
    target: DVec3,
    target_speed: DVec3,
}

impl Hand {
    /// Creates a hand at rest at a point, which is also its target.
    #[must_use]
    pub fn new(model: HandModel, at_m: [f64; 3]) -> Self {
        let at = DVec3::from(at_m);
        Self {
            model,
            at,
            speed: DVec3::ZERO,
            target: at,
            target_speed: DVec3::ZERO,
        }
    }

    /// Sets the hand's target and its velocity, m and m/s.
    pub fn set_target(&mut self, target_m: [f64; 3], speed_m_s: [f64; 3]) {
        self.target = DVec3::from(target_m);
        self.target_speed = DVec3::from(speed_m_s);
    }

    /// Returns the force of the grip on the tip, N.
    pub(super) fn force_on_tip(&self, tip: DVec3, tip_speed: DVec3) -> DVec3 {
        self.model.grip_n_per_m * (self.at - tip)
            + self.model.grip_ns_per_m * (self.speed - tip_speed)
    }

    /// Returns the acceleration of the hand's mass while it pulls the tip with `on_tip`.
    pub(super) fn acceleration(&self, on_tip: DVec3) -> DVec3 {
        let arm = self.model.arm_n_per_m * (self.target - self.at)
            + self.model.arm_ns_per_m * (self.target_speed - self.speed);
        (arm - on_tip) / self.model.mass_kg
    }

    /// Moves the hand at its speed for `h_s` seconds.
    pub(super) fn drift(&mut self, h_s: f64) {
        self.at += self.speed * h_s;
        self.target += self.target_speed * h_s;
    }
}
