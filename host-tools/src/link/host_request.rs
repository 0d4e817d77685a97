//! A host's request to a device: an action, or a query of its status or calibration.

use std::mem::discriminant;

use hapterra_core::wire::request::Request;

/// A host's request, repeated until it is answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HostRequest {
    /// An action, executed once.
    Request(Request),
    /// The device's status.
    Status,
    /// The calibration in force.
    Calibration,
}

impl HostRequest {
    /// Returns true if both are of the same kind. Equality would not do: a NaN in a request equals
    /// nothing.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Request(one), Self::Request(two)) => discriminant(one) == discriminant(two),
            _ => discriminant(self) == discriminant(other),
        }
    }
}
