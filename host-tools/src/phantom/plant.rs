//! The moving arm: joints, motors and encoders, and the hand on the tip.
//!
//! Each step is cut into substeps of at most 50 µs (20 in a millisecond). A substep is half a kick,
//! a drift, half a kick (velocity Verlet), with the friction of `friction.rs` in each kick. The
//! method has second order: half the substep has a quarter of the error, which
//! `halving_the_substep_...` measures below a tenth of a micrometre, 1/200 of an encoder count.

use glam::{DMat3, DVec3};

use super::amplifier::{Amplifier, AmplifierFault};
use super::dynamics::Dynamics;
use super::encoder::Encoder;
use super::friction;
use super::hand::{Hand, HandModel};
use super::kinematics::{self, Pose};
use super::model::PhantomModel;
use super::motor::MotorTemperature;

/// Max substep of the integration, s.
pub const MAX_SUBSTEP_S: f64 = 50e-6;

/// A virtual Phantom, with or without a hand on it.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    model: PhantomModel,
    dynamics: Dynamics,
    q: DVec3,
    rate: DVec3,
    amplifiers: [Amplifier; 3],
    encoders: [Encoder; 3],
    motors: [MotorTemperature; 3],
    hand: Option<Hand>,
    substep_s: f64,
}

impl Plant {
    /// Creates an arm at rest in a pose, without a hand. Its counters read zero in the pose
    /// `q = 0`; see [`Plant::power_up`].
    #[must_use]
    pub fn new(model: PhantomModel, q_rad: [f64; 3]) -> Self {
        Self {
            model,
            dynamics: Dynamics::new(model),
            q: DVec3::from(q_rad),
            rate: DVec3::ZERO,
            amplifiers: model.drive.map(Amplifier::new),
            encoders: model.drive.map(|axis| Encoder::new(&axis)),
            motors: model.drive.map(|axis| MotorTemperature::new(axis.motor)),
            hand: None,
            substep_s: MAX_SUBSTEP_S,
        }
    }

    /// Adds a hand at rest on the tip.
    #[must_use]
    pub fn with_hand(mut self, hand: HandModel) -> Self {
        self.hand = Some(Hand::new(hand, self.tip_m()));
        self
    }

    /// Removes the hand.
    #[must_use]
    pub fn without_hand(mut self) -> Self {
        self.hand = None;
        self
    }

    /// Sets all counters to zero in this pose, as at power-up.
    pub fn power_up(&mut self) {
        for (encoder, angle) in self.encoders.iter_mut().zip(self.q.to_array()) {
            encoder.power_up(angle);
        }
    }

    /// Moves arm and hand to another pose, at rest. The counters continue.
    pub fn put(&mut self, q_rad: [f64; 3]) {
        self.q = DVec3::from(q_rad);
        self.rate = DVec3::ZERO;
        let tip_m = self.tip_m();
        if let Some(hand) = &mut self.hand {
            hand.at = DVec3::from(tip_m);
            hand.speed = DVec3::ZERO;
            hand.set_target(tip_m, [0.0; 3]);
        }
    }

    /// Sets the hand's target, m and m/s in the device frame. Within a step the target continues at
    /// that speed. Does nothing without a hand.
    pub fn set_target(&mut self, target_m: [f64; 3], speed_m_s: [f64; 3]) {
        if let Some(hand) = &mut self.hand {
            hand.set_target(target_m, speed_m_s);
        }
    }

    /// Applies current commands (A) for `dt_s` seconds; returns the counters' readings at the end.
    pub fn step(&mut self, currents_a: [f64; 3], dt_s: f64) -> [i32; 3] {
        for (amplifier, current) in self.amplifiers.iter_mut().zip(currents_a) {
            amplifier.command(current);
        }
        let substeps = (dt_s / self.substep_s - 1e-9).ceil().max(1.0);
        let h = dt_s / substeps;
        for _ in 0..substeps as u32 {
            self.substep(h);
        }
        for (motor, amplifier) in self.motors.iter_mut().zip(&self.amplifiers) {
            motor.advance(amplifier.current_a(), dt_s);
        }
        self.counts()
    }

    /// Returns the counters' readings.
    #[must_use]
    pub fn counts(&self) -> [i32; 3] {
        let angles = self.q.to_array();
        std::array::from_fn(|i| self.encoders[i].counts(angles[i]))
    }

    /// Sets or removes a fault of the amplifier of an axis (0 to 2). Ignores other axes.
    pub fn set_amplifier_fault(&mut self, axis: usize, fault: Option<AmplifierFault>) {
        if let Some(amplifier) = self.amplifiers.get_mut(axis) {
            amplifier.set_fault(fault);
        }
    }

