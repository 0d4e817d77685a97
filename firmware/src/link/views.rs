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
        self.is_changing && self.last_record.sample.view != self.view
    }

    fn apply_placement(&mut self, view: SceneChange, room: CommandRoom) {
        self.is_changing = view.in_contact.is_some() && !view.keeps_tiles;
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
