//! Other views of the scene in force, and the clutch that lets them in.
//!
//! The loop takes commands in their order. So every tile that follows a view in the queue
//! is the view's own, and a tile of the one before is refused by its epoch.

use hapterra_core::clutch::ClutchHold;
use hapterra_core::guard::Limits;
use hapterra_core::scene::{Scene, SceneChange, Source};
use hapterra_core::terrain::RequestHint;
use hapterra_core::tick::Command;
use hapterra_core::wire::message::ToHost;

use super::Link;
use super::commands::CommandRoom;

/// Views whose numbers are at most so far ahead are newer than the one in force; others are
/// late, or sent twice.
const NEWER: u8 = 128;

/// Who holds the clutch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ClutchOfHost {
    /// No side.
    #[default]
    LetGo,
    /// The host of this session.
    Held,
    /// A host that is gone: it is to be let go.
    Forsaken,
}

impl<const D: usize> Link<'_, D> {
    /// The host holds the clutch, or lets it go.
    pub(super) fn set_clutch(&mut self, hold: ClutchHold, room: CommandRoom) {
        self.clutch = match hold {
            ClutchHold::LetGo => ClutchOfHost::LetGo,
            ClutchHold::WithHand | ClutchHold::InPlace => ClutchOfHost::Held,
        };
        self.command(room, Command::Clutch(hold));
    }

    /// The host that may hold the clutch is gone.
    pub(super) fn forsake_clutch(&mut self) {
        if self.clutch == ClutchOfHost::Held {
            self.clutch = ClutchOfHost::Forsaken;
        }
    }

    /// Lets the clutch of a host go that is gone.
    pub(super) fn release_forsaken_clutch(&mut self) {
        if self.clutch == ClutchOfHost::Forsaken
            && let Some(room) = self.room_for_command()
        {
            self.set_clutch(ClutchHold::LetGo, room);
        }
    }

    /// Sets another placement, and answers; one that was sent twice is answered twice.
    pub(super) fn take_view(&mut self, view: SceneChange, room: CommandRoom) {
        let (epoch, ahead) = (view.scene.epoch, view.number.wrapping_sub(self.view));
        let is_again = ahead == 0 && self.scene == Some(view.scene);
        if !is_again && !(1..NEWER).contains(&ahead) {
            return;
        }
        let may_come = || self.has_materials_of(&view.scene) && self.may_change_view(&view.scene);
        let accepted = is_again || (view.scene.is_valid() && may_come());
        if accepted && !is_again {
            self.put_in(view, room);
        }
        self.say(&ToHost::SceneAck { epoch, accepted });
    }

    /// Returns true if no force is rendered now: the clutch is open, as the loop has reported since it is
    /// held, or it is a replay between two points.
    fn may_change_view(&self, scene: &Scene) -> bool {
        let latest = &self.last_record.sample;
        let is_open = self.clutch == ClutchOfHost::Held
            && latest.view == self.view
            && latest.limits.contains(Limits::CLUTCH_OPEN);
        self.scene.is_some_and(|before| {
            before.source == scene.source
                && match scene.source {
                    Source::Encoders => is_open,
                    Source::Points => self.replay.under_way.is_none() && self.points.is_empty(),
                }
        })
    }

    fn put_in(&mut self, view: SceneChange, room: CommandRoom) {
        let (scene, at) = (view.scene, view.hip.column());
        if !view.keeps_tiles {
            self.requester.reset(scene.level, scene.size);
        }
        let fallback = self.scene.and_then(|before| before.fallback);
        if !view.keeps_tiles || fallback != scene.fallback {
            self.requester.lay(scene.fallback);
        }
        self.requester.forget_asked();
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
