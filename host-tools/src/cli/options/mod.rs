//! Options that several subcommands share: which terrain file, how it feels,
//! which device, how to start the emulated board.

pub mod device;
pub mod emulated_board;
pub mod events;
pub mod exaggeration;
pub mod materials;
pub mod placing;
pub mod recorded;
pub mod rendering;
pub mod steering;
pub mod terrain_file;
pub mod texture;
