//! Invariants of every tick, on any terrain, for any path of the HIP. They are checked in f64, by
//! methods independent of the product, in `tests/tests/contact/properties.rs`, `quick_soak.rs` and `cargo
//! xtask soak`. `tests/tests/contact/oracles.rs` shows that each can fail.
//!
//! [`oracle`] lists the invariants in the order in which they are checked; [`material`] checks the
//! forces of a scene with materials. [`observed_tick`] is one tick as the oracle receives it.
//! `single_tick`, `proxy_position` and `tick_to_tick` check a tick, its proxy, and its change from
//! the tick before. [`surface`], [`crossing`] and [`descent`] are the terrain in f64. All lengths
//! are in cells.

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
    /// The result is finite, and the proxy is a valid position.
    Finite,
    /// The force is the spring's force, limited by the clamp.
    Clamp,
    /// The tick spends at most `WORK_PER_TICK` work units.
    Work,
    /// State, displacement and proxy agree: there is no force without a contact, a free proxy is at
    /// the HIP, and the force points to the proxy.
    Consistent,
    /// A tick that is repeated for the same HIP converges.
    Settles,
    /// In contact the proxy is on the surface.
    OnSurface,
    /// After a tick with work left, no path along the surface leads from the proxy nearer to the
    /// HIP.
    LocalMinimum,
    /// While a contact lasts, a path through ground and air joins the proxy with its last position,
    /// and is nowhere farther from the HIP than that position.
    Basin,
    /// With friction: after a tick with work left, the HIP lies inside the friction cone over the
    /// proxy, and on the cone if the proxy has slid.
    Cone,
    /// With friction: a proxy stays exactly where it is while the HIP lies inside its friction
    /// cone.
    Stuck,
    /// In contact the straight line from the proxy to the HIP leads into the ground: no contact
    /// pulls.
    HipBelow,
    /// While a contact lasts, the proxy is no farther from the HIP than its last position is.
    Descent,
    /// A contact begins at the first crossing of the HIP's path with the surface, and
    /// is no farther from the HIP than that.
    FirstCrossing,
    /// A HIP whose path crosses nothing stays free.
    Freedom,
    /// A proxy that moves through the air and does not wait for a tile makes progress, wherever the
    /// HIP moves ahead of it.
    Advances,
    /// No free HIP is below the surface.
    AboveSurface,
    /// No contact begins before the HIP was above the surface.
    SeenAbove,
    /// The proxy does not pass through a wall.
    Wall,
    /// The force fades in and out at a bounded rate.
    Fade,
    /// With shading: the force has the length of the unshaded one, along the smoothed normal.
    Shading,
    /// With texture: the force is the untextured one plus the relief's; it never pulls.
    Texture,
    /// On materials: the force is that of the active material, which changes gradually to that of
    /// the sample nearest to the proxy.
    Material,
    /// On materials: a proxy that slides over a plane trails the HIP by the distance that the
    /// friction of its last position holds.
    Slides,
    /// The same input has identical results, bit by bit.
    Repeatable,
    /// A scene shifted by whole cells has identical results, bit by bit.
    Shift,
    /// A small window that waits for tiles has identical results to one of the whole field.
    Window,
    /// A mirrored or turned scene has the same results, mirrored or turned.
    Symmetry,
}

/// A tick that broke an invariant.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// The invariant.
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
