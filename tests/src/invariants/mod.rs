//! Invariants of every tick, on any terrain, for any path of the HIP. They are checked
//! in f64, by methods that are none of the product's: in `tests/tests/properties.rs`, `quick_soak.rs`
//! and `cargo xtask soak`. `tests/tests/oracles.rs` shows that each can fail.
//!
//! [`oracle`] lists the invariants in the order in which they are checked; [`material`] checks the
//! forces of a scene with materials. [`observed_tick`] is one tick as the oracle sees it. `single_tick`,
//! `proxy_position` and `tick_to_tick` check a tick, its proxy, and its change from the tick before.
//! [`surface`], [`crossing`] and [`descent`] are the terrain in f64. All lengths are in cells.

mod basin;
pub mod crossing;
pub mod descent;
mod friction;
pub mod material;
pub mod observed_tick;
pub mod oracle;
mod proxy_position;
mod shading;
mod single_tick;
pub mod surface;
pub mod texture;
mod tick_to_tick;

/// Invariant of every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Invariant {
    /// The answer is finite, and the proxy is a valid position.
    Finite,
    /// The force is the spring's force, or as long as the clamp allows.
    Clamp,
    /// The tick spends at most `WORK_PER_TICK` units of work.
    Work,
    /// State, displacement and proxy fit each other: there is no force without a
    /// contact, a free proxy is at the HIP, and the force points to the proxy.
    Consistent,
    /// A tick that is repeated for the same HIP comes to its end.
    Settles,
    /// In contact the proxy is on the surface.
    OnSurface,
    /// After a tick with work left, no path along the surface leads from the proxy nearer to the
    /// HIP.
    LocalMinimum,
    /// While a contact lasts, a way of ground and air joins the proxy with its last place, and is
    /// nowhere farther from the HIP than that place.
    Basin,
    /// With friction: where a tick leaves no work over, the HIP lies inside the friction
    /// cone over the proxy, and on the cone if the proxy has slid.
    Cone,
    /// With friction: a proxy that the HIP lies inside the friction cone of stays where it
    /// is, to the bit.
    Stuck,
    /// In contact the straight way from the proxy to the HIP leads into the ground:
    /// no contact pulls.
    HipBelow,
    /// While a contact lasts, the proxy is no farther from the HIP than its last
    /// place is.
    Descent,
    /// A contact begins at the first crossing of the HIP's path with the surface, and
    /// is no farther from the HIP than that.
    FirstCrossing,
    /// A HIP whose path crosses nothing stays free.
    Freedom,
    /// A proxy on its way through the air that waits for no tile comes farther, wherever
    /// the HIP moves on ahead of it.
    Advances,
    /// No free HIP is below the surface.
    AboveSurface,
    /// No contact begins before the HIP was seen above the surface.
    SeenAbove,
    /// The proxy passes no wall.
    Wall,
    /// The force fades in and out at a bounded rate.
    Fade,
    /// With shading: the force is as long as without, and along the smoothed normal.
    Shading,
    /// With texture: the force is the one without and what the relief adds; it never pulls.
    Texture,
    /// On materials: the force is that of the material in force, which goes evenly to that of the
    /// sample nearest to the proxy.
    Material,
    /// On materials: a proxy that slides over a plane trails the HIP by what the friction of the
    /// place before holds.
    Slides,
    /// The same input gives the same bits.
    Repeatable,
    /// A scene shifted by whole cells gives the same bits.
    Shift,
    /// A small window that waits for tiles gives the bits of a window that holds all.
    Window,
    /// A scene that is mirrored or turned gives the same answers, mirrored or turned.
    Symmetry,
}

/// A tick that broke an invariant.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub invariant: Invariant,
    /// The tick in its scene.
    pub tick: usize,
    /// Its details.
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
