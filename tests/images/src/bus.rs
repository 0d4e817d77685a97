//! The peripherals of a chip, at their addresses.

use std::collections::HashMap;

use crate::chip::{Chip, Commands, Unreadable, UsbKind};
use crate::converter::Converter;
use crate::nvic::{self, Nvic};
use crate::timer::Timer;
use crate::usb::{FullSpeed, Otg, Peripheral};
use crate::watchdog::Watchdog;

/// Offsets of a GPIO port's registers.
const MODER: u32 = 0x00;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const PORTS: u32 = 11;
/// DWT's cycle counter.
const CYCCNT: u32 = 0xE000_1004;

/// How long a sector takes to be erased, ns: twice the watchdog's time. A real
/// H743 takes seconds, which would be as many minutes here.
const ERASE_NS: u64 = 100_000_000;

/// A write to something that moves the arm: its commands or the enable pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The command of an axis (0 to 2): a converter code or a compare count.
    Command(usize, i32),
    /// The amplifiers' enable pin.
    Enable(bool),
}

/// Every pin is analogue but the debugger's, on both chips.
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
    /// What is on the SPI of a board that has it.
    pub converter: Converter,
    /// The USB peripheral.
    pub usb: Box<dyn Peripheral>,
    /// Sectors that are being erased: address and bytes.
    pub erased: Vec<(u32, u32)>,
    /// Until when the flash is busy, ns.
    busy_until_ns: u64,
    /// Time since power-up.
    pub now_ns: u64,
    /// What reached commands and enable pin, in order, since it was last taken.
    pub effects: Vec<Effect>,
}

