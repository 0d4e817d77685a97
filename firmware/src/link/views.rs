//! Changes of the current scene's placement, and the clutch that allows them.
//!
//! The loop applies commands in order. So every tile behind a placement in the queue belongs to it,
//! and a tile of the previous placement is refused by its epoch.

use hapterra_core::clutch::ClutchMode;
use hapterra_core::guard::Limits;
use hapterra_core::scene::{Scene, SceneChange, Source};
use hapterra_core::terrain::RequestHint;
use hapterra_core::tick::Command;
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::request::Refusal;

use super::Link;
use super::commands::CommandRoom;

/// A placement is newer if its number is less than this ahead of the current one; otherwise it is
/// late or repeated.
const MAX_AHEAD: u8 = 128;

/// Host that holds the clutch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum HostClutch {
    /// No host.
    #[default]
    Released,
    /// The host of this session.
    Held,
    /// A host that has left: the clutch must be released.
    Abandoned,
}

/// A change of placement under the pressing hand, made or not.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChangeInContact {
    /// The scene before, and the number of its placement.
    before: (Scene, u8),
    keeps_tiles: bool,
    cancel: Cancel,
}

/// Progress of a cancel. A record shows its result if the loop has made it after it took the
/// command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cancel {
    NotRequested,
    /// The command is in the queue.
    Sent,
    /// The loop has taken the command, and the records before were read.
    Taken,
}

