//! The boards: one table of their images, memories and budgets.

/// A memory of a board and how much of it an image may take.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Memory {
    /// Its name in the table on screen.
    pub(crate) name: &'static str,
    /// First address.
    pub(crate) origin: u64,
    /// Bytes there are.
    pub(crate) length: u64,
    /// Bytes an image may take. In RAM that is static data; what is left is
    /// for the stack.
    pub(crate) budget: u64,
}

impl Memory {
    /// Whether `address` lies in this memory.
    pub(crate) fn contains(&self, address: u64) -> bool {
        (self.origin..self.origin + self.length).contains(&address)
    }
}

/// A call that the panic check lets pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Exception {
    /// Parts of the caller's name, all of them in it: compilers write generic
    /// names in two ways.
    pub(crate) caller: &'static [&'static str],
    /// Part of the callee's name.
    pub(crate) callee: &'static str,
    /// Why it is safe.
    #[expect(dead_code, reason = "for the reader of the table")]
    pub(crate) because: &'static str,
}

/// A board that the firmware is built for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Board {
    /// Name of the binary; its cargo feature is this behind `board-`.
    pub(crate) name: &'static str,
    /// What probe-rs calls the chip; none for the emulated board.
    pub(crate) chip: Option<&'static str>,
    /// Environment variable that tells tests where the image is.
    pub(crate) elf_variable: &'static str,
    /// Symbol of the interrupt that runs the haptic tick. Nothing that it can
    /// reach may panic.
    pub(crate) tick_interrupt: &'static str,
    /// Calls through a register under that interrupt that someone has followed.
    pub(crate) known_indirect: &'static [Exception],
    /// Calls to panics, or on the way to one, under that interrupt, that someone
    /// has proven never to happen.
    pub(crate) known_calls: &'static [Exception],
    /// Its memories. Bytes outside all of them are an error.
    pub(crate) memories: &'static [Memory],
}

const KIB: u64 = 1024;

/// The emulated board has only its queues to the tasks to be known for.
const QUEUES: &[Exception] = &[queue(&["HapticTick"]), queue(&["HapticLoop"])];

const G474_QUEUES: &[Exception] = &[queue(&["TIM7_DAC"]), queue(&["HapticLoop"])];

const H743_QUEUES: &[Exception] = &[queue(&["TIM7"]), queue(&["HapticLoop"])];

const H743_MEMORIES: &[Memory] = &[
    // Plenty; the smaller board is the one that has to be small.
    memory("flash", 0x0800_0000, 2048 * KIB, 192 * KIB),
    memory("AXI RAM", 0x2400_0000, 512 * KIB, 512 * KIB),
    // The stack's own; 32 KiB of it at least.
    memory("DTCM", 0x2000_0000, 128 * KIB, 96 * KIB),
];

const fn queue(caller: &'static [&'static str]) -> Exception {
    Exception {
        caller,
        callee: "panic_const_rem_by_zero",
        because: "heapless' queues wrap by `% length`, and know their length, never 0, only at run time",
    }
}

/// The board that QEMU emulates.
pub(crate) static EMULATED: &Board = &BOARDS[0];

/// Every board. Budgets are limits to be argued with, not hopes: raise one in
/// the commit that needs it, with the reason.
pub(crate) static BOARDS: [Board; 4] = [
    Board {
        name: "mps2-an386",
        chip: None,
        elf_variable: "HAPTERRA_MPS2_ELF",
        tick_interrupt: "HapticTick",
        known_indirect: &[],
        known_calls: QUEUES,
        memories: &[
            // Zero-wait SRAM in the place of flash: held to what the G474 is held to.
            memory("flash", 0x0000_0000, 4096 * KIB, 192 * KIB),
            memory("RAM", 0x2000_0000, 4096 * KIB, 1536 * KIB),
        ],
    },
    Board {
        name: "nucleo-g474re",
        chip: Some("STM32G474RETx"),
        elf_variable: "HAPTERRA_G474_ELF",
        tick_interrupt: "TIM7_DAC",
        known_indirect: &[],
        known_calls: G474_QUEUES,
        memories: &[
            memory("flash", 0x0800_0000, 512 * KIB, 192 * KIB),
            // 16 KiB stay for the stack.
            memory("RAM", 0x2000_0000, 128 * KIB, 112 * KIB),
        ],
    },
    Board {
        name: "nucleo-h743zi2",
        chip: Some("STM32H743ZITx"),
        elf_variable: "HAPTERRA_H743_ELF",
        tick_interrupt: "TIM7",
        known_indirect: &[],
        known_calls: H743_QUEUES,
        memories: H743_MEMORIES,
    },
    Board {
        name: "nucleo-h743zi2-spi",
        chip: Some("STM32H743ZITx"),
        elf_variable: "HAPTERRA_H743_SPI_ELF",
        tick_interrupt: "TIM7",
        known_indirect: &[],
        known_calls: H743_QUEUES,
        memories: H743_MEMORIES,
    },
];

const fn memory(name: &'static str, origin: u64, length: u64, budget: u64) -> Memory {
    Memory {
        name,
        origin,
        length,
        budget,
    }
}

/// The board called `name`.
pub(crate) fn by_name(name: &str) -> anyhow::Result<&'static Board> {
    BOARDS.iter().find(|b| b.name == name).ok_or_else(|| {
        let names: Vec<_> = BOARDS.iter().map(|b| b.name).collect();
        anyhow::anyhow!("no board is called {name}: there are {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_fit_their_memories_and_memories_do_not_overlap() {
        for board in &BOARDS {
            for (i, m) in board.memories.iter().enumerate() {
                assert!(m.budget <= m.length, "{}: {}", board.name, m.name);
                for other in &board.memories[i + 1..] {
                    assert!(
                        m.origin + m.length <= other.origin
                            || other.origin + other.length <= m.origin,
                        "{}: {} and {}",
                        board.name,
                        m.name,
                        other.name
                    );
                }
            }
        }
    }

    #[test]
    fn an_unknown_board_is_answered_with_the_known_ones() {
        let message = by_name("nucleo-f4").unwrap_err().to_string();
        assert!(message.contains("nucleo-f4") && message.contains("mps2-an386"));
    }
}
