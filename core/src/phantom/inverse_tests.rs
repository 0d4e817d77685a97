//! Tip to angles and back, everywhere and at the edges.

use super::*;
use crate::cases::cases;
use crate::phantom::{JointLimits, Model, Pose};

fn tip(record: &Calibration, q: Vec3) -> Vec3 {
    Pose::from_angles(record, q).tip_mm()
}

/// Angles of an axis, ends included.
fn along(limits: &JointLimits, axis: usize, steps: u32) -> impl Iterator<Item = f32> {
    let (low, high) = (limits.min_rad[axis], limits.max_rad[axis]);
    (0..=steps).map(move |i| low + (high - low) * i as f32 / steps as f32)
}

#[test]
fn inverse_kinematics_round_trips_within_a_micrometre() {
    for model in [
        Model::Premium10,
        Model::Premium15,
        Model::Premium30,
        Model::Omni,
    ] {
        let record = model.preset();
        let limits = record.limits;
        let (mut worst, mut same, mut poses) = (0.0f32, 0, 0);
        for q1 in along(&limits, 0, cases(24, 3)) {
            for q2 in along(&limits, 1, cases(60, 8)) {
                for q3 in along(&limits, 2, cases(60, 8)) {
                    let q = Vec3::new(q1, q2, q3);
                    if !limits.contains(q, 0.0) {
                        continue;
                    }
                    let at = tip(&record, q);
                    let found = record.joints_at(at).expect("it is from a pose");
                    assert!(limits.contains(found, 1e-5), "{q} {found}");
                    worst = worst.max((tip(&record, found) - at).length());
                    same += u32::from((found - q).abs().max_element() < 1e-3);
                    poses += 1;
                }
            }
        }
        std::eprintln!(
            "{model:?}: {:.3} µm over {poses} poses, {same} the same",
            worst * 1e3
        );
        assert!(worst < 1e-3, "{model:?}: {worst} mm");
        // Most poses that lean over backwards have a second pose that faces the tip.
        assert!(same * 10 > poses * 8, "{same} of {poses}");
    }
}

#[test]
fn inverse_kinematics_uses_the_branch_inside_limits() {
    let record = Calibration::PREMIUM_1_5;
    // Leaning over backwards, turned by 80°: turning towards the tip would need −100°.
    let q = Vec3::new(80f32.to_radians(), 115f32.to_radians(), 169f32.to_radians());
    assert!(record.limits.contains(q, 0.0));
    let at = tip(&record, q);
    let pose = Pose::from_angles(&record, q);
    assert!(pose.reach_mm() < -10.0, "{}", pose.reach_mm());
    let found = record.joints_at(at).expect("reachable");
    assert!((found - q).abs().max_element() < 1e-4, "{found}");
}

#[test]
fn inverse_kinematics_is_accurate_near_singular_poses() {
    let mut record = Calibration::PREMIUM_1_5;
    record.limits.q2_minus_q3_max_rad = 1.5;
    record.limits.q3_minus_q2_max_rad = 1.5;
    for off in [0.0, 1e-7, 1e-5, 1e-3, 1e-2] {
        // Links nearly in line, folded and stretched.
        for q2 in [0.3f32, 0.8] {
            for spread in [1.5 - off, -1.5 + off] {
                let q = Vec3::new(0.2, q2, q2 - spread);
                if !record.limits.contains(q, 0.0) {
                    continue;
                }
                let at = tip(&record, q);
                let found = record.joints_at(at).expect("reachable");
                assert!((tip(&record, found) - at).length() < 1e-3, "{q} {found}");
            }
        }
        // On the base's axis.
        let height = Vec3::new(off * 100.0, 0.0, 320.0);
        let found = record.joints_at(height).expect("reachable");
        assert!((tip(&record, found) - height).length() < 1e-3, "{found}");
        assert!(found.is_finite());
    }
}

#[test]
fn unreachable_position_returns_the_reason() {
    let record = Calibration::PREMIUM_1_5;
    let at = |x: f32, y: f32, z: f32| record.joints_at(Vec3::new(x, y, z));
    assert_eq!(at(f32::NAN, 0.0, 0.0), Err(Unreachable::NotFinite));
    assert_eq!(at(0.0, f32::INFINITY, 0.0), Err(Unreachable::NotFinite));
    assert_eq!(at(380.0, 0.0, 0.0), Err(Unreachable::TooFar));
    assert_eq!(at(3e38, 0.0, 0.0), Err(Unreachable::TooFar));
    assert_eq!(at(1.0, 0.0, 0.0), Err(Unreachable::TooNear));
    assert_eq!(at(378.0, 0.0, 0.0), Err(Unreachable::BeyondLimits));
    assert_eq!(at(-200.0, 1.0, -150.0), Err(Unreachable::BeyondLimits));
}

#[test]
fn joint_angles_beyond_half_a_turn_are_found() {
    let mut record = Calibration::PREMIUM_1_5;
    record.limits.min_rad = Vec3::new(-1.5, -4.0, -4.0);
    record.limits.max_rad = Vec3::new(1.5, 2.0, 2.0);
    let q = Vec3::new(0.1, -3.4, -3.2);
    assert!(record.limits.contains(q, 0.0));
    let found = record.joints_at(tip(&record, q)).expect("reachable");
    assert!((found - q).abs().max_element() < 1e-4, "{found}");
}
