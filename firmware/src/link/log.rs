//! The link's log lines, where there is a log: written by the link's task,
//! never by the haptic interrupt.

use hapterra_core::wire::frame::BadFrame;

#[cfg(feature = "defmt")]
mod lines {
    use super::BadFrame;

    pub(crate) fn opened(bad_frames: u32) {
        defmt::info!("a host opened a session; bad frames so far: {}", bad_frames);
    }

    pub(crate) fn refused(protocol: u16) {
        defmt::warn!("refused a host that speaks protocol {}", protocol);
    }

    pub(crate) fn scene(epoch: u32, accepted: bool) {
        defmt::info!("scene {}, accepted: {}", epoch, accepted);
    }

    pub(crate) fn bad_frame(bad: BadFrame) {
        defmt::debug!("dropped a frame: {}", bad);
    }
}

#[cfg(not(feature = "defmt"))]
mod lines {
    use super::BadFrame;

    pub(crate) const fn opened(_bad_frames: u32) {}
    pub(crate) const fn refused(_protocol: u16) {}
    pub(crate) const fn scene(_epoch: u32, _accepted: bool) {}
    pub(crate) const fn bad_frame(_bad: BadFrame) {}
}

pub(crate) use lines::{bad_frame, opened, refused, scene};
