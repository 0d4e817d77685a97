//! The way into the loader in the chip's ROM, for an update without a debug probe.

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
    /// The host has asked for it. There is no way back.
    Wanted,
}

impl<const D: usize> Link<'_, D> {
    /// Says that the board enters a loader when [`Self::enters_loader`] reports it.
    pub fn offer_loader(&mut self) {
        self.loader = LoaderEntry::Offered;
    }

    /// Returns true if the board is to enter its loader: the host has asked for it, has been
    /// answered, the amplifiers are off, and the loop holds no output any more.
    #[must_use]
    pub fn enters_loader(&self) -> bool {
        let is_wanted = self.loader == LoaderEntry::Wanted;
        is_wanted
            && self.tx.is_empty()
            && self.ends.commands.is_empty()
            && self.device.may_change_settings().is_ok()
    }

    /// Returns true if the board is on its way into its loader, where nothing else is done.
    pub(super) fn is_leaving(&self) -> bool {
        self.loader == LoaderEntry::Wanted
    }

    /// Takes the request for the loader: only while the arm is disarmed and nothing is
    /// under way that would arm it or is to be stored.
    pub(super) fn want_loader(&mut self, room: CommandRoom) -> Result<(), Refusal> {
        if self.loader == LoaderEntry::None {
            return Err(Refusal::NoLoader);
        }
        self.device.may_change_settings()?;
        if !self.device.is_at_rest() {
            return Err(Refusal::NotWhileArmed);
        }
        if self.device.is_storing() {
            return Err(Refusal::Busy);
        }
        // It ends outputs that are held, too: a converter outside of the chip would keep them
        // through the whole update.
        self.command(room, Command::Disarm);
        self.loader = LoaderEntry::Wanted;
        Ok(())
    }
}
