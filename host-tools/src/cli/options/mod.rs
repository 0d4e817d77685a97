//! Options that several subcommands share: the terrain, its place and scale, its surface, the
//! device.

pub mod device;
pub mod events;
pub mod exaggeration;
pub mod input;
pub mod level;
pub mod placing;
pub mod recording;
pub mod rendering;
pub mod scale;
pub mod steering;
pub mod surface;
pub mod terrain_file;
