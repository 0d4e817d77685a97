//! The data cache of an H743's core (ARM DDI 0403E, B2.2.7; ARM DDI 0489, 1.2): data that is only
//! in the cache is lost at a reset.
//!
//! Modelled: DC of CCR, and cleaning by address (DCCMVAC, DCCIMVAC), over the AXI SRAM. The worst
//! cache is assumed: it writes back only on command, and keeps everything. The worst memory is
//! assumed as well: its buffer (RM0433, 2.4) keeps the last line written until the next one, and
//! not only an incomplete word. Not modelled: sets and ways, an invalidation that drops written
//! data, other masters of the bus, and the instruction cache. No image uses DMA, and a test patches
//! both the cache and the memory.

use unicorn_engine::Unicorn;

/// The cached memory: address and bytes. The tightly coupled memory is not cached.
const CACHED: (u32, usize) = (0x2400_0000, 512 * 1024);
/// CCR and its bit that enables the data cache.
const CCR: u32 = 0xE000_ED14;
const DC: u32 = 1 << 16;
/// Registers that clean a line, or clean and invalidate it, by an address in it.
const DCCMVAC: u32 = 0xE000_EF68;
const DCCIMVAC: u32 = 0xE000_EF70;
/// Bytes of a line.
const LINE: usize = 32;

/// The cache, represented by the content of the memory behind it while it is on. Off at first.
#[derive(Default)]
pub(super) struct DataCache {
    memory: Option<Vec<u8>>,
    /// The line in the memory's buffer: its offset and bytes.
    buffered: Option<(usize, Vec<u8>)>,
}

impl DataCache {
    /// Handles the core's write of a register.
    pub(super) fn follow(&mut self, core: &Unicorn<'_, ()>, register: u32, value: u32) {
        let (start, bytes) = CACHED;
        let read = |at: usize, bytes: usize| {
            let read = core.mem_read_as_vec(u64::from(start) + at as u64, bytes);
            read.expect("in a memory")
        };
        match (register, &mut self.memory) {
            (CCR, None) if value & DC != 0 => self.memory = Some(read(0, bytes)),
            (CCR, Some(_)) if value & DC == 0 => (self.memory, self.buffered) = (None, None),
            (DCCMVAC | DCCIMVAC, Some(memory)) => {
                let at = value.wrapping_sub(start) as usize / LINE * LINE;
                if memory.len() < at + LINE {
                    return;
                }
                let before = self.buffered.replace((at, read(at, LINE)));
                if let Some((at, bytes)) = before {
                    memory[at..at + LINE].copy_from_slice(&bytes);
                }
            }
            _ => {}
        }
    }

    /// Changes memory for a test: both the cached data and the data behind it.
    pub(super) fn patch(&mut self, address: u32, bytes: &[u8]) {
        let at = address.wrapping_sub(CACHED.0) as usize;
        let memory = self.memory.as_mut();
        if let Some(place) = memory.and_then(|all| all.get_mut(at..at.checked_add(bytes.len())?)) {
            place.copy_from_slice(bytes);
        }
    }

    /// Switches it off at a reset. Returns the address of the covered memory, and its content.
    pub(super) fn reset(&mut self) -> Option<(u32, Vec<u8>)> {
        self.buffered = None;
        self.memory.take().map(|memory| (CACHED.0, memory))
    }
}
