//! Kinds of instructions by their timing: Thumb-2 of an ARMv7E-M core, by its encoding (DDI 0403E,
//! A5 and A6).

/// A kind of instruction, by its timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One pass through the integer unit.
    Integer,
    /// A multiplication, with or without an addition.
    Multiply,
    /// An integer division.
    Divide,
    /// Loads this number of words.
    Load(u32),
    /// Stores this number of words.
    Store(u32),
    /// A branch, conditional or not.
    Branch {
        /// True if it may fall through.
        conditional: bool,
    },
    /// A branch through a table.
    TableBranch,
    /// Access to a system register, or a barrier.
    System,
    /// One pass through the floating-point unit: an addition, multiplication, conversion or move.
    Float,
    /// A floating-point multiplication and addition.
    FloatMac,
    /// A floating-point division or square root.
    FloatDivide,
    /// A transfer between the registers of the two units.
    FloatTransfer,
}

/// An instruction at its address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Its address.
    pub address: u32,
    /// Its length in bytes.
    pub length: u32,
    /// Its kind.
    pub kind: Kind,
    /// True if it loads a constant beside the code.
    pub is_literal: bool,
    /// The single-precision register of its floating-point result.
    pub result: Option<u32>,
    /// Floating-point registers that it reads.
    pub reads: [Option<u32>; 3],
}

/// Decodes an instruction from its first half-word and, if it is wide, the second.
#[must_use]
pub fn decode(address: u32, first: u16, second: u16) -> Instruction {
    let is_wide = first >> 11 >= 0b11101;
    let (first, second) = (u32::from(first), u32::from(second));
    let (kind, is_literal) = match is_wide {
        true => (wide(first, second), is_wide_literal(first, second)),
        false => (narrow(first), first >> 11 == 0b01001),
    };
    let (result, reads) = match is_wide {
        true => float_registers(first, second),
        false => (None, [None; 3]),
    };
    Instruction {
        address,
        length: if is_wide { 4 } else { 2 },
        kind,
        is_literal,
        result,
        reads,
    }
}

fn narrow(word: u32) -> Kind {
    let listed = (word & 0xFF).count_ones();
    let branch = |conditional| Kind::Branch { conditional };
    match word >> 11 {
        // Data processing, with BX, BLX, and ADD or MOV to PC.
        0b01000 if word >> 8 == 0x47 || word & 0xFD87 == 0x4487 || word & 0xFF87 == 0x4687 => {
            branch(false)
        }
        0b01000 if word >> 6 == 0b01_0000_1101 => Kind::Multiply,
        0b01001 => Kind::Load(1),
        0b01010 | 0b01011 => match word >> 9 & 7 {
            0..=2 => Kind::Store(1),
            _ => Kind::Load(1),
        },
        0b01100..=0b10011 => match word >> 11 & 1 {
            0 => Kind::Store(1),
            _ => Kind::Load(1),
        },
        0b10110 | 0b10111 => match word {
            w if w & 0xF500 == 0xB100 => branch(true),
            w if w & 0xFE00 == 0xB400 => Kind::Store(listed + (w >> 8 & 1)),
            w if w & 0xFE00 == 0xBC00 => Kind::Load(listed + (w >> 8 & 1)),
            w if w & 0xFFE0 == 0xB660 => Kind::System,
            _ => Kind::Integer,
        },
        0b11000 => Kind::Store(listed),
        0b11001 => Kind::Load(listed),
        0b11010 | 0b11011 => branch(true),
        0b11100 => branch(false),
        _ => Kind::Integer,
    }
}

fn wide(first: u32, second: u32) -> Kind {
    let loads = |words| match first >> 4 & 1 {
        0 => Kind::Store(words),
        _ => Kind::Load(words),
    };
    // The second field of the opcode (A5.3), of seven bits.
    let field = first >> 4 & 0x7F;
    match first >> 11 & 3 {
        _ if field & 0x40 != 0 && first >> 11 & 3 != 2 => coprocessor(first, second),
        1 if field & 0x64 == 0 => loads(second.count_ones()),
        1 if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 => Kind::TableBranch,
        1 if field & 0x60 == 0 => loads(2),
        2 if second >> 15 == 1 => branch_or_system(first, second),
        3 if field & 0x71 == 0 => Kind::Store(1),
        3 if field & 0x61 == 1 => Kind::Load(1),
        3 if field & 0x78 == 0x30 => Kind::Multiply,
        3 if field & 0x78 == 0x38 && second >> 4 & 0xF == 0xF => Kind::Divide,
        3 if field & 0x78 == 0x38 => Kind::Multiply,
        _ => Kind::Integer,
    }
}

