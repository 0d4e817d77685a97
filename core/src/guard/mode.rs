//! The steps between off and on.

use serde::{Deserialize, Serialize};

/// Progress of arming. Amplifiers are on in `Ramping`, `Armed` and
/// `Fading`, and in no other.
///
/// ```text
///            arm                  switch pressed           small force for 0.1 s
/// Disarmed ───────▶ Requested ───────────────▶ Confirming ──────────────▶ Ramping
///    ▲                  ▲            let go         │                        │ 2 s
///    │                  └───────────────────────────┘                        ▼
///    │  0.1 s                                                              Armed
///    └──────────── Fading ◀──────────────── disarm, goodbye ─────────────────┘
/// ```
///
/// From every one of them a fault leads to `Disarmed` within the tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Off. Where every boot begins.
    #[default]
    Disarmed,
    /// The host has asked to arm; waits for the dead-man switch to be pressed.
    Requested,
    /// The switch was pressed; waits for a small force on consecutive ticks.
    Confirming,
    /// On; force comes in.
    Ramping,
    /// On.
    Armed,
    /// On; force goes out.
    Fading,
}

impl Mode {
    /// The modes that may follow this one.
    #[must_use]
    pub const fn exits(self) -> &'static [Self] {
        match self {
            Self::Disarmed => &[Self::Requested],
            Self::Requested => &[Self::Confirming, Self::Disarmed],
            Self::Confirming => &[Self::Ramping, Self::Requested, Self::Disarmed],
            Self::Ramping => &[Self::Armed, Self::Fading, Self::Disarmed],
            Self::Armed => &[Self::Fading, Self::Disarmed],
            Self::Fading => &[Self::Disarmed],
        }
    }

    /// Returns true if the amplifiers are on.
    #[must_use]
    pub const fn drives(self) -> bool {
        matches!(self, Self::Ramping | Self::Armed | Self::Fading)
    }
}
