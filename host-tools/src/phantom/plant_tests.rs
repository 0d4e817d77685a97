//! The arm as a physical object: energy, friction, convergence.

use super::*;

/// Test queries.
impl Plant {
    /// Sets the joint rates, rad/s.
    pub(in crate::phantom) fn moving(mut self, rate_rad_s: [f64; 3]) -> Self {
        self.rate = DVec3::from(rate_rad_s);
        self
    }

    /// Returns the force of the motors at the resting tip, N, device frame: the solution of
    /// `τ = Jᵀ·F`. Not finite in a singular pose.
    pub(in crate::phantom) fn motor_force_n(&self) -> [f64; 3] {
        let jacobian = kinematics::jacobian_at(&self.model, &Pose::new(self.q));
        (jacobian.transpose().inverse() * DVec3::from(self.amplifiers.map(|a| a.torque_nm())))
            .to_array()
    }

    /// Returns the kinetic plus potential energy of the arm (no hand, no stops), J.
    pub(in crate::phantom) fn energy_j(&self) -> f64 {
        self.dynamics
            .energy_j(self.q.to_array(), self.rate.to_array())
    }
}

fn premium() -> PhantomModel {
    PhantomModel::premium_1_5()
}

/// Runs for `ms` milliseconds without current.
fn coast(plant: &mut Plant, ms: u32) {
    for _ in 0..ms {
        plant.step([0.0; 3], 1e-3);
    }
}

#[test]
fn energy_is_conserved_without_friction() {
    let from = [0.1, 0.2, 0.1];
    for model in [
        premium().frictionless(),
        premium().frictionless().weightless(),
    ] {
        let mut plant = Plant::new(model, from).moving([3.0, -2.0, 1.0]);
        let start = plant.energy_j();
        let kinetic = start - Plant::new(model, from).energy_j();
        let mut worst = 0.0f64;
        for _ in 0..200 {
            coast(&mut plant, 1);
            assert!(kinematics::within_stops(&model, plant.q_rad()));
            worst = worst.max((plant.energy_j() - start).abs());
        }
        eprintln!("energy drift: {:.1e} of {kinetic:.2e} J", worst / kinetic);
        assert!(worst < 1e-6 * kinetic, "{worst:e} J of {kinetic:e} J");
        let turned = DVec3::from(plant.q_rad()) - DVec3::from(from);
        assert!(turned.length() > 0.5, "the test arm must really move");
    }
}

#[test]
fn friction_dissipates_energy_until_rest() {
    let mut plant = Plant::new(premium().weightless(), [0.0; 3]).moving([2.0, -2.0, 2.0]);
    let mut energy = plant.energy_j();
    for _ in 0..2000 {
        coast(&mut plant, 1);
        assert!(plant.energy_j() <= energy);
        energy = plant.energy_j();
    }
    assert_eq!(plant.rate_rad_s(), [0.0; 3]);
}

/// Coulomb friction alone stops a joint after ½·I·ω²/τ.
#[test]
fn joint_stops_after_the_coulomb_friction_angle() {
    let mut model = premium().weightless();
    model.viscous_nms_per_rad = [0.0; 3];
    let inertia = Dynamics::new(model).mass(&Pose::new(DVec3::ZERO)).x_axis.x;
    let mut plant = Plant::new(model, [0.0; 3]).moving([1.0, 0.0, 0.0]);
    coast(&mut plant, 2000);
    let expected = 0.5 * inertia / 0.01;
    let turned = plant.q_rad()[0];
    assert!(
        (turned / expected - 1.0).abs() < 0.02,
        "{turned} {expected}"
    );
}

#[test]
fn arm_loaded_below_friction_does_not_creep() {
    let level = [0.0, 1.0, 0.6];
    let model = premium();
    let held = Dynamics::new(model).gravity(&Pose::new(level.into()));
    assert!(held[1].abs() < 0.01 && held[2].abs() > 0.01, "{held:?}");
    // The motor carries the part that friction cannot.
    let per_amp = model.drive[2].ratio * model.drive[2].motor.kt_nm_per_a;
    let currents = [0.0, 0.0, (held[2] + 0.008) / per_amp];
    let mut plant = Plant::new(model, level);
    // While the current rises, the arm falls a little.
    for _ in 0..200 {
        plant.step(currents, 1e-3);
    }
    let still = plant.q_rad();
    for _ in 0..10_000 {
        plant.step(currents, 1e-3);
    }
    assert_eq!(plant.q_rad(), still, "not one bit in ten seconds");
    let fallen = DVec3::from(still) - DVec3::from(level);
    assert!(fallen.length() < 1e-4, "{fallen}");
}

