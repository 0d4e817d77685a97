//! The comparator of a chip's supply (PVD), on its line of EXTI, and the cause of a chip's reset.
//!
//! Modelled by RM0440 (6.2.3, 15.5) and RM0433 (6.5.3, 20.6): PVDE, PLS and PVDO of PWR, and of
//! EXTI the rising edge, the mask and the pending bit of line 16. The hysteresis (100 mV) is not
//! modelled.

use std::collections::HashMap;

/// Voltage of a board's regulator, mV.
pub const NOMINAL_MV: u32 = 3_300;
/// The comparator's line of EXTI.
const LINE: u32 = 1 << 16;

/// Registers of a chip's comparator.
#[derive(Clone, Copy, Debug)]
pub struct Comparator {
    /// Control register, its enable bit, and the first of the level's three bits.
    pub control: (u32, u32, u32),
    /// Status register, and its bit for a low supply.
    pub status: (u32, u32),
    /// EXTI's rising edge, mask and pending registers.
    pub exti: [u32; 3],
    /// The levels, mV.
    pub levels_mv: [u32; 7],
    /// Its interrupt.
    pub interrupt: usize,
}

/// The supply of a chip, as measured by its comparator.
pub struct Supply {
    /// Its voltage, mV.
    pub mv: u32,
    was_low: bool,
}

impl Default for Supply {
    fn default() -> Self {
        Self {
            mv: NOMINAL_MV,
            was_low: false,
        }
    }
}

impl Supply {
    /// Returns true if the comparator is on and detects a low supply.
    #[must_use]
    pub fn is_low(&self, at: &Comparator, words: &HashMap<u32, u32>) -> bool {
        let (control, on, level) = at.control;
        let control = words.get(&control).copied().unwrap_or(0);
        let level = at.levels_mv.get((control >> level & 7) as usize);
        control & on != 0 && level.is_some_and(|level| self.mv < *level)
    }

    /// Updates the comparator. Returns true if the interrupt is asserted.
    pub fn follow(&mut self, at: &Comparator, words: &mut HashMap<u32, u32>) -> bool {
        let is_low = self.is_low(at, words);
        let rose = is_low && !self.was_low;
        self.was_low = is_low;
        let [rising, mask, pending] = at.exti;
        let has = |words: &HashMap<u32, u32>, register| {
            words.get(&register).copied().unwrap_or(0) & LINE != 0
        };
        if rose && has(words, rising) {
            *words.entry(pending).or_default() |= LINE;
        }
        has(words, pending) && has(words, mask)
    }
}

/// Cause of a chip's reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Power-up: memory is empty.
    PowerUp,
    /// The watchdog was not fed.
    Watchdog,
    /// The program requested it.
    Software,
    /// The supply was below the brown-out level, and memory kept its content.
    BrownOut,
}

/// The register with the flags of resets.
#[derive(Clone, Copy, Debug)]
pub struct ResetFlags {
    /// Its address.
    pub register: u32,
    /// The flags of a reset by power-up, watchdog, program and brown-out. Each reset also pulls the
    /// pin.
    pub of: [u32; 4],
    /// The bit that clears them all.
    pub clear: u32,
}

impl ResetFlags {
    /// Returns the register after a reset.
    #[must_use]
    pub const fn after(&self, cause: Reset) -> u32 {
        let [power_up, watchdog, software, brown_out] = self.of;
        match cause {
            Reset::PowerUp => power_up,
            Reset::Watchdog => watchdog,
            Reset::Software => software,
            Reset::BrownOut => brown_out,
        }
    }
}
