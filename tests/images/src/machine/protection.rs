//! The memory protection unit (ARM DDI 0403E, B3.5) as used by the images: regions without access,
//! and read-only regions, over the default map. Not modelled: other access, subregions, XN, and
//! overlapping regions. Also exception entry with a stack that cannot be written: the handler still
//! runs (ARM DDI 0337, 5.12.1), and its frame has the old memory.

use std::cell::Cell;
use std::ops::Range;
use std::rc::Rc;

use unicorn_engine::{HookType, MemType, Prot, Unicorn};

use super::Machine;

/// The fault status, and the address of a forbidden access.
const CFSR: u32 = 0xE000_ED28;
const MMFAR: u32 = 0xE000_ED34;
/// Bits of CFSR: forbidden data access, with its address in MMFAR; forbidden stacking; bus fault of
/// the stacking.
const DACCVIOL: u32 = 1 << 1;
const MSTKERR: u32 = 1 << 4;
const MMARVALID: u32 = 1 << 7;
const STKERR: u32 = 1 << 12;

/// Forbidden memory, and the last access to it.
#[derive(Default)]
pub(super) struct Protection {
    /// Base and attributes of each region, from the registers.
    registers: [(u32, u32); 16],
    forbidden_access: Rc<Cell<Option<u32>>>,
}

/// Returns a region with less access than in the default map, and its access, from base and
/// attributes.
fn restricted((base, attributes): (u32, u32)) -> Option<(Range<u32>, Prot)> {
    let access = match attributes >> 24 & 7 {
        0 => Prot::NONE,
        0b110 | 0b111 => Prot::READ | Prot::EXEC,
        _ => return None,
    };
    let bytes = 2 << (attributes >> 1 & 0x1F);
    (attributes & 1 != 0).then(|| (base..base + bytes, access))
}

impl Machine {
    /// Records the address of each forbidden access.
    pub(super) fn watch_forbidden(&mut self) {
        let forbidden_access = Rc::clone(&self.protection.forbidden_access);
        let note = move |_: &mut Unicorn<'_, ()>, _: MemType, at: u64, _: usize, _: i64| {
            forbidden_access.set(Some(at as u32));
            false
        };
        let all = HookType::MEM_READ_PROT | HookType::MEM_WRITE_PROT;
        self.core.add_mem_hook(all, 1, 0, note).expect("a hook");
    }

    /// Applies the present registers.
    pub(super) fn protect(&mut self) {
        let registers = self.bus().nvic.regions();
        let before = std::mem::replace(&mut self.protection.registers, registers);
        if registers == before {
            return;
        }
        for (region, _) in before.into_iter().filter_map(restricted) {
            self.allow(region, Prot::ALL);
        }
        for (region, access) in registers.into_iter().filter_map(restricted) {
            self.allow(region, access);
        }
        self.core.ctl_flush_tlb().expect("its data is dropped");
    }

    /// Allows accesses to a region of memory: elsewhere an access fails anyway.
    fn allow(&mut self, region: Range<u32>, access: Prot) {
        for (start, bytes) in self.chip.memories {
            let from = region.start.max(*start);
            let to = region.end.min(start + bytes);
            if from < to {
                let changed = self
                    .core
                    .mem_protect(from.into(), (to - from).into(), access);
                changed.expect("whole pages");
            }
        }
    }

    /// Reports the failed access to the program.
    pub(super) fn report_forbidden(&mut self) {
        if let Some(address) = self.protection.forbidden_access.take() {
            self.raise_status(DACCVIOL | MMARVALID);
            self.bus().write(MMFAR, address, u32::MAX);
        }
    }

    /// Writes an exception's frame, as far as the memory is writable.
    pub(super) fn stack_frame(&mut self, stack: u32, frame: &[u8]) {
        let regions = self.protection.registers.into_iter();
        let mut regions = regions.filter_map(restricted);
        let last = stack + frame.len() as u32 - 1;
        if regions.any(|(region, _)| region.contains(&stack) || region.contains(&last)) {
            self.raise_status(MSTKERR);
        } else if self.core.mem_write(stack.into(), frame).is_err() {
            self.raise_status(STKERR);
        }
    }

    fn raise_status(&mut self, bits: u32) {
        let mut bus = self.bus();
        let status = bus.read(CFSR) | bits;
        bus.write(CFSR, status, u32::MAX);
    }
}
