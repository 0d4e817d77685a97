//! Errors between host and device.

use std::io;
use std::time::Duration;

use hapterra_core::wire::hello::PROTOCOL;

/// Reason why a link cannot be opened, or was lost.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// No device was found.
    #[error("no device: looked for {searched_for}: {why}")]
    Absent {
        /// The searched device and place.
        searched_for: String,
        /// The finding in its place.
        why: String,
    },
    /// Several devices match.
    #[error("several hapterra boards: {}", .0.join(", "))]
    Several(Vec<String>),
    /// The transport broke while the device was in use.
    #[error("the device was disconnected")]
    Disconnected(#[source] io::Error),
    /// The transport is open, but the device does not answer.
    #[error("the device has not answered for {0:.1?}")]
    Silent(Duration),
    /// Another host controls the device.
    #[error("another host controls the device: the arm may be armed")]
    Taken,
    /// The device has not received a message of this host for too long, and has disarmed the arm.
    #[error(
        "the device has received nothing from this computer for too long, and has disarmed the arm"
    )]
    HostSilent,
    /// The close message was not answered.
    #[error("the board did not confirm that it is disarmed: switch the amplifiers off")]
    NotConfirmed,
    /// The user has ended the command.
    #[error("interrupted")]
    Interrupted,
    /// Host and device use different protocols.
    #[error(
        "version mismatch: the device speaks link protocol {theirs}, this command speaks {ours}"
    )]
    Version {
        /// The host's protocol.
        ours: u16,
        /// The device's protocol.
        theirs: u16,
    },
    /// The device refused the scene.
    #[error("the device refused the scene: it contains an invalid number")]
    SceneRefused,
    /// The device was restarted during an operation that cannot be resumed.
    #[error("the device was restarted and lost its session")]
    Restarted,
    /// The device does not answer a point of a replay.
    #[error("the device did not finish point {0} of the trajectory")]
    Stuck(u32),
}

impl LinkError {
    /// Returns the error for a device with another protocol than this program.
    pub(super) const fn version(theirs: u16) -> Self {
        Self::Version {
            ours: PROTOCOL,
            theirs,
        }
    }

    /// Returns true if a later try can succeed.
    #[must_use]
    pub const fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Absent { .. } | Self::Disconnected(_) | Self::Silent(_) | Self::HostSilent
        )
    }
}