/// The firmware's own kinematics, in f32 and from counts, agree with the plant's true position.
#[test]
fn firmware_kinematics_agree_with_the_plant() {
    use hapterra_core::phantom::{Calibration, Kinematics};
    let device = Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid");
    for joint in 0..60 {
        let turn = f64::from(joint) / 10.0;
        let q = [0.8 * turn.sin(), 0.5 * turn.cos(), 0.4 * (2.0 * turn).sin()];
        let plant = Plant::new(premium(), q);
        let pose = device.pose(plant.counts(), [0; 3]);
        let tip_m = pose.tip_mm().as_dvec3() * 1e-3;
        let distance = tip_m.distance(DVec3::from(plant.tip_m()));
        // Half a count of each axis: 12, 15 and 12 µm at home, more stretched out.
        assert!(distance < 45e-6, "{distance:e} m at {q:?}");
    }
}

#[test]
fn stops_catch_a_thrown_arm() {
    let mut plant = Plant::new(premium(), [0.0; 3]).moving([8.0, 8.0, 0.0]);
    for _ in 0..3000 {
        plant.step([5.5, 5.5, -5.5], 1e-3);
        let [q1, q2, q3] = plant.q_rad().map(f64::to_degrees);
        assert!(q1 < 105.0 && q2 < 130.0 && q2 - q3 < 80.0, "{q1} {q2} {q3}");
    }
}

/// Moves the arm by a hand, with friction and with the current steps of a wall.
fn dragged(substep_s: f64) -> DVec3 {
    let mut plant = Plant::new(premium(), [0.0; 3]).with_hand(HandModel::default());
    plant.substep_s = substep_s;
    let home = DVec3::from(plant.tip_m());
    for tick in 0..500 {
        let t = 1e-3 * f64::from(tick);
        let at = home + 0.02 * DVec3::new((9.0 * t).sin(), (7.0 * t).sin(), (11.0 * t).sin());
        let speed = 0.02
            * DVec3::new(
                9.0 * (9.0 * t).cos(),
                7.0 * (7.0 * t).cos(),
                11.0 * (11.0 * t).cos(),
            );
        plant.set_target(at.to_array(), speed.to_array());
        let square = if tick / 50 % 2 == 0 { 0.5 } else { -0.5 };
        plant.step([square, -square, square], 1e-3);
    }
    DVec3::from(plant.tip_m())
}

#[test]
fn max_substep_error_is_below_a_tenth_of_a_micrometre() {
    let exact = dragged(MAX_SUBSTEP_S / 32.0);
    let used = dragged(MAX_SUBSTEP_S).distance(exact);
    let coarse = dragged(8.0 * MAX_SUBSTEP_S).distance(exact);
    eprintln!("tip error: {used:.2e} m at 50 µs, {coarse:.2e} m at 400 µs");
    assert!(used < 0.1e-6, "{used:e} m");
    assert!(coarse / used > 20.0, "second order: {coarse:e} {used:e}");
}

#[test]
fn plant_is_deterministic() {
    assert_eq!(dragged(MAX_SUBSTEP_S), dragged(MAX_SUBSTEP_S));
}

#[test]
fn hand_force_balances_motor_force_at_rest() {
    let mut plant =
        Plant::new(premium().weightless().frictionless(), [0.0; 3]).with_hand(HandModel::default());
    for _ in 0..3000 {
        plant.step([0.5, 0.3, -0.4], 1e-3);
    }
    let (motor, hand) = (plant.motor_force_n(), plant.hand_force_n());
    let sum = DVec3::from(motor) + DVec3::from(hand);
    assert!(sum.length() < 1e-3, "{motor:?} {hand:?}");
    assert!(DVec3::from(motor).length() > 0.5);
}
