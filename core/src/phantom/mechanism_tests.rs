//! From counts to tip against f64, over the whole workspace of every preset.

use super::*;
use crate::cases::cases;
use crate::phantom::Model;

const MODELS: [Model; 4] = [
    Model::Premium10,
    Model::Premium15,
    Model::Premium30,
    Model::Omni,
];

fn tip_f64(record: &Calibration, [q1, q2, q3]: [f64; 3]) -> [f64; 3] {
    let (l1, l2) = (f64::from(record.l1_mm), f64::from(record.l2_mm));
    let r = l1 * q2.cos() + l2 * q3.sin();
    [q1.cos() * r, q1.sin() * r, l1 * q2.sin() - l2 * q3.cos()]
}

/// The joint angles at these counts, with the record's numbers taken as exact.
fn angles_f64(record: &Calibration, counts: [i32; 3]) -> [f64; 3] {
    core::array::from_fn(|axis| {
        let turn = f64::from(record.counts_per_turn) * f64::from(record.ratio[axis]);
        let turned = f64::from(counts[axis]) * core::f64::consts::TAU / turn;
        f64::from(record.zero_rad[axis]) + f64::from(record.encoder_sign[axis]) * turned
    })
}

/// Joint angles every `step` degrees or so, within the joint limits and the linkage's.
fn workspace(record: &Calibration, step: usize) -> impl Iterator<Item = Vec3> {
    let limits = record.limits;
    let (low, high) = (limits.min_rad, limits.max_rad);
    let along = move |axis: usize| {
        let degrees = (high[axis] - low[axis]).to_degrees();
        let steps = (degrees / step as f32) as usize;
        (0..=steps).map(move |i| low[axis] + (high[axis] - low[axis]) * i as f32 / steps as f32)
    };
    along(0)
        .flat_map(move |q1| {
            along(1).flat_map(move |q2| along(2).map(move |q3| Vec3::new(q1, q2, q3)))
        })
        .filter(move |q| limits.contains(*q, 0.0))
}

#[test]
fn tip_from_counts_is_within_a_micrometre_for_every_preset() {
    for model in MODELS {
        for (sign, zero_rad) in [(1.0, Vec3::ZERO), (-1.0, Vec3::new(0.3, 0.5, 0.7))] {
            let record = Calibration {
                encoder_sign: Vec3::splat(sign),
                zero_rad,
                ..model.preset()
            };
            let mechanism = Kinematics::new(&record).expect("valid");
            let (mut worst, mut poses) = (0.0f64, 0);
            for q in workspace(&record, cases(3, 24) as usize) {
                let counts = mechanism.counts(q, [0; 3]);
                let truth = tip_f64(&record, angles_f64(&record, counts));
                let tip = mechanism.pose(counts, [0; 3]).tip_mm();
                for axis in 0..3 {
                    worst = worst.max((f64::from(tip[axis]) - truth[axis]).abs());
                }
                poses += 1;
            }
            std::eprintln!("{model:?}: {:.3} µm over {poses} poses", worst * 1e3);
            assert!(poses > cases(20_000, 40), "{poses}");
            assert!(worst < 1e-3, "{model:?}: {worst} mm");
        }
    }
}

#[test]
fn counts_follow_the_pose_for_any_zero() {
    let record = Calibration {
        encoder_sign: Vec3::new(1.0, -1.0, 1.0),
        zero_rad: Vec3::new(0.0, 0.2, 0.3),
        ..Calibration::PREMIUM_1_5
    };
    let mechanism = Kinematics::new(&record).expect("valid");
    for zero in [[0; 3], [12_345, -777, i32::MAX - 10]] {
        assert_eq!(mechanism.counts(record.zero_rad, zero), zero);
        let q = Vec3::new(0.4, -0.1, 0.6);
        let counts = mechanism.counts(q, zero);
        let back = mechanism.angles(counts, zero);
        let half_a_count = mechanism.radians_per_count().abs() * 0.51;
        assert!((back - q).abs().cmple(half_a_count).all(), "{back}");
    }
}

#[test]
fn one_count_moves_the_tip_by_the_data_sheet_resolution() {
    let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid");
    let home = mechanism.pose([0; 3], [0; 3]).tip_mm();
    assert_eq!(home, mechanism.home_mm());
    for (axis, expected_um) in [24.2, 28.7, 23.2].into_iter().enumerate() {
        let mut counts = [0; 3];
        counts[axis] = 1;
        let moved = mechanism.pose(counts, [0; 3]).tip_mm() - home;
        assert!((moved.length() * 1e3 - expected_um).abs() < 0.2, "{moved}");
    }
}

#[test]
fn one_newton_up_at_home_needs_the_current_of_its_lever() {
    let record = Calibration {
        motor_sign: Vec3::new(1.0, -1.0, 1.0),
        ..Calibration::PREMIUM_1_5
    };
    let mechanism = Kinematics::new(&record).expect("valid");
    let pose = mechanism.pose([0; 3], [0; 3]);
    let currents = mechanism.currents_a(pose.torques_nm(Vec3::Z));
    let expected = Vec3::new(0.0, -0.209_55 / (11.2 * 0.0234), 0.0);
    assert!((currents - expected).length() < 1e-5, "{currents}");
}

#[test]
fn invalid_record_is_refused_by_kinematics() {
    let record = Calibration {
        ratio: Vec3::ZERO,
        ..Calibration::PREMIUM_1_5
    };
    assert!(Kinematics::new(&record).is_err());
}
