//! The peripherals of a chip, at their addresses.

use std::collections::HashMap;

use crate::adc::Adc;
use crate::chip::{Chip, Commands, Unreadable, UsbKind};
use crate::converter::Converter;
use crate::nvic::{self, Nvic};
use crate::shutdown::{self, BreakAt, Outputs, Sources};
use crate::stopwatch::Stopwatch;
use crate::supply::{Reset, Supply};
use crate::timer::Timer;
use crate::usb::{Cable, FullSpeed, Otg, Peripheral};
use crate::watchdog::Watchdog;

/// Offsets of a GPIO port's registers.
const MODER: u32 = 0x00;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const AFRL: u32 = 0x20;
const PORTS: u32 = 11;
/// RCC_CR of an H743 and its bit for PLL1, and RCC_PLLCKSELR's offset.
const H743_RCC: u32 = 0x5802_4400;
const PLL1ON: u32 = 1 << 24;
const PLLCKSELR: u32 = 0x28;
/// CRS_CR: the clock recovery is on.
const CRS_CEN: u32 = 1 << 5;
/// DBGMCU_IDC of an H743, and its value on one of revision V.
const H743_IDC: (u32, u32) = (0x5C00_1000, 0x2003_6450);
/// DWT's cycle counter.
const CYCCNT: u32 = 0xE000_1004;

/// Duration of a sector's erase, ns: twice the watchdog's time. A real H743 takes seconds, which
/// would be as many minutes here.
const ERASE_NS: u64 = 100_000_000;

/// A write that affects the arm: a command or the enable pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The command of an axis (0 to 2): a converter code or a compare count.
    Command(usize, i32),
    /// The amplifiers' enable pin.
    Enable(bool),
}

/// Returns the ports after a reset: all pins except the debugger's are analogue on both chips.
fn ports_after_reset(gpio: u32) -> HashMap<u32, u32> {
    let analogue = (0..PORTS).map(|port| (gpio + 0x400 * port + MODER, u32::MAX));
    let debuggers = [
        (gpio + MODER, 0xABFF_FFFF),
        (gpio + PUPDR, 0x6400_0000),
        (gpio + 0x400 + MODER, 0xFFFF_FEBF),
        (gpio + 0x400 + PUPDR, 0x0000_0100),
    ];
    analogue.chain(debuggers).collect()
}

/// All peripherals of a chip.
pub struct Bus {
    chip: &'static Chip,
    words: HashMap<u32, u32>,
    inputs: HashMap<(u32, u32), bool>,
    timers: Vec<Timer>,
    /// The interrupt controller.
    pub nvic: Nvic,
    /// The independent watchdog.
    pub watchdog: Watchdog,
    /// Converter on the SPI, on a board that has one.
    pub converter: Converter,
    /// Converter that reads the current monitors.
    pub adc: Adc,
    /// The USB peripheral, plugged in.
    pub usb: Cable,
    /// Sectors in the process of being erased: address and bytes.
    pub erased: Vec<(u32, u32)>,
    /// The time until which the flash is busy, ns.
    busy_until_ns: u64,
    /// The supply.
    pub supply: Supply,
    /// Option bits that were cleared, of those set at delivery.
    pub cleared_options: Option<(u32, u32)>,
    /// True if a debugger has halted the core.
    pub is_halted: bool,
    /// True if the core has locked up.
    pub is_locked_up: bool,
    /// A memory with a double error, as an index into [`BreakAt::memories`].
    pub failing_memory: Option<usize>,
    /// The level that is forced on the enable pin from outside.
    pub enable_held_at: Option<bool>,
    /// A command's pin (axis 0 to 2) and the 12-bit reading that is forced on it from outside.
    pub command_held_at: Option<(usize, u16)>,
    /// True if the oscillator of USB follows the host's start-of-frames.
    pub usb_clock_follows: bool,
    /// Converter that reads the commands back.
    read_back: Adc,
    /// Time since power-up.
    pub now_ns: u64,
    /// Runs during a measurement.
    pub stopwatch: Option<Stopwatch>,
    /// Effects on commands and enable pin since the last read, in order.
    pub effects: Vec<Effect>,
}

