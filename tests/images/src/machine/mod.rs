//! The core: reset, exceptions by priority, sleep, time.

mod data_cache;
mod exceptions;
mod fault_injection;
mod halting;
mod protection;
mod running;

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use hapterra_tests::usb::{Answer, Handshake, MOMENTS_A_MS, Port};
use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM, Unicorn};

use crate::bus::{Bus, Effect};
use crate::chip::Chip;
use crate::elf::Image;
use crate::supply::Reset;
use data_cache::DataCache;
use exceptions::Active;
use fault_injection::{Load, UnreadableWord};
use protection::Protection;
use running::SLICE;

/// The Thumb bit of the program status.
const THUMB: u64 = 1 << 24;

/// Cause of a stop of the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The time is up.
    Time,
    /// The watchdog has reset the chip.
    Watchdog,
    /// The program has reset the chip.
    Software,
    /// The caller's condition was met.
    Requested,
    /// A fault in the handler of a hard fault, with its location.
    Lockup(String),
}

/// A chip with an image in it.
pub struct Machine {
    /// The chip.
    pub chip: &'static Chip,
    /// Its image.
    pub image: Image,
    core: Unicorn<'static, ()>,
    bus: Rc<RefCell<Bus>>,
    active: Vec<Active>,
    unreadable: Vec<UnreadableWord>,
    /// State of a load from a word that cannot be read.
    load: Rc<Cell<Load>>,
    /// The data cache, on a core that has one.
    cache: Rc<RefCell<DataCache>>,
    /// Memory protection unit.
    protection: Protection,
    /// Vectors taken since the list was last cleared.
    pub taken: Vec<u32>,
    /// Number of hard faults.
    pub hard_faults: u32,
    /// Instructions between two checks of time and interrupts.
    pub slice: usize,
    /// If set, the haptic interrupt is raised out of turn at every n-th check that finds the core
    /// in a critical section or in another interrupt.
    pub raises_tick_every: Option<u32>,
    /// Number of checks that found the core there.
    pub busy_ticks: u32,
    /// Number of times the haptic interrupt was raised out of turn.
    pub raised: u32,
    /// Number of times the haptic interrupt was pending and could not be taken although no tick was
    /// running.
    pub delayed: u32,
    /// Number of checks that found PRIMASK set with the haptic interrupt enabled.
    pub masked: u32,
}

impl Machine {
    /// Creates a powered-up chip with `image` in its flash, and unattended switches: emergency stop
    /// not pressed, dead-man and clutch not held; the amplifiers are ready and have no current
    /// monitors.
    #[must_use]
    pub fn new(chip: &'static Chip, image: Image) -> Self {
        let model = if chip.is_m7 {
            ArmCpuModel::CORTEX_M7
        } else {
            ArmCpuModel::CORTEX_M4
        };
        let mut core = Unicorn::new(Arch::ARM, Mode::MCLASS | Mode::THUMB).expect("a core");
        core.ctl_set_cpu_model(model as i32).expect("its model");
        for (address, bytes) in chip.memories {
            core.mem_map((*address).into(), (*bytes).into(), Prot::ALL)
                .expect("memory");
        }
        let bus = Rc::new(RefCell::new(Bus::new(chip, Reset::PowerUp)));
        let cache = Rc::<RefCell<DataCache>>::default();
        for (address, bytes) in [(0x4000_0000, 0x2000_0000), (0xE000_0000, 0x10_0000)] {
            let cache = chip.is_m7.then_some(&cache);
            map_peripherals(&mut core, &bus, cache, address, bytes);
        }
        let mut machine = Self {
            chip,
            image,
            core,
            bus,
            active: vec![],
            unreadable: vec![],
            load: Rc::default(),
            cache,
            protection: Protection::default(),
            taken: vec![],
            hard_faults: 0,
            slice: SLICE,
            raises_tick_every: None,
            busy_ticks: 0,
            raised: 0,
            delayed: 0,
            masked: 0,
        };
        machine.watch_forbidden();
        machine.load();
        machine.reset(Reset::PowerUp);
        machine
    }

    fn load(&mut self) {
        let (flash, bytes) = self.chip.memories[0];
        let erased = vec![0xFF; bytes as usize];
        self.core.mem_write(flash.into(), &erased).expect("flash");
        for segment in &self.image.segments {
            if !segment.bytes.is_empty() {
                self.core
                    .mem_write(segment.loaded.into(), &segment.bytes)
                    .expect("in a memory");
            }
        }
    }

