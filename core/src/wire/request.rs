//! Requests of a host and their answers: each is done once, however
//! often it is asked.
//!
//! A request travels in [`ToDevice::Request`](super::message::ToDevice::Request)
//! under a number that counts up from request to request, wrapping. The host
//! repeats it under that number until it is answered.

use serde::{Deserialize, Serialize};

use crate::clutch::ClutchHold;
use crate::guard::{Blockers, Fault, Jog};
use crate::phantom::{Calibration, CalibrationError};

/// Request of a host to a device. New kinds go to the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
// It is made on the stack and taken apart there; there is no heap to box it on.
#[allow(clippy::large_enum_variant)]
pub enum Request {
    /// To arm: once nothing blocks it, the dead-man switch has to be let go and
    /// pressed. Answered when it is known whether anything blocks it.
    Arm,
    /// To disarm; force goes out gently.
    Disarm,
    /// To take what the encoders read in the zero pose of the calibration.
    Zero {
        /// Counts of axes 1 to 3.
        counts: [i32; 3],
    },
    /// To put a calibration in force. Only while disarmed.
    SetCalibration {
        /// The record.
        calibration: Calibration,
    },
    /// To store the calibration in force in the device's memory, once the user has
    /// pressed the dead-man switch, which no host can. Only while disarmed. Answered when
    /// it is stored.
    StoreCalibration,
    /// To clear a latched fault: the one that the user has seen. Another one, which came
    /// after what the user was shown, stays ([`Refusal::Blocked`]). Its field is none where
    /// no fault was shown; it then clears none.
    ClearFault {
        /// The fault that was shown.
        seen: Option<Fault>,
    },
    /// To drop the scene: disarms, and force goes out gently.
    DropScene,
    /// To enter the loader in the chip's ROM, for an update. Only while disarmed.
    /// The device answers and is gone; it does nothing else that is asked for then.
    EnterLoader,
    /// To drop the scene and to arm for a jog. Only while disarmed. Answered as
    /// [`Request::Arm`] is.
    Jog(Jog),
    /// To hold the outputs at these shares of full scale, -1 to 1, with the amplifiers
    /// off, or no longer. Only while disarmed and without a fault; it ends by itself
    /// ([`HOLD_S`](crate::guard::HOLD_S)).
    HoldOutputs(Option<[f32; 3]>),
    /// To hold the clutch, or to let it go: while it is held there is no force, and another
    /// view may be put in. It is let go when the session ends.
    Clutch {
        /// Its use from now on.
        hold: ClutchHold,
    },
    /// To mark a tick: the board's mark pin is high for
    /// [`MARK_PULSE_MS`](crate::scene::MARK_PULSE_MS) from the end of that tick on. Answered by
    /// [`ToHost::Marked`](super::message::ToHost::Marked) when the pin may rise again.
    Mark,
}

/// Reason for which a request was refused. Nothing was touched.
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
    Calibration(CalibrationError),
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
    /// The user did not press the dead-man switch within [`PRESS_MS`].
    ///
    /// [`PRESS_MS`]: super::status::PRESS_MS
    #[error("the dead-man switch was not pressed: the calibration is in use but not stored")]
    NotPressed,
    /// The device's memory has no room left; it makes room when it starts.
    #[error(
        "the device's memory is full until it is started again: the calibration is in force but not stored"
    )]
    MemoryFull,
    /// The device has no loader to enter.
    #[error("this device has no loader in a ROM")]
    NoLoader,
    /// A jog with more current or time than a jog may have, or of no axis.
    #[error("the jog exceeds the largest current or time, or the axis does not exist")]
    NoSuchJog,
}

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The request's number.
    pub number: u8,
    /// Outcome, or the reason for the refusal.
    pub result: Result<(), Refusal>,
}
