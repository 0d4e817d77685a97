//! The end of a program that failed: amplifiers off, a record that survives the
//! reset, a report to whoever listens, then the reset that the starved watchdog
//! brings.

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use hapterra_core::wire::status::Crash;
use hapterra_firmware::crash::{CRASH_BYTES, CrashRecord};

use crate::chip::{amplifiers_off, write_back};

/// Ticks since the start, counted by the interrupt below the haptic one.
static TICKS: AtomicU32 = AtomicU32::new(0);

type Bytes = [u8; CRASH_BYTES];

/// Start-up code leaves this section as it is, so a record outlives a reset.
#[unsafe(link_section = ".uninit.crash")]
static mut RECORD: MaybeUninit<Bytes> = MaybeUninit::uninit();

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    stop();
    let (file, line) = info.location().map_or(("", 0), |at| (at.file(), at.line()));
    keep(CrashRecord::panic(file, line, ticks()));
    defmt::error!("panic at {}:{}", file, line);
    rest()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop();
    // SAFETY: a read of a status register, which has no side effect.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    keep(CrashRecord::hard_fault(
        frame.pc(),
        frame.lr(),
        status,
        ticks(),
    ));
    defmt::error!("hard fault at {:#x}, status {:#x}", frame.pc(), status);
    rest()
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    unhandled(number)
}

/// Counts a tick, for the record of a crash.
pub(crate) fn count_tick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}

/// The end of a program that met an exception or interrupt it cannot handle.
#[inline(never)]
pub(crate) fn unhandled(number: i16) -> ! {
    stop();
    keep(CrashRecord::unhandled(number, ticks()));
    defmt::error!("interrupt {} has no handler", number);
    rest()
}

/// Amplifiers off before anything else, and no interrupt that could turn them
/// on again.
fn stop() {
    cortex_m::interrupt::disable();
    amplifiers_off();
}

fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

fn keep(record: CrashRecord) {
    let place = &raw mut RECORD;
    // SAFETY: written here only: by `main` before any interrupt is enabled, and by a
    // program that failed, which does nothing else any more.
    unsafe { ptr::write_volatile(place.cast::<Bytes>(), *record.bytes()) };
    write_back(place as usize, CRASH_BYTES);
}

/// Takes what the program before this one left, once, before any interrupt is
/// enabled.
pub(crate) fn take_record() -> Option<Crash> {
    // SAFETY: nothing writes it now, and any bits are bytes. Its check sum says whether
    // they are a record.
    let bytes = unsafe { ptr::read_volatile((&raw const RECORD).cast::<Bytes>()) };
    keep(CrashRecord::NONE);
    CrashRecord::read(&bytes)
}

fn rest() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
