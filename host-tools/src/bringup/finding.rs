//! Findings of the steps, by name, with their remedies.

use hapterra_core::guard::{Blockers, Fault};
use hapterra_core::wire::request::Refusal;

use super::attendant::Task;
use crate::calibrate::FitError;

/// Reason why a step fails. Axes and joints are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Finding {
    /// The board has a fault.
    #[error("the board has fault {} {:?}: {}", .0.number(), .0, .0.meaning())]
    Fault(Fault),
    /// The board reports a blocker.
    #[error("the board is not ready: {}", .0.meaning())]
    NotReady(Blockers),
    /// The board's tick rate differs by another clock.
    #[error(
        "the board runs at {hz:.0} ticks a second by this computer's clock, and reports {nominal_hz:.0}"
    )]
    WrongTickRate {
        /// The counted rate.
        hz: f64,
        /// The rate that the board reports.
        nominal_hz: f64,
    },
    /// The board's USB oscillator is not locked to the host's.
    #[error("the board's USB clock does not follow this computer's")]
    UsbClockUnlocked,
    /// The board refuses a request.
    #[error("the board refuses: {0}")]
    Refused(Refusal),
    /// The user's action was not detected.
    #[error("the board did not detect it: {0}")]
    NotDetected(Task),
    /// The enable line is not low.
    #[error("the enable line is at {0:.2} V where it has to be low")]
    EnableHigh(f64),
    /// An output has a wrong value.
    #[error("output {axis} is at {found} {unit} where {expected} {unit} is expected")]
    Output {
        /// The output.
        axis: usize,
        /// Measured value.
        found: f64,
        /// Expected value.
        expected: f64,
        /// Unit of both values.
        unit: &'static str,
    },
    /// An encoder did not count while its joint turned.
    #[error("the encoder of joint {joint} is dead: {counts} counts while the joint turned")]
    DeadEncoder {
        /// The joint.
        joint: usize,
        /// Counts.
        counts: i32,
    },
    /// Another joint's encoder counted.
    #[error("encoders are swapped: joint {joint} turned and encoder {encoder} counted")]
    SwappedEncoders {
        /// The joint that was turned.
        joint: usize,
        /// The encoder that counted.
        encoder: usize,
    },
    /// An encoder did not return to its first count.
    #[error("the encoder of joint {joint} loses counts: {there} there, {back} back")]
    CountsLost {
        /// The joint.
        joint: usize,
        /// Counts in the outward motion.
        there: i32,
        /// Counts in the return motion.
        back: i32,
    },
    /// The board has no calibration record.
    #[error("the board has no stored calibration")]
    NoCalibration,
    /// The distances by the ruler fit no record.
    #[error(transparent)]
    Ruler(#[from] FitError),
    /// An encoder's direction differs from the record's.
    #[error(
        "the encoder sign of joint {joint} is inverted: {record:+} in the record, the opposite by the ruler"
    )]
    InvertedEncoder {
        /// The joint.
        joint: usize,
        /// The record's sign.
        record: i8,
    },
    /// A cable ratio differs from the record's.
    #[error(
        "the ratio of joint {joint} is wrong: {record:.2} in the record, {found:.2} by the ruler"
    )]
    WrongRatio {
        /// The joint.
        joint: usize,
        /// The record's ratio.
        record: f64,
        /// The ratio by the ruler.
        found: f64,
    },
    /// A motor turned another motor's joint.
    #[error("motors are swapped: command {motor} turns joint {joint}")]
    SwappedMotors {
        /// The command.
        motor: usize,
        /// The joint that moved.
        joint: usize,
    },
    /// A motor turned its joint in the wrong direction.
    #[error(
        "the sign of motor {motor} is inverted: it turns its joint against the direction in the record"
    )]
    InvertedMotor {
        /// The motor.
        motor: usize,
        /// The correct sign.
        right: i8,
    },
    /// A motor does not push.
    #[error("motor {motor} does not push: no joint moved at {current_a:.2} A")]
    NoPush {
        /// The motor.
        motor: usize,
        /// The current, A.
        current_a: f32,
    },
    /// The hand's motion hides the direction of a motor.
    #[error(
        "the direction of motor {motor} cannot be determined: the hand moved more than the motor"
    )]
    Unclear {
        /// The motor.
        motor: usize,
    },
    /// A motor's torque is far from the record's.
    #[error(
        "the torque constant of motor {motor} is wrong: {record:.4} Nm/A in the record, {found:.4} by the scale"
    )]
    WrongTorque {
        /// The motor.
        motor: usize,
        /// Torque constant by the scale, Nm/A of the motor.
        found: f64,
        /// The record's torque constant.
        record: f64,
    },
    /// The arm drifts after its release.
    #[error("the arm drifts: {mm:.0} mm within {seconds:.1} s after its release")]
    Drifts {
        /// Distance, mm.
        mm: f64,
        /// Time, s.
        seconds: f64,
    },
    /// The arm moves fast after its release.
    #[error("the arm moves by itself: its tip moved at {mm_s:.0} mm/s at its release")]
    MovesByItself {
        /// Speed, mm/s.
        mm_s: f64,
    },
    /// The pressed stop does not cut the amplifiers' power.
    #[error("the pressed stop does not cut the power of the amplifiers' power stages")]
    StopLeavesPower,
    /// The floor does not push the tip up.
    #[error("the floor does not push the tip back")]
    NoFloor,
}

