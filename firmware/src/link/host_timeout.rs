//! The host's time-out: a host that is silent for too long is disarmed.

use hapterra_core::tick::Command;

use super::{Link, log};

impl<const D: usize> Link<'_, D> {
    /// Disarms and ends the session if the host has been silent for its time-out. A wait for a
    /// dead-man press ends as soon as the host is absent.
    pub(super) fn check_host_timeout(&mut self) {
        let now = self.ends.monitor.ticks();
        let is_waiting = self.device.is_being_armed() || self.device.is_awaiting_press();
        if is_waiting
            && let Some(room) = self.room_for_command()
            && self.session.is_absent(now, self.device.ticks_per_ms())
        {
            log::host_silent();
            self.device.expire_press();
            self.command(room, Command::Disarm);
        }
        if !self.session.is_timed_out(now) || !self.device.may_drive {
            return;
        }
        if let Some(room) = self.room_for_command() {
            log::host_silent();
            self.command(room, Command::Disarm);
            self.clear_messages();
            self.abandon_clutch();
            self.session.end_silent();
        }
    }
}
