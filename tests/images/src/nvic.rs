//! The interrupt controller and the few system registers that the images use.
//!
//! Modelled: the registers that enable, disable, set and clear interrupts, their priorities with
//! four bits, and the reset by AIRCR. Not modelled: priority groups, the active bits, STIR,
//! SysTick. The memory protection unit has only its regions, see `machine/protection`. Other
//! registers of the page read back their written values; the faults and the data cache read theirs
//! from there.

use std::collections::HashMap;

/// Base of the system control space's page.
pub const BASE: u32 = 0xE000_E000;
const ISER: u32 = 0x100;
const ICER: u32 = 0x180;
const ISPR: u32 = 0x200;
const ICPR: u32 = 0x280;
const IPR: u32 = 0x400;
/// Application interrupt and reset control: the key in its upper half, and the reset bit.
const AIRCR: u32 = 0xD0C;
const KEY: u32 = 0x05FA;
const SYSRESETREQ: u32 = 1 << 2;
/// The memory protection unit: its enable, the selected region, the base, with another region's
/// number if bit 4 is set, and the attributes.
const MPU_CTRL: u32 = 0xD94;
const MPU_RNR: u32 = 0xD98;
const MPU_RBAR: u32 = 0xD9C;
const MPU_RASR: u32 = 0xDA0;
const VALID: u32 = 1 << 4;
/// Regions of a Cortex-M7; an M4 has half as many.
const REGIONS: usize = 16;
/// Largest number of interrupts.
const INTERRUPTS: usize = 240;

/// Enables, pending bits and priorities of all interrupts.
pub struct Nvic {
    enabled: [bool; INTERRUPTS],
    pending: [bool; INTERRUPTS],
    priority: [u8; INTERRUPTS],
    /// Base and attributes of each region.
    regions: [(u32, u32); REGIONS],
    other: HashMap<u32, u32>,
    /// True if the program has requested a reset.
    pub requests_reset: bool,
}

impl Default for Nvic {
    fn default() -> Self {
        Self {
            enabled: [false; INTERRUPTS],
            pending: [false; INTERRUPTS],
            priority: [0; INTERRUPTS],
            regions: [(0, 0); REGIONS],
            other: HashMap::new(),
            requests_reset: false,
        }
    }
}

impl Nvic {
    /// Returns the word at an offset in the page.
    #[must_use]
    pub fn read(&self, offset: u32) -> u32 {
        let bits = |from: u32, of: &[bool; INTERRUPTS]| {
            let first = ((offset - from) / 4 * 32) as usize;
            let bit = |i: usize| u32::from(of.get(first + i).copied().unwrap_or(false)) << i;
            (0..32).map(bit).sum()
        };
        match offset {
            ISER..0x120 => bits(ISER, &self.enabled),
            ICER..0x1A0 => bits(ICER, &self.enabled),
            ISPR..0x220 => bits(ISPR, &self.pending),
            ICPR..0x2A0 => bits(ICPR, &self.pending),
            IPR..0x4F0 => {
                let first = (offset - IPR) as usize;
                let four = self.priority.get(first..first + 4).unwrap_or(&[0; 4]);
                u32::from_le_bytes(four.try_into().unwrap_or_default())
            }
            MPU_RBAR => self.region().0 | self.region_number() as u32,
            MPU_RASR => self.region().1,
            _ => self.other.get(&offset).copied().unwrap_or(0),
        }
    }

    /// Writes `value` under `mask` (the bytes of the access).
    pub fn write(&mut self, offset: u32, value: u32, mask: u32) {
        let each = |from: u32| {
            let first = (offset - from) / 4 * 32;
            let is_set = move |i: &u32| value & mask & (1 << i) != 0;
            (0..32).filter(is_set).map(move |i| (first + i) as usize)
        };
        match offset {
            ISER..0x120 => set(&mut self.enabled, each(ISER), true),
            ICER..0x1A0 => set(&mut self.enabled, each(ICER), false),
            ISPR..0x220 => set(&mut self.pending, each(ISPR), true),
            ICPR..0x2A0 => set(&mut self.pending, each(ICPR), false),
            IPR..0x4F0 => {
                let first = (offset - IPR) as usize;
                for (i, byte) in value.to_le_bytes().into_iter().enumerate() {
                    if mask >> (8 * i) & 0xFF != 0 {
                        // Only four bits are implemented: the others read as zero.
                        self.priority[first + i] = byte & 0xF0;
                    }
                }
            }
            MPU_RBAR => {
                if value & VALID != 0 {
                    self.other.insert(MPU_RNR, value & 0xF);
                }
                self.regions[self.region_number()].0 = value & !0x1F;
            }
            MPU_RASR => self.regions[self.region_number()].1 = value,
            AIRCR => self.requests_reset |= value >> 16 == KEY && value & SYSRESETREQ != 0,
            _ => {
                let word = self.other.entry(offset).or_default();
                *word = *word & !mask | value & mask;
            }
        }
    }

    fn region_number(&self) -> usize {
        self.other
            .get(&MPU_RNR)
            .map_or(0, |n| *n as usize % REGIONS)
    }

    fn region(&self) -> (u32, u32) {
        self.regions[self.region_number()]
    }

    /// Returns base and attributes of every region of the memory protection unit, or zeros while it
    /// is off.
    #[must_use]
    pub fn regions(&self) -> [(u32, u32); REGIONS] {
        let is_on = self.other.get(&MPU_CTRL).is_some_and(|on| on & 1 != 0);
        if is_on {
            self.regions
        } else {
            Default::default()
        }
    }

    /// Raises an interrupt.
    pub fn pend(&mut self, interrupt: usize) {
        self.pending[interrupt] = true;
    }

    /// Returns the interrupt that would be taken at execution priority `current`, and its own
    /// priority.
    #[must_use]
    pub fn deliverable(&self, current: i16) -> Option<(usize, u8)> {
        let ready = (0..INTERRUPTS).filter(|i| self.enabled[*i] && self.pending[*i]);
        let first = ready.min_by_key(|i| (self.priority[*i], *i))?;
        let priority = self.priority[first];
        (i16::from(priority) < current).then_some((first, priority))
    }

    /// Returns true if any enabled interrupt is pending, which wakes a sleeping core.
    #[must_use]
    pub fn has_pending(&self) -> bool {
        (0..INTERRUPTS).any(|i| self.enabled[i] && self.pending[i])
    }

    /// Returns true if an interrupt is enabled.
    #[must_use]
    pub fn is_enabled(&self, interrupt: usize) -> bool {
        self.enabled[interrupt]
    }

    /// Returns true if an interrupt is enabled and pending.
    #[must_use]
    pub fn is_waiting(&self, interrupt: usize) -> bool {
        self.enabled[interrupt] && self.pending[interrupt]
    }

    /// Takes an interrupt, which is then no longer pending.
    pub fn take(&mut self, interrupt: usize) {
        self.pending[interrupt] = false;
    }

    /// Returns every enabled interrupt and its priority.
    #[must_use]
    pub fn enabled(&self) -> Vec<(usize, u8)> {
        let on = (0..INTERRUPTS).filter(|i| self.enabled[*i]);
        on.map(|i| (i, self.priority[i])).collect()
    }
}

fn set(bits: &mut [bool; INTERRUPTS], which: impl Iterator<Item = usize>, to: bool) {
    for bit in which.filter(|i| *i < INTERRUPTS) {
        bits[bit] = to;
    }
}
