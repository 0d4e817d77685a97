//! The Phantom: encoder counts to tip position, tip force to motor currents.
//!
//! Two frames. The *device frame* has its origin where the joint axes meet, x
//! away from the base toward the user, z up. The *terrain frame* is the user's
//! view: x east (right), y north (away), z up. They differ by a quarter turn.

mod calibration;
mod kinematics;
mod trig;

pub use calibration::Calibration;
pub(crate) use kinematics::to_device_frame;
pub use kinematics::{Pose, to_terrain_frame};
pub use trig::sin_cos;
