//! The driver against a converter that answers, loses its settings or does not answer.

use core::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

use super::*;
use crate::amplifier::tests::Pin;
use crate::amplifier::{Off, On};
use crate::board::{Amplifiers, EnabledAmplifiers};

/// The converter at the other end of the wires.
#[derive(Default)]
struct Converter {
    /// The frames that were sent.
    frames: Vec<[u8; 3]>,
    range: [u16; 4],
    power: u16,
    data: [u16; 4],
    /// Register that the last frame requested.
    requested: u16,
    /// The converter does not answer.
    is_silent: bool,
    /// Last reported state.
    as_set: bool,
    paused_us: u32,
}

#[derive(Clone, Default)]
struct Wires(Rc<RefCell<Converter>>);

impl Wires {
    fn take_frames(&self) -> Vec<[u8; 3]> {
        core::mem::take(&mut self.0.borrow_mut().frames)
    }
}

impl FrameBus for Wires {
    fn send(&mut self, frame: [u8; 3]) -> [u8; 3] {
        let mut part = self.0.borrow_mut();
        part.frames.push(frame);
        let [head, high, low] = frame;
        let value = u16::from_be_bytes([high, low]);
        let back = core::mem::take(&mut part.requested);
        let channel = usize::from(head & 7);
        match (head & READ != 0, head & 0x38) {
            (true, DATA) => part.requested = part.data[channel],
            (true, RANGE) => part.requested = part.range[channel],
            (true, _) => part.requested = part.power,
            (false, DATA) if channel == 4 => part.data = [value; 4],
            (false, DATA) => part.data[channel] = value,
            (false, RANGE) => part.range = [value; 4],
            (false, _) => part.power = value,
        }
        let [high, low] = back.to_be_bytes();
        if part.is_silent {
            return [0xFF; 3];
        }
        [0, high, low]
    }

    fn pause_us(&mut self, us: u32) {
        self.0.borrow_mut().paused_us += us;
    }

    fn report_state(&mut self, as_set: bool) {
        self.0.borrow_mut().as_set = as_set;
    }
}

const SET_UP: [[u8; 3]; 3] = [[0x04, 0x00, 0x00], [0x0C, 0x00, 0x04], [0x10, 0x00, 0x17]];
const ZERO: [[u8; 3]; 3] = [[0, 0, 0], [1, 0, 0], [2, 0, 0]];

fn off() -> (Off<Ad5754<Wires>, Pin>, Wires, Pin) {
    let (wires, pin) = (Wires::default(), Pin::default());
    let off = Off::new(Ad5754::new(wires.clone()), pin.clone(), 5.0);
    (off, wires, pin)
}

/// Returns amplifiers that are on, after enough ticks at rest to read all registers.
fn on() -> (On<Ad5754<Wires>, Pin>, Wires, Pin) {
    let (mut off, wires, pin) = off();
    (0..7).for_each(|_| off.set_held_outputs([0.0; 3]));
    let on = off.enable();
    assert!(pin.is_high());
    wires.take_frames();
    (on, wires, pin)
}

#[test]
fn converter_has_range_and_zero_before_power() {
    let (_off, wires, _) = off();
    let read_range = [[0x88, 0, 0]];
    let expected = [&SET_UP[..], &read_range, &ZERO].concat();
    assert_eq!(wires.take_frames(), expected);
    assert_eq!(wires.0.borrow().paused_us, 20);
}

#[test]
fn three_currents_become_one_frame_per_channel() {
    let (mut on, wires, _) = on();
    on.write([2.5, -2.5, f32::NAN]);
    let frames = wires.take_frames();
    assert_eq!(
        frames[1..],
        [[0x00, 0x40, 0x00], [0x01, 0xC0, 0x00], [0x02, 0x00, 0x00]]
    );
    let _off = on.disable();
    assert_eq!(wires.take_frames()[1..], ZERO);
}

#[test]
fn every_register_is_read_back() {
    let (mut on, wires, _) = on();
    let mut requested = Vec::new();
    for _ in 0..7 {
        on.write([1.0, 2.0, 3.0]);
        requested.push(wires.take_frames()[0][0]);
        assert!(wires.0.borrow().as_set);
    }
    requested.sort_unstable();
    assert_eq!(requested, [0x80, 0x81, 0x82, 0x88, 0x89, 0x8A, 0x90]);
}

/// Safety: 20.
#[test]
fn enable_stays_low_until_all_registers_read_back() {
    for ticks in 0..10 {
        let (mut off, wires, pin) = off();
        wires.take_frames();
        (0..ticks).for_each(|_| off.set_held_outputs([0.0; 3]));
        let on = off.enable();
        // Start-up and the enable also read a register.
        assert_eq!(pin.is_high(), ticks >= 5, "after {ticks} ticks");
        assert_eq!(wires.0.borrow().as_set, pin.is_high());
        let _off = on.disable();
        assert!(!pin.is_high());
    }
}

/// Safety: images.
#[test]
fn lost_range_or_overload_is_reported_within_seven_ticks() {
    for lose in [
        |part: &mut Converter| part.range[2] = 0,
        |part: &mut Converter| part.power = 0,
        |part: &mut Converter| part.power |= 1 << 5,
        |part: &mut Converter| part.power |= 1 << 7,
        |part: &mut Converter| part.power |= 1 << 10,
    ] {
        let (mut on, wires, pin) = on();
        lose(&mut wires.0.borrow_mut());
        let reported = (1..=7).find(|_| {
            on.write([1.0, 2.0, 3.0]);
            !wires.0.borrow().as_set
        });
        let mut off = on.disable();
        assert!(reported.is_some());
        assert!(!pin.is_high());
        (0..20).for_each(|_| off.set_held_outputs([0.0; 3]));
        assert!(wires.0.borrow().as_set, "set up again");
        assert_eq!(wires.0.borrow().range, [4; 4]);
    }
}

#[test]
fn broken_wire_is_reported_at_once_and_blocks_enable() {
    let (mut on, wires, pin) = on();
    wires.0.borrow_mut().is_silent = true;
    on.write([1.0, 2.0, 3.0]);
    assert!(!wires.0.borrow().as_set);
    let mut off = on.disable();
    (0..50).for_each(|_| off.set_held_outputs([0.0; 3]));
    let _on = off.enable();
    assert!(!pin.is_high());
}

/// Safety: 19.
#[test]
fn held_outputs_are_written_disabled_and_zeroed_before_enable() {
    let (mut off, wires, pin) = off();
    (0..7).for_each(|_| off.set_held_outputs([0.0; 3]));
    wires.take_frames();
    off.set_held_outputs([0.5, -9.0, f32::NAN]);
    assert_eq!(
        wires.take_frames()[1..],
        [[0x00, 0x40, 0x00], [0x01, 0x80, 0x00], [0x02, 0x00, 0x00]]
    );
    off.set_held_outputs([0.0; 3]);
    assert_eq!(wires.take_frames()[1..], ZERO);
    off.set_held_outputs([1.0; 3]);
    wires.take_frames();
    let _on = off.enable();
    assert!(pin.is_high());
    assert_eq!(wires.take_frames()[1..], ZERO, "zero before the enable");
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