impl Bus {
    /// Creates the peripherals after a reset.
    #[must_use]
    pub fn new(chip: &'static Chip, cause: Reset) -> Self {
        let usb: Box<dyn Peripheral> = match chip.usb {
            UsbKind::FullSpeedDevice { .. } => Box::new(FullSpeed::default()),
            UsbKind::Otg { .. } => Box::new(Otg::default()),
        };
        let mut words = ports_after_reset(chip.gpio);
        words.insert(chip.reset_flags.register, chip.reset_flags.after(cause));
        let (option_bytes, field, highest) = chip.brown_out_level;
        words.insert(option_bytes, highest << field);
        if chip.is_m7 {
            words.insert(H743_IDC.0, H743_IDC.1);
        }
        Self {
            chip,
            words,
            inputs: HashMap::new(),
            timers: chip
                .timers
                .iter()
                .map(|_| Timer::new(chip.timer_hz))
                .collect(),
            nvic: Nvic::default(),
            watchdog: Watchdog::default(),
            converter: Converter::default(),
            adc: Adc::new(chip.monitors.1),
            usb: Cable::new(usb),
            erased: vec![],
            busy_until_ns: 0,
            supply: Supply::default(),
            cleared_options: None,
            is_halted: false,
            is_locked_up: false,
            failing_memory: None,
            enable_held_at: None,
            command_held_at: None,
            usb_clock_follows: true,
            read_back: Adc::new(chip.monitors.1),
            now_ns: 0,
            stopwatch: None,
            effects: vec![],
        }
    }

    /// Lets time pass.
    pub fn advance(&mut self, by_ns: u64) {
        self.now_ns += by_ns;
        if self.is_halted && self.is_frozen(self.chip.freeze.watchdog) {
            self.watchdog.freeze(by_ns);
        }
        self.follow_gate();
        let freeze = self.chip.freeze;
        let stands = |bit| self.is_halted && self.is_frozen(bit);
        let clock_stands = stands(freeze.clock);
        let gate_stands = freeze.gate.is_some_and(stands);
        for (timer, at) in self.timers.iter_mut().zip(self.chip.timers) {
            let is_frozen = match at.name {
                "TIM5" => clock_stands,
                "TIM15" => gate_stands,
                _ => false,
            };
            match is_frozen {
                true => timer.freeze(self.now_ns),
                false => timer.advance(self.now_ns),
            }
        }
        self.raise_interrupts();
    }

    /// Makes asserted lines of peripherals pending interrupts.
    pub fn raise_interrupts(&mut self) {
        for (timer, at) in self.timers.iter().zip(self.chip.timers) {
            if let Some(interrupt) = at.interrupt.filter(|_| timer.is_asserting()) {
                self.nvic.pend(interrupt);
            }
        }
        if self.usb.is_asserting() {
            self.nvic.pend(self.chip.usb_interrupt);
        }
        if self.supply.follow(&self.chip.comparator, &mut self.words) {
            self.nvic.pend(self.chip.comparator.interrupt);
        }
        self.follow_break();
    }

    /// Applies the gate: TIM15 is ITR0 of TIM1.
    fn follow_gate(&mut self) {
        let level = self
            .timer_named("TIM15")
            .is_some_and(|gate| gate.trigger_output());
        if let Some(timer) = self.timer_named("TIM1") {
            timer.trigger = level;
        }
    }

    fn is_frozen(&self, (register, bit): (u32, u32)) -> bool {
        self.plain(register) & bit != 0
    }

