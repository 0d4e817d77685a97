//! Time of the haptic interrupt, from the model of cycles for every instruction that it executes
//! and every peripheral that it accesses.

use std::cell::RefCell;
use std::rc::Rc;

use hapterra_tests::cycles::instruction::{Instruction, decode};
use hapterra_tests::cycles::{Cycles, Tick};
use unicorn_engine::Unicorn;

/// Start address of a chip's flash.
const FLASH: u32 = 0x0800_0000;
/// First and last addresses of code, in ITCM and in flash.
const CODE: [(u64, u64); 2] = [(0, 0xFFFF), (0x0800_0000, 0x081F_FFFF)];

/// The figures of successive interrupts.
#[derive(Debug, Default)]
pub struct Figures {
    /// From the interrupt's first instruction to the command of axis 3.
    pub to_output: Vec<Cycles>,
    /// Of the whole interrupt.
    pub whole: Vec<Cycles>,
}

/// The measurement of an interrupt in progress.
#[derive(Debug, Default)]
struct Following {
    /// The handler's first instruction.
    entry: u32,
    tick: Option<Tick>,
    /// Counted when the next address is known.
    pending: Option<Instruction>,
    figures: Figures,
}

/// The measurement, shared by the core's hooks and the code that detects the end of an interrupt.
#[derive(Clone, Debug)]
pub struct Stopwatch(Rc<RefCell<Following>>);

impl Stopwatch {
    /// Starts to follow the handler at `entry` on this core.
    pub(crate) fn start(core: &mut Unicorn<'static, ()>, entry: u32) -> Self {
        let following = Following {
            entry,
            ..Following::default()
        };
        let stopwatch = Self(Rc::new(RefCell::new(following)));
        for (from, to) in CODE {
            let code = stopwatch.clone();
            let executes = move |core: &mut Unicorn<'_, ()>, address: u64, _: u32| {
                let mut bytes = [0; 4];
                core.mem_read(address, &mut bytes).expect("code");
                let [first, second] = [0, 2].map(|i| u16::from_le_bytes([bytes[i], bytes[i + 1]]));
                let instruction = decode(address as u32, first, second);
                code.0.borrow_mut().execute(instruction);
            };
            core.add_code_hook(from, to, executes).expect("a hook");
        }
        core.ctl_flush_tb().expect("translated code is dropped");
        stopwatch
    }

    /// Records a load or store at an address.
    pub(crate) fn touch(&self, address: u32) {
        if let Some(tick) = &mut self.0.borrow_mut().tick {
            tick.touch(address);
        }
    }

    /// Records that the command of axis 3 was written.
    pub(crate) fn output(&self) {
        let mut following = self.0.borrow_mut();
        let cycles = following.tick.as_ref().map(Tick::cycles);
        following.figures.to_output.extend(cycles);
    }

    /// Records the end of the interrupt.
    pub(crate) fn end(&self) {
        let mut following = self.0.borrow_mut();
        if let Some(instruction) = following.pending.take() {
            // It returns to another address.
            following.execute_pending(instruction, 0);
        }
        if let Some(tick) = following.tick.take() {
            following.figures.whole.push(tick.cycles());
        }
    }

    /// Returns the figures up to now.
    #[must_use]
    pub fn take(&self) -> Figures {
        std::mem::take(&mut self.0.borrow_mut().figures)
    }
}

impl Following {
    fn execute(&mut self, instruction: Instruction) {
        if instruction.address == self.entry {
            (self.tick, self.pending) = (Some(Tick::default()), None);
        }
        if let Some(before) = self.pending.take() {
            self.execute_pending(before, instruction.address);
        }
        self.pending = Some(instruction);
    }

    fn execute_pending(&mut self, instruction: Instruction, next: u32) {
        if let Some(tick) = &mut self.tick {
            tick.execute(&instruction, next, instruction.address >= FLASH);
        }
    }
}
