//! Commands to the haptic loop.

use hapterra_core::tick::Command;

use super::Link;

/// A reserved place in the queue of commands, for one command. A reserved command is not lost, and
/// an operation of two commands cannot begin with one place.
pub(super) struct CommandRoom(());

impl<'t, const D: usize> Link<'t, D> {
    /// Returns a place in the queue, if there is one. It must be used, or dropped, before the next
    /// call.
    pub(super) fn room_for_command(&self) -> Option<CommandRoom> {
        self.ends.commands.ready().then_some(CommandRoom(()))
    }

    /// Sends a command to the loop, into its reserved place.
    pub(super) fn command(&mut self, room: CommandRoom, command: Command<'t>) {
        let CommandRoom(()) = room;
        // None of these leads to driving; any other command may.
        self.device.may_drive |= !matches!(
            command,
            Command::Scene(_)
                | Command::DropScene
                | Command::SceneChange(_)
                | Command::CancelChange(_)
                | Command::Clutch(_)
                | Command::Mark(_)
                | Command::Tile(_)
                | Command::Hip(_)
                | Command::Disarm
                | Command::Zero(_)
                | Command::ClearFault(_)
                | Command::Trip(_)
        );
        self.commands_drained = false;
        // There is room: this is the queue's only producer, and each place is reserved once.
        let sent = self.ends.commands.enqueue(command);
        debug_assert!(sent.is_ok());
    }
}
