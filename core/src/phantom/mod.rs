//! The Phantom: encoder counts to tip position, tip force to motor currents.
//!
//! Reading order: `calibration` (the data of an arm), [`Kinematics`] (constants derived from it
//! outside of the tick), [`Pose`] (tip and torques), and [`Readings`] (velocity). `presets`,
//! `check`, `absolute_limits` and `record` belong to the calibration: records to start from,
//! checks, limits that no record can raise, and its bytes in memory.
//!
//! Two frames. The *device frame* has its origin where the joint axes meet, x away from the base
//! toward the user, z up. The *terrain frame* is the user's: x east (right), y north (away), z up.
//! They differ by a quarter turn.

mod absolute_limits;
mod calibration;
mod check;
mod inverse;
mod kinematics;
mod mechanism;
mod presets;
mod record;
mod trig;
mod velocity;

pub use calibration::{Calibration, JointLimits, Model, Thermal};
pub use check::{Bound, CalibrationError, CalibrationField};
pub use inverse::Unreachable;
pub(crate) use kinematics::to_device_frame;
pub use kinematics::{Pose, to_terrain_frame};
pub use mechanism::Kinematics;
pub use record::{RECORD_BYTES, RecordError, VERSION as RECORD_VERSION};
pub use trig::sin_cos;
pub use velocity::{Readings, WINDOW as VELOCITY_WINDOW};
