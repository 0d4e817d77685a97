//! Single or double precision for the same code.

use std::fmt::Debug;

use num_traits::Float;

/// The arithmetic of a baseline.
pub trait Real: Float + Debug {
    /// 1/2
    const HALF: Self;
    /// Length of a Newton step, cells, below which the iteration ends.
    const LAST_STEP: Self;
    /// Converts to the nearest value.
    fn of(value: f32) -> Self;
    /// Rounds down.
    fn whole(self) -> i32;
    /// Converts a whole number; exact up to 2²⁴.
    fn from_whole(whole: i32) -> Self;
    /// Converts to single precision.
    fn single(self) -> f32;
}

macro_rules! real {
    ($real:ident, $last_step:expr) => {
        impl Real for $real {
            const HALF: Self = 0.5;
            const LAST_STEP: Self = $last_step;
            #[inline]
            fn of(value: f32) -> Self {
                Self::from(value)
            }
            #[inline]
            fn whole(self) -> i32 {
                self.floor() as i32
            }
            // Exact for f64 only, but both types support the cast.
            #[allow(clippy::cast_lossless)]
            #[inline]
            fn from_whole(whole: i32) -> Self {
                whole as Self
            }
            #[inline]
            fn single(self) -> f32 {
                self as f32
            }
        }
    };
}

real!(f32, 1e-6);
real!(f64, 1e-12);
