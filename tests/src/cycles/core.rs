//! Time of instructions in two cores, without the wait states of their memories.
//!
//! Upper bounds: the end of a manual's range, and no overlap of instructions that might overlap.

use super::instruction::{Instruction, Kind};

/// A core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// The Cortex-M4, by its manual's tables (DDI 0439, 3.3 and 7.2). A load or store takes its 2
    /// cycles though neighbours overlap, a refill of the pipeline the maximum of 3, a division 12.
    M4,
    /// The Cortex-M7. Arm publishes no table, so it has the latencies of LLVM's model
    /// (`ARMScheduleM7.td`), one instruction at a time: the next one waits for an integer result to
    /// the end, as if it were an address, and for a floating-point result when it reads it
    /// ([`Floats`]). Every branch that may be mispredicted is: 6 cycles, where that model has 4 to
    /// 6.
    M7,
}

/// Cycles to refill the M4's pipeline, at most.
const REFILL: u64 = 3;
/// Cycles of a branch that the M7 predicted wrongly.
const MISPREDICTED: u64 = 6;

impl Core {
    /// Returns the most cycles of an instruction. `jumps`: the next one executed is elsewhere.
    #[must_use]
    pub fn cycles(self, instruction: &Instruction, jumps: bool) -> u64 {
        match self {
            Self::M4 => m4(instruction.kind) + if jumps { REFILL } else { 0 },
            Self::M7 => {
                let is_guess = matches!(instruction.kind, Kind::Branch { conditional: true });
                m7(instruction.kind) + if jumps || is_guess { MISPREDICTED } else { 0 }
            }
        }
    }

    /// Returns the cycles that a floating-point instruction waits for the result of the previous
    /// one, if it reads it. For the M7, [`Floats`] computes them.
    #[must_use]
    pub fn wait(self, before: Option<u32>, instruction: &Instruction) -> u64 {
        let reads = before.is_some() && instruction.reads.contains(&before);
        u64::from(self == Self::M4 && reads)
    }
}

fn m4(kind: Kind) -> u64 {
    match kind {
        Kind::Integer | Kind::Branch { .. } | Kind::Float => 1,
        Kind::Multiply | Kind::TableBranch | Kind::FloatTransfer => 2,
        Kind::Divide => 12,
        Kind::Load(words) | Kind::Store(words) => 1 + u64::from(words),
        Kind::System => 4,
        Kind::FloatMac => 3,
        Kind::FloatDivide => 14,
    }
}

fn m7(kind: Kind) -> u64 {
    match kind {
        Kind::Integer | Kind::Branch { .. } => 1,
        Kind::Multiply => 2,
        Kind::Divide => 12,
        Kind::Load(words) => 2 + u64::from(words),
        Kind::Store(words) => 1 + u64::from(words),
        Kind::TableBranch | Kind::System => 4,
        Kind::Float | Kind::FloatMac => 1,
        Kind::FloatTransfer => 3,
        Kind::FloatDivide => 16,
    }
}

/// Times at which the M7's floating-point results are ready.
#[derive(Clone, Debug, Default)]
pub struct Floats {
    ready_at: [u64; 32],
    /// The latest of them: a transfer waits for it, as it may read the flags.
    all_ready_at: u64,
}

impl Floats {
    /// Returns the time, `now` or later, at which an instruction can begin, and records its result.
    pub fn begin(&mut self, instruction: &Instruction, now: u64) -> u64 {
        let reads = instruction.reads.iter().flatten();
        let at = reads.map(|register| self.ready_at[*register as usize]);
        let at = at.fold(now, u64::max);
        let latency = match instruction.kind {
            Kind::FloatTransfer => return at.max(self.all_ready_at),
            Kind::Float => 3,
            Kind::FloatMac => 6,
            _ => return at,
        };
        if let Some(register) = instruction.result {
            self.ready_at[register as usize] = at + latency;
        }
        self.all_ready_at = self.all_ready_at.max(at + latency);
        at
    }
}

#[cfg(test)]
mod tests {
    use super::super::instruction::decode;
    use super::*;

    /// Returns the cycles on an M4 without wait states, each with the next one's address.
    fn m4_cycles(program: &[(u16, u16, bool)]) -> u64 {
        let mut before = None;
        let each = program.iter().map(|&(first, second, jumps)| {
            let instruction = decode(0, first, second);
            let cycles = Core::M4.cycles(&instruction, jumps) + Core::M4.wait(before, &instruction);
            before = instruction.result;
            cycles
        });
        each.sum()
    }

    #[test]
    fn m4_cycle_counts_match_the_manual() {
        // movs r0, #1; adds r0, r0, r1; muls r0, r1
        assert_eq!(m4_cycles(&[(0x2001, 0, false), (0x1840, 0, false)]), 2);
        // push {r4-r7, lr}: 1 + N; pop {r4-r7, pc}: 1 + N + P
        assert_eq!(m4_cycles(&[(0xB5F0, 0, false), (0xBDF0, 0, true)]), 6 + 9);
        // A branch not taken, and one taken: 1, 1 + P.
        assert_eq!(m4_cycles(&[(0xD001, 0, false), (0xD001, 0, true)]), 1 + 4);
        // vdiv.f32 s0, s0, s1; vsqrt.f32 s2, s3
        let (divide, root) = ((0xEE80, 0x0A20, false), (0xEEB1, 0x1AE1, false));
        assert_eq!(m4_cycles(&[divide, root]), 28);
        // vadd.f32 s0, s0, s1 twice: the second needs the first one's result.
        let add = (0xEE30, 0x0A20, false);
        assert_eq!(m4_cycles(&[add, add]), 3);
        // vldmia r0, {s0-s3}: 1 + N
        assert_eq!(m4_cycles(&[(0xEC90, 0x0A04, false)]), 5);
    }

    #[test]
    fn m7_waits_for_its_operands() {
        let add = decode(0, 0xEE30, 0x0A20); // vadd.f32 s0, s0, s1
        let other = decode(0, 0xEE31, 0x1A22); // vadd.f32 s2, s2, s5
        let mac = decode(0, 0xEE00, 0x0A20); // vmla.f32 s0, s0, s1
        let flags = decode(0, 0xEEF1, 0xFA10); // vmrs apsr_nzcv, fpscr
        let mut floats = Floats::default();
        assert_eq!(floats.begin(&add, 10), 10);
        assert_eq!(floats.begin(&other, 11), 11);
        assert_eq!(floats.begin(&mac, 12), 13);
        assert_eq!(floats.begin(&add, 14), 19);
        assert_eq!(floats.begin(&flags, 20), 22);
    }

    #[test]
    fn m7_is_charged_for_each_misprediction() {
        let conditional = decode(0, 0xD001, 0);
        assert_eq!(Core::M7.cycles(&conditional, false), 7);
        assert_eq!(Core::M7.cycles(&decode(0, 0x1840, 0), false), 1);
        assert_eq!(Core::M7.cycles(&decode(0, 0xEE80, 0x0A20), false), 16);
    }
}