    /// Applies the break inputs to the outputs.
    fn follow_break(&mut self) {
        let Some(at) = self.chip.output_break else {
            return;
        };
        let (port, pin, function) = at.pin;
        let register = |offset| self.plain(self.chip.gpio + 0x400 * port + offset);
        let bears = register(MODER) >> (2 * pin) & 3 == 2
            && register(AFRL + 4 * (pin / 8)) >> (4 * (pin % 8)) & 0xF == function;
        let level = self.inputs.get(&(port, pin)).copied().unwrap_or(false);
        let (system, by_supply, by_lockup) = at.system;
        let through = self.plain(system);
        let is_low = self.supply.is_low(&self.chip.comparator, &self.words);
        let sources = Sources {
            pin: bears.then_some(level),
            system: through & by_supply != 0 && is_low
                || through & by_lockup != 0 && self.is_locked_up
                || self
                    .failing_memory
                    .is_some_and(|n| through & at.memories[n] != 0),
        };
        if let Some(timer) = self.timer_named(at.timer) {
            shutdown::follow(timer, sources);
        }
    }

    /// Returns true if duty cycles leave the chip, on a board with duty-cycle commands.
    #[must_use]
    pub fn drives_duty_cycles(&mut self) -> Option<bool> {
        self.duty_outputs()
            .map(|outputs| outputs == Outputs::Pulses)
    }

    /// Returns the outputs at the pins of the duty cycles, on a board with duty-cycle commands.
    #[must_use]
    pub fn duty_outputs(&mut self) -> Option<Outputs> {
        self.follow_gate();
        let at = self.chip.output_break?;
        let stops = self.chip.freeze.outputs;
        let is_stopped = self.is_halted && stops.is_some_and(|bit| self.is_frozen(bit));
        let timer = self.timer_named(at.timer)?;
        Some(shutdown::outputs(timer, is_stopped))
    }

    fn timer_named(&mut self, name: &str) -> Option<&mut Timer> {
        let found = self.chip.timers.iter().position(|t| t.name == name);
        found.and_then(|i| self.timers.get_mut(i))
    }

    /// Sets the revision of an H743, as in DBGMCU_IDC.REV_ID.
    pub fn set_revision(&mut self, revision: u16) {
        let (register, v) = H743_IDC;
        self.words
            .insert(register, v & 0xFFFF | u32::from(revision) << 16);
    }

    /// Sets the brown-out level of the option bytes.
    pub fn set_brown_out_level(&mut self, level: u32) {
        let (option_bytes, field, _) = self.chip.brown_out_level;
        self.words.insert(option_bytes, level << field);
    }

    /// Sets the counters of axes 1 to 3.
    pub fn set_encoders(&mut self, counts: [i32; 3]) {
        for (name, count) in self.chip.encoders.into_iter().zip(counts) {
            if let Some(timer) = self.timer_named(name) {
                timer.feed(count as u16);
            }
        }
    }

    /// Plays the channels of an axis's encoder (0 to 2) for a while. Returns the counts of its
    /// timer. `levels` returns channels A and B at a time in ns.
    pub fn play_encoder(
        &mut self,
        axis: usize,
        ms: u64,
        levels: impl FnMut(f64) -> [bool; 2],
    ) -> i32 {
        let name = self.chip.encoders[axis];
        let found = self.chip.timers.iter().position(|t| t.name == name);
        let timer = found.and_then(|i| self.timers.get_mut(i));
        timer.map_or(0, |timer| timer.play(ms, levels))
    }

    /// Sets the level at an input pin.
    pub fn set_input(&mut self, pin: (u32, u32), high: bool) {
        self.inputs.insert(pin, high);
    }

    /// Returns the level of a pin, with an external pull-down if nothing drives it.
    #[must_use]
    pub fn output(&self, (port, pin): (u32, u32)) -> bool {
        let register = |offset| self.plain(self.chip.gpio + 0x400 * port + offset);
        let drives = register(MODER) >> (2 * pin) & 3 == 1;
        drives && register(ODR) >> pin & 1 == 1
    }

    /// Returns the commands of axes 1 to 3 in the registers.
    #[must_use]
    pub fn commands(&mut self) -> [i32; 3] {
        match self.chip.commands {
            Commands::Converters(at) | Commands::DutyCycles(at, _) => {
                at.map(|address| self.read(address) as i32)
            }
            Commands::Serial { .. } => self.converter.codes(),
        }
    }

    /// Returns the code of a current on this board, not rounded.
    #[must_use]
    pub fn code(&mut self, current_a: f64) -> f64 {
        let largest = match self.chip.commands {
            Commands::DutyCycles(_, largest) => self.read(largest),
            _ => 0,
        };
        self.chip.commands.code(current_a, largest)
    }

