//! Commands to the haptic loop.

use hapterra_core::tick::Command;

use super::Link;

/// A place in the queue of commands, for one command. What needs two cannot be begun with one,
/// and a command that has its place is not lost.
pub(super) struct CommandRoom(());

impl<'t, const D: usize> Link<'t, D> {
    /// A place in the queue, if there is one. It has to be used, or dropped, before another one is
    /// asked for.
    pub(super) fn room_for_command(&self) -> Option<CommandRoom> {
        self.ends.commands.ready().then_some(CommandRoom(()))
    }

    /// Hands a command to the loop, into the place that was found for it.
    pub(super) fn command(&mut self, room: CommandRoom, command: Command<'t>) {
        let CommandRoom(()) = room;
        // Of these none leads to driving; of others that is not known here.
        self.device.may_drive |= !matches!(
            command,
            Command::Scene(_)
                | Command::DropScene
                | Command::SceneChange(_)
                | Command::Clutch(_)
                | Command::Mark(_)
                | Command::Tile(_)
                | Command::Hip(_)
                | Command::Disarm
                | Command::Zero(_)
                | Command::ClearFault(_)
                | Command::Trip(_)
        );
        self.commands_taken = false;
        // There is room: this is the queue's only producer, and each place is found once.
        let taken = self.ends.commands.enqueue(command);
        debug_assert!(taken.is_ok());
    }
}
