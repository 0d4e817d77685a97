//! The bring-up of a board and its arm, step by step; no step is skipped.
//!
//! ```text
//! Step (in order) ─▶ steps/ ─ tasks ─▶ Attendant (a terminal, or a VirtualUser)
//!                       │     requests ─▶ Board (over the link)
//!                       ▼
//!           result, or a Finding that names what is wrong ─▶ Log (TOML)
//! ```
//!
//! The motors are first driven by a *jog*: one at a time, with a quarter of the continuous current,
//! while no joint may move faster than
//! [`MAX_JOG_SPEED_RAD_S`](hapterra_core::guard::MAX_JOG_SPEED_RAD_S) or farther than
//! [`MAX_JOG_ROTATION_RAD`](hapterra_core::guard::MAX_JOG_ROTATION_RAD). No surface is rendered
//! before each motor's joint, sign and torque are verified.

mod attendant;
mod board;
mod finding;
mod halt;
mod log;
mod sequence;
mod step;
mod steps;
mod utc;
mod virtual_bench;
mod virtual_user;

pub use attendant::{Attendant, BoardState, Question, Reading, Stopped, Task};
pub use finding::Finding;
pub use halt::Halt;
pub use log::{Entry, Identity, Log, LogError};
pub use sequence::{BringupError, SequenceEnd, run_sequence};
pub use step::Step;
pub use virtual_bench::{BenchMistakes, VirtualBench};
pub use virtual_user::VirtualUser;
