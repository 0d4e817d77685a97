//! What an image needs to run at all, and the timer that counts.

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use vcell::VolatileCell;

/// A CMSDK APB timer (ARM DDI 0479): counts down from `u32::MAX` at 25 MHz.
#[repr(C)]
pub(crate) struct Timer {
    control: VolatileCell<u32>,
    value: VolatileCell<u32>,
    reload: VolatileCell<u32>,
}

/// TIMER1, running.
pub(crate) fn timer() -> &'static Timer {
    // SAFETY: TIMER1 of the memory map, always there and accessed through
    // volatile cells only, in the one context there is.
    let timer = unsafe { &*(0x4000_1000 as *const Timer) };
    timer.reload.set(u32::MAX);
    timer.value.set(u32::MAX);
    timer.control.set(1);
    timer
}

impl Timer {
    /// Timer counts that `work` takes, without those of looking at the timer.
    #[inline(always)]
    pub(crate) fn counted<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let empty = self.between(|| black_box(()));
        let (took, result) = self.between(work);
        (took.wrapping_sub(empty.0), result)
    }

    #[inline(always)]
    fn between<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let began = self.value.get();
        let result = work();
        let ended = self.value.get();
        (began.wrapping_sub(ended), result)
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    semihosting::eprintln!("{info}");
    semihosting::process::exit(1)
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    semihosting::eprintln!("hard fault: {frame:?}");
    semihosting::process::exit(1)
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    semihosting::eprintln!("interrupt {number} has no handler");
    semihosting::process::exit(1)
}

// SAFETY: cortex-m-rt defines it from the function above, with this signature.
unsafe extern "C" {
    #[link_name = "DefaultHandler"]
    safe fn no_handler();
}

/// No interrupt is ever let through.
// SAFETY: the section and the name are the ones cortex-m-rt's `device` feature
// asks for, and the table holds a function only.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [extern "C" fn(); 1] = [no_handler];