    /// Returns the timer at an address, and the offset in it.
    fn timer(&mut self, address: u32) -> Option<(&mut Timer, u32)> {
        let mut all = self.timers.iter_mut().zip(self.chip.timers);
        all.find(|(_, at)| (at.base..at.base + 0x70).contains(&address))
            .map(|(timer, at)| (timer, address - at.base))
    }

    fn usb_offset(&self, address: u32) -> Option<u32> {
        let (base, bytes) = match self.chip.usb {
            UsbKind::FullSpeedDevice { base, .. } => (base, 0x800),
            UsbKind::Otg { base } => (base, 0xB000),
        };
        (base..base + bytes)
            .contains(&address)
            .then(|| address - base)
    }

    fn adc_offset(&self, address: u32) -> Option<u32> {
        let (base, ..) = self.chip.monitors;
        (base..base + 0x100)
            .contains(&address)
            .then(|| address - base)
    }

    fn read_back_offset(&self, address: u32) -> Option<u32> {
        let (base, _) = self.chip.read_back?;
        (base..base + 0x100)
            .contains(&address)
            .then(|| address - base)
    }

    /// Updates the inputs of the converter that reads the commands back.
    fn follow_commands(&mut self) {
        let (Commands::Converters(at), Some((_, channels))) =
            (self.chip.commands, self.chip.read_back)
        else {
            return;
        };
        for (axis, channel) in channels.into_iter().enumerate() {
            let overridden = self
                .command_held_at
                .filter(|(overridden, _)| *overridden == axis);
            self.read_back.levels[channel] =
                overridden.map_or(self.plain(at[axis]) as u16, |(_, reading)| reading);
        }
    }

    /// Returns the level at a pin: its output if it is driven, else the external level.
    fn level(&self, pin: (u32, u32)) -> bool {
        let overridden = self.enable_held_at.filter(|_| pin == self.chip.enable);
        let from_outside = || self.inputs.get(&pin).copied().unwrap_or(false);
        overridden.unwrap_or_else(|| self.output(pin) || from_outside())
    }

    /// Sets the readings of the current monitors of axes 1 to 3, A, as 12-bit values.
    pub fn set_monitors(&mut self, currents_a: [f64; 3]) {
        let (_, _, channels) = self.chip.monitors;
        for (channel, current_a) in channels.into_iter().zip(currents_a) {
            let code = Commands::Converters([0; 3]).code(current_a, 0);
            self.adc.levels[channel] = (code + 0.5).clamp(0.0, 4095.0) as u16;
        }
    }

    fn port(&self, address: u32) -> Option<(u32, u32)> {
        let offset = address.checked_sub(self.chip.gpio)?;
        (offset < 0x400 * PORTS).then_some((offset / 0x400, offset % 0x400))
    }

    fn plain(&self, address: u32) -> u32 {
        self.words.get(&address).copied().unwrap_or(0)
    }

    /// Returns a word for the core.
    pub fn read(&mut self, address: u32) -> u32 {
        self.touch(address);
        if let Some((timer, offset)) = self.timer(address) {
            return timer.get(offset);
        }
        if let Some(offset) = self.usb_offset(address) {
            return self.usb.read(offset);
        }
        if let Some((port, IDR)) = self.port(address) {
            return (0..16)
                .map(|pin| u32::from(self.level((port, pin))) << pin)
                .sum();
        }
        if let Some(offset) = self.adc_offset(address) {
            return self.adc.read(offset, self.now_ns);
        }
        if let Some(offset) = self.read_back_offset(address) {
            self.follow_commands();
            return self.read_back.read(offset, self.now_ns);
        }
        match address {
            nvic::BASE..=0xE000_EFFF => self.nvic.read(address - nvic::BASE),
            CYCCNT => {
                (u128::from(self.now_ns) * u128::from(self.chip.core_hz) / 1_000_000_000) as u32
            }
            _ if address & !0x3FF == self.chip.watchdog => {
                self.watchdog.read(address - self.chip.watchdog)
            }
            _ if address == self.chip.recovery.0 + 8 => self.recovery_status(),
            _ if self.is_sent(address) => self.converter.status(self.plain(address)),
            _ if self.is_response_register(address) => self.converter.next_byte().into(),
            _ => self.ready(address, self.plain(address)),
        }
    }

