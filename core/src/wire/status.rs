//! A device's report about itself: how it booted, the state of its guard, what
//! it measures.

use heapless::String;
use serde::{Deserialize, Serialize};

use super::hello::DeviceHello;
use crate::guard::Fault;
use crate::phantom::{CalibrationError, Model};
use crate::scene::Health;

/// Cause of the board's last start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// The chip does not say, or there is no chip.
    #[default]
    Unknown,
    /// Power came up.
    PowerOn,
    /// The reset button, or a debug probe.
    Pin,
    /// The program asked for it.
    Software,
    /// A watchdog was not fed.
    Watchdog,
    /// The supply was too low for a moment.
    BrownOut,
}

/// Kind of end of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum CrashKind {
    /// A panic; `line` of `file`.
    Panic = 1,
    /// A hard fault at `pc`.
    HardFault = 2,
    /// An interrupt without a handler; its number is `status`.
    UnhandledInterrupt = 3,
    /// The stack ran into what guards its end; `pc` is zero where no stack was left to
    /// keep it.
    StackOverflow = 4,
    /// The supply fell below what the chip watches it for.
    SupplyLow = 5,
}

/// Bytes of a file's name that a crash keeps: its end.
pub const CRASH_FILE: usize = 24;

/// End of the program before the board was reset.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// Its kind.
    pub kind: CrashKind,
    /// Address of the instruction; zero where it is not known.
    pub pc: u32,
    /// Return address at that moment; zero where it is not known.
    pub lr: u32,
    /// The chip's fault status (CFSR of a Cortex-M), or an interrupt's number.
    pub status: u32,
    /// Line of the source file; zero where there is none.
    pub line: u32,
    /// Ticks since that program had started.
    pub tick: u32,
    /// End of the source file's path.
    pub file: String<CRASH_FILE>,
}

/// Findings of the board at its start.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BootReport {
    /// Cause of the start.
    pub cause: ResetCause,
    /// End of the program before, if it crashed.
    pub crash: Option<Crash>,
    /// Supply below which the chip holds itself in reset, as its option bytes have it,
    /// millivolts; zero where no chip reports it.
    pub resets_below_mv: u16,
}

/// The lowest [`BootReport::resets_below_mv`] that a board should have, millivolts: the
/// highest level of each chip is above it, and all others are below.
pub const RESETS_BELOW_MV: u16 = 2_600;

impl BootReport {
    /// Returns true if the chip runs on at a supply at which it need not work.
    #[must_use]
    pub fn lacks_brown_out_reset(&self) -> bool {
        (1..RESETS_BELOW_MV).contains(&self.resets_below_mv)
    }

    /// The fault to begin with: a board that crashed reports it before it drives
    /// anything again.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        match (&self.crash, self.cause) {
            (Some(crash), _) => Some(match crash.kind {
                CrashKind::Panic => Fault::Panicked,
                CrashKind::HardFault | CrashKind::UnhandledInterrupt => Fault::HardFault,
                CrashKind::StackOverflow => Fault::StackOverflow,
                CrashKind::SupplyLow => Fault::SupplyLow,
            }),
            (None, ResetCause::Watchdog) => Some(Fault::WatchdogReset),
            (None, ResetCause::BrownOut) => Some(Fault::SupplyLow),
            (None, _) => None,
        }
    }
}

/// Source of the calibration in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationSource {
    /// There is none.
    #[default]
    None,
    /// The device's memory.
    Stored,
    /// This session's host; it is gone when the device restarts.
    Session,
    /// There is none: the stored record is whole, and cannot be worked with.
    Refused(CalibrationError),
}

/// Ticks and what they cost, in counts of the device's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickFigures {
    /// Ticks since the start, wrapping.
    pub run: u32,
    /// The last tick's cost.
    pub cost: u32,
    /// Maximum cost.
    pub worst_cost: u32,
    /// Ticks that began or ended too late.
    pub late: u32,
}

/// The stack, in bytes; zero where the board does not measure it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StackFigures {
    /// Its size.
    pub size: u32,
    /// Maximum use.
    pub high_water: u32,
}

/// The state of the clock recovery of a board's USB: its oscillator follows the host's
/// start-of-frames, or is too inaccurate for some hosts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UsbClock {
    /// There is none, or it was not measured yet.
    #[default]
    Unknown,
    /// It followed all of them in the last second.
    Locked,
    /// It did not.
    Unlocked,
}

/// Everything worth knowing about a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Board, versions, rates, scene.
    pub device: DeviceHello,
    /// Its start.
    pub boot: BootReport,
    /// Source of the calibration in force, and its model.
    pub calibration: CalibrationSource,
    /// The calibration's model.
    pub model: Option<Model>,
    /// The loop, as it last reported.
    pub health: Health,
    /// Its ticks.
    pub ticks: TickFigures,
    /// The stack.
    pub stack: StackFigures,
    /// The oscillator of USB.
    pub usb_clock: UsbClock,
    /// Frames that were not understood.
    pub bad_frames: u32,
    /// Frames of a session that is not the open one.
    pub foreign_frames: u32,
    /// Samples that were dropped.
    pub dropped: u32,
}

/// For how long a request that is kept for good waits for a press of the dead-man switch,
/// ms.
pub const PRESS_MS: u32 = 10_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crash_says_more_than_the_watchdog_that_followed_it() {
        let crash = |kind| Crash {
            kind,
            pc: 0,
            lr: 0,
            status: 0,
            line: 7,
            tick: 9,
            file: String::new(),
        };
        let boot = |cause, crash| {
            let report = BootReport {
                cause,
                crash,
                ..BootReport::default()
            };
            report.fault()
        };
        let panicked = Some(crash(CrashKind::Panic));
        assert_eq!(boot(ResetCause::Watchdog, panicked), Some(Fault::Panicked));
        let hard = Some(crash(CrashKind::HardFault));
        assert_eq!(boot(ResetCause::Watchdog, hard), Some(Fault::HardFault));
        let starved = boot(ResetCause::Watchdog, None);
        assert_eq!(starved, Some(Fault::WatchdogReset));
        let browned_out = boot(ResetCause::BrownOut, None);
        assert_eq!(browned_out, Some(Fault::SupplyLow));
        assert_eq!(boot(ResetCause::PowerOn, None), None);
        let kept = |kind| boot(ResetCause::Software, Some(crash(kind)));
        assert_eq!(kept(CrashKind::StackOverflow), Some(Fault::StackOverflow));
        assert_eq!(kept(CrashKind::SupplyLow), Some(Fault::SupplyLow));
    }

    #[test]
    fn a_brown_out_is_a_fault_and_a_chip_that_does_not_see_one_is_told() {
        let boot = BootReport {
            cause: ResetCause::BrownOut,
            ..BootReport::default()
        };
        assert_eq!(boot.fault(), Some(Fault::SupplyLow));
        let lacks = |resets_below_mv| {
            let boot = BootReport {
                resets_below_mv,
                ..BootReport::default()
            };
            boot.lacks_brown_out_reset()
        };
        assert!(!lacks(0), "no chip says so");
        assert!(lacks(1_700) && lacks(2_500) && !lacks(2_700) && !lacks(2_800));
    }
}
