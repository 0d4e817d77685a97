//! The boards: one table of their images, memories and budgets.

/// A memory of a board, and the part of it that an image may use.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Memory {
    /// Its name in the printed table.
    pub(crate) name: &'static str,
    /// First address.
    pub(crate) origin: u64,
    /// Size in bytes.
    pub(crate) length: u64,
    /// Maximum bytes of an image. In RAM these are static data; the rest is for the stack.
    pub(crate) budget: u64,
}

impl Memory {
    /// Returns true if `address` is in this memory.
    pub(crate) fn contains(&self, address: u64) -> bool {
        (self.origin..self.origin + self.length).contains(&address)
    }
}

/// A call that the panic check accepts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Exception {
    /// Parts of the caller's name, all of which it contains: compilers write generic names in two
    /// ways.
    pub(crate) caller: &'static [&'static str],
    /// Part of the callee's name; empty for a call through a register.
    pub(crate) callee: &'static str,
    /// For a call through a register: parts of the names of its possible callees. They are checked
    /// like all other functions that an interrupt reaches.
    pub(crate) targets: &'static [&'static str],
    /// Reason why it is safe.
    #[expect(dead_code, reason = "for the reader of the table")]
    pub(crate) because: &'static str,
}

/// A board that the firmware is built for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Board {
    /// Name of the binary; its cargo feature is `board-` and this name.
    pub(crate) name: &'static str,
    /// Name of the chip in probe-rs; `None` for the emulated board.
    pub(crate) chip: Option<&'static str>,
    /// Environment variable with the image's path, for tests.
    pub(crate) elf_variable: &'static str,
    /// Interrupts that run tasks, which may reach panics. No function that another interrupt or an
    /// exception reaches may panic.
    pub(crate) runs_tasks: &'static [&'static str],
    /// Calls through a register under an interrupt that were followed by hand.
    pub(crate) allowed_indirect: &'static [Exception],
    /// Calls to panics, directly or indirectly, under an interrupt that are proven never to happen.
    pub(crate) allowed_calls: &'static [Exception],
    /// The interrupt whose code runs from a memory without wait states, if there is one.
    pub(crate) fast_interrupt: Option<&'static str>,
    /// Its memories. Bytes outside all of them are an error.
    pub(crate) memories: &'static [Memory],
}

const KIB: u64 = 1024;

const G474_CALLS: &[Exception] = &[queue(&["TIM7_DAC"]), queue(&["HapticLoop"]), TIMER_QUEUE];

const H743_CALLS: &[Exception] = &[queue(&["TIM7"]), queue(&["HapticLoop"]), TIMER_QUEUE];

/// Exceptions for emulated boards only: serial ports, and a failed program's last frame to the
/// virtual arm.
const EMULATED_CALLS: &[Exception] = &[
    queue(&["HapticTick"]),
    queue(&["HapticLoop"]),
    Exception {
        caller: &["Serial", "on_received"],
        callee: "panic_already_borrowed",
        targets: &[],
        because: "embassy's ring of bytes is borrowed in critical sections only, which mask this \
                  interrupt",
    },
    Exception {
        caller: &["Serial", "on_received"],
        callee: "core::panicking::panic",
        targets: &[],
        because: "embassy's ring of bytes keeps its indices below its length, and was checked for \
                  free space",
    },
    Exception {
        caller: &["wire::frame::Framing"],
        callee: "core::panicking::panic",
        targets: &[],
        because: "the frame of a program that has ended: some twenty bytes into 64. A panic there \
                  would end it once more",
    },
];

/// embassy's clock, whose vector is embassy's own and cannot be replaced.
const TIMER_QUEUE: Exception = Exception {
    caller: &["TIM5"],
    callee: "panic_already_borrowed",
    targets: &[],
    because: "the queue of timers is borrowed in critical sections only, this interrupt's among \
              them; they mask this interrupt, so it finds no borrow",
};

/// Calls that wake a task.
const WAKERS: &[Exception] = &[
    waker(&["TIM6_DAC"]),
    waker(&["TIM5"]),
    // The work of the clock's interrupt, if it is compiled as a function.
    waker(&["embassy_time_queue_utils", "next_expiration"]),
    waker(&["USB_LP"]),
    waker(&["OTG_FS"]),
];

