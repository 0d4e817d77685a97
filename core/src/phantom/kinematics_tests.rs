//! The pose against f64, and in singular poses.

use super::*;
use crate::cases::cases;

const PREMIUM: Calibration = Calibration::PREMIUM_1_5;

/// Joint angles every 7 degrees or so (28 under Miri), within the limits and beyond, including
/// singular poses.
fn workspace() -> impl Iterator<Item = [f64; 3]> {
    let each = cases(7, 28) as usize;
    let steps =
        move |from: i32, to: i32| (from..=to).step_by(each).map(|d| f64::from(d).to_radians());
    steps(-90, 90).flat_map(move |q1| {
        steps(-124, 119).flat_map(move |q2| steps(-29, 214).map(move |q3| [q1, q2, q3]))
    })
}

fn single([q1, q2, q3]: [f64; 3]) -> Vec3 {
    Vec3::new(q1 as f32, q2 as f32, q3 as f32)
}

fn tip_f64([q1, q2, q3]: [f64; 3]) -> [f64; 3] {
    let (l1, l2) = (f64::from(PREMIUM.l1_mm), f64::from(PREMIUM.l2_mm));
    let r = l1 * q2.cos() + l2 * q3.sin();
    [q1.cos() * r, q1.sin() * r, l1 * q2.sin() - l2 * q3.cos()]
}

/// ∂tip/∂q of a joint, mm/rad.
fn lever_f64(q: [f64; 3], joint: usize) -> [f64; 3] {
    let h = 1e-6;
    let (mut lo, mut hi) = (q, q);
    lo[joint] -= h;
    hi[joint] += h;
    let (lo, hi) = (tip_f64(lo), tip_f64(hi));
    core::array::from_fn(|axis| (hi[axis] - lo[axis]) / (2.0 * h))
}

#[test]
fn tip_error_stays_within_its_bound_over_the_workspace() {
    let mut worst = 0.0_f64;
    for q in workspace() {
        // The input is the angle rounded to f32, so this rounding is not an error of the code.
        let angles = single(q);
        let truth = tip_f64(angles.to_array().map(f64::from));
        let tip = Pose::from_angles(&PREMIUM, angles).tip_mm();
        for axis in 0..3 {
            worst = worst.max((f64::from(tip[axis]) - truth[axis]).abs());
        }
    }
    assert!(worst < 2e-4, "{worst} mm");
}

#[test]
fn torques_and_tip_velocity_match_the_jacobian() {
    let force = Vec3::new(1.5, -0.7, 2.2);
    let rates = Vec3::new(0.7, -1.9, 1.1);
    for q in workspace().step_by(97) {
        let pose = Pose::from_angles(&PREMIUM, single(q));
        let torques = pose.torques_nm(force);
        let velocity = pose.tip_velocity_mm_s(rates);
        let mut moved = [0.0f64; 3];
        for joint in 0..3 {
            let lever = lever_f64(q, joint);
            let power: f64 = (0..3).map(|a| lever[a] * 1e-3 * f64::from(force[a])).sum();
            assert!((power - f64::from(torques[joint])).abs() < 1e-5);
            for axis in 0..3 {
                moved[axis] += lever[axis] * f64::from(rates[joint]);
            }
        }
        for axis in 0..3 {
            assert!(
                (moved[axis] - f64::from(velocity[axis])).abs() < 1e-3,
                "{q:?}"
            );
        }
    }
}

/// Forces of one newton in all directions.
fn directions() -> impl Iterator<Item = Vec3> {
    (0..60).map(|i| {
        let turn = i as f32 * 2.399_963;
        let up = (i as f32 + 0.5) / 30.0 - 1.0;
        let out = libm::sqrtf(1.0 - up * up);
        let (sin, cos) = sin_cos(turn % core::f32::consts::TAU);
        Vec3::new(out * cos, out * sin, up)
    })
}

/// Safety: 10.
#[test]
fn torques_stay_within_levers_even_in_singular_poses() {
    let (l1, l2) = (PREMIUM.l1_mm * 1e-3, PREMIUM.l2_mm * 1e-3);
    let bound = Vec3::new(l1 + l2, l1, l2) * 1.000_01;
    let right = core::f32::consts::FRAC_PI_2;
    // On the axis: l1·cos q2 = −l2·sin q3. In line: |q2 − q3| = 90°. Both at once: stretched upward
    // along the axis.
    let on_axis = |q2: f32| Vec3::new(0.3, q2, -libm::asinf(l1 * libm::cosf(q2) / l2));
    let singular = [on_axis(1.2), on_axis(1.5), Vec3::new(0.1, 0.4, 0.4 - right)]
        .into_iter()
        .chain([
            Vec3::new(0.1, -0.4, right - 0.4),
            Vec3::new(0.0, right, 2.0 * right),
        ]);
    let near = singular.flat_map(|q| {
        [0.0, 1e-6, -1e-6, 1e-3, -1e-3].map(move |off| q + Vec3::new(0.0, off, -off))
    });
    let mut largest = Vec3::ZERO;
    for q in workspace().step_by(13).map(single).chain(near) {
        let pose = Pose::from_angles(&PREMIUM, q);
        for force in directions() {
            let torques = pose.torques_nm(force).abs();
            assert!(torques.cmple(bound).all(), "{q}: {torques}");
            largest = largest.max(torques);
        }
    }
    // The bound is tight.
    assert!(largest.cmpge(bound * 0.95).all(), "{largest} of {bound}");
}

#[test]
fn device_and_terrain_frames_convert_back() {
    let v = Vec3::new(1.0, 2.0, 3.0);
    assert_eq!(to_terrain_frame(to_device_frame(v)), v);
    // Away from the user is north, which is toward the base.
    assert_eq!(to_terrain_frame(Vec3::NEG_X), Vec3::Y);
}
