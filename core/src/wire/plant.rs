//! The emulated board's second line: encoders and switches in, amplifiers out.
//!
//! On this line the virtual Phantom takes the place of encoder timers and
//! amplifiers. Each tick is one exchange, in the same framing as the link.

use serde::{Deserialize, Serialize};

use crate::guard::GuardInputs;

/// Plant to board: what the encoders and switches say at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensed {
    /// The tick this is for.
    pub tick: u32,
    /// Encoders and switches.
    pub sense: GuardInputs,
}

/// Board to plant: what the amplifiers were given in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Currents {
    /// The tick these currents came from.
    pub tick: u32,
    /// Motor currents of the three axes, amperes.
    pub currents_a: [f32; 3],
    /// True if the amplifiers are enabled.
    pub enabled: bool,
    /// Length of the board's tick, ns.
    pub tick_ns: u32,
}
