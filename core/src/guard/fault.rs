//! Faults: numbered, stable, latched.

use serde::{Deserialize, Serialize};

/// A latched fault. The numbers are stable. Only an explicit reset clears a fault, and until then
/// the amplifiers are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Fault {
    /// A force or current was not a number.
    NotANumber = 1,
    /// A tick took longer than its period.
    TickOverrun = 2,
    /// An encoder moved farther in a tick than the arm can. It lost counts, so the arm must be
    /// zeroed again.
    EncoderJump = 3,
    /// The encoder or amplifier hardware did not respond.
    Hardware = 4,
    /// The emergency stop was pressed, or its wire broke.
    EmergencyStop = 5,
    /// The dead-man switch was released while the amplifiers were on.
    DeadManReleased = 6,
    /// A motor winding is too hot, in spite of derating.
    MotorTooHot = 7,
    /// A joint is beyond its stops.
    JointLimit = 8,
    /// Joints 2 and 3 are in a relation that the linkage does not allow.
    Linkage = 9,
    /// A motor pushes and its encoder does not move.
    NoMotion = 10,
    /// The tip stayed above twice the speed limit.
    TooFast = 11,
    /// A task has stopped: the watchdog is no longer fed.
    TaskStalled = 12,
    /// Found at boot: the watchdog had to reset the board.
    WatchdogReset = 13,
    /// Found at boot: the program had panicked.
    Panicked = 14,
    /// Found at boot: the processor had hit a hard fault, or an interrupt
    /// without a handler.
    HardFault = 15,
    /// Found at boot: the stored calibration record is damaged.
    CalibrationCorrupt = 16,
    /// An amplifier reports that it is not ready while it is enabled.
    AmplifierNotReady = 17,
    /// A motor's measured current differs from the commanded one.
    CurrentMismatch = 18,
    /// The board's supply voltage fell too low, now or (found at boot) before the reset.
    SupplyLow = 19,
    /// A converter's settings read back differently from the written ones.
    OutputsNotAsSet = 20,
    /// Found at boot: the program had overrun its stack.
    StackOverflow = 21,
    /// A joint moved faster or farther than a jog permits.
    JogRanAway = 22,
    /// More than one and a half periods passed between two ticks: a debugger halted the
    /// core, or a bus stalled it.
    TickGap = 23,
}

impl Fault {
    /// Every fault, by number.
    pub const ALL: [Self; 23] = [
        Self::NotANumber,
        Self::TickOverrun,
        Self::EncoderJump,
        Self::Hardware,
        Self::EmergencyStop,
        Self::DeadManReleased,
        Self::MotorTooHot,
        Self::JointLimit,
        Self::Linkage,
        Self::NoMotion,
        Self::TooFast,
        Self::TaskStalled,
        Self::WatchdogReset,
        Self::Panicked,
        Self::HardFault,
        Self::CalibrationCorrupt,
        Self::AmplifierNotReady,
        Self::CurrentMismatch,
        Self::SupplyLow,
        Self::OutputsNotAsSet,
        Self::StackOverflow,
        Self::JogRanAway,
        Self::TickGap,
    ];

