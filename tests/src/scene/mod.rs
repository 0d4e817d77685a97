//! Scenes: a terrain, a path of the HIP, and the supply of tiles.

pub mod checked_run;
pub mod emulator_scene;
pub mod hip_path;
pub mod loop_replay;
pub mod material_checks;
pub mod materials;
pub mod metamorphic;
pub mod run;
pub mod symmetry;
pub mod terrain;
pub mod tile_supply;
