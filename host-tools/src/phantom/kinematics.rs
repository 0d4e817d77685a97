//! Joint angles to tip position and the inverse, in f64 and metres, device frame.
//!
//! ```text
//! r = l1·cos q2 + l2·sin q3     x = r·cos q1   y = r·sin q1   z = l1·sin q2 − l2·cos q3
//! ```
//!
//! `q2` and `q3` are absolute link angles. Singular at `r = 0` (the tip above
//! or below the base's axis) and at `|q2 − q3| = 90°` (the links in line).

use glam::{DMat3, DVec3};
use libm::{acos, atan2, sincos};
use std::f64::consts::{FRAC_PI_2, PI};

use super::model::PhantomModel;

/// Sines and cosines of a pose, computed once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) s: [f64; 3],
    pub(super) c: [f64; 3],
}

impl Pose {
    pub(super) fn new(q_rad: DVec3) -> Self {
        let [(s1, c1), (s2, c2), (s3, c3)] = q_rad.to_array().map(sincos);
        Self {
            s: [s1, s2, s3],
            c: [c1, c2, c3],
        }
    }
}

/// Returns the tip position in metres at joint angles in radians.
#[must_use]
pub fn tip(model: &PhantomModel, q_rad: [f64; 3]) -> [f64; 3] {
    tip_at(model, &Pose::new(DVec3::from(q_rad))).to_array()
}

/// Returns the Jacobian, rows x, y, z (metres), columns q1, q2, q3 (radians).
#[must_use]
pub fn jacobian(model: &PhantomModel, q_rad: [f64; 3]) -> [[f64; 3]; 3] {
    jacobian_at(model, &Pose::new(DVec3::from(q_rad)))
        .transpose()
        .to_cols_array_2d()
}

pub(super) fn tip_at(model: &PhantomModel, pose: &Pose) -> DVec3 {
    let (l1, l2) = (model.l1_m, model.l2_m);
    let ([s1, s2, s3], [c1, c2, c3]) = (pose.s, pose.c);
    let r = l1 * c2 + l2 * s3;
    DVec3::new(c1 * r, s1 * r, l1 * s2 - l2 * c3)
}

pub(super) fn jacobian_at(model: &PhantomModel, pose: &Pose) -> DMat3 {
    let (l1, l2) = (model.l1_m, model.l2_m);
    let ([s1, s2, s3], [c1, c2, c3]) = (pose.s, pose.c);
    let r = l1 * c2 + l2 * s3;
    DMat3::from_cols(
        DVec3::new(-s1 * r, c1 * r, 0.0),
        DVec3::new(-l1 * c1 * s2, -l1 * s1 * s2, l1 * c2),
        DVec3::new(l2 * c1 * c3, l2 * s1 * c3, l2 * s3),
    )
}

/// Returns the joint angles for a tip position in metres, with the elbow on the side that the
/// linkage allows (`|q2 − q3| < 90°`), or `None` beyond the links' reach. Stops are not checked:
/// see [`within_stops`].
#[must_use]
pub fn inverse(model: &PhantomModel, tip_m: [f64; 3]) -> Option<[f64; 3]> {
    let (l1, l2) = (model.l1_m, model.l2_m);
    let [x, y, z] = tip_m;
    let r = (x * x + y * y).sqrt();
    let reach2 = r * r + z * z;
    let cos_elbow = (reach2 - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
    if !(-1.0..=1.0).contains(&cos_elbow) {
        return None;
    }
    // The fore link points along q3 − 90°, so the angle from it up to the
    // upper link is q2 − q3 + 90°, between 0 and 180°.
    let elbow = acos(cos_elbow);
    let (sin_elbow, cos_elbow) = sincos(elbow);
    let q2 = wrap(atan2(z, r) + atan2(l2 * sin_elbow, l1 + l2 * cos_elbow));
    Some([atan2(y, x), q2, q2 - elbow + FRAC_PI_2])
}

/// Returns true if a pose lies inside the mechanical stops.
#[must_use]
pub fn within_stops(model: &PhantomModel, q_rad: [f64; 3]) -> bool {
    let limits = &model.limits;
    let each = (0..3).all(|i| (limits.min_rad[i]..=limits.max_rad[i]).contains(&q_rad[i]));
    let difference = q_rad[1] - q_rad[2];
    each && difference <= limits.q2_minus_q3_max_rad && -difference <= limits.q3_minus_q2_max_rad
}

fn wrap(angle: f64) -> f64 {
    if angle > PI { angle - 2.0 * PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses() -> impl Iterator<Item = [f64; 3]> {
        let steps = |from: i32, to: i32| (from..=to).step_by(10).map(|d| f64::from(d).to_radians());
        steps(-80, 80).flat_map(move |q1| {
            steps(-60, 80)
                .flat_map(move |q2| steps(-50, 60).map(move |difference| [q1, q2, q2 - difference]))
        })
    }

    #[test]
    fn home_is_one_link_out_and_one_link_down() {
        let model = PhantomModel::premium_1_5();
        assert_eq!(tip(&model, [0.0; 3]), [model.l1_m, 0.0, -model.l2_m]);
    }

    #[test]
    fn inverse_undoes_forward_within_a_nanometre() {
        let model = PhantomModel::premium_1_5();
        let mut count = 0;
        for q in poses().filter(|q| within_stops(&model, *q)) {
            let at = tip(&model, q);
            if at[0].hypot(at[1]) < 0.02 || q[0].cos() * at[0] < 0.0 {
                continue;
            }
            let back = inverse(&model, at).expect("reachable");
            let error = DVec3::from(tip(&model, back)) - DVec3::from(at);
            assert!(error.length() < 1e-9, "{q:?} {back:?}");
            let joints = DVec3::from(back) - DVec3::from(q);
            assert!(joints.abs().max_element() < 1e-6, "{q:?} {back:?}");
            count += 1;
        }
        assert!(count > 1000, "{count}");
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        let model = PhantomModel::premium_1_5();
        let step = 1e-6;
        for q in poses() {
            let exact = jacobian(&model, q);
            for joint in 0..3 {
                let (mut low, mut high) = (q, q);
                low[joint] -= step;
                high[joint] += step;
                let (low, high) = (tip(&model, low), tip(&model, high));
                for axis in 0..3 {
                    let slope = (high[axis] - low[axis]) / (2.0 * step);
                    assert!((slope - exact[axis][joint]).abs() < 1e-9, "{q:?}");
                }
            }
        }
    }

    #[test]
    fn point_beyond_the_links_has_no_pose() {
        let model = PhantomModel::premium_1_5();
        assert_eq!(inverse(&model, [0.4, 0.0, 0.0]), None);
        assert_eq!(inverse(&model, [0.001, 0.0, 0.0]), None);
        assert_eq!(inverse(&model, [f64::NAN, 0.0, 0.0]), None);
    }
}
