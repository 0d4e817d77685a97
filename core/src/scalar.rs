//! Arithmetic of single numbers for which a Cortex-M4F has no instruction: what is called in
//! their place takes many times as long.

/// The smaller one; `b` where one of them is not a number. `f32::min` is a call.
#[inline]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger one; `b` where one of them is not a number. `f32::max` is a call.
#[inline]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// 1/√x of a normal x above zero, to 3e-7 of it: by three of Newton's steps from the exponent
/// halved. A root to the last bit takes 95 instructions, this one 20.
pub(crate) fn one_over_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5F37_5A86 - (x.to_bits() >> 1));
    for _ in 0..3 {
        y *= 1.5 - 0.5 * x * y * y;
    }
    y
}

/// √x, to 3e-7 of it where x is normal; as [`libm::sqrtf`] of all else.
// A call: five copies of it would be a kilobyte.
#[inline(never)]
pub(crate) fn root(x: f32) -> f32 {
    if x.is_normal() && x > 0.0 {
        x * one_over_root(x)
    } else {
        libm::sqrtf(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_as_near_as_is_said_at_every_size() {
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
    fn a_root_of_what_is_not_normal_is_the_usual_one() {
        for x in [0.0, -0.0, 1e-40, f32::INFINITY] {
            assert_eq!(root(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
        }
        assert!(root(-1.0).is_nan() && root(f32::NAN).is_nan());
    }

    #[test]
    fn what_is_no_number_gives_the_second() {
        assert_eq!([smaller(f32::NAN, 1.0), larger(f32::NAN, 1.0)], [1.0; 2]);
        assert_eq!([smaller(1.0, 2.0), larger(1.0, 2.0)], [1.0, 2.0]);
        assert_eq!([smaller(2.0, 1.0), larger(2.0, 1.0)], [1.0, 2.0]);
    }
}
