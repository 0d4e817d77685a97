//! Upper bound of an executed tick's cycles on the boards' chips: a model of their cores and
//! memories, driven by the addresses that the emulated core executed. `docs/reference/cycles.md`
//! has its sources and margins.

pub mod core;
pub mod fetch;
pub mod in_flash;
pub mod instruction;

use self::core::{Core, Floats};
use fetch::{Fetch, G474};
use instruction::{Instruction, Kind};

/// Bytes of a line of the H743's caches, and of a word of its flash.
const H743_LINE: u32 = 32;
/// Core cycles until a line arrives from the H743's flash: the bus has half of the core's clock. A
/// word of flash takes five of its cycles (RM0433, 4.3.8), the transfers four, and the path through
/// bus and cache about ten.
const H743_MISS: u64 = 40;
/// Additional cycles of an access to a peripheral, through its buses; the slowest of an H743 has a
/// quarter of the core's clock.
const G474_PERIPHERAL: u64 = 4;
const H743_PERIPHERAL: u64 = 32;
/// The most cycles that a tick of the H743 waits for its data if none is in the data cache:
/// [`H743_DATA_LINES`] lines of the AXI SRAM at [`H743_DATA_LINE`] each. Up to this sum every load
/// and store waits `H743_MISS`.
pub const H743_DATA: u64 = 16_000;
/// Lines of data of a tick: the loop's own data, four for each patch that a tick may examine, and a
/// queue's. A test checks the images against this.
pub const H743_DATA_LINES: u64 = 615;
/// Core cycles for one line: 13 cycles of the bus, of which four are transfers.
pub const H743_DATA_LINE: u64 = 26;
const _: () = assert!(H743_DATA_LINES * H743_DATA_LINE <= H743_DATA);
/// Address range of the peripherals.
const PERIPHERALS: std::ops::Range<u32> = 0x4000_0000..0x6000_0000;

/// Cycles of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cycles {
    /// Instructions.
    pub instructions: u32,
    /// Most cycles of an STM32G474 at 168 MHz with its code in flash.
    pub g474: u32,
    /// Most cycles of an STM32H743 at 456 MHz with its code in ITCM, except some functions.
    pub h743: u32,
}

/// Both chips while they execute one tick. Their caches are empty at its start.
#[derive(Clone, Debug)]
pub struct Tick {
    instructions: u64,
    g474: u64,
    fetch: Fetch,
    h743: u64,
    floats: Floats,
    /// The line of the H743's flash in use.
    line: Option<u32>,
    /// Loads and stores.
    accesses: u64,
    /// Register of the previous floating-point instruction's result.
    before: Option<u32>,
}

impl Default for Tick {
    fn default() -> Self {
        Self {
            instructions: 0,
            g474: 0,
            fetch: Fetch::new(G474),
            h743: 0,
            floats: Floats::default(),
            line: None,
            accesses: 0,
            before: None,
        }
    }
}

impl Tick {
    /// Executes an instruction; `next` is the address executed after it. `in_flash` is true if the
    /// H743 has it in flash as well.
    pub fn execute(&mut self, instruction: &Instruction, next: u32, in_flash: bool) {
        let Instruction {
            address,
            length,
            kind,
            ..
        } = *instruction;
        let jumps = next != address + length;
        self.instructions += 1;
        self.accesses += u64::from(matches!(kind, Kind::Load(_) | Kind::Store(_)));
        let there_at = self.fetch.instruction(address, length, self.g474);
        self.g474 = there_at + Core::M4.wait(self.before, instruction);
        if instruction.is_literal {
            self.g474 = self.fetch.literal(self.g474);
        }
        self.g474 += Core::M4.cycles(instruction, jumps);
        self.before = instruction.result;
        self.h743 = self.floats.begin(instruction, self.h743);
        self.h743 += Core::M7.cycles(instruction, jumps);
        let line = in_flash.then_some((address + length - 1) / H743_LINE);
        if line.is_some() && line != self.line {
            // No prefetch, and no cache hit.
            self.h743 += H743_MISS;
        }
        self.line = line;
    }

    /// Records the address of a load or store, if it is known.
    pub fn touch(&mut self, address: u32) {
        if PERIPHERALS.contains(&address) {
            self.g474 += G474_PERIPHERAL;
            self.h743 += H743_PERIPHERAL;
        }
    }

    /// Returns the cycles up to now.
    #[must_use]
    pub fn cycles(&self) -> Cycles {
        let data = (self.accesses * H743_MISS).min(H743_DATA);
        Cycles {
            instructions: self.instructions as u32,
            g474: self.g474 as u32,
            h743: (self.h743 + data) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::instruction::decode;
    use super::*;

    /// The encodings are `vadd.f32 s0, s0, s1` and `b`.
    #[test]
    fn loop_is_charged_for_each_jump() {
        let mut tick = Tick::default();
        for _ in 0..10 {
            for address in [0, 4, 8] {
                tick.execute(&decode(address, 0xEE30, 0x0A20), address + 4, false);
            }
            tick.execute(&decode(12, 0xE7F8, 0), 0, false);
        }
        let cycles = tick.cycles();
        assert_eq!(cycles.instructions, 40);
        // An iteration: reads of the first and second line, two instructions of the second, one of
        // which waits for a result, and the branch with its refill. The prefetch has ended by then.
        assert_eq!(cycles.g474, 10 * (5 + 5 + 2 + 4));
        // The second and third wait for the previous result; then the branch and its misprediction.
        assert_eq!(cycles.h743, 10 * (2 * 3 + 1 + 1 + 6));
    }

    #[test]
    fn h743_code_in_flash_costs_one_read_per_line() {
        let run = |in_flash| {
            let mut tick = Tick::default();
            for address in (0..64).step_by(2) {
                tick.execute(&decode(address, 0x1840, 0), address + 2, in_flash);
            }
            tick.cycles().h743
        };
        assert_eq!([run(false), run(true)], [32, 32 + 2 * 40]);
    }

    #[test]
    fn data_access_waits_for_the_whole_line() {
        let loads = |count| {
            let mut tick = Tick::default();
            (0..count).for_each(|_| tick.execute(&decode(0, 0x6840, 0), 2, false));
            u64::from(tick.cycles().h743) - 3 * count
        };
        assert_eq!([1, 400, 600].map(loads), [40, 16_000, 16_000]);
    }

    #[test]
    fn peripheral_access_waits_each_time() {
        let mut tick = Tick::default();
        for address in [0x2400_0000, 0x4000_0024, 0x4000_0024] {
            tick.touch(address);
        }
        assert_eq!((tick.cycles().g474, tick.cycles().h743), (8, 64));
    }
}
