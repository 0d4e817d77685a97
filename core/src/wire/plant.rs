//! The emulated board's second line: encoders and switches in, amplifiers out.
//!
//! On this line the virtual Phantom takes the place of encoder timers and
//! amplifiers. Each tick is one exchange, in the same framing as the link.

use serde::{Deserialize, Serialize};

use crate::guard::GuardInputs;

/// Message from plant to board: the state of encoders and switches at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlantState {
    /// Number of the tick.
    pub tick: u32,
    /// Encoders and switches.
    pub sense: GuardInputs,
}

/// Message from board to plant: the commands of the amplifiers in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Currents {
    /// The tick of these currents.
    pub tick: u32,
    /// Motor currents of the three axes, amperes.
    pub currents_a: [f32; 3],
    /// True if the amplifiers are enabled.
    pub enabled: bool,
    /// Length of the board's tick, ns.
    pub tick_ns: u32,
}
