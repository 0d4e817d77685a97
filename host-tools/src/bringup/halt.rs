//! Reason for which a step ends before it is passed.

use super::attendant::Stopped;
use super::finding::Finding;
use crate::link::LinkError;

/// Reason for which a step ends before it is passed.
#[derive(Debug, thiserror::Error)]
pub enum Halt {
    /// The attendant stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The device is gone or silent.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Something is wrong.
    #[error("{0}")]
    Found(#[from] Finding),
}
