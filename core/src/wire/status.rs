//! What a device reports about itself: how it booted, the state of its guard, what
//! it measures.

use heapless::String;
use serde::{Deserialize, Serialize};

use super::hello::DeviceHello;
use crate::guard::{Blockers, Fault};
use crate::phantom::{BadCalibration, Model};
use crate::scene::Health;

/// Why the board last started.
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

/// What kind of end the program came to.
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
}

/// Bytes of a file's name that a crash keeps: its end.
pub const CRASH_FILE: usize = 24;

/// How the program ended before the board was reset.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// What kind of end.
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

/// What the board found when it started.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BootReport {
    /// Why it started.
    pub cause: ResetCause,
    /// How the program before had ended, if it crashed.
    pub crash: Option<Crash>,
}

impl BootReport {
    /// The fault to begin with: a board that crashed says so before it drives
    /// anything again.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        match (&self.crash, self.cause) {
            (Some(crash), _) => Some(match crash.kind {
                CrashKind::Panic => Fault::Panicked,
                CrashKind::HardFault | CrashKind::UnhandledInterrupt => Fault::HardFault,
            }),
            (None, ResetCause::Watchdog) => Some(Fault::WatchdogReset),
            (None, _) => None,
        }
    }
}

/// Where the calibration in force comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationSource {
    /// There is none.
    #[default]
    None,
    /// The device's memory.
    Stored,
    /// This session's host; it is gone when the device restarts.
    Session,
}

/// Ticks and what they cost, in counts of the device's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickFigures {
    /// Ticks since the start, wrapping.
    pub run: u32,
    /// The last tick's cost.
    pub cost: u32,
    /// The costliest so far.
    pub worst_cost: u32,
    /// Ticks that began or ended too late.
    pub late: u32,
}

/// The stack, in bytes; zero where the board does not measure it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StackFigures {
    /// How large it is.
    pub size: u32,
    /// How much of it was ever used.
    pub high_water: u32,
}

/// Everything worth knowing about a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Board, versions, rates, scene.
    pub device: DeviceHello,
    /// How it started.
    pub boot: BootReport,
    /// Where the calibration in force comes from, and of what model it is.
    pub calibration: CalibrationSource,
    /// The calibration's model.
    pub model: Option<Model>,
    /// The loop, as it last reported.
    pub health: Health,
    /// Its ticks.
    pub ticks: TickFigures,
    /// The stack.
    pub stack: StackFigures,
    /// Frames that were not understood.
    pub bad_frames: u32,
    /// Samples that were dropped.
    pub dropped: u32,
}

/// What a host asked for that is answered with an [`Answer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request {
    /// To arm.
    Arm,
    /// To disarm.
    Disarm,
    /// To take the counts of the zero pose.
    Zero,
    /// To take a calibration.
    SetCalibration,
    /// To store the calibration in force.
    StoreCalibration,
    /// To clear a fault.
    ClearFault,
    /// To drop the scene.
    DropScene,
}

/// Why a request was refused. Nothing was touched.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The arm cannot be armed.
    #[error("the arm cannot be armed")]
    Blocked(Blockers),
    /// Not while the arm is armed or being armed.
    #[error("not while the arm is armed or being armed: disarm first")]
    NotWhileArmed,
    /// The calibration has a number that cannot be worked with.
    #[error("the calibration cannot be used: {0}")]
    Calibration(BadCalibration),
    /// There is no calibration to do this with.
    #[error("there is no calibration")]
    NoCalibration,
    /// The device has no memory to store a calibration in.
    #[error("this device has no memory to store a calibration in")]
    NoMemory,
    /// The device's memory failed.
    #[error("the device's memory failed: the calibration is in force but not stored")]
    MemoryFailed,
    /// The device still works on the last request of this kind.
    #[error("the device is still busy with the last request of this kind")]
    Busy,
    /// The device's memory has no room left; it makes room when it starts.
    #[error(
        "the device's memory is full until it is started again: the calibration is in force but not stored"
    )]
    MemoryFull,
}

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// What was asked for.
    pub request: Request,
    /// Whether it was done; why not.
    pub result: Result<(), Refusal>,
}

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
        let boot = |cause, crash| BootReport { cause, crash }.fault();
        let panicked = Some(crash(CrashKind::Panic));
        assert_eq!(boot(ResetCause::Watchdog, panicked), Some(Fault::Panicked));
        let hard = Some(crash(CrashKind::HardFault));
        assert_eq!(boot(ResetCause::Watchdog, hard), Some(Fault::HardFault));
        let starved = boot(ResetCause::Watchdog, None);
        assert_eq!(starved, Some(Fault::WatchdogReset));
        assert_eq!(boot(ResetCause::PowerOn, None), None);
    }
}
