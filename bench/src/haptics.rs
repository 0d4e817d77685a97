//! What every variant is asked, and what it answers.

use std::hint::black_box;
use std::time::Duration;

use hapterra_core::Vec3;
use hapterra_core::grid::GridPoint;

use crate::clock::Stopwatch;

/// One haptic interface point, ready for every variant's arithmetic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Cell and fraction.
    pub grid: GridPoint,
    /// The same point, exactly.
    pub wide: [f64; 3],
    /// The same point as single floats counted from the origin.
    pub single: [f32; 3],
}

impl Hand {
    /// The point of the grid next to `[x, y, z]` in cells.
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

/// What is felt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Whether there is a force.
    pub touching: bool,
    /// Whether all there was to do for this hand was done.
    pub settled: bool,
    /// From the hand to the proxy, cells.
    pub stretch: [f32; 3],
}

impl Answer {
    /// Nothing is felt.
    pub const FREE: Self = Self {
        touching: false,
        settled: true,
        stretch: [0.0; 3],
    };

    /// The proxy is `stretch` away from the hand.
    #[must_use]
    pub const fn touching(stretch: [f32; 3]) -> Self {
        Self {
            touching: true,
            settled: true,
            stretch,
        }
    }
}

/// A way to render a height field: one of ours or an opponent.
pub trait Haptics {
    /// Forgets the last tick.
    fn forget(&mut self);

    /// One tick.
    fn tick(&mut self, hand: &Hand) -> Answer;

    /// Time for a whole path, from nothing.
    fn time(&mut self, path: &[Hand]) -> Duration {
        self.forget();
        let watch = Stopwatch::start();
        for hand in path {
            black_box(self.tick(black_box(hand)));
        }
        watch.elapsed()
    }

    /// What is felt along a path, from nothing.
    fn answers(&mut self, path: &[Hand]) -> Vec<Answer> {
        self.forget();
        path.iter().map(|hand| self.tick(hand)).collect()
    }
}
