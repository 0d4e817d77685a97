//! The motors' temperatures as words in RAM that survives the reset.
//!
//! A reset does not cool a motor. Ten times a second the haptic interrupt writes a copy of the
//! temperatures (`MotorLog`) to memory that start-up does not clear, alternating between two
//! places. A reset during a write damages that copy, and the other one is still valid. The next
//! start uses the newest valid copy ([`begin`]).
//!
//! A start without a valid copy, or after a power-up, assumes the maximum temperatures that
//! derating allows ([`Temperatures::HOT`]). The continuous current is then available at once and
//! the peak current after about a minute.
//!
//! ```text
//! words of a copy:   number   winding 1 2 3   housing 1 2 3 (f32, K)   CRC-32
//! ```

use hapterra_core::Vec3;
use hapterra_core::crc;
use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::rate::TickRate;
use hapterra_core::wire::status::ResetCause;

/// Words of a copy: a line of an H743's data cache.
pub const WORDS: usize = 8;
/// A copy.
pub type Words = [u32; WORDS];
/// Both copies.
pub type Copies = [Words; 2];

/// "HAPT", before the words in the checksum: a memory of zeros is no copy.
const MAGIC: u32 = 0x4841_5054;
/// Time between two copies, ms.
const EVERY_MS: u32 = 100;

/// Selects the time and the place of the next copy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotorLog {
    every: u32,
    ticks: u32,
    number: u32,
}

impl MotorLog {
    /// Creates the log of a loop at this rate, after the copy of [`begin`].
    pub(crate) fn new(rate: TickRate) -> Self {
        Self {
            every: rate.ticks(EVERY_MS),
            ticks: 0,
            number: 0,
        }
    }

    /// Updates with the temperatures after a tick. Returns a copy and its index if one is due.
    pub(crate) fn tick(&mut self, temperatures: &Temperatures) -> Option<(usize, Words)> {
        self.ticks += 1;
        if self.ticks < self.every {
            return None;
        }
        self.ticks = 0;
        self.number = self.number.wrapping_add(1);
        let copy = (self.number & 1) as usize;
        Some((copy, encode(self.number, temperatures)))
    }
}

/// Returns the assumed temperatures of the motors, from the cause of the reset and the RAM's
/// content, and the RAM's new content, which contains no older copy.
#[must_use]
pub fn begin(cause: ResetCause, found: &Copies) -> (Temperatures, Copies) {
    let stored = match cause {
        // After a power-up the RAM's content is random, and the time without power is unknown.
        ResetCause::PowerOn | ResetCause::Unknown => None,
        ResetCause::Pin | ResetCause::Software | ResetCause::Watchdog | ResetCause::BrownOut => {
            newest(found).and_then(Temperatures::after_reset)
        }
    };
    let temperatures = stored.unwrap_or(Temperatures::HOT);
    (temperatures, [encode(0, &temperatures), [0; WORDS]])
}

/// Returns the newest valid copy.
fn newest(copies: &Copies) -> Option<Temperatures> {
    let [first, second] = copies.each_ref().map(decode);
    match (first, second) {
        (Some((a, first)), Some((b, second))) => {
            let is_first_newer = a.wrapping_sub(b) < u32::MAX / 2;
            Some(if is_first_newer { first } else { second })
        }
        (one, other) => one.or(other).map(|(_, temperatures)| temperatures),
    }
}

fn encode(number: u32, temperatures: &Temperatures) -> Words {
    let [a, b, c] = temperatures.winding_k.to_array().map(f32::to_bits);
    let [d, e, f] = temperatures.housing_k.to_array().map(f32::to_bits);
    let words = [number, a, b, c, d, e, f];
    [number, a, b, c, d, e, f, check_sum(&words)]
}

fn decode(copy: &Words) -> Option<(u32, Temperatures)> {
    let [words @ .., check] = copy;
    if check_sum(words) != *check {
        return None;
    }
    let [number, a, b, c, d, e, f] = *words;
    let three = |words: [u32; 3]| Vec3::from_array(words.map(f32::from_bits));
    let temperatures = Temperatures {
        winding_k: three([a, b, c]),
        housing_k: three([d, e, f]),
    };
    Some((number, temperatures))
}

fn check_sum(words: &[u32; WORDS - 1]) -> u32 {
    let [a, b, c, d, e, f, g] = *words;
    let summed = [MAGIC, a, b, c, d, e, f, g].map(u32::to_le_bytes);
    crc::sum(summed.as_flattened())
}

#[cfg(test)]
mod tests;
