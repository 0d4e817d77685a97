//! Arithmetic without an instruction on a Cortex-M4F: the functions in its place take many times as
//! long.

use glam::Vec3;

/// Returns the smaller number; `b` if one is NaN. `f32::min` is a call.
#[inline]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Returns the larger number; `b` if one is NaN. `f32::max` is a call.
#[inline]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Returns 1/√x of a normal x above zero, with a relative error of 3e-7: three Newton steps,
/// starting from half of the exponent. An exact root takes 95 instructions, this one 20.
pub(crate) fn one_over_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5F37_5A86 - (x.to_bits() >> 1));
    for _ in 0..3 {
        y *= 1.5 - 0.5 * x * y * y;
    }
    y
}

/// Returns √x, with a relative error of 3e-7 for normal x; otherwise the same as [`libm::sqrtf`].
// Not inlined: five copies would take a kilobyte.
#[inline(never)]
pub(crate) fn root(x: f32) -> f32 {
    if x.is_normal() && x > 0.0 {
        x * one_over_root(x)
    } else {
        libm::sqrtf(x)
    }
}

/// Returns `v`, shortened to `limit` if it is longer; zero if it is not finite.
///
/// The result is never longer than `limit` (of normal size), and at most 8 ulp shorter than `limit`
/// if it was clamped.
#[must_use]
#[inline]
pub fn clamp_length(v: Vec3, limit: f32) -> Vec3 {
    let squared = v.length_squared();
    // The usual case. It excludes squares that are too small or too large to compare, or not
    // finite.
    if squared.is_normal() && squared <= limit * limit {
        return v;
    }
    // No force in the air.
    if v == Vec3::ZERO {
        return Vec3::ZERO;
    }
    shortened(v, limit)
}

/// Returns `v`, shortened to `limit`, for any numbers.
#[inline(never)]
fn shortened(v: Vec3, limit: f32) -> Vec3 {
    let largest = v.abs().max_element();
    if !is_finite(v) {
        return Vec3::ZERO;
    }
    // Scaled first, so that squaring cannot overflow.
    let unit = v / largest;
    // Margin for four roundings below, and for one in a caller's check of the length.
    let limit = limit * (1.0 - 4.0 * f32::EPSILON);
    let part = limit / libm::sqrtf(unit.length_squared());
    if largest <= part { v } else { unit * part }
}

/// Returns true if all components are finite: only finite numbers times zero are zero. It takes a
/// third of the instructions of `Vec3::is_finite`, in every tick.
#[inline]
pub(crate) fn is_finite(v: Vec3) -> bool {
    (v * 0.0).element_sum() == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clamp_keeps_limits_whose_square_overflows() {
        let long = Vec3::new(5.1e27, -2e27, 5.1e26);
        let length = |v: Vec3| {
            let squares = v.to_array().map(|c| f64::from(c).powi(2));
            squares.iter().sum::<f64>().sqrt()
        };
        for limit in [1e-30, 1e-22, 1e19, 1e20, 5e27, 1e38] {
            for scale in [1e-37, 1.0, 1e10] {
                let v = long * scale;
                let clamped = length(clamp_length(v, limit));
                let expected = length(v).min(f64::from(limit));
                assert!(
                    clamped <= f64::from(limit) && clamped >= expected * (1.0 - 1e-6),
                    "{v} by {limit}: {clamped}"
                );
            }
        }
    }

    #[test]
    fn is_finite_rejects_nan_and_infinities() {
        let finite = [
            0.0,
            -0.0,
            f32::MIN_POSITIVE,
            1e-45,
            -3.0,
            f32::MAX,
            f32::MIN,
        ];
        let not = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for axis in 0..3 {
            for (numbers, expected) in [(&finite[..], true), (&not[..], false)] {
                for number in numbers {
                    let mut v = Vec3::splat(f32::MAX);
                    v[axis] = *number;
                    assert_eq!(is_finite(v), expected, "{v}");
                }
            }
        }
    }

    #[test]
    fn root_error_stays_within_bound_at_every_magnitude() {
        let mut worst = 0.0_f64;
        for bits in (f32::MIN_POSITIVE.to_bits()..f32::MAX.to_bits()).step_by(9_973) {
            let x = f32::from_bits(bits);
            let exact = libm::sqrt(f64::from(x));
            let off = (f64::from(root(x)) / exact - 1.0).abs();
            let off_inverse = (f64::from(one_over_root(x)) * exact - 1.0).abs();
            worst = worst.max(off).max(off_inverse);
        }
        assert!(worst < 3e-7, "{worst:e}");
    }

    #[test]
    fn root_of_a_non_normal_number_equals_sqrtf() {
        for x in [0.0, -0.0, 1e-40, f32::INFINITY] {
            assert_eq!(root(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
        }
        assert!(root(-1.0).is_nan() && root(f32::NAN).is_nan());
    }

    #[test]
    fn smaller_and_larger_ignore_a_nan_first_argument() {
        assert_eq!([smaller(f32::NAN, 1.0), larger(f32::NAN, 1.0)], [1.0; 2]);
        assert_eq!([smaller(1.0, 2.0), larger(1.0, 2.0)], [1.0, 2.0]);
        assert_eq!([smaller(2.0, 1.0), larger(2.0, 1.0)], [1.0, 2.0]);
    }
}