fn branch_or_system(first: u32, second: u32) -> Kind {
    match second & 0x5000 {
        0 if first >> 6 & 15 < 14 => Kind::Branch { conditional: true },
        0 => Kind::System,
        _ => Kind::Branch { conditional: false },
    }
}

fn coprocessor(first: u32, second: u32) -> Kind {
    match first >> 8 & 0xF {
        // Two core registers at once.
        0xC if first & 0xFFE0 == 0xEC40 => Kind::FloatTransfer,
        0xC | 0xD => {
            // One register if P is set and W is not, else the words of the list.
            let words = match first & 0x120 {
                0x100 => second >> 8 & 1,
                _ => (second & 0xFF).max(1) - 1,
            };
            match first >> 4 & 1 {
                0 => Kind::Store(1 + words),
                _ => Kind::Load(1 + words),
            }
        }
        _ if second >> 4 & 1 == 1 => Kind::FloatTransfer,
        _ => match (first >> 4 & 0b1011, first & 0xF, second >> 6 & 3) {
            (0b0000 | 0b0001 | 0b1001 | 0b1010, ..) => Kind::FloatMac,
            (0b1000, ..) | (0b1011, 1, 3) => Kind::FloatDivide,
            _ => Kind::Float,
        },
    }
}

/// Returns true for LDR and VLDR relative to PC.
fn is_wide_literal(first: u32, second: u32) -> bool {
    let single = first & 0xFE1F == 0xF81F && first >> 5 & 3 != 3;
    let double = first & 0xFE5F == 0xE85F && first & 0x120 != 0;
    let float = first & 0xFF3F == 0xED1F && second >> 9 & 7 == 0b101;
    single || double || float
}

