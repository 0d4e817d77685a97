//! Faults that tests inject into a running image.

use std::cell::Cell;
use std::rc::Rc;

use unicorn_engine::{HookType, MemType, UcHookId, Unicorn};

use super::Machine;
use crate::elf::Function;
use crate::stopwatch::Stopwatch;

/// The first disable register of the interrupt controller.
const NVIC_ICER: u32 = 0xE000_E180;

/// State of a load from a flash word that may fail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Load {
    #[default]
    Inactive,
    /// A load from this address is next.
    Armed(u32),
    /// The load is completed.
    Done,
}

/// A word of flash that cannot be read.
pub(super) struct UnreadableWord {
    pub(super) address: u32,
    pub(super) hook: UcHookId,
}

impl Machine {
    /// Overwrites memory, code included.
    pub fn patch(&mut self, address: u32, bytes: &[u8]) {
        self.core
            .mem_write(address.into(), bytes)
            .expect("in a memory");
        self.cache.borrow_mut().patch(address, bytes);
        let (from, to) = (u64::from(address), u64::from(address) + bytes.len() as u64);
        self.core
            .ctl_remove_cache(from, to)
            .expect("translated code is dropped");
    }

    /// Counts, from now on, the calls of a function and the instructions in it without its callees.
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

    /// Follows every instruction of the haptic interrupt from now on. Slow.
    pub fn start_stopwatch(&mut self) -> Stopwatch {
        let vector = 4 * (self.chip.tick_interrupt as u32 + 16);
        let entry = self.word(self.chip.memories[0].0 + vector) & !1;
        let stopwatch = Stopwatch::start(&mut self.core, entry);
        self.bus().stopwatch = Some(stopwatch.clone());
        stopwatch
    }

    /// Makes the flash word at `address` unreadable until it is erased, like an interrupted write.
    pub fn make_unreadable(&mut self, address: u32) {
        let bytes = self.chip.flash.word;
        let load = Rc::clone(&self.load);
        let on_load = move |core: &mut Unicorn<'_, ()>, _: MemType, _: u64, _: usize, _: i64| {
            if load.get() == Load::Inactive {
                load.set(Load::Armed(address));
                // Before the load.
                core.emu_stop().expect("stops");
            }
            true
        };
        let (from, to) = (u64::from(address), u64::from(address + bytes - 1));
        let hook = self
            .core
            .add_mem_hook(HookType::MEM_READ, from, to, on_load);
        // Code translated earlier has no hook.
        self.core
            .ctl_flush_tb()
            .expect("translated code is dropped");
        self.core.ctl_flush_tlb().expect("and its data");
        self.unreadable.push(UnreadableWord {
            address,
            hook: hook.expect("a hook"),
        });
    }

    /// Replaces calls of `function` by calls of `panicking`, a function of core's that takes only a
    /// source location, as if a line panicked.
    pub fn call_instead(&mut self, function: Function, panicking: Function) {
        let (flash, bytes) = self.chip.memories[0];
        // The end of flash, which no image reaches.
        let text = flash + bytes - 64;
        let location = text + 32;
        self.patch(text, b"made/by/a/test.rs");
        let words: Vec<u8> = [text, 17, 7, 9]
            .iter()
            .flat_map(|w: &u32| w.to_le_bytes())
            .collect();
        self.patch(location, &words);
        // ldr r0, [pc, #4]; ldr.w pc, [pc, #8]; nop; and their literals.
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

    /// Disables the interrupt of the supply's comparator, like a faulty program.
    pub fn mask_supply_interrupt(&mut self) {
        let interrupt = self.chip.comparator.interrupt as u32;
        let clear_enable = NVIC_ICER + 4 * (interrupt / 32);
        self.bus()
            .write(clear_enable, 1 << (interrupt % 32), u32::MAX);
    }

    /// Restores a function's own code.
    pub fn restore(&mut self, function: Function) {
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
}
