//! Scenes: a terrain, a path of the HIP, and how the tiles come.

pub mod hip_path;
pub mod judged;
pub mod materials;
pub mod on_materials;
pub mod recorded;
pub mod replayed;
pub mod run;
pub mod supply;
pub mod symmetry;
pub mod terrain;
pub mod twin;
