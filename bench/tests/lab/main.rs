//! The commands of `hapterra-lab`: their results that do not depend on a clock.

mod effects;
mod picture;
mod replay;
mod stability;
mod streaming;
mod synth;