/// Returns the single register of an arithmetic instruction's result, and those that any
/// floating-point instruction reads.
fn float_registers(first: u32, second: u32) -> (Option<u32>, [Option<u32>; 3]) {
    let is_single = second >> 8 & 0xF == 0b1010;
    let d = (second >> 12 & 0xF) << 1 | first >> 6 & 1;
    let n = (first & 0xF) << 1 | second >> 7 & 1;
    let m = (second & 0xF) << 1 | second >> 5 & 1;
    match first >> 8 {
        // Arithmetic. A comparison and an accumulation also read the destination.
        0xEE if is_single && second >> 4 & 1 == 0 => (Some(d), [Some(d), Some(n), Some(m)]),
        // To or from a core register.
        0xEE if is_single => (None, [Some(n), None, None]),
        // VSTR
        0xED if is_single && first >> 4 & 3 == 0 => (None, [Some(d), None, None]),
        _ => (None, [None; 3]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(first: u16, second: u16) -> Kind {
        decode(0, first, second).kind
    }

    // The encodings are LLVM's for the instructions in the comments.
    #[test]
    fn kinds_match_the_assembler() {
        for (first, second, is) in [
            (0x1840, 0, Kind::Integer),                            // adds r0, r0, r1
            (0x4348, 0, Kind::Multiply),                           // muls r0, r1
            (0x4770, 0, Kind::Branch { conditional: false }),      // bx lr
            (0x4687, 0, Kind::Branch { conditional: false }),      // mov pc, r0
            (0x4608, 0, Kind::Integer),                            // mov r0, r1
            (0x4408, 0, Kind::Integer),                            // add r0, r1
            (0xB5F0, 0, Kind::Store(5)),                           // push {r4-r7, lr}
            (0xBDF0, 0, Kind::Load(5)),                            // pop {r4-r7, pc}
            (0xBF08, 0, Kind::Integer),                            // it eq
            (0xB108, 0, Kind::Branch { conditional: true }),       // cbz r0
            (0xD001, 0, Kind::Branch { conditional: true }),       // beq
            (0xE7FE, 0, Kind::Branch { conditional: false }),      // b
            (0x6840, 0, Kind::Load(1)),                            // ldr r0, [r0, #4]
            (0x8041, 0, Kind::Store(1)),                           // strh r1, [r0, #2]
            (0xF000, 0xF87E, Kind::Branch { conditional: false }), // bl
            (0xF000, 0x807E, Kind::Branch { conditional: true }),  // beq.w
            (0xF3BF, 0x8F4F, Kind::System),                        // dsb
            (0xF240, 0x0001, Kind::Integer),                       // movw r0, #1
            (0xE92D, 0x4FF0, Kind::Store(9)),                      // push.w {r4-r11, lr}
            (0xE8BD, 0x8FF0, Kind::Load(9)),                       // pop.w {r4-r11, pc}
            (0xE9D0, 0x0100, Kind::Load(2)),                       // ldrd r0, r1, [r0]
            (0xE8DF, 0xF001, Kind::TableBranch),                   // tbb [pc, r1]
            (0xF8D0, 0x0004, Kind::Load(1)),                       // ldr.w r0, [r0, #4]
            (0xF8C0, 0x0004, Kind::Store(1)),                      // str.w r0, [r0, #4]
            (0xFB00, 0x0101, Kind::Multiply),                      // mla
            (0xFB90, 0xF0F1, Kind::Divide),                        // sdiv r0, r0, r1
            (0xFBA0, 0x0101, Kind::Multiply),                      // umull
            (0xEE30, 0x0A20, Kind::Float),                         // vadd.f32 s0, s0, s1
            (0xEE20, 0x0A20, Kind::Float),                         // vmul.f32
            (0xEE00, 0x0A20, Kind::FloatMac),                      // vmla.f32
            (0xEEA0, 0x0A20, Kind::FloatMac),                      // vfma.f32
            (0xEE80, 0x0A20, Kind::FloatDivide),                   // vdiv.f32
            (0xEEB1, 0x0AC0, Kind::FloatDivide),                   // vsqrt.f32
            (0xEEB0, 0x0AC0, Kind::Float),                         // vabs.f32
            (0xEEF1, 0xFA10, Kind::FloatTransfer),                 // vmrs apsr_nzcv, fpscr
            (0xEE10, 0x0A10, Kind::FloatTransfer),                 // vmov r0, s0
            (0xEC51, 0x0B10, Kind::FloatTransfer),                 // vmov r0, r1, d0
            (0xED90, 0x0A01, Kind::Load(1)),                       // vldr s0, [r0, #4]
            (0xED90, 0x0B01, Kind::Load(2)),                       // vldr d0, [r0, #4]
            (0xED2D, 0x8B04, Kind::Store(4)),                      // vpush {d8, d9}
            (0xECBD, 0x8B04, Kind::Load(4)),                       // vpop {d8, d9}
        ] {
            assert_eq!(kind(first, second), is, "{first:#06x} {second:#06x}");
        }
    }

    #[test]
    fn literal_loads_are_distinguished_from_other_loads() {
        for (first, second, is) in [
            (0x4812, 0, true),       // ldr r0, [pc, #72]
            (0xF8DF, 0x0010, true),  // ldr.w r0, [pc, #16]
            (0xED9F, 0x0A01, true),  // vldr s0, [pc, #4]
            (0xED90, 0x0A01, false), // vldr s0, [r0, #4]
            (0xF8D0, 0x0004, false), // ldr.w r0, [r0, #4]
            (0xE8DF, 0xF001, false), // tbb [pc, r1]
        ] {
            let found = decode(0, first, second).is_literal;
            assert_eq!(found, is, "{first:#06x} {second:#06x}");
        }
    }

    #[test]
    fn result_and_operand_have_the_same_register_number() {
        let adds = decode(0, 0xEE70, 0x0A20); // vadd.f32 s1, s0, s1
        let stores = decode(0, 0xEDC0, 0x0A00); // vstr s1, [r0]
        assert_eq!(adds.result, Some(1));
        assert!(stores.reads.contains(&Some(1)));
        assert_eq!(stores.result, None);
    }
}
