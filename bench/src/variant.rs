//! Interface of every compared contact rule.

use std::hint::black_box;
use std::time::Duration;

use hapterra_core::Vec3;
use hapterra_core::grid::GridPoint;

use crate::clock::Stopwatch;

/// One haptic interface point, in the form of every variant's arithmetic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hip {
    /// Cell and fraction.
    pub grid: GridPoint,
    /// The same point, exactly.
    pub wide: [f64; 3],
    /// The same point as single floats counted from the origin.
    pub single: [f32; 3],
}

impl Hip {
    /// Returns the point of the grid nearest to `[x, y, z]` in cells.
    #[must_use]
    pub fn at(point: [f64; 3]) -> Self {
        let cell = point.map(|c| c.floor() as i32);
        let frac = [0, 1, 2].map(|i| (point[i] - point[i].floor()) as f32);
        let grid = GridPoint::new(cell, Vec3::from_array(frac));
        let (cell, frac) = (grid.cell(), grid.frac());
        let wide = [0, 1, 2].map(|i| f64::from(cell[i]) + f64::from(frac[i]));
        Self {
            grid,
            wide,
            single: wide.map(|c| c as f32),
        }
    }
}

/// Result of a variant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactResult {
    /// True if there is a force.
    pub touching: bool,
    /// True if all work for this HIP was done.
    pub converged: bool,
    /// Vector from the HIP to the proxy, cells.
    pub displacement: [f32; 3],
}

impl ContactResult {
    /// The result without a force.
    pub const FREE: Self = Self {
        touching: false,
        converged: true,
        displacement: [0.0; 3],
    };

    /// Returns a result in contact, with the proxy `displacement` away from the HIP.
    #[must_use]
    pub const fn touching(displacement: [f32; 3]) -> Self {
        Self {
            touching: true,
            converged: true,
            displacement,
        }
    }
}

impl ContactResult {
    /// Returns the change from this displacement to another, cells.
    #[must_use]
    pub fn change(&self, other: &Self) -> f64 {
        let off = |i: usize| f64::from(other.displacement[i]) - f64::from(self.displacement[i]);
        (0..3).map(|i| off(i).powi(2)).sum::<f64>().sqrt()
    }
}

/// A method of rendering a height field: the product's or another.
pub trait Haptics {
    /// Clears all state of earlier ticks.
    fn reset(&mut self);

    /// Runs one tick.
    fn tick(&mut self, hip: &Hip) -> ContactResult;

    /// Returns the time for a whole path, with cleared state.
    fn time(&mut self, path: &[Hip]) -> Duration {
        self.reset();
        let watch = Stopwatch::start();
        for hip in path {
            black_box(self.tick(black_box(hip)));
        }
        watch.elapsed()
    }

    /// Returns the results along a path, with cleared state.
    fn results(&mut self, path: &[Hip]) -> Vec<ContactResult> {
        self.reset();
        path.iter().map(|hip| self.tick(hip)).collect()
    }
}
