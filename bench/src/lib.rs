//! Run time against error: hapterra's contact and other methods at their best, on the same terrain,
//! under the same HIP, in the same run.
//!
//! - [`grid`] and [`path`]: the terrains and the paths of the HIP;
//! - [`variant`]: the interface of every compared contact rule;
//! - [`product`]: the product's contact rule;
//! - [`baseline`]: the compared methods, which are not in the product;
//! - [`oracle`]: the exact closest point in f64, with which every result is compared;
//! - [`compare`]: all variants on one terrain, interleaved;
//! - [`continuity`]: the change of the force from one tick to the next;
//! - [`effects`]: cost and error of friction, shading, texture and damping;
//! - [`solver`]: one patch, and the square root, alone;
//! - [`tick_states`]: states of a tick, for counting instructions;
//! - [`streaming`]: terrain larger than memory and farther than the disk;
//! - [`stability`]: the largest stable stiffness, by trials on a virtual arm;
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
pub mod oracle;
pub mod path;
pub mod product;
pub mod report;
pub mod solver;
pub mod stability;
mod stats;
pub mod streaming;
pub mod tick_states;
pub mod variant;
