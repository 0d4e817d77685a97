//! Conversions between two systems in PROJ's syntax, parsed once for all points.

use std::fmt;
use std::sync::Arc;

use proj4rs::Proj;
use proj4rs::transform::transform;

/// A conversion between two systems. Angles are in radians.
#[derive(Clone)]
pub(super) struct Transform {
    words: [String; 2],
    systems: Arc<[Proj; 2]>,
}

impl Transform {
    /// Creates the conversion between two systems; `None` if `proj4rs` does not support one of
    /// them.
    pub(super) fn new(from: String, to: String) -> Option<Self> {
        let system = |words: &str| Proj::from_proj_string(words).ok();
        let systems = Arc::new([system(&from)?, system(&to)?]);
        let words = [from, to];
        Some(Self { words, systems })
    }

    /// Converts a position of the first system to the second.
    pub(super) fn forward(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let [from, to] = &*self.systems;
        moved(from, to, place)
    }

    /// Converts a position of the second system to the first.
    pub(super) fn inverse(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let [from, to] = &*self.systems;
        moved(to, from, place)
    }
}

fn moved(from: &Proj, to: &Proj, (x, y): (f64, f64)) -> Option<(f64, f64)> {
    let mut place = (x, y, 0.0);
    transform(from, to, &mut place).ok()?;
    (place.0.is_finite() && place.1.is_finite()).then_some((place.0, place.1))
}

impl PartialEq for Transform {
    fn eq(&self, other: &Self) -> bool {
        self.words == other.words
    }
}

impl fmt::Debug for Transform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.words.fmt(f)
    }
}