    /// Returns CRS_ISR: SYNCOKF, or ERRF and SYNCMISS. With a start-of-frame each millisecond the
    /// flags are set again as soon as they are cleared.
    fn recovery_status(&self) -> u32 {
        let runs = self.plain(self.chip.recovery.0) & CRS_CEN != 0;
        match (runs, self.usb_clock_follows) {
            (false, _) => 0,
            (true, true) => 1 << 0,
            (true, false) => 1 << 2 | 1 << 9,
        }
    }

    /// Returns true for the register that reports the end of a frame.
    fn is_sent(&self, address: u32) -> bool {
        matches!(self.chip.commands, Commands::Serial { sent, .. } if sent.0 == address)
    }

    /// Returns true for the register with the data received by the SPI.
    fn is_response_register(&self, address: u32) -> bool {
        matches!(self.chip.commands, Commands::Serial { response_register, .. } if response_register == address)
    }

    /// Returns the value of a register with the bits that the hardware adds.
    fn ready(&self, address: u32, mut value: u32) -> u32 {
        for rule in self.chip.follows.iter().filter(|f| f.address == address) {
            if value & rule.of != 0 {
                value |= rule.ready;
            }
        }
        let (status, busy) = self.chip.flash.status;
        if address == status && self.now_ns < self.busy_until_ns {
            value |= busy;
        }
        let (status, low) = self.chip.comparator.status;
        if address == status && self.supply.is_low(&self.chip.comparator, &self.words) {
            value |= low;
        }
        for (_, bits) in self.chip.set.iter().filter(|(at, _)| *at == address) {
            value |= bits;
        }
        if let Some((_, bits)) = self.cleared_options.filter(|(at, _)| *at == address) {
            value &= !bits;
        }
        for &(_, from, to, width) in self.chip.copies.iter().filter(|c| c.0 == address) {
            let mask = (1 << width) - 1;
            value = value & !(mask << to) | (value >> from & mask) << to;
        }
        value
    }

    /// Writes a word from the core, in the bytes of `mask`.
    pub fn write(&mut self, address: u32, value: u32, mask: u32) {
        self.touch(address);
        let enabled = self.output(self.chip.enable);
        if let Some((timer, offset)) = self.timer(address) {
            timer.write(offset, value, mask);
        } else if let Some(offset) = self.usb_offset(address) {
            self.usb.write(offset, value, mask);
        } else if let Some(offset) = self.adc_offset(address) {
            self.adc.write(offset, value, mask, self.now_ns);
        } else if let Some(offset) = self.read_back_offset(address) {
            self.follow_commands();
            self.read_back.write(offset, value, mask, self.now_ns);
        } else if let Some((port, BSRR)) = self.port(address) {
            let odr = self.chip.gpio + 0x400 * port + ODR;
            let level = self.plain(odr) & !(value >> 16) | value & 0xFFFF;
            self.words.insert(odr, level);
        } else if (nvic::BASE..nvic::BASE + 0x1000).contains(&address) {
            self.nvic.write(address - nvic::BASE, value, mask);
        } else if address & !0x3FF == self.chip.watchdog {
            self.watchdog
                .write(address - self.chip.watchdog, value, self.now_ns);
        } else {
            self.write_plain(address, value, mask);
        }
        self.follow_break();
        self.command(address, value, mask);
        let now_enabled = self.output(self.chip.enable);
        if now_enabled != enabled {
            self.effects.push(Effect::Enable(now_enabled));
        }
    }

    /// Reports an access of the core to the stopwatch, if it runs.
    fn touch(&self, address: u32) {
        if let Some(stopwatch) = &self.stopwatch {
            stopwatch.touch(address);
        }
    }

