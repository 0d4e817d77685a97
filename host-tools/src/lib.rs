//! The host side of hapterra: from a terrain file to tiles on the link, and
//! the `hapterra` command.
//!
//! Read top to bottom, the modules follow the data:
//!
//! - [`heightfield`], a crate of its own: terrain files become one [`heightfield::Raster`];
//! - [`synth`]: terrains made by formula, for trials and tests;
//! - [`terrain`]: a raster at a scale, cut into tiles;
//! - [`named_surfaces`]: surfaces that an option can name;
//! - [`materials`]: classes of ground over a terrain, each with its surface;
//! - [`link`]: the terrain served to a device, tile by tile;
//! - [`serving`]: that session from its first message to its confirmed end;
//! - [`phantom`]: a virtual Phantom in the hand of a scripted user;
//! - [`stability`]: the stiffness above which sampling becomes unstable in a hand on that Phantom;
//! - [`quantity`]: numbers with units, as an option or a command states them;
//! - [`published`]: the paper's algorithm, for comparison;
//! - [`replay`]: a trajectory rendered in lock-step, and recordings;
//! - [`place`]: a terrain's position in front of the arm, and its size;
//! - [`steering`]: changes of the placement during a session;
//! - [`telemetry`]: the numbers that a device reports during a session;
//! - [`events`]: contacts, materials and marks as lines of JSON on a local socket;
//! - [`picture`]: sessions drawn as PNG files;
//! - [`view_feed`]: the same, live, for a viewer that never delays the loop;
//! - [`board`]: boards, debug probes, and the writing of images to chips;
//! - [`calibrate`]: measurements with ruler and scale, as a calibration record;
//! - [`bringup`]: the first power-up of a board and its arm, step by step;
//! - [`output`]: files that appear only when they are complete;
//! - [`cli`]: the `hapterra` command, one file for each subcommand.

#![forbid(unsafe_code)]

// Before all others: modules see the macros only if they are declared after it.
#[macro_use]
mod print_macros;
// Time-outs for the tests of all crates; each crate uses a part of them.
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
pub mod quantity;
pub mod replay;
pub mod serving;
pub mod stability;
pub mod steering;
pub mod synth;
pub mod telemetry;
pub mod terrain;
pub mod view_feed;
