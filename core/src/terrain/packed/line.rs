//! Conversion of an integer to a height: `(offset + k · step) · 2⁻ᵉ`, rounded once.

use super::LINE;

/// A linear function from integers to heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) exponent: i8,
    pub(super) offset: i64,
    pub(super) step: i64,
}

impl Line {
    /// Zero for every number.
    pub(super) const NONE: Self = Self {
        exponent: 0,
        offset: 0,
        step: 0,
    };

    /// Reads the written form; returns `None` for an exponent that no `f32` has.
    pub(super) fn read(bytes: [u8; LINE]) -> Option<Self> {
        let [exponent, offset @ .., _, _, _, _, _, _, _, _] = bytes;
        let [_, _, _, _, _, _, _, _, _, step @ ..] = bytes;
        let exponent = exponent as i8;
        (-126..=126).contains(&exponent).then_some(Self {
            exponent,
            offset: i64::from_le_bytes(offset),
            step: i64::from_le_bytes(step),
        })
    }

    pub(super) fn write(&self) -> [u8; LINE] {
        let mut bytes = [0; LINE];
        bytes[0] = self.exponent as u8;
        bytes[1..9].copy_from_slice(&self.offset.to_le_bytes());
        bytes[9..].copy_from_slice(&self.step.to_le_bytes());
        bytes
    }

    #[inline(never)]
    pub(super) fn at(&self, k: i32) -> f32 {
        let sum = i64::from(k)
            .wrapping_mul(self.step)
            .wrapping_add(self.offset);
        let unit = f32::from_bits(((127 - i32::from(self.exponent)) as u32) << 23);
        sum as f32 * unit
    }

    /// Returns the line with a given height at the number `at` and a rise of `step` per number, as
    /// exact as possible for numbers up to `span` away.
    pub(super) fn through(at: i64, height: f64, step: f64, span: f64) -> Option<Self> {
        let reach = height.abs() + step.abs() * span.abs().max(1.0);
        if !(reach.is_finite() && reach > 0.0) {
            return None;
        }
        // The sum stays below 2^62, although its parts may wrap.
        let exponent = 60 - libm::ilogb(reach);
        let whole = |x: f64| libm::rint(libm::ldexp(x, exponent)) as i64;
        let step = whole(step);
        (-126..=126).contains(&exponent).then(|| Self {
            exponent: exponent as i8,
            offset: whole(height).wrapping_sub(at.wrapping_mul(step)),
            step,
        })
    }
}

/// Returns an integer that increases with the `f32`, made of its highest bit and the 31 others.
pub(super) const fn rank(height: f32) -> i32 {
    let bits = height.to_bits() as i32;
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// Returns the `f32` of a rank.
#[inline]
pub(super) const fn of_rank(rank: i32) -> f32 {
    f32::from_bits((rank ^ ((rank >> 31) as u32 >> 1) as i32) as u32)
}