impl Finding {
    /// Returns the remedy, in the imperative.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Fault(fault) => return fault.remedy().into(),
            Self::InvertedMotor { motor, right } => {
                return format!(
                    "exchange the motor's two wires, or type: hapterra calibrate --measure none --set motor-sign-{motor}={right}"
                );
            }
            Self::WrongTorque { .. } => {
                "check the amplifier's full scale against the board's page, then the torque constant of the motor's data sheet"
            }
            Self::NotReady(_) | Self::Refused(_) => "look at hapterra status",
            Self::WrongTickRate { .. } => "do not continue: every limit in seconds would be wrong; flash the image of this very board again, and report it if it stays so",
            Self::UsbClockUnlocked => "try another USB port without a hub; if it stays so, report it with the board's name and revision",
            Self::NotDetected(Task::PullReadyWire(_) | Task::ConnectReadyWire(_)) => {
                "check that the amplifier is there, that its logic has power, and that its ready output is low while it is ready; an input that is tied to ground belongs to an amplifier without such an output"
            }
            Self::NotDetected(_) => "check the switch's wires against the board's page",
            Self::EnableHigh(_) => "add the pull-down at the amplifiers; do not continue until it is low",
            Self::Output { .. } => "check the output's wire and its offset stage, which gets 1.65 V for no current from a G474; switch no amplifier on until it is right",
            Self::DeadEncoder { .. } => "check the encoder's supply, both its channels, and its plug",
            Self::SwappedEncoders { .. } => "exchange the two encoders' wires",
            Self::CountsLost { .. } => "check the encoder's level shifter, its shield and its ground",
            Self::NoCalibration | Self::InvertedEncoder { .. } | Self::WrongRatio { .. } => {
                "calibrate the arm: hapterra calibrate"
            }
            Self::Ruler(_) => "measure again, along the ruler; if it stays so, calibrate: hapterra calibrate",
            Self::SwappedMotors { .. } => "exchange the two motors' plugs, or the two commands",
            Self::NoPush { .. } => "check that the amplifier is there, has power and its enable, then fuse and motor cable",
            Self::Unclear { .. } => {
                "hold the tip more loosely and as still as you can, and try again; if it stays so, a current may flow without a command: measure the command at the amplifier again (--again-from outputs)"
            }
            Self::Drifts { .. } | Self::MovesByItself { .. } => "measure the arm's weight again: hapterra calibrate --measure zero,gravity",
            Self::StopLeavesPower => "wire the stop's second contact into the supply of the power stages; the board alone is not sufficient",
            Self::NoFloor => "report it with the log; do not continue with terrain",
        }
        .into()
    }
}
