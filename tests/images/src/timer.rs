//! A timer of the chips: counting up, driven by an encoder, or stopped.
//!
//! Modelled: CEN, URS, OPM and CKD of CR1, MMS of CR2 for CEN as output to other timers, the
//! encoder mode on both channels and the gated mode of SMCR, UG of EGR, the flags and interrupts of
//! the update and of the four compare matches, the input filters of CCMR1, CNT, PSC, ARR and the
//! compare registers. The timer's pins are in `shutdown`. Not modelled: counting down, repetition,
//! the other slave modes and triggers, capture, DMA, and every preload: writes take effect at once.

use crate::quadrature::{Filter, count};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
/// The counter.
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
/// The auto-reload register: the counter counts from 0 to its value.
pub const ARR: u32 = 0x2C;
/// Alternate functions: after a reset the break's pin is one of its sources.
const AF1: u32 = 0x60;
/// The first of four compare registers.
pub const CCR1: u32 = 0x34;

/// Bits of CR1.
const CEN: u32 = 1 << 0;
const URS: u32 = 1 << 2;
const OPM: u32 = 1 << 3;
/// CR2.MMS: CEN is the trigger output to other timers.
const TRIGGER_IS_CEN: (u32, u32) = (7 << 4, 1 << 4);
/// SMCR: the timer counts while its trigger is high; the trigger is ITR0.
const SMS_TS: u32 = 0x77;
const GATED: u32 = 5;
/// Bit of SR: the counter overflowed.
const UIF: u32 = 1 << 0;

/// One timer.
pub struct Timer {
    hz: u64,
    registers: [u32; 28],
    now_ns: u64,
    /// Remainder of the last count, in billionths of a clock.
    carry: u64,
    /// The level of ITR0.
    pub(crate) trigger: bool,
}

impl Timer {
    /// Creates a stopped timer with a kernel clock of `hz`.
    #[must_use]
    pub fn new(hz: u64) -> Self {
        let mut timer = Self {
            hz,
            registers: [0; 28],
            now_ns: 0,
            carry: 0,
            trigger: false,
        };
        timer.set(ARR, 0xFFFF);
        timer.set(AF1, 1);
        timer
    }

    /// Returns a register.
    #[must_use]
    pub fn get(&self, offset: u32) -> u32 {
        self.registers.get((offset / 4) as usize).map_or(0, |r| *r)
    }

    pub(crate) fn set(&mut self, offset: u32, value: u32) {
        if let Some(register) = self.registers.get_mut((offset / 4) as usize) {
            *register = value;
        }
    }

    /// Sets the count, as driven by an encoder.
    pub fn feed(&mut self, count: u16) {
        self.set(CNT, count.into());
    }

    /// Plays an encoder's two channels at the inputs, through their filters. Returns the counts:
    /// zero unless the timer is in encoder mode on both channels' edges.
    pub fn play(&mut self, ms: u64, levels: impl FnMut(f64) -> [bool; 2]) -> i32 {
        if self.get(SMCR) & 7 != 3 || self.get(CR1) & CEN == 0 {
            return 0;
        }
        let (divided, filters) = (self.get(CR1) >> 8 & 3, self.get(CCMR1));
        let filters = [4, 12].map(|at| Filter::of(filters >> at & 0xF, divided));
        let counted = count(filters, self.hz, ms, levels);
        let round = i64::from(self.get(ARR)) + 1;
        let now = (i64::from(self.get(CNT)) + i64::from(counted)).rem_euclid(round);
        self.set(CNT, now as u32);
        counted
    }

