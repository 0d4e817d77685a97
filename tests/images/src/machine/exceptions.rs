//! Entry of exceptions by priority, and return from them.

use unicorn_engine::{Context, RegisterARM};

use super::fault_injection::Load;
use super::{Machine, Stop, THUMB};
use crate::chip::Unreadable;

/// Return address of an exception, where there is no memory.
pub(super) const EXC_RETURN: u64 = 0xFFFF_FFF8;
/// Positions in the vector table.
const NMI: u32 = 2;
const HARD_FAULT: u32 = 3;
const BUS_FAULT: u32 = 5;
/// SHCSR and its bit that enables bus faults; SHPR1 and the position of their priority.
const BUS_FAULTS_ON: (u32, u32) = (0xE000_ED24, 1 << 17);
const BUS_FAULTS_PRIORITY: (u32, u32) = (0xE000_ED18, 8);
/// Offset of the return address in an exception's frame.
const PC_IN_FRAME: u32 = 24;
/// Priority of thread execution, below any interrupt.
const THREAD: i16 = 256;

/// An active exception.
pub(super) struct Active {
    pub(super) context: Context,
    pub(super) vector: u32,
    pub(super) priority: i16,
}

impl Machine {
    /// Returns the execution priority, with the masks.
    fn priority(&self) -> i16 {
        let active = self.active.last().map_or(THREAD, |a| a.priority);
        let base = self.register(RegisterARM::BASEPRI) as i16 & 0xF0;
        let by_base = if base == 0 { THREAD } else { base };
        let by_primask = if self.register(RegisterARM::PRIMASK) & 1 != 0 {
            0
        } else {
            THREAD
        };
        active.min(by_base).min(by_primask)
    }

    pub(super) fn take_interrupt(&mut self) {
        let current = self.priority();
        let next = self.bus().nvic.deliverable(current);
        if let Some((interrupt, priority)) = next {
            self.bus().nvic.take(interrupt);
            self.enter(interrupt as u32 + 16, priority.into());
        }
    }

    /// Stacks the architecture's frame (with room for the FPU's registers, as with lazy stacking)
    /// and jumps to the vector.
    fn enter(&mut self, vector: u32, priority: i16) {
        let context = self.core.context_init().expect("saved");
        let registers = [
            RegisterARM::R0,
            RegisterARM::R1,
            RegisterARM::R2,
            RegisterARM::R3,
            RegisterARM::R12,
            RegisterARM::LR,
            RegisterARM::PC,
            RegisterARM::XPSR,
        ];
        let frame: Vec<u8> = registers
            .iter()
            .flat_map(|r| (self.register(*r) as u32).to_le_bytes())
            .collect();
        let stack = (self.register(RegisterARM::SP) - 26 * 4) & !7;
        self.stack_frame(stack as u32, &frame);
        let table = {
            let set = self.bus().read(0xE000_ED08);
            if set == 0 {
                self.chip.memories[0].0
            } else {
                set
            }
        };
        let handler = self.word(table + 4 * vector);
        self.active.push(Active {
            context,
            vector,
            priority,
        });
        self.taken.push(vector);
        self.set_register(RegisterARM::EPSR, THUMB);
        self.set_register(RegisterARM::SP, stack);
        self.set_register(RegisterARM::LR, EXC_RETURN | 1);
        self.set_register(RegisterARM::PC, handler.into());
    }

    /// Returns to the address in the exception's frame, which the handler may have changed. BASEPRI
    /// and PRIMASK are not restored, so a handler that leaves one set is detected.
    pub(super) fn leave(&mut self) {
        let Some(active) = self.active.pop() else {
            return;
        };
        if active.vector == self.chip.tick_interrupt as u32 + 16
            && let Some(stopwatch) = &self.bus().stopwatch
        {
            stopwatch.end();
        }
        let return_address = self.word(self.register(RegisterARM::SP) as u32 + PC_IN_FRAME);
        let masks = [RegisterARM::BASEPRI, RegisterARM::PRIMASK];
        let saved = masks.map(|mask| self.register(mask));
        self.core
            .context_restore(&active.context)
            .expect("restored");
        for (mask, value) in masks.into_iter().zip(saved) {
            self.set_register(mask, value);
        }
        self.set_register(RegisterARM::PC, u64::from(return_address) | 1);
    }

    pub(super) fn fault(&mut self, why: &str) -> Option<Stop> {
        if self.active.iter().any(|a| a.vector == HARD_FAULT) {
            let mut bus = self.bus();
            bus.is_locked_up = true;
            bus.raise_interrupts();
            drop(bus);
            return Some(Stop::Lockup(format!("{why} at {}", self.place())));
        }
        self.hard_faults += 1;
        self.report_forbidden();
        self.enter(HARD_FAULT, -1);
        None
    }

    /// Raises the chip's exception for the load of a word that cannot be read.
    pub(super) fn fail_load(&mut self, address: u32) -> Option<Stop> {
        self.bus().report_unreadable(address);
        match self.chip.flash.unreadable {
            Unreadable::Nmi { .. } => {
                // The load is completed first.
                self.load.set(Load::Done);
                let pc = self.register(RegisterARM::PC) | 1;
                let done = self.core.emu_start(pc, EXC_RETURN, 0, 1);
                done.expect("any bits are a word");
                self.enter(NMI, -2);
            }
            Unreadable::BusFault { .. } => {
                let (on, bit) = BUS_FAULTS_ON;
                let (register, shift) = BUS_FAULTS_PRIORITY;
                let priority = (self.bus().read(register) >> shift & 0xF0) as i16;
                if self.bus().read(on) & bit == 0 || self.priority() <= priority {
                    self.load.set(Load::Inactive);
                    return self.fault("bus fault");
                }
                self.enter(BUS_FAULT, priority);
            }
        }
        self.load.set(Load::Inactive);
        None
    }
}
