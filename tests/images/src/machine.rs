//! The core: reset, exceptions by priority, sleep, time.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use hapterra_tests::usb::{Answer, Handshake, MOMENTS_A_MS, Port};
use unicorn_engine::{
    Arch, ArmCpuModel, Context, HookType, MemType, Mode, Prot, RegisterARM, UcHookId, Unicorn,
};

use crate::bus::{Bus, Effect};
use crate::chip::{Chip, Unreadable};
use crate::elf::{Function, Image};

/// Where an exception's return leads: no memory is there.
const EXC_RETURN: u64 = 0xFFFF_FFF8;
/// Instructions between two looks at time and interrupts, where nothing else is
/// said. An instruction takes 8 ns: 1.36 cycles at 170 MHz.
const SLICE: usize = 200;
/// Nanoseconds that an exception costs, whatever is done in it.
const EXCEPTION_NS: u64 = 200;
/// Nanoseconds between two looks while the core sleeps.
const NAP_NS: u64 = 5_000;
/// The Thumb bit of the program status.
const THUMB: u64 = 1 << 24;
/// Positions in the vector table.
const NMI: u32 = 2;
const HARD_FAULT: u32 = 3;
const BUS_FAULT: u32 = 5;
/// SHCSR and its bit that lets bus faults through; SHPR1 and where their priority
/// is in it.
const BUS_FAULTS_ON: (u32, u32) = (0xE000_ED24, 1 << 17);
const BUS_FAULTS_PRIORITY: (u32, u32) = (0xE000_ED18, 8);
/// Where an exception's frame has the place to go back to.
const PC_IN_FRAME: u32 = 24;
/// Priority of an execution that no interrupt can be below.
const THREAD: i16 = 256;

/// An exception under way.
struct Active {
    context: Context,
    vector: u32,
    priority: i16,
}

/// Whether the core loads a word of flash that cannot be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Load {
    #[default]
    None,
    /// It is about to, from this address.
    Of(u32),
    /// It does.
    Done,
}

/// A word of flash that cannot be read.
struct Spoilt {
    address: u32,
    hook: UcHookId,
}

/// Why the machine stopped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The time is up.
    Time,
    /// The watchdog has reset the chip.
    Watchdog,
    /// A condition of the caller's.
    Asked,
    /// An exception with no way out: where.
    Lockup(String),
}

/// A chip with an image in it.
pub struct Machine {
    /// The chip.
    pub chip: &'static Chip,
    /// What it runs.
    pub image: Image,
    core: Unicorn<'static, ()>,
    bus: Rc<RefCell<Bus>>,
    active: Vec<Active>,
    spoilt: Vec<Spoilt>,
    /// A load of a word that cannot be read.
    load: Rc<Cell<Load>>,
    /// Vectors taken since it was last cleared.
    pub taken: Vec<u32>,
    /// How often a hard fault was taken.
    pub hard_faults: u32,
    /// Instructions between two looks at time and interrupts.
    pub slice: usize,
    /// Every so manieth look that finds a critical section entered, or another
    /// interrupt at work, raises the haptic interrupt out of turn.
    pub provokes_every: Option<u32>,
    /// Looks that found one.
    pub found_busy: u32,
    /// How often it was raised.
    pub provoked: u32,
    /// How often the haptic interrupt was pending and could not be taken
    /// although no tick was under way.
    pub delayed: u32,
    /// Looks that found PRIMASK set although the haptic interrupt was let through.
    pub masked: u32,
}

impl Machine {
    /// A powered-up chip with `image` in its flash, the switches as they are
    /// when nobody is near: emergency stop not pressed, dead-man not held.
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
        let bus = Rc::new(RefCell::new(Bus::new(chip, false)));
        for (address, bytes) in [(0x4000_0000, 0x2000_0000), (0xE000_0000, 0x10_0000)] {
            map_peripherals(&mut core, &bus, address, bytes);
        }
        let mut machine = Self {
            chip,
            image,
            core,
            bus,
            active: vec![],
            spoilt: vec![],
            load: Rc::default(),
            taken: vec![],
            hard_faults: 0,
            slice: SLICE,
            provokes_every: None,
            found_busy: 0,
            provoked: 0,
            delayed: 0,
            masked: 0,
        };
        machine.load();
        machine.reset(false);
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

