//! Instructions, readings and questions for the user.

use std::fmt;

use crate::calibrate::Direction;

/// The user's side of a bring-up: acts, measures and answers.
pub trait Attendant {
    /// Receives a message.
    fn notify(&mut self, line: &str);

    /// Requests an action that the board detects by itself.
    fn begin(&mut self, task: Task);

    /// Requests an action and returns when it is done.
    ///
    /// # Errors
    /// [`Stopped`].
    fn finish(&mut self, task: Task) -> Result<(), Stopped>;

    /// Returns the reading of a meter, ruler or scale.
    ///
    /// # Errors
    /// [`Stopped`].
    fn read(&mut self, reading: Reading) -> Result<f64, Stopped>;

    /// Returns the answer to a yes-or-no question.
    ///
    /// # Errors
    /// [`Stopped`].
    fn confirm(&mut self, question: Question) -> Result<bool, Stopped>;

    /// Returns a function that is true if the attendant wants to stop; it is called before each
    /// status request.
    fn stop_check(&self) -> fn() -> bool {
        || false
    }

    /// Returns the time since a fixed moment on a clock independent of the board, s. The board's
    /// own time is `board_ms`.
    fn time_s(&self, board_ms: f64) -> f64;

    /// Receives a change: the arm may be armed from now on, or is disarmed for certain.
    fn may_be_armed(&mut self, _may: bool) {}
}

/// The attendant stopped the bring-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped: the steps that are passed are kept in the log")]
pub struct Stopped;

/// An action for the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Wire the board for a step.
    Wire(&'static str),
    /// Press the emergency stop.
    PressStop,
    /// Release the emergency stop.
    ReleaseStop,
    /// Disconnect one wire of the released emergency stop.
    PullStopWire,
    /// Connect the wire again.
    ConnectStopWire,
    /// Disconnect the ready wire of an amplifier (0 to 2) from the board.
    PullReadyWire(usize),
    /// Connect the ready wire again.
    ConnectReadyWire(usize),
    /// Press the dead-man switch and hold it.
    PressDeadMan,
    /// Release the dead-man switch.
    ReleaseDeadMan,
    /// Put the arm into its zero pose and hold it.
    ZeroPose,
    /// Move the tip along a ruler from its position, by this many millimetres.
    MoveAlong(Direction, u16),
    /// Hold the tip loosely in the zero pose.
    HoldLoosely,
    /// Hold the tip in the zero pose with a spring scale, against the push of an axis (0 to 2).
    HoldWithScale(usize),
    /// Read the scale now; the question follows later.
    ReadScale,
    /// Release the tip, with a hand near it.
    ReleaseTip,
    /// Hold the tip again.
    HoldTip,
    /// Lower the tip slowly through the plane.
    LowerTip,
    /// Lift the tip off the plane.
    LiftTip,
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wire(how) => f.write_str(how),
            Self::PressStop => f.write_str("press the emergency stop"),
            Self::ReleaseStop => f.write_str("release the emergency stop"),
            Self::PullStopWire => f.write_str("pull one wire of the emergency stop off the board"),
            Self::ConnectStopWire => f.write_str("connect the wire again"),
            Self::PullReadyWire(axis) => {
                write!(f, "pull ready wire {} off the board", axis + 1)
            }
            Self::ConnectReadyWire(axis) => write!(f, "connect ready wire {} again", axis + 1),
            Self::PressDeadMan => f.write_str("press the dead-man switch and hold it"),
            Self::ReleaseDeadMan => f.write_str("release the dead-man switch"),
            Self::ZeroPose => f.write_str(
                "put the arm into its zero pose and hold it: upper link level and pointing at you, fore link hanging straight down",
            ),
            Self::MoveAlong(direction, mm) => write!(
                f,
                "place a ruler at the tip; move the tip {} by about {mm} mm and hold it",
                direction.words()
            ),
            Self::HoldLoosely => f.write_str(
                "hold the tip loosely with two fingers in the zero pose, your face away from the arm",
            ),
            Self::HoldWithScale(axis) => write!(
                f,
                "hook a spring scale to the tip and hold the tip with it in the zero pose, the scale pulling {}",
                against(*axis)
            ),
            Self::ReadScale => f.write_str("read the scale now"),
            Self::ReleaseTip => f.write_str("release the tip, a hand near it; keep the switch pressed"),
            Self::HoldTip => f.write_str("hold the tip again"),
            Self::LowerTip => f.write_str(
                "lower the tip slowly: a soft floor begins some 20 mm below; push 10 mm into it",
            ),
            Self::LiftTip => f.write_str("lift the tip again"),
        }
    }
}

/// Returns the direction in which a scale pulls against the push of an axis.
const fn against(axis: usize) -> &'static str {
    match axis {
        0 => "to your left",
        1 => "straight down",
        _ => "away from you",
    }
}

/// A measurement by the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// The enable line at the amplifiers, V.
    EnableVolts(BoardState),
    /// A command output (0 to 2) that the board holds at a fraction of full scale.
    Output {
        /// The output.
        axis: usize,
        /// The fraction, −1 to 1.
        fraction: f64,
        /// Unit of the reading.
        unit: &'static str,
    },
    /// Distance that the tip moved along the ruler, mm.
    MovedMm(Direction, u16),
    /// The scale, grams: at rest, or at the requested moment.
    ScaleGrams {
        /// True if the motor pushed.
        pushed: bool,
    },
}

/// State of the board while the enable line is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardState {
    /// The board runs, disarmed.
    Running,
    /// The reset button is held down.
    InReset,
    /// The board has no power.
    Unplugged,
}

impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EnableVolts(when) => {
                let when = match when {
                    BoardState::Running => "the board running",
                    BoardState::InReset => "the board's reset button held down",
                    BoardState::Unplugged => "the board unplugged",
                };
                write!(f, "volts on the enable line at the amplifiers, {when}?")
            }
            Self::Output {
                axis,
                fraction,
                unit,
            } => write!(
                f,
                "{unit}, output {}, held at {:+.0} % of full scale?",
                axis + 1,
                100.0 * fraction
            ),
            Self::MovedMm(direction, _) => {
                write!(f, "how many mm did the tip move {}?", direction.words())
            }
            Self::ScaleGrams { pushed: false } => f.write_str("grams on the scale, at rest?"),
            Self::ScaleGrams { pushed: true } => {
                f.write_str("grams on the scale, while the motor pushed?")
            }
        }
    }
}

/// A yes-or-no question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Are the amplifiers' ready outputs wired to the board?
    ReadyIsWired,
    /// Does the pressed stop cut the amplifiers' power?
    StopCutsPower,
    /// Did the floor push the tip back up?
    PushedBack,
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadyIsWired => f.write_str(
                "are the amplifiers' ready outputs wired to the board, their logic supplied?",
            ),
            Self::StopCutsPower => f.write_str(
                "the stop still pressed: are the amplifiers' power stages without power?",
            ),
            Self::PushedBack => f.write_str("did the floor push the tip up, and only up?"),
        }
    }
}
