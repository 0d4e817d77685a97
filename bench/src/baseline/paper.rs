//! The paper's algorithm as published, as a variant.

use hapterra::published::{Heights, Paper, Real};

use crate::grid::Grid;
use crate::variant::{ContactResult, Haptics, Hip};

impl Heights for Grid {
    #[inline]
    fn has(&self, cell: [i32; 2]) -> bool {
        Self::has(self, cell)
    }

    #[inline]
    fn corners(&self, cell: [i32; 2]) -> [f32; 4] {
        Self::corners(self, cell)
    }
}

/// Conversion of the HIP to the arithmetic of a baseline.
trait OfHip: Real {
    fn hip(hip: &Hip) -> [Self; 3];
}

impl OfHip for f32 {
    #[inline]
    fn hip(hip: &Hip) -> [Self; 3] {
        hip.single
    }
}

impl OfHip for f64 {
    #[inline]
    fn hip(hip: &Hip) -> [Self; 3] {
        hip.wide
    }
}

impl<R: OfHip> Haptics for Paper<&Grid, R> {
    fn reset(&mut self) {
        Self::forget(self);
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        self.step(R::hip(hip))
            .map_or(ContactResult::FREE, |displacement| {
                ContactResult::touching(displacement.map(R::single))
            })
    }
}