impl Bus {
    /// After a power-up, or a reset by the watchdog.
    #[must_use]
    pub fn new(chip: &'static Chip, by_watchdog: bool) -> Self {
        let usb: Box<dyn Peripheral> = match chip.usb {
            UsbKind::FullSpeedDevice { .. } => Box::new(FullSpeed::default()),
            UsbKind::Otg { .. } => Box::new(Otg::default()),
        };
        let (flags, power_up, watchdog, _) = chip.reset_flags;
        let cause = if by_watchdog { watchdog } else { power_up };
        let mut words = ports_after_reset(chip.gpio);
        words.insert(flags, cause);
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
            usb,
            erased: vec![],
            busy_until_ns: 0,
            now_ns: 0,
            effects: vec![],
        }
    }

    /// Lets time pass.
    pub fn advance(&mut self, by_ns: u64) {
        self.now_ns += by_ns;
        for timer in &mut self.timers {
            timer.advance(self.now_ns);
        }
        self.raise_interrupts();
    }

    /// Peripherals' lines become pending interrupts.
    pub fn raise_interrupts(&mut self) {
        for (timer, at) in self.timers.iter().zip(self.chip.timers) {
            if let Some(interrupt) = at.interrupt.filter(|_| timer.is_asserting()) {
                self.nvic.pend(interrupt);
            }
        }
        if self.usb.is_asserting() {
            self.nvic.pend(self.chip.usb_interrupt);
        }
    }

    /// Sets the counters of axes 1 to 3.
    pub fn set_encoders(&mut self, counts: [i32; 3]) {
        for (name, count) in self.chip.encoders.into_iter().zip(counts) {
            let found = self.chip.timers.iter().position(|t| t.name == name);
            if let Some(timer) = found.and_then(|i| self.timers.get_mut(i)) {
                timer.feed(count as u16);
            }
        }
    }

    /// Sets the level at an input pin.
    pub fn set_input(&mut self, pin: (u32, u32), high: bool) {
        self.inputs.insert(pin, high);
    }

    /// The level of a pin, as a pull-down outside makes it where nothing drives.
    #[must_use]
    pub fn output(&self, (port, pin): (u32, u32)) -> bool {
        let register = |offset| self.plain(self.chip.gpio + 0x400 * port + offset);
        let drives = register(MODER) >> (2 * pin) & 3 == 1;
        drives && register(ODR) >> pin & 1 == 1
    }

    /// What is commanded on axes 1 to 3, as the registers have it.
    #[must_use]
    pub fn commands(&mut self) -> [i32; 3] {
        match self.chip.commands {
            Commands::Converters(at) | Commands::DutyCycles(at, _) => {
                at.map(|address| self.read(address) as i32)
            }
            Commands::Serial { .. } => self.converter.codes(),
        }
    }

    /// The code of a current on this board, not yet rounded.
    #[must_use]
    pub fn code(&mut self, current_a: f64) -> f64 {
        let largest = match self.chip.commands {
            Commands::DutyCycles(_, largest) => self.read(largest),
            _ => 0,
        };
        self.chip.commands.code(current_a, largest)
    }

    /// The timer at an address, and the offset into it.
    fn timer(&mut self, address: u32) -> Option<(&mut Timer, u32)> {
        let mut all = self.timers.iter_mut().zip(self.chip.timers);
        all.find(|(_, at)| (at.base..at.base + 0x60).contains(&address))
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

    fn port(&self, address: u32) -> Option<(u32, u32)> {
        let offset = address.checked_sub(self.chip.gpio)?;
        (offset < 0x400 * PORTS).then_some((offset / 0x400, offset % 0x400))
    }

    fn plain(&self, address: u32) -> u32 {
        self.words.get(&address).copied().unwrap_or(0)
    }

    /// A word that the core reads.
    pub fn read(&mut self, address: u32) -> u32 {
        if let Some((timer, offset)) = self.timer(address) {
            return timer.get(offset);
        }
        if let Some(offset) = self.usb_offset(address) {
            return self.usb.read(offset);
        }
        if let Some((port, IDR)) = self.port(address) {
            let level = |pin| self.inputs.get(&(port, pin)).copied().unwrap_or(false);
            return (0..16).map(|pin| u32::from(level(pin)) << pin).sum();
        }
        match address {
            nvic::BASE..=0xE000_EFFF => self.nvic.read(address - nvic::BASE),
            CYCCNT => {
                (u128::from(self.now_ns) * u128::from(self.chip.core_hz) / 1_000_000_000) as u32
            }
            _ if address & !0x3FF == self.chip.watchdog => {
                self.watchdog.read(address - self.chip.watchdog)
            }
            _ if self.is_sent(address) => self.converter.status(self.plain(address)),
            _ => self.ready(address, self.plain(address)),
        }
    }

    /// Whether this is the register that says that a frame is out.
    fn is_sent(&self, address: u32) -> bool {
        matches!(self.chip.commands, Commands::Serial { sent, .. } if sent.0 == address)
    }

    /// What the hardware adds to a register.
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
        for (_, bits) in self.chip.set.iter().filter(|(at, _)| *at == address) {
            value |= bits;
        }
        for &(_, from, to, width) in self.chip.copies.iter().filter(|c| c.0 == address) {
            let mask = (1 << width) - 1;
            value = value & !(mask << to) | (value >> from & mask) << to;
        }
        value
    }

    /// A write of the core's, in the bytes of `mask`.
    pub fn write(&mut self, address: u32, value: u32, mask: u32) {
        let enabled = self.output(self.chip.enable);
        if let Some((timer, offset)) = self.timer(address) {
            timer.write(offset, value, mask);
        } else if let Some(offset) = self.usb_offset(address) {
            self.usb.write(offset, value, mask);
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
        self.command(address, value, mask);
        let now_enabled = self.output(self.chip.enable);
        if now_enabled != enabled {
            self.effects.push(Effect::Enable(now_enabled));
        }
    }

    /// What a write does to the commands.
    fn command(&mut self, address: u32, value: u32, mask: u32) {
        match self.chip.commands {
            Commands::Converters(at) | Commands::DutyCycles(at, _) => {
                if let Some(axis) = at.iter().position(|c| *c == address) {
                    let command = Effect::Command(axis, (value & mask) as i32);
                    self.effects.push(command);
                }
            }
            Commands::Serial { data, sync, .. } => {
                if address == data {
                    self.converter.take(value as u8);
                }
                if let Some((axis, code)) = self.converter.select(!self.output(sync)) {
                    self.effects.push(Effect::Command(axis, code));
                }
            }
        }
    }

    /// The chip's flash says that a word of it could not be read.
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

    /// Whether the flash still says that a word of it could not be read.
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

    /// Registers of the flash's in which what is written as set is cleared.
    fn clear(&mut self, address: u32, value: u32) -> bool {
        let register = match self.chip.flash.unreadable {
            Unreadable::Nmi { register, .. } if register == address => register,
            Unreadable::BusFault { status, clear } if clear == address => status.0,
            // Its bits are the hardware's.
            Unreadable::BusFault { status, .. } => return status.0 == address,
            Unreadable::Nmi { .. } => return false,
        };
        *self.words.entry(register).or_default() &= !value;
        true
    }

    fn write_plain(&mut self, address: u32, value: u32, mask: u32) {
        if self.clear(address, value & mask) {
            return;
        }
        let (flags, _, _, clear) = self.chip.reset_flags;
        let mut value = self.plain(address) & !mask | value & mask;
        if address == flags && value & clear != 0 {
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
