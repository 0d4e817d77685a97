//! The emulated board's second line: encoders in, amplifiers out.
//!
//! On this line the virtual Phantom takes the place of encoder timers and
//! amplifiers. Each tick is one exchange, in the same framing as the link.

use serde::{Deserialize, Serialize};

/// Plant to board: what the encoders read at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// The tick these counts are for.
    pub tick: u32,
    /// Encoder counts of the three axes.
    pub counts: [i32; 3],
}

/// Board to plant: what the amplifiers were given in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Currents {
    /// The tick these currents came from.
    pub tick: u32,
    /// Motor currents of the three axes, amperes.
    pub currents_a: [f32; 3],
    /// Whether the amplifiers are enabled.
    pub enabled: bool,
}
