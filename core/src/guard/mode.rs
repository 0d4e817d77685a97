//! The modes between off and on.

use serde::{Deserialize, Serialize};

/// Progress of arming. The amplifiers are on only in `Ramping`, `Armed` and `Fading`.
///
/// ```text
///            arm                  switch pressed           small force for 0.1 s
/// Disarmed ───────▶ Requested ───────────────▶ Confirming ──────────────▶ Ramping
///    ▲                  ▲            let go         │                        │ 2 s
///    │                  └───────────────────────────┘                        ▼
///    │  0.1 s                                                              Armed
///    └──────────── Fading ◀──────────────── disarm, bye ─────────────────────┘
/// ```
///
/// From every mode a fault leads to `Disarmed` within the tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Off, the mode after every boot.
    #[default]
    Disarmed,
    /// The host has requested arming; waits for a press of the dead-man switch.
    Requested,
    /// The switch was pressed; waits for a small force on consecutive ticks.
    Confirming,
    /// On; the force ramps up.
    Ramping,
    /// On.
    Armed,
    /// On; the force fades out.
    Fading,
}

impl Mode {
    /// Returns the modes that may follow this one.
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
    pub const fn is_driving(self) -> bool {
        matches!(self, Self::Ramping | Self::Armed | Self::Fading)
    }
}
