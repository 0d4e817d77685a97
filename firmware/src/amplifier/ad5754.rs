//! A quad converter on SPI with bipolar outputs, ±10 V: AD5754R and its
//! 12- and 14-bit relatives (Analog Devices, data sheet rev. G).
//!
//! The pins BIN/2sCOMP (two's complement) and LDAC (each write takes effect at once) are tied to
//! ground; CLR is connected to the chip's reset. A frame has 24 bits: read or write in bit 23, the
//! register in bits 21-19, the channel in bits 18-16, then the value. Outputs A, B and C command
//! axes 1 to 3; D stays powered down.
//!
//! The converter sends a requested register during the next frame. Each tick therefore requests one
//! register before it writes the three commands, and compares the answer with the first of them. A
//! register with another value than was written means that the converter lost its supply, or that a
//! wire to it is broken.

use super::CurrentOutputs;

/// Registers, as bits of a frame's first byte.
const DATA: u8 = 0b000 << 3;
const RANGE: u8 = 0b001 << 3;
const POWER: u8 = 0b010 << 3;
/// Reads a register instead of writing it.
const READ: u8 = 1 << 7;
/// The channel number that addresses all channels.
const ALL: u8 = 0b100;
/// ±10 V.
const BIPOLAR_10_V: u16 = 0b100;
/// Channels A, B and C on, and the reference.
const POWER_UP: u16 = 0b1_0111;
/// Bits of a register that are compared. Of the range: all its bits. Of the power register: the
/// written bits; bit 5, set after a thermal shutdown; and bits 10 to 7, set if the outputs of
/// channels D to A are overloaded. Bit 6 has no meaning.
const RANGE_BITS: u16 = 0b111;
const POWER_BITS: u16 = 0b111_1011_1111;
/// Number of registers that are read in turn: the ranges of A, B and C, the power register, the
/// codes.
const REGISTERS: u8 = 7;
/// Time for the part to power up its outputs, µs: twice the minimum of the data sheet before the
/// first code is written.
const POWER_UP_US: u32 = 20;

/// The bus to a converter: it sends frames.
pub trait FrameBus {
    /// Sends a frame of three bytes with SYNC low, sets SYNC high even after a failure (the part
    /// ignores an incomplete frame) and returns the bytes received meanwhile. SYNC is high for at
    /// least 200 ns between two frames: the part needs 100 ns after a write and 200 ns after a
    /// read. The part clocks data in on the falling edge (mode 1), at 30 MHz at most; its output is
    /// valid 40 ns after the rising edge, so a frame has 10 MHz at most.
    ///
    /// A failure is not reported here: the bus reports it through
    /// [`GuardInputs::hardware_failed`](crate::board::GuardInputs), which switches off.
    fn send(&mut self, frame: [u8; 3]) -> [u8; 3];

    /// Waits for at least `us` microseconds, a few tens. Called at start-up only.
    fn pause_us(&mut self, us: u32);

    /// Receives true if all registers read back as they were written, for
    /// [`GuardInputs::outputs_not_as_set`](crate::board::GuardInputs).
    fn report_state(&mut self, as_set: bool);
}

/// The converter on a bus of its own.
pub struct Ad5754<B> {
    bus: B,
    /// Codes as last written.
    codes: [u16; 3],
    /// The register that is read next, below [`REGISTERS`].
    next_register: u8,
    /// Number of correct readings in a row, up to [`REGISTERS`].
    correct_readings: u8,
}

impl<B: FrameBus> Ad5754<B> {
    /// Creates a converter that has not been set up.
    pub const fn new(bus: B) -> Self {
        Self {
            bus,
            codes: [0; 3],
            next_register: 0,
            correct_readings: 0,
        }
    }

    // Not inlined: a frame takes microseconds, so the cost of a call is negligible, and a copy of
    // the transfer at each of seven places takes 3 kB of flash.
    #[inline(never)]
    fn write(&mut self, head: u8, value: u16) -> u16 {
        let [high, low] = value.to_be_bytes();
        let [_, high, low] = self.bus.send([head, high, low]);
        u16::from_be_bytes([high, low])
    }

    /// Writes the settings: zero to every channel, then the range, then power.
    fn set_up(&mut self) {
        self.write(DATA | ALL, 0);
        self.codes = [0; 3];
        self.write(RANGE | ALL, BIPOLAR_10_V);
        self.write(POWER, POWER_UP);
    }

    /// Returns the head of the register that is read next, its compared bits, and their expected
    /// value.
    fn expected(&self) -> (u8, u16, u16) {
        let [a, b, c] = self.codes;
        match self.next_register {
            0 => (RANGE, RANGE_BITS, BIPOLAR_10_V),
            1 => (RANGE | 1, RANGE_BITS, BIPOLAR_10_V),
            2 => (RANGE | 2, RANGE_BITS, BIPOLAR_10_V),
            3 => (POWER, POWER_BITS, POWER_UP),
            4 => (DATA, u16::MAX, a),
            5 => (DATA | 1, u16::MAX, b),
            _ => (DATA | 2, u16::MAX, c),
        }
    }
}

impl<B: FrameBus> CurrentOutputs for Ad5754<B> {
    fn prepare(&mut self) {
        self.set_up();
        self.bus.pause_us(POWER_UP_US);
    }

    /// Sets up a converter that did not read back correctly. It may share the supply of the power
    /// stages and has then lost its settings. The next frame is sent in the next tick, at least 100
    /// µs later, so no wait is needed.
    fn maintain(&mut self) {
        if self.correct_readings == 0 {
            self.set_up();
        }
    }

    fn are_as_set(&self) -> bool {
        self.correct_readings == REGISTERS
    }

    /// Sends four frames: one that requests a register, and the three commands. The answer arrives
    /// with the first command.
    fn set(&mut self, fractions: [f32; 3]) {
        let (head, bits, expected) = self.expected();
        self.write(READ | head, 0);
        let [a, b, c] = fractions.map(bipolar_code);
        let found = self.write(DATA, a);
        self.write(DATA | 1, b);
        self.write(DATA | 2, c);
        self.codes = [a, b, c];
        self.next_register = if self.next_register + 1 < REGISTERS {
            self.next_register + 1
        } else {
            0
        };
        self.correct_readings = if found & bits == expected {
            REGISTERS.min(self.correct_readings + 1)
        } else {
            0
        };
        self.bus.report_state(self.correct_readings == REGISTERS);
    }
}

/// Returns the code for `fraction` of ±10 V, -1..=1, in two's complement. Rounded to the nearest,
/// with an error of at most half a code (0.15 mV); the converter's full scale is one code below 10
/// V.
#[must_use]
pub fn bipolar_code(fraction: f32) -> u16 {
    // The cast saturates, and converts NaN to zero.
    let scaled = fraction * 32_768.0;
    let rounded = scaled + if scaled < 0.0 { -0.5 } else { 0.5 };
    (rounded as i16).cast_unsigned()
}

#[cfg(test)]
#[path = "ad5754_tests.rs"]
mod tests;