    /// Records a new command of an axis: the third is the last one of a tick.
    fn reach(&mut self, axis: usize, code: i32) {
        self.effects.push(Effect::Command(axis, code));
        if let Some(stopwatch) = self.stopwatch.as_ref().filter(|_| axis == 2) {
            stopwatch.output();
        }
    }

    /// Applies a write to the commands.
    fn command(&mut self, address: u32, value: u32, mask: u32) {
        match self.chip.commands {
            Commands::Converters(at) | Commands::DutyCycles(at, _) => {
                if let Some(axis) = at.iter().position(|c| *c == address) {
                    self.reach(axis, (value & mask) as i32);
                }
            }
            Commands::Serial { data, sync, .. } => {
                if address == data {
                    self.converter.receive(value as u8);
                }
                if let Some((axis, code)) = self.converter.select(!self.output(sync), self.now_ns) {
                    self.reach(axis, code);
                }
            }
        }
    }

    /// Sets the flash's status for a word that cannot be read.
    pub fn report_unreadable(&mut self, address: u32) {
        let flash = &self.chip.flash;
        let (register, bits) = match flash.unreadable {
            Unreadable::Nmi {
                register,
                failed,
                second,
            } if address >= flash.second_bank => (register, failed | second),
            Unreadable::Nmi {
                register, failed, ..
            } => (register, failed),
            Unreadable::BusFault { status, .. } => status,
        };
        *self.words.entry(register).or_default() |= bits;
    }

    /// Returns true if the flash's status still reports a word that cannot be read.
    #[must_use]
    pub fn reports_unreadable(&self) -> bool {
        let (register, bit) = match self.chip.flash.unreadable {
            Unreadable::Nmi {
                register, failed, ..
            } => (register, failed),
            Unreadable::BusFault { status, .. } => status,
        };
        self.plain(register) & bit != 0
    }

    /// Handles registers of the flash in which writing a one clears a bit.
    fn clear(&mut self, address: u32, value: u32) -> bool {
        let register = match self.chip.flash.unreadable {
            Unreadable::Nmi { register, .. } if register == address => register,
            Unreadable::BusFault { status, clear } if clear == address => status.0,
            // Its bits are set by hardware.
            Unreadable::BusFault { status, .. } => return status.0 == address,
            Unreadable::Nmi { .. } => return false,
        };
        *self.words.entry(register).or_default() &= !value;
        true
    }

    /// Returns the write-protected bits of a register: the comparator's after PVDL is set, and the
    /// source and prescaler of an H743's PLL1 while that is on.
    fn locked(&self, address: u32) -> u32 {
        let pll_is_on = self.plain(H743_RCC) & PLL1ON != 0;
        if self.chip.is_m7 && address == H743_RCC + PLLCKSELR && pll_is_on {
            return 0x3F3;
        }
        let (control, on, level) = self.chip.comparator.control;
        let locks = |at: &BreakAt| self.plain(at.system.0) & at.system.1 != 0;
        match address == control && self.chip.output_break.as_ref().is_some_and(locks) {
            true => on | 7 << level,
            false => 0,
        }
    }

    fn write_plain(&mut self, address: u32, value: u32, mask: u32) {
        if self.clear(address, value & mask) {
            return;
        }
        if address == self.chip.comparator.exti[2] {
            // Writing a one clears a bit.
            *self.words.entry(address).or_default() &= !(value & mask);
            return;
        }
        // The clock recovery's settings are locked while it runs.
        let (recovery, _) = self.chip.recovery;
        if address == recovery + 4 && self.plain(recovery) & CRS_CEN != 0 {
            return;
        }
        let flags = self.chip.reset_flags;
        let mask = mask & !self.locked(address);
        let mut value = self.plain(address) & !mask | value & mask;
        if address == flags.register && value & flags.clear != 0 {
            value = 0;
        }
        let (control, start) = self.chip.flash.control;
        if address == control && value & start != 0 {
            self.erased.push((self.chip.flash.sector)(value));
            self.busy_until_ns = self.now_ns + ERASE_NS;
            value &= !start;
        }
        self.words.insert(address, value);
    }
}
