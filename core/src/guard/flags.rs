//! Blockers of arming and reasons for reduced output: two sets of
//! named bits. Neither is a fault.

use bitflags::bitflags;
use serde::{Deserialize, Serialize};

bitflags! {
    /// Reasons for which the amplifiers are off. The bits are stable.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub struct Blockers: u16 {
        /// There is no calibration record.
        const NO_CALIBRATION = 1 << 0;
        /// The arm has not been put into its zero pose since power-up.
        const NOT_ZEROED = 1 << 1;
        /// No scene is loaded.
        const NO_SCENE = 1 << 2;
        /// The scene is a replay: the HIP follows points of the host, not the arm.
        const REPLAY = 1 << 3;
        /// A fault is latched.
        const FAULT_LATCHED = 1 << 4;
        /// The emergency stop is pressed, or its wire is broken.
        const EMERGENCY_STOP = 1 << 5;
        /// The encoders or amplifiers report that they cannot work.
        const HARDWARE = 1 << 6;
        /// The joints' readings exceed their limits.
        const OUTSIDE_LIMITS = 1 << 7;
        /// The watchdog is not being fed.
        const WATCHDOG_NOT_LIVE = 1 << 8;
        /// The host has not requested arming, or has requested disarming.
        const HOST_DISARMED = 1 << 9;
        /// The dead-man switch was held when arming was requested: it must be released first.
        const DEAD_MAN_STILL_HELD = 1 << 10;
        /// The dead-man switch is not held.
        const DEAD_MAN_RELEASED = 1 << 11;
        /// The force must be small before arming, and is not.
        const FORCE_TOO_LARGE = 1 << 12;
        /// An amplifier reports that it is not ready, or its ready line is broken.
        const AMPLIFIER_NOT_READY = 1 << 13;
        /// A converter's settings do not read back as they were written.
        const OUTPUTS_NOT_AS_SET = 1 << 14;
    }
}

bitflags! {
    /// Reasons for a force below that of the scene. The bits are stable.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub struct Limits: u16 {
        /// The force was above the device's limit.
        const FORCE_CLAMPED = 1 << 0;
        /// The force would have changed faster than its rate limit.
        const SLEW_LIMITED = 1 << 1;
        /// A motor current was above its peak.
        const CURRENT_LIMITED = 1 << 2;
        /// The current of a warm motor was above its derated limit.
        const THERMAL_DERATED = 1 << 3;
        /// The tip moves faster than the speed limit.
        const SPEED_LIMITED = 1 << 4;
        /// The force ramps up after arming.
        const RAMPING = 1 << 5;
        /// The force ramps down before disarming.
        const FADING = 1 << 6;
        /// A tile that may be needed here has not arrived yet.
        const TERRAIN_MISSING = 1 << 7;
        /// The force ramps down at the edge of the surface, or up after a wait.
        const EDGE_FADING = 1 << 8;
        /// The clutch is open: there is no force, and the HIP stays where it is over the terrain.
        const CLUTCH_OPEN = 1 << 9;
        /// The clutch opens or closes, or a placement changes under the hand: the force ramps.
        const CLUTCH_MOVES = 1 << 10;
        /// The clutch is held by the board's clutch input.
        const CLUTCH_INPUT = 1 << 11;
        /// Damping dissipates the energy leak of the sampled wall.
        const ENERGY_DISSIPATED = 1 << 12;
        /// The surface under the proxy is the coarse fallback, or blends from it to the tile.
        const TERRAIN_COARSE = 1 << 13;
    }
}

impl Blockers {
    /// Blockers that only the user or the host can clear: an arm command waits for them.
    pub const BY_HAND: Self = Self::HOST_DISARMED
        .union(Self::DEAD_MAN_STILL_HELD)
        .union(Self::DEAD_MAN_RELEASED)
        .union(Self::FORCE_TOO_LARGE);

    /// Returns the name of each set bit, with its meaning and remedy.
    pub fn meanings(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.iter_names().map(|(name, bit)| (name, bit.meaning()))
    }

    /// Returns the meaning and the remedy of the lowest set bit.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        let lowest = Self::from_bits_retain(self.bits() & self.bits().wrapping_neg());
        match lowest {
            Self::NO_CALIBRATION => "there is no calibration record: calibrate the arm",
            Self::NOT_ZEROED => "the joints' positions are unknown: put the arm into its zero pose",
            Self::NO_SCENE => "no scene is loaded: run a terrain",
            Self::REPLAY => "a trajectory is being replayed: end it first",
            Self::FAULT_LATCHED => "a fault is latched: remove its cause, then clear it",
            Self::EMERGENCY_STOP => "the emergency stop is pressed, or its wire is broken",
            Self::HARDWARE => "the encoders or amplifiers cannot work: check supply and cables",
            Self::OUTSIDE_LIMITS => "the joints' readings exceed their limits: zero the arm again",
            Self::WATCHDOG_NOT_LIVE => "the watchdog is not being fed: a task on the board hangs",
            Self::HOST_DISARMED => "the host has not requested arming",
            Self::DEAD_MAN_STILL_HELD => "the dead-man switch is held: release it, then press it",
            Self::DEAD_MAN_RELEASED => "the dead-man switch is not held: press it",
            Self::FORCE_TOO_LARGE => "the tip is inside the terrain: lift it off",
            Self::AMPLIFIER_NOT_READY => {
                "an amplifier is not ready: check supplies, fault lights and ready wires"
            }
            Self::OUTPUTS_NOT_AS_SET => {
                "the converter reads back wrong settings: check its supply and its wires"
            }
            _ => "",
        }
    }
}

impl Limits {
    /// Returns the name and meaning of each set bit.
    pub fn meanings(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.iter_names().map(|(name, bit)| (name, bit.meaning()))
    }

    /// Returns the meaning of the lowest set bit.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        let lowest = Self::from_bits_retain(self.bits() & self.bits().wrapping_neg());
        match lowest {
            Self::FORCE_CLAMPED => "the force is at the device's limit",
            Self::SLEW_LIMITED => "the force changes at its maximum rate",
            Self::CURRENT_LIMITED => "a motor is at its peak current",
            Self::THERMAL_DERATED => "a motor is warm: its current is reduced",
            Self::SPEED_LIMITED => "the tip is too fast for the full force",
            Self::RAMPING => "the force rises after arming",
            Self::FADING => "the force ramps down before disarming",
            Self::TERRAIN_MISSING => "terrain that may be touched here has not arrived yet",
            Self::EDGE_FADING => {
                "the force ramps down at the edge of the surface, or up after a late tile"
            }
            Self::CLUTCH_OPEN => "the clutch is open: no force",
            Self::CLUTCH_MOVES => {
                "the clutch opens or closes, or the placement changes under the hand: the force ramps"
            }
            Self::CLUTCH_INPUT => "the clutch switch at the board is held",
            Self::ENERGY_DISSIPATED => {
                "the surface is damped to dissipate the energy leak of the sampled wall"
            }
            Self::TERRAIN_COARSE => "the coarse fallback is rendered until the tile arrives",
            _ => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_has_a_name_and_a_meaning() {
        for (name, meaning) in Blockers::all().meanings().chain(Limits::all().meanings()) {
            assert!(!name.is_empty() && !meaning.is_empty(), "{name}");
        }
        assert_eq!(Blockers::all().meanings().count(), 15);
        assert_eq!(Limits::all().meanings().count(), 14);
        assert_eq!(Blockers::empty().meaning(), "");
    }
}
