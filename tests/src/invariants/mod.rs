//! What must hold in every tick, on any terrain, for any hand, judged in f64 by
//! methods that are none of the product's.
//!
//! [`judge`] is the list; [`seen`] is what it looks at, [`surface`], [`crossing`]
//! and [`descent`] are what it knows about the terrain. Everything is in cells.

mod answer;
mod change;
pub mod crossing;
pub mod descent;
pub mod judge;
mod place;
pub mod seen;
pub mod surface;

/// What a tick may not break.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Invariant {
    /// The answer is finite and a valid position.
    Finite,
    /// The force is the spring's, within the clamp.
    Clamp,
    /// The tick's work is within its bound.
    Work,
    /// State, stretch and proxy fit each other.
    Consistent,
    /// A hand that repeats its tick gets to the end of it.
    Settles,
    /// In contact the proxy is on the surface.
    OnSurface,
    /// Where nothing is left to do, no way on the surface leads nearer.
    LocalMinimum,
    /// In contact the way from the proxy to the hand leads into the ground.
    HandBelow,
    /// In contact the proxy is no farther from the hand than where it was.
    Descent,
    /// A contact begins at the first crossing of the hand's way, and is no
    /// farther from the hand than that.
    FirstCrossing,
    /// A way that crosses nothing stays free.
    Freedom,
    /// No free hand is below the surface.
    AboveSurface,
    /// There is no contact before the hand has been seen above the surface.
    SeenAbove,
    /// A wall is not passed.
    Wall,
    /// The force fades in and out at a bounded rate.
    Fade,
    /// The same input gives the same bits.
    Repeatable,
    /// Shifted by whole cells, the scene gives the same bits.
    Shift,
    /// A small window that waits for tiles feels what a whole one feels.
    Window,
    /// Mirrored and turned, the scene feels the same.
    Symmetry,
}

/// A tick that broke an invariant.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub invariant: Invariant,
    /// The tick in its scene.
    pub tick: usize,
    /// What was found.
    pub detail: String,
}

impl std::fmt::Display for Violation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:?} at tick {}: {}",
            self.invariant, self.tick, self.detail
        )
    }
}
