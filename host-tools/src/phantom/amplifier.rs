//! From a current command to joint torque: the amplifier's limit, the current loop's lag, the motor
//! and the cable ratio; and the amplifier's ready line and current monitor.

use libm::exp;

use super::model::AxisDrive;

/// Fault of an amplifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AmplifierFault {
    /// The amplifier is missing or has no supply: it is not ready, and no current flows.
    Missing,
    /// The motor's wire is broken: the amplifier is ready, and no current flows.
    MotorOpen,
}

/// One joint's amplifier and motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplifier {
    axis: AxisDrive,
    fault: Option<AmplifierFault>,
    command_a: f64,
    current_a: f64,
}

impl Amplifier {
    /// Creates an amplifier without current.
    #[must_use]
    pub fn new(axis: AxisDrive) -> Self {
        Self {
            axis,
            fault: None,
            command_a: 0.0,
            current_a: 0.0,
        }
    }

    /// Sets the current command in amperes, limited to the peak current; NaN commands zero.
    pub fn command(&mut self, amperes: f64) {
        let peak = self.axis.motor.peak_a;
        self.command_a = if amperes.is_nan() {
            0.0
        } else {
            amperes.clamp(-peak, peak)
        };
    }

    /// Sets or removes a fault.
    pub fn set_fault(&mut self, fault: Option<AmplifierFault>) {
        self.fault = fault;
    }

    /// Returns true if its ready line is active.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.fault != Some(AmplifierFault::Missing)
    }

    /// Returns the reading of its current monitor, mA, rounded towards zero.
    #[must_use]
    pub fn monitor_ma(&self) -> i16 {
        // The cast saturates.
        (1e3 * self.current_a) as i16
    }

    /// Moves the current towards the command for `h_s` seconds.
    pub fn advance(&mut self, h_s: f64) {
        let target_a = match self.fault {
            None => self.command_a,
            Some(AmplifierFault::Missing | AmplifierFault::MotorOpen) => 0.0,
        };
        let decay = exp(-h_s / self.axis.motor.current_lag_s);
        self.current_a = target_a + (self.current_a - target_a) * decay;
    }

    /// Returns the present current, A.
    #[must_use]
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Returns the torque on the joint, N·m.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        self.current_a * self.axis.motor.kt_nm_per_a * self.axis.ratio * self.axis.sign
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::{PhantomModel, kinematics};
    use glam::{DMat3, DVec3};

    fn settled(axis: AxisDrive, amperes: f64) -> Amplifier {
        let mut amplifier = Amplifier::new(axis);
        amplifier.command(amperes);
        amplifier.advance(1.0);
        amplifier
    }

    #[test]
    fn continuous_current_yields_published_tip_forces() {
        let model = PhantomModel::premium_1_5();
        let jacobian = DMat3::from_cols_array_2d(&kinematics::jacobian(&model, [0.0; 3]));
        for (amperes, expected_n) in [(1.24, [1.84, 1.55, 1.92]), (5.5, [8.2, 6.9, 8.5])] {
            for joint in 0..3 {
                let mut torque = DVec3::ZERO;
                torque[joint] = settled(model.drive[joint], amperes).torque_nm();
                // τ = Jᵀ·F, and the array's rows are glam's columns: J as read is Jᵀ.
                let force = (jacobian.inverse() * torque).length();
                assert!(
                    (force - expected_n[joint]).abs() < 0.05,
                    "{joint}: {force} N"
                );
            }
        }
    }

    #[test]
    fn command_is_limited_to_peak_and_nan_is_zero() {
        let axis = PhantomModel::premium_1_5().drive[0];
        assert_eq!(settled(axis, 99.0).current_a(), 5.5);
        assert_eq!(settled(axis, f64::NEG_INFINITY).current_a(), -5.5);
        assert_eq!(settled(axis, f64::NAN).current_a(), 0.0);
    }

    #[test]
    fn amplifier_fault_determines_ready_state_and_monitor() {
        let axis = PhantomModel::premium_1_5().drive[0];
        let broken = |fault| {
            let mut amplifier = settled(axis, -2.0);
            amplifier.set_fault(fault);
            amplifier.advance(1.0);
            (amplifier.is_ready(), amplifier.monitor_ma())
        };
        assert_eq!(broken(None), (true, -2000));
        assert_eq!(broken(Some(AmplifierFault::Missing)), (false, 0));
        assert_eq!(broken(Some(AmplifierFault::MotorOpen)), (true, 0));
    }

    #[test]
    fn current_follows_a_step_with_the_loop_lag() {
        let axis = PhantomModel::premium_1_5().drive[0];
        let mut amplifier = Amplifier::new(axis);
        amplifier.command(1.0);
        for _ in 0..100 {
            amplifier.advance(axis.motor.current_lag_s / 100.0);
        }
        assert!((amplifier.current_a() - (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }
}
