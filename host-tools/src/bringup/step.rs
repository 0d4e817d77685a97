//! The steps of a bring-up, in order.

use serde::{Deserialize, Serialize};

/// A step. It runs only after all steps before it have passed.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// The board answers, is disarmed, and finds nothing wrong with itself.
    Board,
    /// Emergency stop and dead-man switch, each in both positions.
    Switches,
    /// The ready lines are detected; the enable line is low in every state of the board.
    EnableLine,
    /// The command outputs follow, with the amplifiers off.
    Outputs,
    /// Each encoder counts, and belongs to its joint.
    Encoders,
    /// The record's ratios and signs are the arm's.
    Calibration,
    /// Motor 1 turns joint 1 in the direction and with the torque of the record.
    #[serde(rename = "motor-1")]
    #[value(name = "motor-1")]
    Motor1,
    /// The same of motor 2.
    #[serde(rename = "motor-2")]
    #[value(name = "motor-2")]
    Motor2,
    /// The same of motor 3.
    #[serde(rename = "motor-3")]
    #[value(name = "motor-3")]
    Motor3,
    /// The motors carry the arm's weight; letting go of the switch ends that.
    Gravity,
    /// A soft plane pushes back; the emergency stop ends that.
    FirstTouch,
}

impl Step {
    /// All steps, in order.
    pub const ALL: [Self; 11] = [
        Self::Board,
        Self::Switches,
        Self::EnableLine,
        Self::Outputs,
        Self::Encoders,
        Self::Calibration,
        Self::Motor1,
        Self::Motor2,
        Self::Motor3,
        Self::Gravity,
        Self::FirstTouch,
    ];

    /// Returns true if the step's result depends on the calibration record.
    #[must_use]
    pub fn depends_on_calibration(self) -> bool {
        self >= Self::Calibration
    }

    /// Returns the step's heading.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Board => "the board answers",
            Self::Switches => "emergency stop and dead-man switch",
            Self::EnableLine => "ready lines and enable line",
            Self::Outputs => "command outputs, amplifiers off",
            Self::Encoders => "encoders, by hand",
            Self::Calibration => "calibration, against a ruler",
            Self::Motor1 => "motor 1",
            Self::Motor2 => "motor 2",
            Self::Motor3 => "motor 3",
            Self::Gravity => "the arm's weight",
            Self::FirstTouch => "first touch",
        }
    }

    /// Returns the required wiring, if it changes at this step.
    #[must_use]
    pub const fn wiring(self) -> Option<&'static str> {
        match self {
            Self::Board => Some("nothing is connected to the board but USB"),
            Self::Switches => Some("connect the emergency stop and the dead-man switch"),
            Self::EnableLine => Some(
                "connect the enable line to the amplifiers, with its pull-down, and their ready lines; their power stages stay off, no motor is connected",
            ),
            Self::Outputs => {
                Some("connect the command outputs to the amplifiers; power stages off")
            }
            Self::Encoders => Some("connect the arm's encoders; no motor is connected"),
            Self::Calibration => None,
            Self::Motor1 => Some(
                "set the amplifiers' own current limits to 0.5 A; connect the three motors; power stages on, your face away from the arm",
            ),
            Self::Motor2 | Self::Motor3 | Self::Gravity => None,
            Self::FirstTouch => None,
        }
    }

    /// Returns the axis of a motor's step, 0 to 2.
    #[must_use]
    pub const fn motor(self) -> Option<usize> {
        match self {
            Self::Motor1 => Some(0),
            Self::Motor2 => Some(1),
            Self::Motor3 => Some(2),
            _ => None,
        }
    }

    /// Returns the step's number, from 1.
    #[must_use]
    pub fn number(self) -> usize {
        1 + Self::ALL.iter().filter(|step| **step < self).count()
    }
}
