//! A closed loop: encoders to a plain spring wall to currents, 1 kHz.

use super::*;
use crate::phantom::{Encoder, Touch, kinematics};
use glam::{DMat3, DVec3};

const WALL_N_PER_MM: f64 = 0.5;
const TICK_S: f64 = 1e-3;

/// Computes the currents for a flat surface at height zero from counts alone, as a device does.
fn wall_currents(model: &PhantomModel, placement: &ArmFrame, counts: [i32; 3]) -> [f64; 3] {
    let q = std::array::from_fn(|i| Encoder::new(&model.drive[i]).angle_rad(counts[i]));
    let [_, _, height_mm] = placement.to_terrain_mm(model, kinematics::tip(model, q));
    let force = DVec3::new(0.0, 0.0, WALL_N_PER_MM * (-height_mm).max(0.0));
    let jacobian_transposed = DMat3::from_cols_array_2d(&kinematics::jacobian(model, q));
    let torque = jacobian_transposed * force;
    std::array::from_fn(|i| {
        let axis = &model.drive[i];
        torque[i] / (axis.ratio * axis.motor.kt_nm_per_a * axis.sign)
    })
}

/// Returns the true height of the tip, mm, terrain frame.
fn height_mm(arm: &HeldPhantom) -> f64 {
    let plant = &arm.plant;
    arm.placement.to_terrain_mm(plant.model(), plant.tip_m())[2]
}

/// Runs the loop until a time; calls `watch` with the height and force in each tick.
fn run(arm: &mut HeldPhantom, until_s: f64, mut watch: impl FnMut(f64, [f64; 3])) {
    while arm.t_s < until_s {
        let currents = wall_currents(arm.plant().model(), &arm.placement, arm.plant.counts());
        arm.step(currents, TICK_S);
        watch(
            height_mm(arm),
            ArmFrame::turn_to_terrain(arm.plant.motor_force_n()),
        );
    }
}

fn press_and_lift(model: PhantomModel) -> (HeldPhantom, f64) {
    let hand = HandModel::default();
    let touch = Touch::start(&|_, _| Some(0.0), &hand, WALL_N_PER_MM, [5.0, -3.0], 10.0);
    let pressed = touch.press(2.0, 1.5);
    let until_s = pressed.script().duration_s();
    let script = pressed.lift(10.0).finish();
    let placement = ArmFrame { home_mm: [0.0; 3] };
    let arm = HeldPhantom::new(model, hand, placement, script).expect("in reach");
    (arm, until_s)
}

#[test]
fn two_newtons_press_four_millimetres_deep() {
    let (mut arm, until) = press_and_lift(PhantomModel::premium_1_5().weightless());
    let mut last = Vec::new();
    run(&mut arm, until, |height, force| last.push((height, force)));
    let settled = &last[last.len() - 300..];
    // Friction carries at most 0.01 N·m on an arm of 0.21 m, against the springs of wall and hand
    // together; the encoder's error is half a count.
    let friction_n = 0.01 / arm.plant().model().l1_m;
    let hand_n_per_mm = 1e-3 / HandModel::default().compliance_m_per_n();
    let bound_mm = friction_n / (WALL_N_PER_MM + hand_n_per_mm) + 0.015;
    for (height, force) in settled {
        assert!((height + 4.0).abs() < bound_mm, "{height} ± {bound_mm} mm");
        assert!(
            (force[2] - 2.0).abs() < WALL_N_PER_MM * bound_mm,
            "{force:?} N"
        );
    }
    eprintln!("rests at {:.3} mm, {:.3} N", settled[0].0, settled[0].1[2]);
    let (low, high) = settled
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), (z, _)| {
            (low.min(*z), high.max(*z))
        });
    assert!(high - low < 0.03, "rings by {} mm", high - low);
}

#[test]
fn lifted_hand_has_no_force() {
    let (mut arm, _) = press_and_lift(PhantomModel::premium_1_5().weightless());
    let end = arm.script.duration_s() + 0.5;
    run(&mut arm, end, |_, _| {});
    assert!(arm.t_s >= arm.begin_s + arm.script.duration_s());
    let height = height_mm(&arm);
    assert!((height - 10.0).abs() < 0.5, "{height}");
    run(&mut arm, end + 0.2, |_, force| {
        assert!(DVec3::from(force).length() < 1e-9, "{force:?}");
    });
}

/// At tapping speed the loop remains stable.
#[test]
fn tapping_stays_stable() {
    let hand = HandModel::default();
    let script = Touch::start(&|_, _| Some(0.0), &hand, WALL_N_PER_MM, [0.0; 2], 10.0)
        .tap(5, 3.0)
        .lift(10.0)
        .finish();
    let placement = ArmFrame { home_mm: [0.0; 3] };
    let until = script.duration_s();
    let mut arm =
        HeldPhantom::new(PhantomModel::premium_1_5(), hand, placement, script).expect("reach");
    let mut highest_n = 0.0f64;
    run(&mut arm, until, |height, force| {
        highest_n = highest_n.max(force[2]);
        assert!(height > -12.0 && height < 20.0);
    });
    assert!((2.0..6.0).contains(&highest_n), "{highest_n} N");
}

#[test]
fn unreachable_script_point_is_named() {
    let script = Script::start([0.0; 3]).line_to([0.0, 400.0, 0.0], 50.0);
    let placement = ArmFrame { home_mm: [0.0; 3] };
    let error = HeldPhantom::new(
        PhantomModel::premium_1_5(),
        HandModel::default(),
        placement,
        script,
    )
    .expect_err("far");
    assert_eq!(error.at_mm, [0.0, 400.0, 0.0]);
    assert!(error.to_string().contains("(0.0, 400.0, 0.0) mm"));
}
