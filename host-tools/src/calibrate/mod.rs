//! Calibration of an arm: from a user's readings of a ruler and a spring scale to a calibration
//! record.
//!
//! ```text
//! zero pose ─▶ counts ──┐
//! ruler     ─▶ mm ──────┼─▶ ratios, signs (ratios.rs) ─┐
//! encoders  ─▶ counts ──┘                              ├─▶ record
//! scale     ─▶ newtons ───▶ gravity (gravity.rs) ──────┘
//! ```
//!
//! The motors stay off throughout, so that an error in a record cannot injure the user during the
//! measurement. [`run_procedure`] runs the steps; the [`Attendant`] that answers is a terminal or a
//! [`VirtualUser`].

mod arm;
pub mod file;
mod fit_error;
mod gravity;
mod procedure;
mod ratios;
mod review;
mod virtual_user;

pub use arm::Arm;
pub use fit_error::FitError;
pub use gravity::{GravityFit, N_PER_GRAM, StaticPose, fit_gravity};
pub use procedure::{Attendant, Plan, ProcedureError, Stopped, run_procedure};
pub use ratios::{Direction, RatioFit, RulerMove, fit_ratios};
pub use review::Review;
pub use virtual_user::VirtualUser;
