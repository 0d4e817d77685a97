//! The motors' temperatures as words in a RAM that survives the reset.
//!
//! A reset does not cool a motor. Ten times a second the haptic interrupt writes a copy
//! of the temperatures (`MotorLog`) where start-up does not clear the memory, into one
//! of two places by turns. A reset in the middle of a write damages that copy, and the
//! one before it is still whole. The next start takes the newest whole copy ([`begin`]).
//!
//! A start that finds none, or that follows a power-up, has no temperatures: it
//! takes them to be as hot as derating lets them become ([`Temperatures::HOT`]). That
//! leaves the continuous current at once and the peak current after about a minute.
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

/// "HAPT", ahead of the words in the check sum: a memory of zeros is no copy.
const MAGIC: u32 = 0x4841_5054;
/// Time between two copies, ms.
const EVERY_MS: u32 = 100;

/// Decides when the next copy is due, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotorLog {
    every: u32,
    ticks: u32,
    number: u32,
}

impl MotorLog {
    /// The log of a loop at this rate, after the copy that [`begin`] made.
    pub(crate) fn new(rate: TickRate) -> Self {
        Self {
            every: rate.ticks(EVERY_MS),
            ticks: 0,
            number: 0,
        }
    }

    /// Takes the temperatures after a tick. Returns a copy where one is due, and which of
    /// the two it is.
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

/// Takes why the board started and what its RAM holds. Returns what the motors are to
/// be taken for, and what the RAM is to hold from now on, so that nothing older is ever
/// found again.
#[must_use]
pub fn begin(cause: ResetCause, found: &Copies) -> (Temperatures, Copies) {
    let kept = match cause {
        // What a RAM holds after a power-up is chance, and how long the power was off is
        // not known.
        ResetCause::PowerOn | ResetCause::Unknown => None,
        ResetCause::Pin | ResetCause::Software | ResetCause::Watchdog | ResetCause::BrownOut => {
            newest(found).and_then(Temperatures::after_reset)
        }
    };
    let temperatures = kept.unwrap_or(Temperatures::HOT);
    (temperatures, [encode(0, &temperatures), [0; WORDS]])
}

/// The newest whole copy.
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
