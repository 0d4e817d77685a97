//! Branch targets of a Thumb-2 instruction besides the next one.
//!
//! Only branches are decoded, by their encodings in the ARMv7-M manual (DDI 0403E, A7.7). These few
//! lines need no disassembler, and the available ones fail at floating-point instructions.

/// Effect of an instruction on the control flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flow {
    /// Continues, returns, or stops.
    Next,
    /// May branch to or call this address.
    To(u32),
    /// Branches to an address from a register or a table.
    Indirect,
}

/// Returns length in bytes and flow of the instruction at `address`, from its first half-word and
/// the next one.
pub(crate) fn instruction(address: u32, first: u16, second: u16) -> (u32, Flow) {
    if first >> 11 >= 0b11101 {
        (4, wide(address, u32::from(first), u32::from(second)))
    } else {
        (2, narrow(address, first))
    }
}

fn narrow(address: u32, word: u16) -> Flow {
    const LR: u16 = 14;
    let to = |offset: i32| Flow::To(target(address, offset));
    match word {
        // BX and BLX; BX LR returns.
        w if w & 0xFF07 == 0x4700 => match (w >> 7 & 1, w >> 3 & 15) {
            (0, LR) => Flow::Next,
            _ => Flow::Indirect,
        },
        // MOV PC and ADD PC
        w if w & 0xFF87 == 0x4687 || w & 0xFF87 == 0x4487 => Flow::Indirect,
        // B<cond>, encoding T1; conditions 14 and 15 are UDF and SVC.
        w if w >> 12 == 0b1101 && w >> 8 & 15 < 14 => to(signed(u32::from(w & 0xFF) << 1, 9)),
        // B, encoding T2
        w if w >> 11 == 0b11100 => to(signed(u32::from(w & 0x7FF) << 1, 12)),
        // CBZ and CBNZ
        w if w & 0xF500 == 0xB100 => {
            let offset = (w >> 9 & 1) << 6 | (w >> 3 & 31) << 1;
            to(i32::from(offset))
        }
        _ => Flow::Next,
    }
}

fn wide(address: u32, first: u32, second: u32) -> Flow {
    const SP: u32 = 13;
    const PC: u32 = 15;
    // LDR PC, […], except POP {PC} in its wide form, which returns.
    if first & 0xFF70 == 0xF850 && second >> 12 == PC {
        return if first & 15 == SP {
            Flow::Next
        } else {
            Flow::Indirect
        };
    }
    if first >> 11 != 0b11110 || second >> 15 != 1 {
        return Flow::Next;
    }
    let sign = first >> 10 & 1;
    let (j1, j2, low) = (second >> 13 & 1, second >> 11 & 1, second & 0x7FF);
    match second & 0x5000 {
        // BL (T1) and B.W (T4)
        0x5000 | 0x1000 => {
            let (i1, i2) = (j1 ^ sign ^ 1, j2 ^ sign ^ 1);
            let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | low << 1;
            Flow::To(target(address, signed(offset, 25)))
        }
        // B<cond>.W (T3); conditions 14 and 15 are other instructions.
        0x0000 if first >> 6 & 15 < 14 => {
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3F) << 12 | low << 1;
            Flow::To(target(address, signed(offset, 21)))
        }
        _ => Flow::Next,
    }
}

fn target(address: u32, offset: i32) -> u32 {
    address.wrapping_add(4).wrapping_add_signed(offset)
}

fn signed(value: u32, bits: u32) -> i32 {
    ((value << (32 - bits)) as i32) >> (32 - bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flow(first: u16, second: u16) -> Flow {
        instruction(0x1000, first, second).1
    }

    // The encodings are LLVM's for the instructions named.
    #[test]
    fn branch_and_call_targets_match_the_assembler() {
        assert_eq!(flow(0xF000, 0xF87E), Flow::To(0x1100), "bl forward");
        assert_eq!(flow(0xF7FF, 0xFFFE), Flow::To(0x1000), "bl to itself");
        assert_eq!(flow(0xF7FF, 0xBF7E), Flow::To(0x0F00), "b.w backward");
        assert_eq!(flow(0xF000, 0x807E), Flow::To(0x1100), "beq.w");
        assert_eq!(flow(0xF43F, 0xAF7E), Flow::To(0x0F00), "beq.w backward");
        assert_eq!(flow(0xE7FE, 0), Flow::To(0x1000), "b to itself");
        assert_eq!(flow(0xD001, 0), Flow::To(0x1006), "beq");
        assert_eq!(flow(0xB108, 0), Flow::To(0x1006), "cbz r0");
        assert_eq!(flow(0xBB00, 0), Flow::To(0x1044), "cbnz r0");
    }

    #[test]
    fn indirect_branch_is_distinguished_from_return() {
        assert_eq!(flow(0x4770, 0), Flow::Next, "bx lr");
        assert_eq!(flow(0x4780, 0), Flow::Indirect, "blx r0");
        assert_eq!(flow(0x4718, 0), Flow::Indirect, "bx r3");
        assert_eq!(flow(0x4687, 0), Flow::Indirect, "mov pc, r0");
        assert_eq!(flow(0xF85D, 0xFB04), Flow::Next, "pop.w of pc");
        assert_eq!(flow(0xF8D0, 0xF000), Flow::Indirect, "ldr.w pc, [r0]");
        assert_eq!(flow(0xBD80, 0), Flow::Next, "pop of r7, pc");
    }

    #[test]
    fn lengths_keep_the_stream_in_step() {
        let length = |first| instruction(0, first, 0).0;
        assert_eq!(length(0xEE30), 4, "vadd.f32");
        assert_eq!(length(0xED90), 4, "vldr");
        assert_eq!(length(0xF3BF), 4, "dsb");
        assert_eq!(length(0xE7FE), 2, "b");
        assert_eq!(length(0xDEFE), 2, "udf");
        assert_eq!(flow(0xDEFE, 0), Flow::Next, "udf");
        assert_eq!(flow(0xF3BF, 0x8F4F), Flow::Next, "dsb");
        assert_eq!(flow(0xF3EF, 0x8010), Flow::Next, "mrs r0, primask");
    }
}