    /// Resets the chip. Memory keeps what it holds.
    pub fn reset(&mut self, by_watchdog: bool) {
        let inputs = self.chip;
        *self.bus.borrow_mut() = Bus::new(self.chip, by_watchdog);
        self.set_input(inputs.emergency_stop, false);
        self.set_input(inputs.dead_man, true);
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

    /// The peripherals.
    #[must_use]
    pub fn bus(&self) -> std::cell::RefMut<'_, Bus> {
        self.bus.borrow_mut()
    }

    /// Sets the level at an input pin.
    pub fn set_input(&mut self, pin: (u32, u32), high: bool) {
        self.bus().set_input(pin, high);
    }

    /// Whether the amplifiers are switched on.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.bus().output(self.chip.enable)
    }

    /// What reached commands and enable pin since this was last asked.
    #[must_use]
    pub fn take_effects(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.bus().effects)
    }

    /// A word of memory.
    #[must_use]
    pub fn word(&self, address: u32) -> u32 {
        let mut bytes = [0; 4];
        self.core
            .mem_read(address.into(), &mut bytes)
            .expect("in a memory");
        u32::from_le_bytes(bytes)
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self, address: u32, count: usize) -> Vec<u8> {
        self.core
            .mem_read_as_vec(address.into(), count)
            .expect("in a memory")
    }

    /// Overwrites memory, code included.
    pub fn patch(&mut self, address: u32, bytes: &[u8]) {
        self.core
            .mem_write(address.into(), bytes)
            .expect("in a memory");
        let (from, to) = (u64::from(address), u64::from(address) + bytes.len() as u64);
        self.core
            .ctl_remove_cache(from, to)
            .expect("translated code is dropped");
    }

    /// Counts calls of a function and the instructions executed in it, without what
    /// it calls, from now on.
    #[must_use]
    pub fn count(&mut self, function: Function) -> Rc<Cell<(u32, u32)>> {
        let counted = Rc::new(Cell::new((0, 0)));
        let into = Rc::clone(&counted);
        let (from, to) = (function.address, function.address + function.size - 1);
        let on_instruction = move |_: &mut Unicorn<'_, ()>, at: u64, _: u32| {
            let (calls, instructions) = into.get();
            let entered = u32::from(at == u64::from(function.address));
            into.set((calls + entered, instructions + 1));
        };
        let hook = self
            .core
            .add_code_hook(from.into(), to.into(), on_instruction);
        hook.expect("a hook");
        self.core
            .ctl_flush_tb()
            .expect("translated code is dropped");
        counted
    }

    /// From now on the flash's word at `address` cannot be read, until it is
    /// erased: what is left of a write that was cut off.
    pub fn spoil(&mut self, address: u32) {
        let bytes = self.chip.flash.word;
        let load = Rc::clone(&self.load);
        let on_load = move |core: &mut Unicorn<'_, ()>, _: MemType, _: u64, _: usize, _: i64| {
            if load.get() == Load::None {
                load.set(Load::Of(address));
                // In front of the load.
                core.emu_stop().expect("stops");
            }
            true
        };
        let (from, to) = (u64::from(address), u64::from(address + bytes - 1));
        let hook = self
            .core
            .add_mem_hook(HookType::MEM_READ, from, to, on_load);
        // Code that was translated before does not ask it.
        self.core
            .ctl_flush_tb()
            .expect("translated code is dropped");
        self.core.ctl_flush_tlb().expect("and what it knows");
        self.spoilt.push(Spoilt {
            address,
            hook: hook.expect("a hook"),
        });
    }

    /// From now on, a call of `function` becomes one of `panicking`, a function
    /// of core's that takes only a source location: as if a line panicked.
    pub fn call_instead(&mut self, function: Function, panicking: Function) {
        let (flash, bytes) = self.chip.memories[0];
        // The end of flash, where no image reaches.
        let text = flash + bytes - 64;
        let location = text + 32;
        self.patch(text, b"made/by/a/test.rs");
        let words: Vec<u8> = [text, 17, 7, 9]
            .iter()
            .flat_map(|w: &u32| w.to_le_bytes())
            .collect();
        self.patch(location, &words);
        // ldr r0, [pc, #4]; ldr.w pc, [pc, #8]; nop; and what they load.
        let mut code = if function.address & 2 == 0 {
            vec![]
        } else {
            vec![0x00, 0xBF]
        };
        code.extend([0x01, 0x48, 0xDF, 0xF8, 0x08, 0xF0, 0x00, 0xBF]);
        code.extend(location.to_le_bytes());
        code.extend((panicking.address | 1).to_le_bytes());
        self.patch(function.address, &code);
    }

    /// Puts a function's own code back.
    pub fn heal(&mut self, function: Function) {
        let holds = |s: &&crate::elf::Segment| {
            (s.runs..s.runs + s.bytes.len() as u32).contains(&function.address)
        };
        let code = self.image.segments.iter().find(holds).map(|segment| {
            let from = (function.address - segment.runs) as usize;
            let to = segment
                .bytes
                .len()
                .min(from + function.size.max(24) as usize);
            segment.bytes[from..to].to_vec()
        });
        self.patch(function.address, &code.unwrap_or_default());
    }

    fn register(&self, register: RegisterARM) -> u64 {
        self.core.reg_read(register).expect("a register")
    }

    fn set_register(&mut self, register: RegisterARM, value: u64) {
        self.core.reg_write(register, value).expect("a register");
    }

    /// Where the core is.
    #[must_use]
    pub fn place(&self) -> String {
        let pc = self.register(RegisterARM::PC) as u32;
        format!("{pc:#x} {}", self.image.at(pc))
    }

    /// Runs for so many milliseconds.
    pub fn run_ms(&mut self, ms: u64) -> Stop {
        self.run_until(ms, |_| false)
    }

    /// Runs until a condition holds, for at most so many milliseconds.
    pub fn run_until(&mut self, ms: u64, mut is_met: impl FnMut(&mut Self) -> bool) -> Stop {
        let end_ns = self.bus().now_ns + ms * 1_000_000;
        loop {
            if is_met(self) {
                return Stop::Asked;
            }
            let (now_ns, bites) = {
                let bus = self.bus();
                (bus.now_ns, bus.watchdog.bites(bus.now_ns))
            };
            if bites {
                return Stop::Watchdog;
            }
            if now_ns >= end_ns {
                return Stop::Time;
            }
            if let Some(stop) = self.step() {
                return stop;
            }
        }
    }

    /// Runs until so many more haptic ticks have begun and ended.
    pub fn run_ticks(&mut self, ticks: usize) -> Stop {
        let vector = self.chip.tick_interrupt as u32 + 16;
        let mut left = ticks;
        let mut was_in_tick = false;
        self.run_until(2 * ticks as u64 + 5, move |machine| {
            let in_tick = machine.active.iter().any(|a| a.vector == vector);
            left -= usize::from(was_in_tick && !in_tick);
            was_in_tick = in_tick;
            left == 0
        })
    }

    /// One slice of instructions, or one nap, between looks at interrupts.
    fn step(&mut self) -> Option<Stop> {
        self.bus().gather();
        self.erase();
        self.provoke();
        self.take_interrupt();
        self.watch_masks();
        let pc = self.register(RegisterARM::PC) | 1;
        let ended = self.core.emu_start(pc, EXC_RETURN, 0, self.slice);
        if let Load::Of(address) = self.load.get() {
            return self.stumble(address);
        }
        let pc = self.register(RegisterARM::PC);
        if pc & !1 == EXC_RETURN {
            self.leave();
            self.bus().advance(EXCEPTION_NS);
            return None;
        }
        match ended {
            Ok(()) => self.bus().advance(8 * self.slice as u64),
            Err(_) if self.is_waiting() => self.nap(),
            Err(error) => return self.fault(&format!("{error:?}")),
        }
        None
    }

    /// What the flash was told to erase is gone at once, and the flash busy for
    /// a while.
    fn erase(&mut self) {
        let sectors = std::mem::take(&mut self.bus().erased);
        for (address, bytes) in sectors {
            self.patch(address, &vec![0xFF; bytes as usize]);
            let sector = address..address + bytes;
            let erased = self.spoilt.extract_if(.., |s| sector.contains(&s.address));
            for Spoilt { hook, .. } in erased {
                self.core.remove_hook(hook).expect("it was there");
            }
        }
    }

    /// What a load of a word that cannot be read leads to.
    fn stumble(&mut self, address: u32) -> Option<Stop> {
        self.bus().tell_unreadable(address);
        match self.chip.flash.unreadable {
            Unreadable::Nmi { .. } => {
                // The load is done first.
                self.load.set(Load::Done);
                let pc = self.register(RegisterARM::PC) | 1;
                let done = self.core.emu_start(pc, EXC_RETURN, 0, 1);
                done.expect("any bits are a word");
                self.enter(NMI, -2);
            }
            Unreadable::BusFault { .. } => {
                let (on, bit) = BUS_FAULTS_ON;
                let (register, shift) = BUS_FAULTS_PRIORITY;
                let priority = (self.bus().read(register) >> shift & 0xF0) as i16;
                if self.bus().read(on) & bit == 0 || self.priority() <= priority {
                    self.load.set(Load::None);
                    return self.fault("bus fault");
                }
                self.enter(BUS_FAULT, priority);
            }
        }
        self.load.set(Load::None);
        None
    }

    fn is_ticking(&self) -> bool {
        let vector = self.chip.tick_interrupt as u32 + 16;
        self.active.iter().any(|a| a.vector == vector)
    }

    fn provoke(&mut self) {
        let busy = !self.active.is_empty() || self.register(RegisterARM::BASEPRI) != 0;
        let let_through = self.bus().nvic.is_enabled(self.chip.tick_interrupt);
        if !busy || !let_through || self.is_ticking() {
            return;
        }
        self.found_busy += 1;
        if self
            .provokes_every
            .is_some_and(|n| self.found_busy.is_multiple_of(n))
        {
            self.provoked += 1;
            self.bus().nvic.pend(self.chip.tick_interrupt);
        }
    }

    fn watch_masks(&mut self) {
        let waits = self.bus().nvic.waits(self.chip.tick_interrupt);
        self.delayed += u32::from(waits && !self.is_ticking());
        let let_through = self.bus().nvic.is_enabled(self.chip.tick_interrupt);
        let masked = self.register(RegisterARM::PRIMASK) & 1 != 0;
        self.masked += u32::from(let_through && masked);
    }

    /// Whether the last instruction was a WFE or WFI.
    fn is_waiting(&self) -> bool {
        let pc = self.register(RegisterARM::PC) as u32 & !1;
        let before = |back: u32| {
            let bytes = self.core.mem_read_as_vec((pc - back).into(), 2);
            bytes.map(|b| u16::from_le_bytes([b[0], b[1]]))
        };
        [0, 2]
            .iter()
            .any(|back| matches!(before(*back), Ok(0xBF20 | 0xBF30)))
    }

    /// Sleeps until an interrupt is pending, at most a moment.
    fn nap(&mut self) {
        let pc = self.register(RegisterARM::PC) as u32 & !1;
        let here = self.word(pc & !3) >> (8 * (pc & 2)) & 0xFFFF;
        if matches!(here, 0xBF20 | 0xBF30) {
            self.set_register(RegisterARM::PC, u64::from(pc + 2) | 1);
        }
        let mut bus = self.bus();
        bus.gather();
        let woken = bus.nvic.has_pending();
        bus.advance(if woken { EXCEPTION_NS } else { NAP_NS });
    }

    /// Priority of what is being executed, masks included.
    fn priority(&self) -> i16 {
        let active = self.active.last().map_or(THREAD, |a| a.priority);
        let base = self.register(RegisterARM::BASEPRI) as i16 & 0xF0;
        let by_base = if base == 0 { THREAD } else { base };
        let by_primask = if self.register(RegisterARM::PRIMASK) & 1 != 0 {
            0
        } else {
            THREAD
        };
        active.min(by_base).min(by_primask)
    }

    fn take_interrupt(&mut self) {
        let current = self.priority();
        let next = self.bus().nvic.deliverable(current);
        if let Some((interrupt, priority)) = next {
            self.bus().nvic.take(interrupt);
            self.enter(interrupt as u32 + 16, priority.into());
        }
    }

    /// Stacks what the architecture stacks (with room for the FPU's registers,
    /// as with lazy stacking) and goes to the vector.
    fn enter(&mut self, vector: u32, priority: i16) {
        let context = self.core.context_init().expect("saved");
        let registers = [
            RegisterARM::R0,
            RegisterARM::R1,
            RegisterARM::R2,
            RegisterARM::R3,
            RegisterARM::R12,
            RegisterARM::LR,
            RegisterARM::PC,
            RegisterARM::XPSR,
        ];
        let frame: Vec<u8> = registers
            .iter()
            .flat_map(|r| (self.register(*r) as u32).to_le_bytes())
            .collect();
        let stack = (self.register(RegisterARM::SP) - 26 * 4) & !7;
        self.core
            .mem_write(stack, &frame)
            .expect("the stack is in a memory");
        let table = {
            let set = self.bus().read(0xE000_ED08);
            if set == 0 {
                self.chip.memories[0].0
            } else {
                set
            }
        };
        let handler = self.word(table + 4 * vector);
        self.active.push(Active {
            context,
            vector,
            priority,
        });
        self.taken.push(vector);
        self.set_register(RegisterARM::EPSR, THUMB);
        self.set_register(RegisterARM::SP, stack);
        self.set_register(RegisterARM::LR, EXC_RETURN | 1);
        self.set_register(RegisterARM::PC, handler.into());
    }

    /// Back to where the exception's frame says, where the handler may have said
    /// otherwise. BASEPRI and PRIMASK are no part of what is restored: a handler
    /// that left one set is seen.
    fn leave(&mut self) {
        let Some(active) = self.active.pop() else {
            return;
        };
        let back = self.word(self.register(RegisterARM::SP) as u32 + PC_IN_FRAME);
        let masks = [RegisterARM::BASEPRI, RegisterARM::PRIMASK];
        let kept = masks.map(|mask| self.register(mask));
        self.core
            .context_restore(&active.context)
            .expect("restored");
        for (mask, value) in masks.into_iter().zip(kept) {
            self.set_register(mask, value);
        }
        self.set_register(RegisterARM::PC, u64::from(back) | 1);
    }

    fn fault(&mut self, why: &str) -> Option<Stop> {
        if self.active.iter().any(|a| a.vector == HARD_FAULT) {
            return Some(Stop::Lockup(format!("{why} at {}", self.place())));
        }
        self.hard_faults += 1;
        self.enter(HARD_FAULT, -1);
        None
    }
}

/// The chip at the end of a scripted host's cable.
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
            Stop::Asked | Stop::Time => Ok(()),
            stop => Err(format!("{stop:?}")),
        }
    }
}

fn map_peripherals(core: &mut Unicorn<'static, ()>, bus: &Rc<RefCell<Bus>>, base: u32, size: u64) {
    let (on_read, on_write) = (Rc::clone(bus), Rc::clone(bus));
    let read = move |_: &mut Unicorn<'_, ()>, offset: u64, bytes: usize| {
        let address = base + offset as u32;
        let word = on_read.borrow_mut().read(address & !3);
        u64::from(word >> (8 * (address & 3)) & ones(bytes))
    };
    let write = move |_: &mut Unicorn<'_, ()>, offset: u64, bytes: usize, value: u64| {
        let address = base + offset as u32;
        let shift = 8 * (address & 3);
        let mut bus = on_write.borrow_mut();
        bus.write(address & !3, (value as u32) << shift, ones(bytes) << shift);
    };
    core.mmio_map(base.into(), size, Some(read), Some(write))
        .expect("peripherals");
}

fn ones(bytes: usize) -> u32 {
    u32::MAX >> (32 - 8 * bytes as u32)
}
