//! The result of one tick of the contact.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::grid::GridPoint;
use crate::terrain::TileIndex;

/// State of the proxy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ContactState {
    /// The HIP has not been above the surface yet: no force.
    #[default]
    Unseeded,
    /// The proxy is free: it is at the HIP, or on its path there.
    Free,
    /// The proxy is on the surface and the HIP below it.
    Touching,
    /// The surface under the proxy has ended: the last force fades out.
    Releasing,
}

/// The result of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactOutput {
    /// State of the proxy.
    pub state: ContactState,
    /// Position of the proxy.
    pub proxy: GridPoint,
    /// Vector from the HIP to the proxy in cells, times the edge fade: the extension of the spring.
    /// Zero unless touching or releasing.
    pub displacement: Vec3,
    /// True if the tick completed the work for this HIP with the stored tiles.
    pub converged: bool,
    /// A missing tile that the tick needed: with it the result may differ.
    pub missing_tile: Option<TileIndex>,
    /// Work units spent; more than [`super::WORK_PER_TICK`] is a fault.
    pub work: u32,
}
