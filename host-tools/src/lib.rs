//! The host side of hapterra: from a terrain file to tiles on the link, and
//! the `hapterra` command.
//!
//! Read top to bottom, the modules follow the data:
//!
//! - [`heightfield`], a crate of its own: terrain files become one [`heightfield::Raster`];
//! - [`synth`]: terrains made by formula, for trying and testing;
//! - [`terrain`]: a raster at a scale, cut into tiles;
//! - [`named_surfaces`]: surfaces that an option can name;
//! - [`materials`]: classes of ground over a terrain, each with its surface;
//! - [`link`]: the terrain served to a device, tile by tile;
//! - [`serving`]: that session from its first line to an end that is known;
//! - [`phantom`]: a virtual Phantom in the hand of a scripted user;
//! - [`stability`]: how stiff a surface may be before a hand on that Phantom feels the ticks;
//! - [`published`]: the paper's algorithm, for comparison;
//! - [`replay`]: a trajectory rendered in lock-step, and recordings;
//! - [`place`]: where a terrain lies in front of the arm, and how large;
//! - [`steering`]: another view of the terrain while it is touched;
//! - [`telemetry`]: what a device reports while it is touched, in numbers;
//! - [`events`]: contacts, materials and marks as lines of JSON on a local socket;
//! - [`picture`]: sessions drawn as PNG files;
//! - [`view_feed`]: the same, live, to a viewer that never delays the loop;
//! - [`board`]: boards, probes, and images onto chips;
//! - [`calibrate`]: from ruler and scale to a calibration record;
//! - [`bringup`]: the first power-up of a board and its arm, step by step;
//! - [`output`]: files that appear only when they are complete;
//! - [`cli`]: the `hapterra` command, one file a subcommand.

#![forbid(unsafe_code)]

// Before all others: its macros hold from here on.
#[macro_use]
mod print_macros;
// What the tests of all crates wait with, of which each uses its part.
#[cfg(test)]
#[path = "../../tests/src/timeouts.rs"]
#[allow(dead_code, unreachable_pub)]
mod timeouts;

pub mod board;
pub mod bringup;
pub mod calibrate;
pub mod cli;
pub mod events;
pub mod link;
pub mod materials;
pub mod named_surfaces;
pub mod output;
pub mod phantom;
pub mod picture;
pub mod place;
pub mod published;
pub mod replay;
pub mod serving;
pub mod stability;
pub mod steering;
pub mod synth;
pub mod telemetry;
pub mod terrain;
pub mod view_feed;