    /// Resets the chip. Memory keeps its content, except for data that was only in the data cache.
    /// Parts outside the chip are reset only at a power-up.
    pub fn reset(&mut self, cause: Reset) {
        let inputs = self.chip;
        let before = self.bus.replace(Bus::new(self.chip, cause));
        if cause != Reset::PowerUp {
            self.bus().converter = before.converter.after_reset();
        }
        let memory = self.cache.borrow_mut().reset();
        if let Some((address, bytes)) = memory {
            self.patch(address, &bytes);
        }
        self.protect();
        self.set_input(inputs.emergency_stop, false);
        self.set_input(inputs.dead_man, true);
        self.set_input(inputs.clutch, true);
        self.set_input(inputs.monitors_fitted, true);
        self.active.clear();
        let flash = self.chip.memories[0].0;
        let (stack, entry) = (self.word(flash), self.word(flash + 4));
        for register in [
            RegisterARM::PRIMASK,
            RegisterARM::BASEPRI,
            RegisterARM::FAULTMASK,
        ] {
            self.set_register(register, 0);
        }
        self.set_register(RegisterARM::FPEXC, 0x4000_0000);
        self.set_register(RegisterARM::EPSR, THUMB);
        self.set_register(RegisterARM::SP, stack.into());
        self.set_register(RegisterARM::LR, 0xFFFF_FFFF);
        self.set_register(RegisterARM::PC, entry.into());
    }

    /// Returns the peripherals.
    #[must_use]
    pub fn bus(&self) -> std::cell::RefMut<'_, Bus> {
        self.bus.borrow_mut()
    }

    /// Sets the level at an input pin.
    pub fn set_input(&mut self, pin: (u32, u32), high: bool) {
        let mut bus = self.bus();
        bus.set_input(pin, high);
        bus.raise_interrupts();
    }

    /// Sets the supply's voltage, mV.
    pub fn set_supply_mv(&mut self, mv: u32) {
        let mut bus = self.bus();
        bus.supply.mv = mv;
        bus.raise_interrupts();
    }

    /// Returns true if the amplifiers are switched on.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.bus().output(self.chip.enable)
    }

    /// Returns the effects on commands and enable pin since the last call.
    #[must_use]
    pub fn take_effects(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.bus().effects)
    }

    /// Returns a word of memory.
    #[must_use]
    pub fn word(&self, address: u32) -> u32 {
        let mut bytes = [0; 4];
        self.core
            .mem_read(address.into(), &mut bytes)
            .expect("in a memory");
        u32::from_le_bytes(bytes)
    }

    /// Returns bytes of memory.
    #[must_use]
    pub fn bytes(&self, address: u32, count: usize) -> Vec<u8> {
        self.core
            .mem_read_as_vec(address.into(), count)
            .expect("in a memory")
    }

    fn register(&self, register: RegisterARM) -> u64 {
        self.core.reg_read(register).expect("a register")
    }

    fn set_register(&mut self, register: RegisterARM, value: u64) {
        self.core.reg_write(register, value).expect("a register");
    }
}

/// The chip on a scripted host's cable.
impl Port for Machine {
    fn is_attached(&self) -> bool {
        self.bus().usb.is_attached()
    }

    fn bus_reset(&mut self) {
        self.bus().usb.bus_reset();
    }

    fn setup(&mut self, request: [u8; 8]) -> Handshake {
        self.bus().usb.setup(request)
    }

    fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake {
        self.bus().usb.out(endpoint, packet)
    }

    fn take_in(&mut self, endpoint: usize) -> Answer {
        self.bus().usb.take_in(endpoint)
    }

    fn wait(&mut self) -> Result<(), String> {
        let until_ns = self.bus().now_ns + 1_000_000 / MOMENTS_A_MS;
        match self.run_until(1, |m| m.bus().now_ns >= until_ns) {
            Stop::Requested | Stop::Time => Ok(()),
            stop => Err(format!("{stop:?}")),
        }
    }
}

fn map_peripherals(
    core: &mut Unicorn<'static, ()>,
    bus: &Rc<RefCell<Bus>>,
    cache: Option<&Rc<RefCell<DataCache>>>,
    base: u32,
    size: u64,
) {
    let cache = cache.map(Rc::clone);
    let (on_read, on_write) = (Rc::clone(bus), Rc::clone(bus));
    let read = move |_: &mut Unicorn<'_, ()>, offset: u64, bytes: usize| {
        let address = base + offset as u32;
        let word = on_read.borrow_mut().read(address & !3);
        u64::from(word >> (8 * (address & 3)) & ones(bytes))
    };
    let write = move |core: &mut Unicorn<'_, ()>, offset: u64, bytes: usize, value: u64| {
        let address = base + offset as u32;
        let shift = 8 * (address & 3);
        let mut bus = on_write.borrow_mut();
        bus.write(address & !3, (value as u32) << shift, ones(bytes) << shift);
        if let Some(cache) = &cache {
            cache.borrow_mut().follow(core, address, value as u32);
        }
    };
    core.mmio_map(base.into(), size, Some(read), Some(write))
        .expect("peripherals");
}

fn ones(bytes: usize) -> u32 {
    u32::MAX >> (32 - 8 * bytes as u32)
}
