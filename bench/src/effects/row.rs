//! Row of an effect: the time of a tick with it, and its errors.

use crate::stats::quantiles;

/// All measurements on one terrain.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Times of each path and effect.
    pub times: Vec<Time>,
    /// Errors of each effect, by its promises.
    pub errors: Vec<Error>,
}

impl Measured {
    /// Appends the figures of another terrain.
    pub fn append(&mut self, other: Self) {
        self.times.extend(other.times);
        self.errors.extend(other.errors);
    }
}

/// The whole tick with one effect along one path.
#[derive(Clone, Debug)]
pub struct Time {
    /// The terrain's name.
    pub terrain: String,
    /// The path's name.
    pub path: &'static str,
    /// The effect's name.
    pub effect: &'static str,
    /// Nanoseconds a tick: lower quartile, median, upper quartile.
    pub ns: [f64; 3],
    /// Median over the rounds of the ratio of its time to that without an effect.
    pub ratio: f64,
}

/// Difference from the documented formula.
#[derive(Clone, Debug)]
pub struct Error {
    /// The terrain's name.
    pub terrain: String,
    /// The path's name.
    pub path: &'static str,
    /// The effect's name.
    pub effect: &'static str,
    /// Its quantity.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The errors.
    pub spread: Spread,
    /// Largest permitted error, if docs/explanation/effects.md has one.
    pub bound: Option<f64>,
    /// Number of checked errors.
    pub compared: usize,
}

/// Distribution of errors; larger is worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Half are below.
    pub median: f64,
    /// 99th percentile.
    pub p99: f64,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    fn of(values: Vec<f64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let [median, p99, worst] = quantiles(values, [0.5, 0.99, 1.0]);
        Some(Self { median, p99, worst })
    }
}

/// Origin of errors: terrain, path and effect.
#[derive(Clone, Copy)]
pub(super) struct Origin<'a>(pub &'a str, pub &'static str, pub &'static str);

impl Origin<'_> {
    /// Returns a row of these errors; `None` if nothing could be checked.
    pub(super) fn error(
        &self,
        (what, unit): (&'static str, &'static str),
        bound: impl Into<Option<f64>>,
        values: Vec<f64>,
    ) -> Option<Error> {
        let compared = values.len();
        let bound = bound.into();
        Spread::of(values).map(|spread| Error {
            terrain: self.0.to_owned(),
            path: self.1,
            effect: self.2,
            what,
            unit,
            spread,
            bound,
            compared,
        })
    }
}
