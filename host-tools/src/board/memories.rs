//! The chips' memories, to check images.
//!
//! The numbers are from ST's reference manuals RM0440 and RM0433; a test compares them with
//! probe-rs' registry.

use std::ops::Range;

const KIB: u64 = 1024;

/// The memories of a chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memories {
    /// First address of flash.
    pub flash: u64,
    /// Bytes of flash.
    pub flash_bytes: u64,
    /// Bytes of the smallest erasable unit.
    pub page_bytes: u64,
    /// Bytes of the smallest writable unit, which has its own check bits.
    pub word_bytes: u64,
    /// Bytes at the beginning of flash that an image may use; the calibrations follow.
    pub image_bytes: u64,
    /// RAM: first address and bytes of each block; adjacent memories are one block.
    pub ram: &'static [(u64, u64)],
}

impl Memories {
    /// STM32G474RE with two banks, as delivered.
    pub const G474: Self = Self {
        flash: 0x0800_0000,
        flash_bytes: 512 * KIB,
        page_bytes: 2 * KIB,
        word_bytes: 8,
        image_bytes: 508 * KIB,
        // CCM RAM; then SRAM1, SRAM2 and CCM again as one block.
        ram: &[(0x1000_0000, 32 * KIB), (0x2000_0000, 128 * KIB)],
    };

    /// STM32H743ZI.
    pub const H743: Self = Self {
        flash: 0x0800_0000,
        flash_bytes: 2048 * KIB,
        page_bytes: 128 * KIB,
        word_bytes: 32,
        image_bytes: 1792 * KIB,
        // ITCM, DTCM, AXI SRAM, SRAM1 to 3, SRAM4.
        ram: &[
            (0x0000_0000, 64 * KIB),
            (0x2000_0000, 128 * KIB),
            (0x2400_0000, 512 * KIB),
            (0x3000_0000, 288 * KIB),
            (0x3800_0000, 64 * KIB),
        ],
    };

    /// Returns all addresses of flash.
    #[must_use]
    pub const fn all_flash(&self) -> Range<u64> {
        self.flash..self.flash + self.flash_bytes
    }

    /// Returns the addresses of flash that an image may use.
    #[must_use]
    pub const fn for_image(&self) -> Range<u64> {
        self.flash..self.flash + self.image_bytes
    }

    /// Returns the memory that contains a whole range, if one does.
    #[must_use]
    pub fn containing(&self, address: u64, bytes: u64, in_flash: bool) -> Option<Range<u64>> {
        let end = address.checked_add(bytes)?;
        let holds = |memory: &Range<u64>| memory.start <= address && end <= memory.end;
        if in_flash {
            return Some(self.all_flash()).filter(holds);
        }
        let ram = self.ram.iter().map(|(start, bytes)| *start..start + bytes);
        ram.into_iter().find(holds)
    }
}

#[cfg(all(test, feature = "probe"))]
mod tests {
    use super::*;
    use probe_rs::config::{MemoryRegion, Registry};

    #[test]
    fn memories_match_probe_rs_registry() {
        let registry = Registry::from_builtin_families();
        for (chip, memories) in [
            ("STM32G474RETx", Memories::G474),
            ("STM32H743ZITx", Memories::H743),
        ] {
            let target = registry.get_target_by_name(chip).expect(chip);
            let mut ram: Vec<Range<u64>> = vec![];
            let mut flash: Vec<Range<u64>> = vec![];
            for region in &target.memory_map {
                match region {
                    MemoryRegion::Ram(found) => ram.push(found.range.clone()),
                    MemoryRegion::Nvm(found) => flash.push(found.range.clone()),
                    _ => {}
                }
            }
            let holds = |all: &[Range<u64>], at: u64| all.iter().any(|range| range.contains(&at));
            let flash_ends = [memories.flash, memories.flash + memories.flash_bytes - 1];
            assert!(flash_ends.iter().all(|at| holds(&flash, *at)), "{chip}");
            for (start, bytes) in memories.ram {
                let ends = [*start, start + bytes - 1];
                assert!(ends.iter().all(|at| holds(&ram, *at)), "{chip} {start:#x}");
            }
        }
    }
}