    /// Returns the fault's number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Returns the fault's meaning, in a sentence for the user.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::NotANumber => "a force or current was not a number",
            Self::TickOverrun => "a tick took longer than its period",
            Self::EncoderJump => "an encoder moved farther in a tick than the arm can",
            Self::Hardware => "the encoder or amplifier hardware did not answer",
            Self::EmergencyStop => "the emergency stop was pressed, or its wire broke",
            Self::DeadManReleased => {
                "the dead-man switch was released while the amplifiers were on"
            }
            Self::MotorTooHot => "a motor winding is too hot",
            Self::JointLimit => "a joint's reading is beyond its stops",
            Self::Linkage => {
                "the readings of joints 2 and 3 are a pose that the linkage does not allow"
            }
            Self::NoMotion => "a motor pushed and its encoder did not move",
            Self::TooFast => "the tip stayed above twice the speed limit",
            Self::TaskStalled => "a task on the board stopped, so the watchdog was not fed",
            Self::WatchdogReset => "the watchdog had to reset the board",
            Self::Panicked => "the board's program panicked, then the board was reset",
            Self::HardFault => "the board's processor met a hard fault, then the board was reset",
            Self::CalibrationCorrupt => "the calibration record on the board is damaged",
            Self::AmplifierNotReady => "an amplifier reports that it is not ready",
            Self::CurrentMismatch => "a motor's measured current differs from the commanded one",
            Self::SupplyLow => "the board's supply fell too low",
            Self::OutputsNotAsSet => {
                "the converter's settings do not read back as they were written"
            }
            Self::StackOverflow => {
                "the board's program overran its stack, then the board was reset"
            }
            Self::JogRanAway => "a joint moved faster or farther than a jog permits",
            Self::TickGap => "more than one and a half periods passed between two ticks",
        }
    }

    /// Returns the remedy, for the user. The fault can be cleared after that.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::NotANumber => "please report it with the terrain and the recording",
            Self::TickOverrun => "choose a lower tick rate; if it is the default, please report it",
            Self::EncoderJump => {
                "check the encoder cables and their shields, then zero the arm again"
            }
            Self::Hardware => "check supply and cables of encoders and amplifiers",
            Self::EmergencyStop => "make sure that the arm is safe, then release the stop",
            Self::DeadManReleased => {
                "nothing is wrong: clear the fault, arm, and press the switch again"
            }
            Self::MotorTooHot => "let the motors cool for some minutes; lower the force",
            Self::JointLimit => "zero the arm again; check ratios and signs of the calibration",
            Self::Linkage => "zero the arm again; check the encoder of joint 2 or 3",
            Self::NoMotion => "check the encoder cable of the axis, the cable drive and the fuse",
            Self::TooFast => "hold the arm firmly; check the motors' signs in the calibration",
            Self::TaskStalled | Self::WatchdogReset => {
                "please report it with the output of `hapterra status`"
            }
            Self::Panicked | Self::HardFault => {
                "please report it with the crash shown by `hapterra status`"
            }
            Self::CalibrationCorrupt => "calibrate again, or store the record from its file",
            Self::AmplifierNotReady => {
                "check the amplifiers' supply, their own fault lights and the ready wires"
            }
            Self::CurrentMismatch => {
                "check the motor's cable and the amplifier; run `hapterra bringup` again"
            }
            Self::SupplyLow => "check the board's supply and its USB cable",
            Self::OutputsNotAsSet => "check the supply and the wires of the converter",
            Self::StackOverflow => "please report it with the crash shown by `hapterra status`",
            Self::JogRanAway => "check the motor's wiring and the axis; make the current smaller",
            Self::TickGap => {
                "attach no debug probe while the arm is armed; without a probe, please report it"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_stable() {
        for (i, fault) in Fault::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(fault.number()), i + 1, "{fault:?}");
            assert!(!fault.meaning().is_empty() && !fault.remedy().is_empty());
        }
        // Repeated here because recordings and pages use these names.
        let named = [
            (Fault::NotANumber, 1),
            (Fault::TickOverrun, 2),
            (Fault::EncoderJump, 3),
            (Fault::Hardware, 4),
            (Fault::EmergencyStop, 5),
            (Fault::DeadManReleased, 6),
            (Fault::MotorTooHot, 7),
            (Fault::JointLimit, 8),
            (Fault::Linkage, 9),
            (Fault::NoMotion, 10),
            (Fault::TooFast, 11),
            (Fault::TaskStalled, 12),
            (Fault::WatchdogReset, 13),
            (Fault::Panicked, 14),
            (Fault::HardFault, 15),
            (Fault::CalibrationCorrupt, 16),
            (Fault::AmplifierNotReady, 17),
            (Fault::CurrentMismatch, 18),
            (Fault::SupplyLow, 19),
            (Fault::OutputsNotAsSet, 20),
            (Fault::StackOverflow, 21),
            (Fault::JogRanAway, 22),
            (Fault::TickGap, 23),
        ];
        for (fault, number) in named {
            assert_eq!(fault.number(), number);
        }
    }
}
