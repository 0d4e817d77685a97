//! The order in which outputs and enable pin are written.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use std::rc::Rc;
use std::string::{String, ToString};
use std::vec::Vec;

use embedded_hal::digital;

use super::*;

/// Writes in order: "on" and "off" for the pin, numbers for duties.
type Log = Rc<RefCell<Vec<String>>>;

/// An enable pin whose level and writes a test can read.
#[derive(Clone, Default)]
pub(super) struct Pin {
    level: Rc<Cell<bool>>,
    log: Log,
}

impl Pin {
    pub(super) fn is_high(&self) -> bool {
        self.level.get()
    }
}

impl digital::ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.level.set(false);
        self.log.borrow_mut().push("off".into());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.level.set(true);
        self.log.borrow_mut().push("on".into());
        Ok(())
    }
}

/// Outputs that are duty cycles of 1,000 counts.
struct Duties(Log);

impl CurrentOutputs for Duties {
    fn set(&mut self, fractions: [f32; 3]) {
        let codes = fractions.map(|fraction| duty_code(fraction, 1000).to_string());
        self.0.borrow_mut().extend(codes);
    }
}

fn amplifiers() -> (Off<Duties, Pin>, Log) {
    let pin = Pin::default();
    let log = pin.log.clone();
    let off = Off::new(Duties(log.clone()), pin, 5.0);
    assert_eq!(log.take(), ["off", "500", "500", "500"]);
    (off, log)
}

#[test]
fn enable_writes_zero_first_and_disable_switches_off_first() {
    let (off, log) = amplifiers();
    let mut on = off.enable();
    assert_eq!(log.take(), ["500", "500", "500", "on"]);
    on.write([1.0, -2.5, 0.0]);
    assert_eq!(log.take(), ["570", "325", "500"]);
    let _off = on.disable();
    assert_eq!(log.take(), ["off", "500", "500", "500"]);
}

#[test]
fn command_is_clamped_to_full_scale_for_any_input() {
    let (off, log) = amplifiers();
    let mut on = off.enable();
    log.take();
    on.write([1e30, f32::NEG_INFINITY, f32::NAN]);
    assert_eq!(log.take(), ["850", "150", "500"]);
}

#[test]
fn held_outputs_do_not_touch_the_enable_pin() {
    let (mut off, log) = amplifiers();
    off.set_held_outputs([1.0, -0.5, f32::NAN]);
    assert_eq!(log.take(), ["850", "325", "500"]);
    off.set_held_outputs([0.0; 3]);
    assert_eq!(log.take(), ["500", "500", "500"]);
}
