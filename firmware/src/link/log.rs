//! The link's log lines, if the board has a log: written by the link's task, never by the haptic
//! interrupt.
#![cfg_attr(not(feature = "defmt"), allow(unused_variables))]

use hapterra_core::wire::frame::FrameError;
use hapterra_core::wire::session::{SessionEnd, SessionNumber};

pub(super) fn opened(session: SessionNumber, last: SessionEnd, bad_frames: u32) {
    #[cfg(feature = "defmt")]
    defmt::info!(
        "a host opened session {}; end of the one before: {}; bad frames so far: {}",
        session.get(),
        last,
        bad_frames
    );
}

pub(super) fn ended() {
    #[cfg(feature = "defmt")]
    defmt::info!("the host closed the session; disarmed");
}

pub(super) fn host_silent() {
    #[cfg(feature = "defmt")]
    defmt::warn!("the host has been silent for too long: the arm is disarmed");
}

pub(super) fn refused(protocol: u16) {
    #[cfg(feature = "defmt")]
    defmt::warn!("refused a host of protocol {}", protocol);
}

pub(super) fn scene(epoch: u32, accepted: bool) {
    #[cfg(feature = "defmt")]
    defmt::info!("scene {}, accepted: {}", epoch, accepted);
}

pub(super) fn bad_frame(bad: FrameError) {
    #[cfg(feature = "defmt")]
    defmt::debug!("dropped a frame: {}", bad);
}
