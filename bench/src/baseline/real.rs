//! Single or double precision, for the same lines of code.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::haptics::Hand;

/// The arithmetic of a baseline.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0
    const ZERO: Self;
    /// 1/2
    const HALF: Self;
    /// 1
    const ONE: Self;
    /// A Newton step below this many cells is the last.
    const LAST_STEP: Self;
    /// Nearest value.
    fn of(value: f32) -> Self;
    /// Toward zero.
    fn whole(self) -> i32;
    /// Exact up to 2²⁴.
    fn from_whole(whole: i32) -> Self;
    /// |x|
    fn abs(self) -> Self;
    /// √x
    fn sqrt(self) -> Self;
    /// The hand counted from the origin.
    fn hand(hand: &Hand) -> [Self; 3];
    /// To single precision.
    fn single(self) -> f32;

    /// Within `[0, 1]`.
    #[inline]
    fn unit(self) -> Self {
        if self < Self::ZERO {
            Self::ZERO
        } else if self > Self::ONE {
            Self::ONE
        } else {
            self
        }
    }
}

macro_rules! real {
    ($real:ident, $hand:ident, $last_step:expr) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const ONE: Self = 1.0;
            const LAST_STEP: Self = $last_step;
            #[inline]
            fn of(value: f32) -> Self {
                Self::from(value)
            }
            #[inline]
            fn whole(self) -> i32 {
                self as i32
            }
            // Exact for f64 only: the cast is what both can do.
            #[allow(clippy::cast_lossless)]
            #[inline]
            fn from_whole(whole: i32) -> Self {
                whole as Self
            }
            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline]
            fn hand(hand: &Hand) -> [Self; 3] {
                hand.$hand
            }
            #[inline]
            fn single(self) -> f32 {
                self as f32
            }
        }
    };
}

real!(f32, single, 1e-6);
real!(f64, wide, 1e-12);
