//! A quad converter on SPI with bipolar outputs, ±10 V: AD5754R and its
//! 12- and 14-bit relatives (Analog Devices, data sheet rev. G).
//!
//! The BIN/2sCOMP pin is tied to ground (two's complement) and LDAC too (each
//! write takes effect at once); CLR is tied high. A frame has 24 bits: the register in bits 21-19,
//! the channel in bits 18-16, then the value. Outputs A, B and C command axes 1
//! to 3; D stays powered down.

use super::CurrentOutputs;

/// Registers, where they are in a frame's first byte.
const DATA: u8 = 0b000 << 3;
const RANGE: u8 = 0b001 << 3;
const POWER: u8 = 0b010 << 3;
/// The channel that stands for all.
const ALL: u8 = 0b100;
/// ±10 V.
const BIPOLAR_10_V: u16 = 0b100;
/// Channels A, B and C on, and the reference.
const POWER_UP: u16 = 0b1_0111;

/// The way to a converter: it sends frames.
pub trait FrameBus {
    /// Sends a frame of three bytes with SYNC low, and lets SYNC rise whatever happened:
    /// the part ignores a frame that was cut short. The part clocks data in on the
    /// falling edge (mode 1), at 30 MHz at most.
    ///
    /// A failure is not told here: the bus reports it through
    /// [`Sense::hardware_failed`](crate::board::Sense), which switches off.
    fn send(&mut self, frame: [u8; 3]);
}

/// The converter behind a bus of its own.
pub struct Ad5754<B>(pub B);

impl<B: FrameBus> Ad5754<B> {
    fn write(&mut self, head: u8, value: u16) {
        let [high, low] = value.to_be_bytes();
        self.0.send([head, high, low]);
    }
}

impl<B: FrameBus> CurrentOutputs for Ad5754<B> {
    /// Writes zero to every channel, then the range of ±10 V, then power. A converter
    /// that is powered with the power stages has forgotten all of it. The outputs may
    /// take 10 µs to settle afterwards.
    fn prepare(&mut self) {
        self.write(DATA | ALL, 0);
        self.write(RANGE | ALL, BIPOLAR_10_V);
        self.write(POWER, POWER_UP);
    }

    fn set(&mut self, fractions: [f32; 3]) {
        for (channel, fraction) in (0..).zip(fractions) {
            self.write(DATA | channel, bipolar_code(fraction));
        }
    }
}

/// The code for `fraction` of ±10 V, -1..=1, in two's complement. Rounded to the
/// nearest, at most half a code (0.15 mV) off; full scale is one code short of
/// 10 V, as the converter has it.
#[must_use]
pub fn bipolar_code(fraction: f32) -> u16 {
    // The cast saturates, and turns not-a-number into zero.
    let scaled = fraction * 32_768.0;
    let rounded = scaled + if scaled < 0.0 { -0.5 } else { 0.5 };
    (rounded as i16).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::amplifier::Off;
    use crate::board::{Amplifiers, EnabledAmplifiers};
    use core::cell::RefCell;
    use core::convert::Infallible;
    use embedded_hal::digital::{self, OutputPin};
    use std::rc::Rc;
    use std::vec::Vec;

    /// The frames that were sent.
    #[derive(Clone, Default)]
    struct Wires(Rc<RefCell<Vec<[u8; 3]>>>);

    impl FrameBus for Wires {
        fn send(&mut self, frame: [u8; 3]) {
            self.0.borrow_mut().push(frame);
        }
    }

    /// An enable pin that nobody looks at.
    struct Enable;

    impl digital::ErrorType for Enable {
        type Error = Infallible;
    }

    impl OutputPin for Enable {
        fn set_low(&mut self) -> Result<(), Infallible> {
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }

    #[test]
    fn it_is_zero_before_it_has_a_range_and_has_one_before_power() {
        let wires = Wires::default();
        let off = Off::new(Ad5754(wires.clone()), Enable, 5.0);
        let set_up = [[0x04, 0x00, 0x00], [0x0C, 0x00, 0x04], [0x10, 0x00, 0x17]];
        let zero = [[0, 0, 0], [1, 0, 0], [2, 0, 0]];
        assert_eq!(wires.0.take(), [set_up, zero].concat());
        // And again, whenever the power stages come on.
        let _on = off.enable();
        assert_eq!(wires.0.take(), [set_up, zero].concat());
    }

    #[test]
    fn currents_become_three_frames_one_a_channel() {
        let wires = Wires::default();
        let converter = Ad5754(wires.clone());
        let mut on = Off::new(converter, Enable, 5.0).enable();
        wires.0.take();
        on.write([2.5, -2.5, f32::NAN]);
        let frames = wires.0.take();
        assert_eq!(
            frames,
            [[0x00, 0x40, 0x00], [0x01, 0xC0, 0x00], [0x02, 0x00, 0x00]]
        );
        let _off = on.disable();
        assert_eq!(wires.0.take(), [[0, 0, 0], [1, 0, 0], [2, 0, 0]]);
    }

    #[test]
    fn codes_are_nearest_and_saturate() {
        assert_eq!(bipolar_code(0.0), 0);
        assert_eq!(bipolar_code(1.0), 0x7FFF);
        assert_eq!(bipolar_code(-1.0), 0x8000);
        assert_eq!(bipolar_code(2.0), 0x7FFF);
        assert_eq!(bipolar_code(f32::NAN), 0);
        for code in -32_768..=32_767_i32 {
            for off in [-0.4, 0.0, 0.4] {
                let fraction = (f64::from(code) + off) / 32_768.0;
                let nearest = (code as i16).cast_unsigned();
                assert_eq!(bipolar_code(fraction as f32), nearest, "{code} {off}");
            }
        }
    }
}
