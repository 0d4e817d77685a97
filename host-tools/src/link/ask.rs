//! Requests of a host.

use std::mem::discriminant;

use hapterra_core::wire::request::Request;

/// A host's request, repeated until it is answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ask {
    /// Something to be done, once.
    Request(Request),
    /// The device's status.
    Status,
    /// The calibration in force.
    Calibration,
}

impl Ask {
    /// Returns true if both ask for the same kind of thing. Not whether they are equal: what is
    /// no number, as a request may hold, equals nothing.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Request(one), Self::Request(two)) => discriminant(one) == discriminant(two),
            _ => discriminant(self) == discriminant(other),
        }
    }
}
