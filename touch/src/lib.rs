#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! - `contact`: the public [`Contact`], a HIP on a terrain; `tick_loop`: the device's tick, which
//!   it calls, and the memory of its tiles; [`ticks`]: conversion of a path's times to ticks.
//! - `terrain`, `heights`: a height field and its source; `tile_cutter`, [`tile_heights`]: its
//!   tiles; [`tip`]: the height field under a ball; `scale`: millimetres and cells; `checks`: of a
//!   terrain.
//! - `surface_params`: the surface.
#![no_std]
#![forbid(unsafe_code)]

extern crate alloc;
#[cfg(test)]
extern crate std;

mod checks;
mod contact;
mod heights;
mod scale;
mod surface_params;
mod terrain;
mod tick_loop;
pub mod ticks;
mod tile_cutter;
pub mod tile_heights;
pub mod tip;

pub use checks::TerrainError;
pub use contact::{Contact, ContactError, RunError, State, Step, StepError};
pub use hapterra_core::contact::Friction;
pub use hapterra_core::force::{Damping, Material, Pattern, Shading, SurfaceParams, Texture};
pub use heights::{Block, Height, Heights, RowOrder, Unread};
pub use scale::{Scale, ScaleError};
pub use surface_params::{Surface, SurfaceError};
pub use terrain::Terrain;

#[cfg(test)]
mod tests;
