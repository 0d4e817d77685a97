//! Rice codes whose parameter follows the mean of the coded numbers.

use super::bits::{BitReader, BitWriter};

/// Number of zeros that precede a number of 32 bits.
const MAX_ZEROS: u32 = 20;
/// Maximum parameter.
pub(super) const MAX_PARAMETER: u32 = 27;
/// Bits of the mean's divisor: it follows some sixteen numbers.
const MEAN_SHIFT: u32 = 4;
/// Maximum bits of a run's length after the first: more than a tile's samples need.
const MAX_RUN_BITS: u32 = 15;

/// State of the parameter.
pub(super) struct Rice {
    /// Sixteen times the mean.
    sum: u32,
}

impl Rice {
    pub(super) const fn new(parameter: u32) -> Self {
        Self {
            sum: 1 << (parameter + MEAN_SHIFT),
        }
    }

    #[inline]
    fn parameter(&self) -> u32 {
        31 - ((self.sum >> MEAN_SHIFT) | 1).leading_zeros()
    }

    #[inline]
    fn update_mean(&mut self, u: u32) {
        // At most 2^31 + 2^27.
        self.sum = self.sum - (self.sum >> MEAN_SHIFT) + u.min(1 << MAX_PARAMETER);
    }

    /// Reads a difference.
    #[inline]
    pub(super) fn read(&mut self, bits: &mut BitReader<'_>) -> i32 {
        let parameter = self.parameter();
        let zeros = bits.zeros(MAX_ZEROS);
        let u = match zeros {
            MAX_ZEROS => bits.number(32),
            _ => (zeros << parameter) | bits.number(parameter),
        };
        self.update_mean(u);
        (u >> 1) as i32 ^ -((u & 1) as i32)
    }

    /// Writes a difference.
    pub(super) fn write(&mut self, difference: i32, bits: &mut BitWriter<'_>) -> Option<()> {
        let u = ((difference << 1) ^ (difference >> 31)) as u32;
        let parameter = self.parameter();
        let zeros = u >> parameter;
        if zeros < MAX_ZEROS {
            bits.number(1, zeros + 1)?;
            bits.number(u & ((1 << parameter) - 1), parameter)?;
        } else {
            bits.number(0, MAX_ZEROS)?;
            bits.number(u, 32)?;
        }
        self.update_mean(u);
        Some(())
    }
}

/// Reads the length of a run, at least one.
#[inline(never)]
pub(super) fn read_run(bits: &mut BitReader<'_>) -> u32 {
    let zeros = bits.zeros(MAX_RUN_BITS);
    (1 << zeros) | bits.number(zeros)
}

/// Writes the length of a run of a tile's samples.
pub(super) fn write_run(length: u32, bits: &mut BitWriter<'_>) -> Option<()> {
    let zeros = length.max(1).ilog2();
    bits.number(1, zeros + 1)?;
    bits.number(length & ((1 << zeros) - 1), zeros)
}
