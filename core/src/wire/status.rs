//! A device's status: its start, the state of its guard, its measurements.

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
    /// The chip does not report it, or there is no chip.
    #[default]
    Unknown,
    /// The power was switched on.
    PowerOn,
    /// The reset button, or a debug probe.
    Pin,
    /// The program requested it.
    Software,
    /// A watchdog was not fed.
    Watchdog,
    /// The supply voltage was too low for a moment.
    BrownOut,
}

/// Kind of a crash of the program.
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
    /// The stack reached the guard at its end; `pc` is zero if no stack was left to store it.
    StackOverflow = 4,
    /// The supply voltage fell below the chip's monitored level.
    SupplyLow = 5,
}

/// Number of stored bytes of a file's name in a crash: its end.
pub const CRASH_FILE: usize = 24;

/// Crash of the program before the board was reset.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// The crash's kind.
    pub kind: CrashKind,
    /// Address of the instruction; zero if it is unknown.
    pub pc: u32,
    /// Return address at that moment; zero if it is unknown.
    pub lr: u32,
    /// The chip's fault status (CFSR of a Cortex-M), or an interrupt's number.
    pub status: u32,
    /// Line of the source file; zero if there is none.
    pub line: u32,
    /// Ticks since the start of that program.
    pub tick: u32,
    /// End of the source file's path.
    pub file: String<CRASH_FILE>,
}

/// The board's report about its start.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BootReport {
    /// Cause of the start.
    pub cause: ResetCause,
    /// Crash of the previous program, if any.
    pub crash: Option<Crash>,
    /// Supply voltage below which the chip holds itself in reset, from its option bytes,
    /// millivolts; zero if no chip reports it.
    pub resets_below_mv: u16,
}

/// Minimum of [`BootReport::resets_below_mv`] for a board, millivolts: the highest level of each
/// chip is above it, all others are below.
pub const RESETS_BELOW_MV: u16 = 2_600;

impl BootReport {
    /// Returns true if the chip runs at a supply voltage below its working range.
    #[must_use]
    pub fn is_brown_out_level_low(&self) -> bool {
        (1..RESETS_BELOW_MV).contains(&self.resets_below_mv)
    }

    /// Returns the initial fault: a board that crashed reports the crash before it drives anything
    /// again.
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

/// Source of the present calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationSource {
    /// There is no calibration.
    #[default]
    None,
    /// The device's memory.
    Stored,
    /// This session's host; the calibration is lost when the device restarts.
    Session,
    /// There is no calibration: the stored record is undamaged, but invalid.
    Refused(CalibrationError),
}

/// Number of ticks and their cost, in counts of the device's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickFigures {
    /// Ticks since the start, wrapping.
    pub run: u32,
    /// The last tick's cost.
    pub cost: u32,
    /// Maximum cost.
    pub worst_cost: u32,
    /// Number of ticks that started or ended too late.
    pub late: u32,
}

/// The stack, in bytes; zero if the board does not measure it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StackFigures {
    /// The stack's size.
    pub size: u32,
    /// Maximum use.
    pub high_water: u32,
}

/// The state of the clock recovery of a board's USB: its oscillator follows the host's
/// start-of-frames; otherwise it is too inaccurate for some hosts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UsbClock {
    /// The board has none, or it was not measured yet.
    #[default]
    Unknown,
    /// It followed all start-of-frames in the last second.
    Locked,
    /// It did not follow all of them.
    Unlocked,
}

/// The status of a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Board, versions, rates, scene.
    pub device: DeviceHello,
    /// The report about its start.
    pub boot: BootReport,
    /// Source of the present calibration.
    pub calibration: CalibrationSource,
    /// The present calibration's model.
    pub model: Option<Model>,
    /// The state of the loop, as last reported.
    pub health: Health,
    /// The number and cost of its ticks.
    pub ticks: TickFigures,
    /// The stack.
    pub stack: StackFigures,
    /// The state of the USB oscillator.
    pub usb_clock: UsbClock,
    /// Number of invalid frames.
    pub bad_frames: u32,
    /// Number of frames of a session that is not the open one.
    pub foreign_frames: u32,
    /// Number of dropped samples.
    pub dropped: u32,
}

/// Time for which a request to store something permanently waits for a press of the dead-man
/// switch, ms.
pub const PRESS_TIMEOUT_MS: u32 = 10_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crash_takes_precedence_over_watchdog_reset() {
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
        let stored = |kind| boot(ResetCause::Software, Some(crash(kind)));
        assert_eq!(stored(CrashKind::StackOverflow), Some(Fault::StackOverflow));
        assert_eq!(stored(CrashKind::SupplyLow), Some(Fault::SupplyLow));
    }

    #[test]
    fn brown_out_is_a_fault_and_a_low_threshold_is_detected() {
        let boot = BootReport {
            cause: ResetCause::BrownOut,
            ..BootReport::default()
        };
        assert_eq!(boot.fault(), Some(Fault::SupplyLow));
        let is_low = |resets_below_mv| {
            let boot = BootReport {
                resets_below_mv,
                ..BootReport::default()
            };
            boot.is_brown_out_level_low()
        };
        assert!(!is_low(0), "no chip reports it");
        assert!(is_low(1_700) && is_low(2_500) && !is_low(2_700) && !is_low(2_800));
    }
}
