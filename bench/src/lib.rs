//! Run time against error: hapterra's contact and honest opponents on the same
//! terrain, under the same HIP, in the same run.
//!
//! - [`grid`] and [`path`]: the terrains and the paths of the HIP;
//! - [`haptics`]: what every variant is asked and answers;
//! - [`product`]: our own rules;
//! - [`baseline`]: the opponents, none of which is in the product;
//! - [`truth`]: the exact closest point in f64, which judges every answer;
//! - [`compare`]: all variants on one terrain, interleaved;
//! - [`continuity`]: how much the force changes from one tick to the next;
//! - [`effects`]: what friction, shading, texture and damping cost, and how exact they are;
//! - [`solver`]: one patch, and the square root, alone;
//! - [`state`]: what a tick can be doing, for counting instructions;
//! - [`streaming`]: terrain larger than memory and farther than the disk;
//! - [`stability`]: how stiff a surface may be, by trials on a virtual arm;
//! - [`report`]: the table, the CSV file, the picture;
//! - [`cli`]: the command `hapterra-lab`.

#![forbid(unsafe_code)]

pub mod baseline;
pub mod cli;
mod clock;
pub mod compare;
pub mod continuity;
pub mod effects;
pub mod grid;
pub mod haptics;
pub mod path;
pub mod product;
pub mod report;
pub mod solver;
pub mod stability;
pub mod state;
mod stats;
pub mod streaming;
pub mod truth;
