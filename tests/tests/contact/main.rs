//! The contact and its effects: forces, friction, texture, the ball, random scenes and their oracles.

mod friction;
mod fuzz_targets;
mod local_minima;
mod material_oracle;
mod oracles;
mod packed_tiles;
mod paper;
mod properties;
mod quick_soak;
mod regressions;
mod scenes_emulated;
mod shading;
mod soak_coverage;
mod texture;
mod tick_cost;
mod tip;
