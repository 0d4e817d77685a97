//! A terrain served to a device, from the connection to a confirmed end.
//!
//! ```text
//! Service (terrain, device) ─ open ─▶ ServedSession ─ serve ─▶ End
//!                                       │  ▲
//!                       SessionHandler ◀┘  └─ connections, reopened when one is lost
//! ```
//!
//! Once connected, the arm may be armed: by this host, or by an earlier one that was killed. Every
//! end of serving (an error, a panic, the user's wish) closes the device's session. If the device
//! does not confirm that it is disarmed, this is reported to the user.
//!
//! Nothing here depends on a terminal or on a kind of connection, so the tests run every end with
//! devices in memory.

mod service;
mod session_handler;
#[cfg(test)]
mod tests;

pub use service::{Connect, End, ServedSession, Service, last_end_remark};
pub use session_handler::SessionHandler;
