//! Errors between host and device.

use std::io;
use std::time::Duration;

use hapterra_core::wire::hello::PROTOCOL;

/// Reason for which there is no link, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// Nothing there to talk to.
    #[error("no device: looked for {looked_for}: {why}")]
    Absent {
        /// Sought device and place.
        looked_for: String,
        /// Finding in its place.
        why: String,
    },
    /// Several devices could be meant.
    #[error("several hapterra boards: {}", .0.join(", "))]
    Several(Vec<String>),
    /// The transport broke while the device was in use.
    #[error("the device is gone")]
    Gone(#[source] io::Error),
    /// The transport stands, but there is no answer.
    #[error("the device has not answered for {0:.1?}")]
    Silent(Duration),
    /// The device has another host.
    #[error("another host has taken the device: the arm may be armed")]
    Taken,
    /// The device has not heard this host for too long, and has disarmed the arm.
    #[error("the device has not heard this computer for too long, and has disarmed the arm")]
    LetGo,
    /// Goodbye was not answered.
    #[error("the board did not confirm that it is disarmed: switch the amplifiers off")]
    NotConfirmed,
    /// The user wants no more.
    #[error("interrupted")]
    Interrupted,
    /// The two ends speak different protocols.
    #[error(
        "version mismatch: the device speaks link protocol {theirs}, this command speaks {ours}"
    )]
    Version {
        /// The host's protocol.
        ours: u16,
        /// The device's protocol.
        theirs: u16,
    },
    /// The device would not take the scene.
    #[error("the device refused the scene: it finds a number in it that it cannot work with")]
    SceneRefused,
    /// In the middle of something that cannot be taken up again.
    #[error("the device was restarted and lost its session")]
    Restarted,
    /// A point of a replay is never answered.
    #[error("the device did not finish point {0} of the trajectory")]
    Stuck(u32),
}

impl LinkError {
    /// The device speaks another protocol than this program.
    pub(super) const fn version(theirs: u16) -> Self {
        Self::Version {
            ours: PROTOCOL,
            theirs,
        }
    }

    /// Returns true if trying again later can help.
    #[must_use]
    pub const fn is_passing(&self) -> bool {
        matches!(
            self,
            Self::Absent { .. } | Self::Gone(_) | Self::Silent(_) | Self::LetGo
        )
    }
}
