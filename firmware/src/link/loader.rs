//! The entry into the loader in the chip's ROM, for an update without a debug probe.

use hapterra_core::tick::Command;
use hapterra_core::wire::request::Refusal;

use super::Link;
use super::commands::CommandRoom;

/// Progress towards the loader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LoaderEntry {
    /// The board has no loader.
    #[default]
    None,
    /// The board has one.
    Offered,
    /// The host has requested it. This is final.
    Requested,
}

impl<const D: usize> Link<'_, D> {
    /// Declares that the board enters a loader when [`Self::is_loader_due`] returns true.
    pub fn offer_loader(&mut self) {
        self.loader = LoaderEntry::Offered;
    }

    /// Returns true if the board is to enter its loader: the host has requested it and received the
    /// answer, the amplifiers are off, and the loop has no held output.
    #[must_use]
    pub fn is_loader_due(&self) -> bool {
        let is_requested = self.loader == LoaderEntry::Requested;
        is_requested
            && self.tx.is_empty()
            && self.ends.commands.is_empty()
            && self.device.may_change_settings().is_ok()
    }

    /// Returns true if the board is about to enter its loader and does nothing else.
    pub(super) fn is_entering_loader(&self) -> bool {
        self.loader == LoaderEntry::Requested
    }

    /// Handles the request for the loader: accepted only while the arm is disarmed, without a
    /// pending arm command or calibration to store.
    pub(super) fn request_loader(&mut self, room: CommandRoom) -> Result<(), Refusal> {
        if self.loader == LoaderEntry::None {
            return Err(Refusal::NoLoader);
        }
        self.device.may_change_settings()?;
        if !self.device.is_idle() {
            return Err(Refusal::NotWhileArmed);
        }
        if self.device.is_storing() {
            return Err(Refusal::Busy);
        }
        // The command also ends held outputs: a converter outside the chip would keep them through
        // the whole update.
        self.command(room, Command::Disarm);
        self.loader = LoaderEntry::Requested;
        Ok(())
    }
}
