//! The force at the true tip stays within the record's limit while an encoder is wrong by what the
//! guard accepts in two ticks, including the converters' rounding.

use hapterra::phantom::{PhantomModel, kinematics};
use hapterra_core::Vec3;
use hapterra_core::guard::{LIMIT_MARGIN_RAD, WORKING_SHARE};
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_firmware::amplifier::offset_code;
use hapterra_tests::campaign::maxima::OFF_COUNTS;
use hapterra_tests::campaign::motor_forces::{force, is_near_singular};

/// Error of an encoder, counts.
const OFF: i32 = OFF_COUNTS as i32;
/// Code of zero current and full scale of the coarsest converter of the boards.
const MIDDLE: f64 = 2_048.0;
const SPAN: f64 = 1_792.0;
const FULL_SCALE_A: f32 = 5.5;

/// Returns poses between the stops, six degrees apart, for one angle of joint 1, which turns all.
fn poses(record: &Calibration) -> Vec<Vec3> {
    let step = |i: i32| (6.0 * i as f32).to_radians();
    let all = (-25..=40).flat_map(|i| (-25..=40).map(move |j| Vec3::new(0.0, step(i), step(j))));
    all.filter(|q| record.limits.contains(*q, LIMIT_MARGIN_RAD))
        .collect()
}

/// Returns directions all round.
fn directions() -> impl Iterator<Item = Vec3> {
    let steps = -2..=2;
    let all = steps.clone().flat_map(move |x| {
        let steps = -2..=2;
        steps.flat_map(move |y| (-2..=2).map(move |z| Vec3::new(x as f32, y as f32, z as f32)))
    });
    all.filter(|v| *v != Vec3::ZERO).map(Vec3::normalize)
}

/// Returns a current after its conversion to a code and back.
fn converted(current_a: f32) -> f64 {
    let code = f64::from(offset_code(current_a / FULL_SCALE_A));
    (code - MIDDLE) / SPAN * f64::from(FULL_SCALE_A)
}

/// Safety: 10.
#[test]
fn encoder_error_of_two_jumps_keeps_force_within_the_maximum() {
    let record = Calibration::PREMIUM_1_5;
    let mechanism = Kinematics::new(&record).expect("valid");
    let model = PhantomModel::premium_1_5();
    let mut worst = 0.0_f64;
    let mut checked = 0;
    for q in poses(&record) {
        let right = mechanism.counts(q, [0; 3]);
        let angles = mechanism.angles(right, [0; 3]);
        let truth = angles.to_array().map(f64::from);
        if is_near_singular(&model, truth) {
            continue;
        }
        let jacobian = kinematics::jacobian(&model, truth);
        let weight = mechanism.gravity_nm(&mechanism.pose(right, [0; 3]));
        for (axis, off) in (0..3).flat_map(|axis| [(axis, OFF), (axis, -OFF)]) {
            let mut counts = right;
            counts[axis] += off;
            let pose = mechanism.pose(counts, [0; 3]);
            for direction in directions() {
                let reported = direction * WORKING_SHARE * record.max_force_n;
                let torques = pose.torques_nm(reported) + mechanism.gravity_nm(&pose);
                let currents = mechanism.currents_a(torques).to_array();
                let torque = std::array::from_fn(|i| {
                    let drive = &model.drive[i];
                    let per_ampere = drive.ratio * drive.sign * drive.motor.kt_nm_per_a;
                    converted(currents[i]) * per_ampere - f64::from(weight[i])
                });
                let [x, y, z] = force(&jacobian, torque);
                worst = worst.max((x * x + y * y + z * z).sqrt());
                checked += 1;
            }
        }
    }
    let most = f64::from(record.max_force_n);
    println!("{worst:.3} N of {most} N at most, in {checked} cases");
    assert!(checked > 100_000, "{checked}");
    assert!(worst <= most, "{worst} N");
    // The bound is not much wider than necessary.
    assert!(worst > 0.95 * most, "{worst} N");
}
