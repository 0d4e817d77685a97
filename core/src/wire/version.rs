//! The version check between two ends of different protocols.
//!
//! These frames belong to no session. They are the same in every protocol, including the first
//! ones: protocols 1 to 3 had a hello of variant 0 and a refusal of variant 1, each followed only
//! by the protocol's number.
//!
//! - A host sends [`VersionCheck::Query`] before each hello. A device of protocol 3 answers with
//!   its refusal; a device of this protocol ignores it, because the hello follows.
//! - A device answers [`VersionCheck::Query`] of another protocol with [`VersionCheck::Refused`].
//!   That changes nothing else: an open session stays open.
//! - A host accepts a refusal only while it waits for the device's hello, and only if the refusal
//!   contains another protocol than its own.
//!
//! The first byte is 0 or 1. In every other frame it is at least 128, see
//! [`SessionNumber`](super::session::SessionNumber).

use serde::{Deserialize, Serialize};

/// A frame that belongs to no session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum VersionCheck {
    /// From host to device: the host's protocol.
    Query {
        /// The host's protocol.
        protocol: u16,
    },
    /// From device to host: the device's protocol, if the host's is another.
    Refused {
        /// The device's protocol.
        protocol: u16,
    },
}

impl VersionCheck {
    /// Returns true if a frame's decoded bytes are a version check and not part of a session.
    #[must_use]
    pub fn is_in(content: &[u8]) -> bool {
        content.first().is_some_and(|first| *first < 128)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::session::{InSession, SessionNumber};

    #[test]
    fn version_check_has_the_bytes_of_protocol_3() {
        let mut buffer = [0; 8];
        let query = VersionCheck::Query { protocol: 3 };
        assert_eq!(
            postcard::to_slice(&query, &mut buffer).ok(),
            Some(&mut [0, 3][..])
        );
        let refused = VersionCheck::Refused { protocol: 3 };
        assert_eq!(
            postcard::to_slice(&refused, &mut buffer).ok(),
            Some(&mut [1, 3][..])
        );
    }

    #[test]
    fn session_frame_is_never_read_as_a_version_check() {
        for random in [0, 1, 0x7F, 0x80, 0x100, 1 << 14, u32::MAX] {
            let framed = InSession {
                session: SessionNumber::new(random),
                message: 0_u8,
            };
            let mut buffer = [0; 8];
            let bytes = postcard::to_slice(&framed, &mut buffer).expect("fits");
            assert!(!VersionCheck::is_in(bytes), "{random}");
        }
        assert!(VersionCheck::is_in(&[0, 3]) && VersionCheck::is_in(&[1, 3]));
    }
}
