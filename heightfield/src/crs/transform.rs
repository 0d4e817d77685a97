//! The way between two systems as PROJ writes them, made once for all points.

use std::fmt;
use std::sync::Arc;

use proj4rs::Proj;
use proj4rs::transform::transform;

/// From one system to another and back. Angles are radians.
#[derive(Clone)]
pub(super) struct Transform {
    words: [String; 2],
    systems: Arc<[Proj; 2]>,
}

impl Transform {
    /// Between two systems; `None` where `proj4rs` does not know one of them.
    pub(super) fn new(from: String, to: String) -> Option<Self> {
        let system = |words: &str| Proj::from_proj_string(words).ok();
        let systems = Arc::new([system(&from)?, system(&to)?]);
        let words = [from, to];
        Some(Self { words, systems })
    }

    /// A place of the first system in the second one.
    pub(super) fn forward(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let [from, to] = &*self.systems;
        moved(from, to, place)
    }

    /// A place of the second system in the first one.
    pub(super) fn back(&self, place: (f64, f64)) -> Option<(f64, f64)> {
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
