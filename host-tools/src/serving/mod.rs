//! A terrain served to a device, from the first line to an end that is known.
//!
//! ```text
//! Service (what, to whom) ─ open ─▶ Served ─ serve ─▶ End
//!                                    │  ▲
//!                          Onlooker ◀┘  └─ lines to the device, made when one is lost
//! ```
//!
//! From the moment a line stands the arm at its other end may be armed: by this host, or
//! by one before it that was killed. However serving ends from then on, with an error, a
//! panic or a wish of the user's, the device is said goodbye to. Where it does not confirm
//! that it is disarmed, the user is told.
//!
//! Nothing here knows a terminal or what a line is made of, so the tests play every end
//! against devices in memory.

mod onlooker;
mod service;
#[cfg(test)]
mod tests;

pub use onlooker::Onlooker;
pub use service::{Connect, End, Served, Service, told_of_last_end};
