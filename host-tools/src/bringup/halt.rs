//! Reason why a step ends early.

use super::attendant::Stopped;
use super::finding::Finding;
use crate::link::LinkError;

/// Reason why a step ends early.
#[derive(Debug, thiserror::Error)]
pub enum Halt {
    /// The attendant stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The device is disconnected or does not respond.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The step failed.
    #[error("{0}")]
    Found(#[from] Finding),
}
