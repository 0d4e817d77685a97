//! Execution of the core: instructions and sleep between checks of interrupts.

use unicorn_engine::RegisterARM;

use super::exceptions::EXC_RETURN;
use super::fault_injection::{Load, UnreadableWord};
use super::{Machine, Stop};

/// Default number of instructions between two checks of time and interrupts. An instruction takes 8
/// ns: 1.34 cycles at 168 MHz.
pub(super) const SLICE: usize = 200;
/// Cost of an exception's entry and exit, ns, without its handler.
const EXCEPTION_NS: u64 = 200;
/// Nanoseconds between two checks while the core sleeps.
const SLEEP_NS: u64 = 5_000;

impl Machine {
    /// Returns the location of the core.
    #[must_use]
    pub fn place(&self) -> String {
        let pc = self.register(RegisterARM::PC) as u32;
        format!("{pc:#x} {}", self.image.at(pc))
    }

    /// Runs for this number of milliseconds.
    pub fn run_ms(&mut self, ms: u64) -> Stop {
        self.run_until(ms, |_| false)
    }

    /// Runs until a condition is met, for at most `ms` milliseconds.
    pub fn run_until(&mut self, ms: u64, mut is_met: impl FnMut(&mut Self) -> bool) -> Stop {
        let end_ns = self.bus().now_ns + ms * 1_000_000;
        loop {
            if is_met(self) {
                return Stop::Requested;
            }
            let (now_ns, has_expired, requests_reset) = {
                let bus = self.bus();
                let has_expired = bus.watchdog.has_expired(bus.now_ns);
                (bus.now_ns, has_expired, bus.nvic.requests_reset)
            };
            if requests_reset {
                return Stop::Software;
            }
            if has_expired {
                return Stop::Watchdog;
            }
            if now_ns >= end_ns {
                return Stop::Time;
            }
            if let Some(stop) = self.step() {
                return stop;
            }
        }
    }

    /// Runs until this many more haptic ticks have begun and ended.
    pub fn run_ticks(&mut self, ticks: usize) -> Stop {
        let vector = self.chip.tick_interrupt as u32 + 16;
        let mut remaining = ticks;
        let mut was_in_tick = false;
        self.run_until(2 * ticks as u64 + 5, move |machine| {
            let in_tick = machine.active.iter().any(|a| a.vector == vector);
            remaining -= usize::from(was_in_tick && !in_tick);
            was_in_tick = in_tick;
            remaining == 0
        })
    }

    /// Runs one slice of instructions, or sleeps once, between checks of interrupts.
    fn step(&mut self) -> Option<Stop> {
        self.bus().raise_interrupts();
        self.erase();
        self.protect();
        self.raise_tick();
        self.take_interrupt();
        self.watch_masks();
        let pc = self.register(RegisterARM::PC) | 1;
        let ended = self.core.emu_start(pc, EXC_RETURN, 0, self.slice);
        if let Load::Armed(address) = self.load.get() {
            return self.fail_load(address);
        }
        let pc = self.register(RegisterARM::PC);
        if pc & !1 == EXC_RETURN {
            self.leave();
            self.bus().advance(EXCEPTION_NS);
            return None;
        }
        match ended {
            Ok(()) => self.bus().advance(8 * self.slice as u64),
            Err(_) if self.is_waiting() => self.sleep(),
            Err(error) => return self.fault(&format!("{error:?}")),
        }
        None
    }

    /// Erases the commanded pages at once; the flash stays busy for a while.
    fn erase(&mut self) {
        let sectors = std::mem::take(&mut self.bus().erased);
        for (address, bytes) in sectors {
            self.patch(address, &vec![0xFF; bytes as usize]);
            let sector = address..address + bytes;
            let erased = self
                .unreadable
                .extract_if(.., |s| sector.contains(&s.address));
            for UnreadableWord { hook, .. } in erased {
                self.core.remove_hook(hook).expect("it was there");
            }
        }
    }

    /// Returns true if the haptic interrupt is active.
    #[must_use]
    pub fn is_ticking(&self) -> bool {
        let vector = self.chip.tick_interrupt as u32 + 16;
        self.active.iter().any(|a| a.vector == vector)
    }

    fn raise_tick(&mut self) {
        let busy = !self.active.is_empty() || self.register(RegisterARM::BASEPRI) != 0;
        let is_unmasked = self.bus().nvic.is_enabled(self.chip.tick_interrupt);
        if !busy || !is_unmasked || self.is_ticking() {
            return;
        }
        self.busy_ticks += 1;
        if self
            .raises_tick_every
            .is_some_and(|n| self.busy_ticks.is_multiple_of(n))
        {
            self.raised += 1;
            self.bus().nvic.pend(self.chip.tick_interrupt);
        }
    }

    fn watch_masks(&mut self) {
        let waits = self.bus().nvic.is_waiting(self.chip.tick_interrupt);
        self.delayed += u32::from(waits && !self.is_ticking());
        let is_unmasked = self.bus().nvic.is_enabled(self.chip.tick_interrupt);
        let masked = self.register(RegisterARM::PRIMASK) & 1 != 0;
        self.masked += u32::from(is_unmasked && masked);
    }

    /// Returns true if the last instruction was a WFE or WFI.
    fn is_waiting(&self) -> bool {
        let pc = self.register(RegisterARM::PC) as u32 & !1;
        let before = |back: u32| {
            let bytes = self.core.mem_read_as_vec((pc - back).into(), 2);
            bytes.map(|b| u16::from_le_bytes([b[0], b[1]]))
        };
        [0, 2]
            .iter()
            .any(|back| matches!(before(*back), Ok(0xBF20 | 0xBF30)))
    }

    /// Sleeps until an interrupt is pending, at most for a moment.
    fn sleep(&mut self) {
        let pc = self.register(RegisterARM::PC) as u32 & !1;
        let here = self.word(pc & !3) >> (8 * (pc & 2)) & 0xFFFF;
        if matches!(here, 0xBF20 | 0xBF30) {
            self.set_register(RegisterARM::PC, u64::from(pc + 2) | 1);
        }
        let mut bus = self.bus();
        bus.raise_interrupts();
        let wakes = bus.nvic.has_pending();
        bus.advance(if wakes { EXCEPTION_NS } else { SLEEP_NS });
    }
}
