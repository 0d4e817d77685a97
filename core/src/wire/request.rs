//! Requests of a host and their answers: each request is done once, even if it is repeated.
//!
//! A request is sent in [`ToDevice::Request`](super::message::ToDevice::Request) with a number that
//! counts requests, wrapping. The host repeats it with the same number until it is answered.

use serde::{Deserialize, Serialize};

use crate::clutch::ClutchMode;
use crate::guard::{Blockers, Fault, Jog};
use crate::phantom::{Calibration, CalibrationError};

/// Request of a host to a device. New variants must be the last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
// Built and consumed on the stack; there is no heap for a box.
#[allow(clippy::large_enum_variant)]
pub enum Request {
    /// Arms: once nothing blocks it, the dead-man switch must be released and pressed. Answered
    /// when the blockers are known.
    Arm,
    /// Disarms after a fade-out of the force.
    Disarm,
    /// Sets the encoder counts of the calibration's zero pose.
    Zero {
        /// Counts of axes 1 to 3.
        counts: [i32; 3],
    },
    /// Sets the calibration. Only while disarmed.
    SetCalibration {
        /// The record.
        calibration: Calibration,
    },
    /// Stores the present calibration in the device's memory after a press of the dead-man switch,
    /// which no host can replace. Only while disarmed. Answered when it is stored.
    StoreCalibration,
    /// Clears the latched fault that the user has seen. A later fault stays ([`Refusal::Blocked`]).
    /// `None`, if no fault was shown, clears none.
    ClearFault {
        /// The fault that was shown.
        fault: Option<Fault>,
    },
    /// Drops the scene: disarms after a fade-out of the force.
    DropScene,
    /// Enters the loader in the chip's ROM, for an update. Only while disarmed. The device answers
    /// and then leaves; it handles no later request.
    EnterLoader,
    /// Drops the scene and arms for a jog. Only while disarmed. Answered like [`Request::Arm`].
    Jog(Jog),
    /// Holds the outputs at these shares of full scale, -1 to 1, with the amplifiers off, or ends
    /// the hold. Only while disarmed and without a fault; it ends automatically
    /// ([`MAX_HOLD_S`](crate::guard::MAX_HOLD_S)).
    HoldOutputs(Option<[f32; 3]>),
    /// Holds or releases the clutch: while it is held there is no force, and the placement may
    /// change. It is released when the session ends.
    Clutch {
        /// Use of the clutch from now on.
        hold: ClutchMode,
    },
    /// Marks a tick: the board's mark pin is high for
    /// [`MARK_PULSE_MS`](crate::scene::MARK_PULSE_MS) from the end of that tick on. Answered by
    /// [`ToHost::Marked`](super::message::ToHost::Marked) when the pin may rise again.
    Mark,
    /// Cancels a change of placement that waits for its terrain
    /// ([`SceneChange::in_contact`](crate::scene::SceneChange::in_contact)): the placement before
    /// is still rendered, and its tiles are requested again. Answered when the loop has decided;
    /// refused if no such change waits ([`Refusal::NoSuchChange`]).
    CancelChange {
        /// Epoch of the change's scene: numbers are used again.
        epoch: u32,
    },
}

/// Reason why a request was refused. Nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The arm cannot be armed.
    #[error("the arm cannot be armed")]
    Blocked(Blockers),
    /// The arm is armed or being armed.
    #[error("not while the arm is armed or being armed: disarm first")]
    NotWhileArmed,
    /// The calibration has an invalid number.
    #[error("the calibration cannot be used: {0}")]
    Calibration(CalibrationError),
    /// There is no calibration for this request.
    #[error("there is no calibration")]
    NoCalibration,
    /// The device has no memory for a calibration.
    #[error("this device has no memory to store a calibration in")]
    NoMemory,
    /// The device's memory failed.
    #[error("the device's memory failed: the calibration is in force but not stored")]
    MemoryFailed,
    /// The device still works on the last request of this kind.
    #[error("the device is still busy with the last request of this kind")]
    Busy,
    /// The user did not press the dead-man switch within [`PRESS_TIMEOUT_MS`].
    ///
    /// [`PRESS_TIMEOUT_MS`]: super::status::PRESS_TIMEOUT_MS
    #[error("the dead-man switch was not pressed: the calibration is in use but not stored")]
    NotPressed,
    /// The device's memory is full; the device frees memory at its start.
    #[error(
        "the device's memory is full until it is started again: the calibration is in force but not stored"
    )]
    MemoryFull,
    /// The device has no loader to enter.
    #[error("this device has no loader in a ROM")]
    NoLoader,
    /// A jog with too much current or time, or without a valid axis.
    #[error("the jog exceeds the largest current or time, or the axis does not exist")]
    NoSuchJog,
    /// No change of placement to this scene waits: it was made already, or never arrived.
    #[error("no such change of placement waits: it was made already, or never arrived")]
    NoSuchChange,
}

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The request's number.
    pub number: u8,
    /// Outcome, or the reason for the refusal.
    pub result: Result<(), Refusal>,
}
