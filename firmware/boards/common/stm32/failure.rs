//! The end of a program that failed: switches the amplifiers off, writes a record that survives the
//! reset, and resets the chip.
//!
//! Nothing here writes to the log: a program that failed inside a log line would panic again. The
//! next start logs the record.

use core::arch::naked_asm;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use hapterra_core::wire::status::{Crash, CrashKind};
use hapterra_firmware::crash::{CRASH_BYTES, CrashRecord};

use super::stack_guard;
use crate::chip::{ENABLE_OFF, amplifiers_off, write_back};

/// Ticks since the start, counted by the interrupt below the haptic one.
static TICKS: AtomicU32 = AtomicU32::new(0);
/// True if a record of this program's end is written or being written. Only the first failure is
/// recorded, because later ones follow from it.
static HAS_ENDED: AtomicBool = AtomicBool::new(false);
/// CFSR: MMFAR holds the address of a forbidden access.
const MMARVALID: u32 = 1 << 7;

type Bytes = [u8; CRASH_BYTES];

/// Start-up code leaves this section as it is, so a record outlives a reset.
#[unsafe(link_section = ".uninit.crash")]
static mut RECORD: MaybeUninit<Bytes> = MaybeUninit::uninit();

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    stop();
    let (file, line) = info.location().map_or(("", 0), |at| (at.file(), at.line()));
    end(CrashKind::Panic, || CrashRecord::panic(file, line, ticks()))
}

/// Switches off without a stack, because the stack may have overflowed. The handler runs even if
/// its frame could not be written (ARM DDI 0337, 5.12.1). Then it continues on a fresh stack, which
/// is the old one's memory: the frame's values are read before. The floating-point unit discards
/// the registers that it has not stored in that frame yet.
#[unsafe(naked)]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".HardFault.hapterra")]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "cpsid i",
        "movw r3, #{off_low}",
        "movt r3, #{off_high}",
        "mov.w r2, #{off_bit}",
        "str r2, [r3]", // The enable pin is low.
        "mov r2, sp",
        "movs r0, #0",
        "movs r1, #0",
        "movw r3, #0xEF34", // FPCCR: no registers to store.
        "movt r3, #0xE000",
        "str r0, [r3]",
        "movw r3, #:lower16:_stack_end",
        "movt r3, #:upper16:_stack_end",
        "cmp r2, r3",
        "blo 2f",
        "movw r3, #:lower16:_stack_start",
        "movt r3, #:upper16:_stack_start",
        "subs r3, #32",
        "cmp r2, r3",
        "bhi 2f",
        "ldr r0, [r2, #24]",
        "ldr r1, [r2, #20]",
        "2:",
        "movw r3, #:lower16:_stack_start",
        "movt r3, #:upper16:_stack_start",
        "mov sp, r3",
        "b {after}",
        off_low = const ENABLE_OFF.0 & 0xFFFF,
        off_high = const ENABLE_OFF.0 >> 16,
        off_bit = const ENABLE_OFF.1,
        after = sym after_hard_fault,
    )
}

/// Continues after a hard fault at `pc`, called from about `lr` (both zero if no frame was stored),
/// with the stack pointer at `sp`.
extern "C" fn after_hard_fault(pc: u32, lr: u32, sp: u32) -> ! {
    // SAFETY: reads of status registers, which have no side effect.
    let (status, address) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).mmfar.read()) };
    let at_guard = status & MMARVALID != 0 && stack_guard::has(address);
    if at_guard || stack_guard::has(sp) {
        end(CrashKind::StackOverflow, || {
            CrashRecord::stack_overflow(pc, lr, status, ticks())
        })
    } else {
        end(CrashKind::HardFault, || {
            CrashRecord::hard_fault(pc, lr, status, ticks())
        })
    }
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    unhandled(number)
}

/// Counts a tick, for the record of a crash.
pub(crate) fn count_tick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}

/// Ends the program after an exception or interrupt that it cannot handle.
#[inline(never)]
pub(crate) fn unhandled(number: i16) -> ! {
    stop();
    end(CrashKind::UnhandledInterrupt, || {
        CrashRecord::unhandled(number, ticks())
    })
}

/// Ends the program after its supply fell too low.
pub(crate) fn supply_low() -> ! {
    stop();
    end(CrashKind::SupplyLow, || CrashRecord::supply_low(ticks()))
}

/// Switches the amplifiers off first, and then masks all interrupts that could switch them on
/// again.
fn stop() {
    amplifiers_off();
    cortex_m::interrupt::disable();
    // Again: a tick may have run in between.
    amplifiers_off();
}

/// Stores the record, unless this program has already stored one, and resets the chip: only the
/// watchdog would run before. A minimal record is stored first, because the code that makes the
/// full one may fail again.
fn end(kind: CrashKind, record: impl FnOnce() -> CrashRecord) -> ! {
    if !HAS_ENDED.swap(true, Ordering::Relaxed) {
        store_record(CrashRecord::bare(kind));
        store_record(record());
    }
    SCB::sys_reset()
}

fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

fn store_record(record: CrashRecord) {
    let place = &raw mut RECORD;
    // SAFETY: written here only: by `main` before any interrupt is enabled, and by a failed
    // program, which runs no other code afterwards.
    unsafe { ptr::write_volatile(place.cast::<Bytes>(), *record.bytes()) };
    write_back(place as usize, CRASH_BYTES);
}

/// Reads and clears the record of the program before this one, once, before any interrupt is
/// enabled.
pub(crate) fn take_record() -> Option<Crash> {
    // SAFETY: nothing writes it now, and any bits are valid bytes. Its checksum shows if they are a
    // record.
    let bytes = unsafe { ptr::read_volatile((&raw const RECORD).cast::<Bytes>()) };
    store_record(CrashRecord::NONE);
    CrashRecord::read(&bytes)
}

/// Logs how the program before this one ended.
pub(crate) fn log(crash: Option<&Crash>) {
    if let Some(crash) = crash {
        defmt::error!(
            "the program before ended with {}: line {} of {=str}, pc {:#x}, lr {:#x}, status {:#x}",
            crash.kind,
            crash.line,
            crash.file.as_str(),
            crash.pc,
            crash.lr,
            crash.status
        );
    }
}