/// The emulated board's serial ports also wake tasks. A failed program writes its report there with
/// `core::fmt`.
const EMULATED_WAKERS: &[Exception] = &[
    waker(&["TickDone"]),
    waker(&["LinkSent"]),
    waker(&["PlantSent"]),
    waker(&["Serial", "on_received"]),
    Exception {
        caller: &["core::fmt::write"],
        callee: "",
        targets: &[],
        because: "the last words of an emulated program that has ended; a panic among them would \
                  end it once more",
    },
];

const fn waker(caller: &'static [&'static str]) -> Exception {
    Exception {
        caller,
        callee: "",
        targets: &["embassy_executor::raw::waker::wake"],
        because: "a task's waker: all tasks are embassy's, so there is one table of waker functions",
    }
}

const H743_MEMORIES: &[Memory] = &[
    // A warning limit: there is plenty of flash, but the smaller board is limited. The same program
    // is 8 % larger here than on a Cortex-M4.
    memory("flash", 0x0800_0000, 2048 * KIB, 280 * KIB),
    memory("AXI RAM", 0x2400_0000, 512 * KIB, 512 * KIB),
    // The constants, and at least 96 KiB of stack.
    memory("DTCM", 0x2000_0000, 128 * KIB, 32 * KIB),
    // The tick's code. The linker script lists the functions that stay in flash.
    memory("ITCM", 0x0000_0000, 64 * KIB, 64 * KIB),
];

const fn queue(caller: &'static [&'static str]) -> Exception {
    Exception {
        caller,
        callee: "panic_const_rem_by_zero",
        targets: &[],
        because: "heapless' queues wrap by `% length`, a length that is never 0 and is set only at run time",
    }
}

/// The board that QEMU emulates.
pub(crate) static EMULATED: &Board = &BOARDS[0];

/// All boards. Budgets are limits to discuss: raise one in the commit that needs it, with the
/// reason.
pub(crate) static BOARDS: [Board; 4] = [
    Board {
        name: "mps2-an386",
        chip: None,
        elf_variable: "HAPTERRA_MPS2_ELF",
        // Only on this board tasks run in an interrupt, the lowest.
        runs_tasks: &["Executor"],
        allowed_indirect: EMULATED_WAKERS,
        allowed_calls: EMULATED_CALLS,
        fast_interrupt: None,
        memories: &[
            // Zero-wait SRAM instead of flash, with the budget of the G474.
            memory("flash", 0x0000_0000, 4096 * KIB, 256 * KIB),
            memory("RAM", 0x2000_0000, 4096 * KIB, 1536 * KIB),
        ],
    },
    Board {
        name: "nucleo-g474re",
        chip: Some("STM32G474RETx"),
        elf_variable: "HAPTERRA_G474_ELF",
        runs_tasks: &[],
        allowed_indirect: WAKERS,
        allowed_calls: G474_CALLS,
        fast_interrupt: None,
        memories: &[
            // Half of the flash. At 192 KiB the image had 116 bytes left, and its size determined
            // the shape of functions; the other half is reserved for a second image.
            memory("flash", 0x0800_0000, 512 * KIB, 256 * KIB),
            // 24 KiB remain for the stack.
            memory("RAM", 0x2000_0000, 128 * KIB, 104 * KIB),
        ],
    },
    Board {
        name: "nucleo-h743zi2",
        chip: Some("STM32H743ZITx"),
        elf_variable: "HAPTERRA_H743_ELF",
        runs_tasks: &[],
        allowed_indirect: WAKERS,
        allowed_calls: H743_CALLS,
        fast_interrupt: Some("TIM7"),
        memories: H743_MEMORIES,
    },
    Board {
        name: "nucleo-h743zi2-spi",
        chip: Some("STM32H743ZITx"),
        elf_variable: "HAPTERRA_H743_SPI_ELF",
        runs_tasks: &[],
        allowed_indirect: WAKERS,
        allowed_calls: H743_CALLS,
        fast_interrupt: Some("TIM7"),
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

/// Returns the board called `name`.
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
    fn unknown_board_error_lists_the_known_boards() {
        let message = by_name("nucleo-f4").unwrap_err().to_string();
        assert!(message.contains("nucleo-f4") && message.contains("mps2-an386"));
    }
}