    /// Writes a register from the core.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32) {
        match offset {
            // Writing a zero clears a flag.
            SR => self.set(SR, self.get(SR) & (value | !mask)),
            EGR => {
                if value & 1 != 0 {
                    self.set(CNT, 0);
                    self.carry = 0;
                    let raised = if self.get(CR1) & URS == 0 { UIF } else { 0 };
                    self.set(SR, self.get(SR) | raised);
                }
            }
            _ => self.set(offset, self.get(offset) & !mask | value & mask),
        }
    }

    fn is_counting(&self) -> bool {
        let follows_encoder = matches!(self.get(SMCR) & 7, 1..=3);
        self.get(CR1) & CEN != 0 && !follows_encoder && self.is_gate_open()
    }

    /// Returns true unless the timer is gated and its trigger is low.
    #[must_use]
    pub fn is_gate_open(&self) -> bool {
        self.get(SMCR) & SMS_TS != GATED || self.trigger
    }

    /// Returns its trigger output, if that is CEN.
    #[must_use]
    pub fn trigger_output(&self) -> bool {
        self.get(CR2) & TRIGGER_IS_CEN.0 == TRIGGER_IS_CEN.1 && self.get(CR1) & CEN != 0
    }

    /// Lets time pass up to `now_ns`, and sets flags.
    pub fn advance(&mut self, now_ns: u64) {
        let passed_ns = now_ns - self.now_ns;
        self.now_ns = now_ns;
        if !self.is_counting() {
            return;
        }
        let a_count = 1_000_000_000 * (u64::from(self.get(PSC)) + 1);
        let clocks = passed_ns * self.hz + self.carry;
        self.carry = clocks % a_count;
        self.step(clocks / a_count);
    }

    /// Lets time pass up to `now_ns` without counting, while a halted core stops the timer.
    pub fn freeze(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
    }

    fn step(&mut self, counts: u64) {
        let period = u64::from(self.get(ARR)) + 1;
        let from = u64::from(self.get(CNT));
        let to = from + counts;
        let mut flags = u32::from(to >= period) * UIF;
        for channel in 0..4 {
            let at = u64::from(self.get(CCR1 + 4 * channel));
            let next = if at > from { at } else { at + period };
            if at < period && next <= to {
                flags |= 2 << channel;
            }
        }
        self.set(SR, self.get(SR) | flags);
        let ends = to >= period && self.get(CR1) & OPM != 0;
        if ends {
            self.set(CR1, self.get(CR1) & !CEN);
        }
        self.set(CNT, if ends { 0 } else { (to % period) as u32 });
    }

    /// Returns true if its interrupt is asserted.
    #[must_use]
    pub fn is_asserting(&self) -> bool {
        self.get(SR) & self.get(DIER) & 0x1F != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prescaled_timer_wraps_in_exactly_its_period() {
        let mut timer = Timer::new(170_000_000);
        for (register, value) in [(PSC, 3), (ARR, 42_499), (DIER, 1), (CR1, CEN)] {
            timer.write(register, value, u32::MAX);
        }
        let mut rounds = 0;
        for step in 1..=1_000_000 {
            timer.advance(step * 10_000);
            if timer.is_asserting() {
                rounds += 1;
                assert_eq!(step, rounds * 100, "a thousand a second");
                timer.write(SR, !UIF, u32::MAX);
            }
        }
        assert_eq!(rounds, 10_000);
    }

    #[test]
    fn one_pulse_gates_another_timer_for_one_period() {
        let mut timers = [Timer::new(1_000_000), Timer::new(1_000_000)];
        let [gate, gated] = &mut timers;
        for (register, value) in [(ARR, 99), (CR2, TRIGGER_IS_CEN.1), (CR1, CEN | OPM)] {
            gate.write(register, value, u32::MAX);
        }
        for (register, value) in [(SMCR, GATED), (CR1, CEN)] {
            gated.write(register, value, u32::MAX);
        }
        for us in 1..=300 {
            gated.trigger = gate.trigger_output();
            gate.advance(us * 1000);
            gated.advance(us * 1000);
        }
        assert_eq!((gate.get(CR1) & CEN, gate.get(CNT)), (0, 0));
        assert_eq!(gated.get(CNT), 100);
        gate.write(CR2, 0, u32::MAX);
        gate.write(CR1, CEN | OPM, u32::MAX);
        assert!(!gate.trigger_output(), "it gives something else");
    }

    #[test]
    fn compare_match_is_flagged_once_per_period() {
        let mut timer = Timer::new(1_000_000);
        for (register, value) in [(ARR, 99), (CCR1, 40), (DIER, 2), (CR1, CEN)] {
            timer.write(register, value, u32::MAX);
        }
        let mut at = vec![];
        for us in 1..=300 {
            timer.advance(us * 1000);
            if timer.is_asserting() {
                at.push(us);
                timer.write(SR, 0, u32::MAX);
            }
        }
        assert_eq!(at, [40, 140, 240]);
    }
}