    /// Returns true if all amplifiers report that they are ready.
    #[must_use]
    pub fn amplifiers_are_ready(&self) -> bool {
        self.amplifiers.iter().all(Amplifier::is_ready)
    }

    /// Returns the readings of the amplifiers' current monitors, mA.
    #[must_use]
    pub fn monitors_ma(&self) -> [i16; 3] {
        self.amplifiers.map(|amplifier| amplifier.monitor_ma())
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> &PhantomModel {
        &self.model
    }

    /// Returns the true joint angles, rad.
    #[must_use]
    pub fn q_rad(&self) -> [f64; 3] {
        self.q.to_array()
    }

    /// Returns the true joint rates, rad/s. They are exactly zero while friction holds a joint.
    #[must_use]
    pub fn rate_rad_s(&self) -> [f64; 3] {
        self.rate.to_array()
    }

    /// Returns the true tip position, m, device frame.
    #[must_use]
    pub fn tip_m(&self) -> [f64; 3] {
        kinematics::tip(&self.model, self.q.to_array())
    }

    /// Returns the force of the hand on the tip, N, device frame; zero without a hand.
    #[must_use]
    pub fn hand_force_n(&self) -> [f64; 3] {
        let pose = Pose::new(self.q);
        let tip = kinematics::tip_at(&self.model, &pose);
        let speed = kinematics::jacobian_at(&self.model, &pose) * self.rate;
        self.hand
            .map_or([0.0; 3], |hand| hand.force_on_tip(tip, speed).to_array())
    }

    /// Returns the true position of the hand, m, device frame; `None` without a hand.
    #[must_use]
    pub fn hand_m(&self) -> Option<[f64; 3]> {
        self.hand.map(|hand| hand.at.to_array())
    }

    /// Returns the winding temperatures, °C.
    #[must_use]
    pub fn winding_c(&self) -> [f64; 3] {
        self.motors.map(|m| m.winding_c())
    }

    fn substep(&mut self, h: f64) {
        // The torque in the middle of the substep is used for all of it.
        self.advance_currents(0.5 * h);
        let torque = DVec3::from(self.amplifiers.map(|a| a.torque_nm()));
        self.kick(torque, 0.5 * h);
        self.q += self.rate * h;
        if let Some(hand) = &mut self.hand {
            hand.drift(h);
        }
        self.kick(torque, 0.5 * h);
        self.advance_currents(0.5 * h);
    }

    fn advance_currents(&mut self, h: f64) {
        for amplifier in &mut self.amplifiers {
            amplifier.advance(h);
        }
    }

    /// Changes the velocities for `h` seconds at fixed positions; velocity-dependent torques are
    /// evaluated half-way.
    fn kick(&mut self, torque: DVec3, h: f64) {
        let pose = Pose::new(self.q);
        let fixed = Fixed {
            inverse_mass: self.dynamics.mass(&pose).inverse(),
            jacobian: kinematics::jacobian_at(&self.model, &pose),
            tip: kinematics::tip_at(&self.model, &pose),
            push: torque - self.dynamics.gravity(&pose),
            pose,
        };
        let (joints, fingers) = self.accelerations(&fixed, self.rate, self.hand);
        let mut half = self.hand;
        if let Some(hand) = &mut half {
            hand.speed += fingers * (0.5 * h);
        }
        let (joints, fingers) = self.accelerations(&fixed, self.rate + joints * (0.5 * h), half);
        let coulomb = DVec3::from(self.model.coulomb_nm);
        let free = self.rate + joints * h;
        self.rate = friction::settle(free, &fixed.inverse_mass, coulomb, h);
        if let Some(hand) = &mut self.hand {
            hand.speed += fingers * h;
        }
    }

    /// Returns the accelerations of the joints (without Coulomb friction) and of the hand.
    fn accelerations(&self, at: &Fixed, rate: DVec3, hand: Option<Hand>) -> (DVec3, DVec3) {
        let on_tip = hand.map_or(DVec3::ZERO, |hand| {
            hand.force_on_tip(at.tip, at.jacobian * rate)
        });
        let torque = at.push + self.dynamics.viscous(rate) + self.dynamics.stops(self.q, rate)
            - self.dynamics.coriolis(&at.pose, rate)
            + at.jacobian.transpose() * on_tip;
        let fingers = hand.map_or(DVec3::ZERO, |hand| hand.acceleration(on_tip));
        (at.inverse_mass * torque, fingers)
    }
}

/// Terms that do not depend on velocities.
struct Fixed {
    pose: Pose,
    inverse_mass: DMat3,
    jacobian: DMat3,
    tip: DVec3,
    push: DVec3,
}

#[cfg(test)]
#[path = "plant_tests.rs"]
mod tests;
