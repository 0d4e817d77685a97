//! Conditions of the effects of a scene besides its surface parameters.

use crate::rate::TickRate;

/// Conditions of a scene's effects, besides its surface parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EffectContext {
    pub(crate) cell_mm: f32,
    pub(crate) rate: TickRate,
    /// Time from the start of a tick until its force acts, s.
    pub(crate) latency_s: f32,
    /// True if the scene follows an arm, not points.
    pub(crate) arm: bool,
}
