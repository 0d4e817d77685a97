//! The result of one tick of the contact.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::grid::GridPoint;
use crate::terrain::TileIndex;

/// State of the proxy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ContactState {
    /// The HIP has not been seen above the surface yet: no force.
    #[default]
    Unseeded,
    /// The proxy is free: it is where the HIP is, or on its way there.
    Free,
    /// The proxy is on the surface and the HIP below it.
    Touching,
    /// The surface that the proxy was on has come to an end: the last force fades
    /// away.
    Releasing,
}

/// One tick's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactOutput {
    /// State of the proxy.
    pub state: ContactState,
    /// Position of the proxy.
    pub proxy: GridPoint,
    /// From the HIP to the proxy in cells, times the boundary fade: what the spring
    /// stretches by. Zero unless touching or fading.
    pub displacement: Vec3,
    /// Returns true if the tick did all there was to do for this HIP, with the tiles that are here.
    pub converged: bool,
    /// A tile that the tick looked for and that is not here: with it the answer may be another.
    pub missing_tile: Option<TileIndex>,
    /// Units of work spent; more than [`super::WORK_PER_TICK`] would be a fault.
    pub work: u32,
}
