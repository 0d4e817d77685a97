//! The host's time-out: a host that is silent for too long is disarmed.

use hapterra_core::tick::Command;

use super::{Link, log};

impl<const D: usize> Link<'_, D> {
    /// Disarms and ends the session if the host has been silent for its time-out. A wait for a
    /// dead-man press ends as soon as the host is absent.
    pub(super) fn watch_host(&mut self) {
        let now = self.ends.monitor.ticks();
        let waits = self.device.is_being_armed() || self.device.waits_for_press();
        if waits
            && let Some(room) = self.room_for_command()
            && self.session.is_absent(now, self.device.ticks_per_ms())
        {
            log::forsaken();
            self.device.give_up_press();
            self.command(room, Command::Disarm);
        }
        if !self.session.is_forsaken(now) || !self.device.may_drive {
            return;
        }
        if let Some(room) = self.room_for_command() {
            log::forsaken();
            self.command(room, Command::Disarm);
            self.forget_conversation();
            self.forsake_clutch();
            self.session.end_silent();
        }
    }
}
