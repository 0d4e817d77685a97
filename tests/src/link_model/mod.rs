//! A checked model of the link: the product's client and the device's link, tick by tick, over a
//! line that loses, repeats and delays the frames named in a plan. Later frames overtake a delayed
//! one.
//!
//! ```text
//! Client ──▶ LossyLine ──▶ Device        `run`: one run
//!        ◀── LossyLine ◀──               `fault_plan`: its injected faults
//!                                        `oracle`: checks of every tick
//! ```

mod fault_plan;
mod forged_frames;
mod frame_record;
mod lossy_line;
mod oracle;
mod requests;
mod run;
mod status_queries;

pub use fault_plan::{Interruption, Plan};
pub use lossy_line::{Direction, FrameFault};
pub use oracle::Violation;
pub use run::{End, Report, check, frames};