impl<const D: usize> Link<'_, D> {
    /// Sets the host's hold of the clutch.
    pub(super) fn set_clutch(&mut self, hold: ClutchMode, room: CommandRoom) {
        self.clutch = match hold {
            ClutchMode::Released => HostClutch::Released,
            ClutchMode::WithHand | ClutchMode::InPlace => HostClutch::Held,
        };
        self.command(room, Command::Clutch(hold));
    }

    /// Marks the clutch for release if the host that holds it has left.
    pub(super) fn abandon_clutch(&mut self) {
        if self.clutch == HostClutch::Held {
            self.clutch = HostClutch::Abandoned;
        }
    }

    /// Releases the clutch of a host that has left.
    pub(super) fn release_abandoned_clutch(&mut self) {
        if self.clutch == HostClutch::Abandoned
            && let Some(room) = self.room_for_command()
        {
            self.set_clutch(ClutchMode::Released, room);
        }
    }

    /// Sets another placement and answers; repeats the answer if the same one arrives again.
    pub(super) fn on_scene_change(&mut self, view: SceneChange, room: CommandRoom) {
        let (epoch, ahead) = (view.scene.epoch, view.number.wrapping_sub(self.view));
        let is_again = ahead == 0 && self.scene == Some(view.scene);
        if !is_again && !(1..MAX_AHEAD).contains(&ahead) {
            return;
        }
        let may_come = || {
            self.has_materials_of(&view.scene)
                && (self.may_change_placement(&view.scene) || self.may_change_in_contact(&view))
        };
        let accepted = is_again || (view.scene.is_valid() && may_come());
        if accepted && !is_again {
            self.apply_placement(view, room);
        }
        self.send(&ToHost::SceneAck { epoch, accepted });
    }

    /// Returns true if no force is rendered: the host's clutch is reported open, or a replay is
    /// between two points.
    fn may_change_placement(&self, scene: &Scene) -> bool {
        let latest = &self.last_record.sample;
        let is_open = self.clutch == HostClutch::Held
            && latest.view == self.view
            && latest.limits.contains(Limits::CLUTCH_OPEN);
        self.scene.is_some_and(|before| {
            before.source == scene.source
                && match scene.source {
                    Source::Encoders => is_open,
                    Source::Points => self.replay.current.is_none() && self.points.is_empty(),
                }
        })
    }

    /// Returns true if the loop may change the placement under the pressing hand, when the tiles of
    /// its fallback have arrived.
    fn may_change_in_contact(&self, view: &SceneChange) -> bool {
        let is_of_arm = |scene: &Scene| scene.source == Source::Encoders;
        view.in_contact.is_some()
            && is_of_arm(&view.scene)
            && self.scene.as_ref().is_some_and(is_of_arm)
            && view.scene.materials.is_none()
            && self.clutch == HostClutch::Released
            && self.last_record.sample.view == self.view
    }

    /// Returns true if the loop still renders the placement before the latest one, whose tiles are
    /// all that it has room for.
    pub(super) fn waits_for_change(&self) -> bool {
        self.change.is_some_and(|change| !change.keeps_tiles)
            && self.last_record.sample.view != self.view
    }

    /// Forgets the latest change in contact; a cancel of it is refused.
    pub(super) fn forget_change(&mut self) {
        self.change = None;
        let refused = Err(Refusal::NoSuchChange);
        self.device.request.cancel_decided(refused);
    }

    /// Begins to cancel the change to the scene of this epoch, if it is not known to be made.
    pub(super) fn begin_cancel(&mut self, epoch: u32, room: CommandRoom) -> Result<(), Refusal> {
        let is_latest = self.scene.is_some_and(|scene| scene.epoch == epoch);
        let waits = is_latest && self.last_record.sample.view != self.view;
        let change = self.change.as_mut().filter(|_| waits);
        change.ok_or(Refusal::NoSuchChange)?.cancel = Cancel::Sent;
        // The loop would store a tile behind the command in the placement before.
        self.requester.clear_pending();
        self.command(room, Command::CancelChange(self.view));
        Ok(())
    }

    /// Returns true from the request of a cancel until its result is known.
    pub(super) fn is_cancelling(&self) -> bool {
        let requested = |change: ChangeInContact| change.cancel != Cancel::NotRequested;
        self.change.is_some_and(requested)
    }

    /// Returns true if this is the epoch of the scene that a cancel restores.
    pub(super) fn is_cancelled_scene(&self, epoch: Option<u32>) -> bool {
        let before = self.change.map(|change| change.before.0.epoch);
        self.is_cancelling() && before == epoch
    }

    /// Records that all records were read; `is_taken` is true if the loop had taken all commands
    /// before.
    pub(super) fn set_cancel_taken(&mut self, is_taken: bool) {
        if let Some(change) = &mut self.change
            && change.cancel == Cancel::Sent
            && is_taken
        {
            change.cancel = Cancel::Taken;
        }
    }

    /// Ends a cancel that the loop has taken, by the placement in its latest record.
    pub(super) fn decide_cancel(&mut self) {
        let taken = |change: &mut ChangeInContact| change.cancel == Cancel::Taken;
        let Some(change) = self.change.take_if(taken) else {
            return;
        };
        let latest = &self.last_record.sample;
        let is_made = latest.view == self.view;
        if !is_made {
            let (scene, number) = change.before;
            (self.scene, self.view) = (Some(scene), number);
            self.requester.reset(scene.level, scene.size);
            self.requester.set_fallback(scene.fallback);
            self.request_hint = Some(RequestHint {
                proxy: latest.proxy.column(),
                hip: latest.hip.column(),
                ..RequestHint::default()
            });
        }
        self.device.request.cancel_decided(match is_made {
            true => Err(Refusal::NoSuchChange),
            false => Ok(()),
        });
    }

    fn apply_placement(&mut self, view: SceneChange, room: CommandRoom) {
        self.forget_change();
        self.change = (self.scene.filter(|_| view.in_contact.is_some())).map(|before| {
            let (before, keeps_tiles) = ((before, self.view), view.keeps_tiles);
            let cancel = Cancel::NotRequested;
            ChangeInContact {
                before,
                keeps_tiles,
                cancel,
            }
        });
        let (scene, at) = (view.scene, view.hip.column());
        if !view.keeps_tiles {
            self.requester.reset(scene.level, scene.size);
        }
        let fallback = self.scene.and_then(|before| before.fallback);
        if !view.keeps_tiles || fallback != scene.fallback {
            self.requester.set_fallback(scene.fallback);
        }
        self.requester.clear_pending();
        self.request_hint = Some(RequestHint {
            proxy: at,
            hip: at,
            ..RequestHint::default()
        });
        self.nothing_to_request_at = None;
        self.scene = Some(scene);
        self.view = view.number;
        self.command(room, Command::SceneChange(view));
    }
}
