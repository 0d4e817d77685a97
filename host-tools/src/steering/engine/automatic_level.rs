//! Changes of the level by the hand's speed, under a pressing hand.
//!
//! A change that the device cannot make soon is cancelled, as is one before a change of the user.
//! The device may make it before the cancel arrives; it is then in force. The changes of the level
//! open no clutch. If a change of the user still waits [`MAX_SAMPLES_IN_CONTACT`] samples after that
//! of the level, the clutch opens for both.

use glam::Vec3;
use hapterra_core::guard::Limits;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::request::{Refusal, Request};

use super::{InContact, MAX_SAMPLES_IN_CONTACT, Stage, Steering, presses};
use crate::link::HostRequest;
use crate::place::{Bounds, Measure, PlacedSurface};
use crate::steering::level_by_speed::LevelBySpeed;
use crate::terrain::Terrain;

/// Samples after which a change that was sent is cancelled; a sample is a millisecond.
const MAX_SAMPLES_SENT: u32 = 100;
/// Samples between two attempts; twice as many after each further one that fails without a lift-off.
const PAUSE_SAMPLES: u32 = 200;
const MAX_PAUSE_SAMPLES: u32 = 6_400;
/// Samples after which a cancel without a result is requested again. Heartbeats, two a second,
/// report the device's scene.
const MAX_SAMPLES_CANCELLING: u32 = 1_500;

/// The rule, and the change that was sent, if any.
pub(super) struct AutomaticLevel<'r> {
    pub(super) rule: LevelBySpeed,
    ticks_per_ms: u32,
    /// The last sample of the current placement.
    last: Option<TickRecord>,
    /// Samples until the next attempt.
    pub(super) pause: u32,
    /// Samples to wait after the next attempt that fails.
    next_pause: u32,
    sent: Option<SentLevel<'r>>,
}

/// A change that the device has not made yet, as far as is known.
struct SentLevel<'r> {
    /// The placement before, and its number.
    before: (PlacedSurface, Terrain<'r>, u8),
    /// Levels above the finest one, of the new placement; once it is accepted, of the one before.
    other_coarser: u8,
    /// Epoch of the new placement's scene.
    epoch: u32,
    cancel: Cancel,
    /// The hand has lifted off before the cancel.
    is_lifted: bool,
}

/// Progress of a cancel, with the samples since then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cancel {
    NotRequested,
    Requested { samples: u32 },
}

impl AutomaticLevel<'_> {
    /// Waits after an attempt that failed; longer after each one without a lift-off.
    fn back_off(&mut self, is_lifted: bool) {
        self.pause = self.next_pause;
        if !is_lifted {
            self.next_pause = (2 * self.next_pause).min(MAX_PAUSE_SAMPLES);
        }
    }
}

impl<'r> Steering<'r> {
    /// Changes the level by the hand's speed from now on, on a device with this tick rate. With
    /// materials, the level stays: it cannot change in contact.
    pub fn follow_speed(&mut self, tick_hz: u32) {
        let has_materials = self.terrain.grid().materials().is_some();
        self.automatic = (!has_materials).then(|| AutomaticLevel {
            rule: LevelBySpeed::default(),
            ticks_per_ms: (tick_hz / 1_000).max(1),
            last: None,
            pause: 0,
            next_pause: PAUSE_SAMPLES,
            sent: None,
        });
    }

    /// Returns true if a change of the level was sent and is not in force yet.
    pub(super) const fn changes_level(&self) -> bool {
        matches!(&self.automatic, Some(AutomaticLevel { sent: Some(_), .. }))
    }

    /// Takes the hand's motion from a sample, and notes that a change is in force.
    pub(super) fn follow_hand(&mut self, sample: &TickRecord) {
        let Some(automatic) = &mut self.automatic else {
            return;
        };
        automatic.pause = automatic.pause.saturating_sub(1);
        if sample.view != self.number {
            automatic.last = None;
            return;
        }
        if !matches!(self.stage, Stage::Applying { .. }) && automatic.sent.take().is_some() {
            automatic.next_pause = PAUSE_SAMPLES;
        }
        // Another placement has other cells, and the HIP of an open clutch does not follow the hand.
        let is_open = sample.limits.contains(Limits::CLUTCH_OPEN);
        let follows = |last: &TickRecord| last.view == sample.view && !is_open;
        let Some(last) = automatic.last.replace(*sample).filter(follows) else {
            return;
        };
        let ms = sample.tick.wrapping_sub(last.tick) / automatic.ticks_per_ms;
        let moved_mm = match presses(&last) && presses(sample) {
            true => last.hip.to(&sample.hip) * self.terrain.scale().cell_mm() as f32,
            // Motion in the air is no motion over the ground.
            false => Vec3::ZERO,
        };
        let finest = self
            .bounds
            .finest_level(self.terrain.grid(), &self.now.view);
        let cell_mm = self.now.view.scale.at_level(finest).cell_mm();
        let moved_mm = [moved_mm.x, moved_mm.y].map(f64::from);
        automatic.rule.take_motion(moved_mm, ms, cell_mm);
    }

    /// Sends another level, if the hand's speed requires one and the hand presses.
    pub(super) fn change_level(&mut self, sample: &TickRecord) {
        let Some(automatic) = &self.automatic else {
            return;
        };
        let coarser = automatic.rule.coarser();
        let is_due = automatic.pause == 0 && coarser != self.bounds.coarser;
        let is_on_ground = !sample.limits.contains(Limits::TERRAIN_COARSE);
        if !is_due || !is_on_ground || !self.may_change_in_contact(sample) {
            return;
        }
        let bounds = Bounds {
            coarser,
            ..self.bounds
        };
        let update = match self.update_in_contact((&bounds, Measure::Keep), &[], sample) {
            InContact::Ready(update) => Some(*update),
            _ => None,
        };
        let level = update
            .as_ref()
            .map(|update| update.placed_surface.view.level);
        if level == Some(self.now.view.level) {
            // It has no coarser or finer level.
            self.bounds.coarser = coarser;
            return;
        }
        if let Some(automatic) = &mut self.automatic {
            automatic.pause = PAUSE_SAMPLES;
            automatic.sent = update.as_ref().map(|update| SentLevel {
                before: (self.now, self.terrain.clone(), self.number),
                other_coarser: coarser,
                epoch: update.view.scene.epoch,
                cancel: Cancel::NotRequested,
                is_lifted: false,
            });
        }
        if let Some(update) = update {
            self.apply(update, Some(vec![]));
        }
    }

    fn sent_level(&mut self) -> Option<&mut SentLevel<'r>> {
        self.automatic.as_mut()?.sent.as_mut()
    }

    /// Applies the device's answer to a change: it was accepted, or is dropped.
    pub(super) fn on_level_result(&mut self, accepted: bool) {
        let Some(automatic) = &mut self.automatic else {
            return;
        };
        if let Some(sent) = automatic.sent.as_mut().filter(|_| accepted) {
            std::mem::swap(&mut self.bounds.coarser, &mut sent.other_coarser);
        } else if automatic.sent.take().is_some() {
            automatic.back_off(false);
        }
    }

    /// Waits until the device renders the level that was sent, or cancels it. The user's requests
    /// are first.
    pub(super) fn wait_for_level(&mut self, sample: &TickRecord, samples: u32) {
        let user_waits = self.must_measure || !self.waiting.is_empty();
        // A clutch that opens makes the change.
        if self.held || (user_waits && samples > MAX_SAMPLES_IN_CONTACT) {
            return self.open_clutch();
        }
        // The link is behind the hand: the tiles of another placement would arrive even later.
        let is_coarse = sample.limits.contains(Limits::TERRAIN_COARSE);
        let is_late = samples > MAX_SAMPLES_SENT || is_coarse || !presses(sample);
        let Some(sent) = self.sent_level() else {
            return;
        };
        let is_over = match &mut sent.cancel {
            Cancel::NotRequested => {
                sent.is_lifted |= !presses(sample);
                user_waits || is_late
            }
            Cancel::Requested { samples } => {
                *samples += 1;
                *samples > MAX_SAMPLES_CANCELLING
            }
        };
        if is_over {
            self.request_cancel();
        }
    }

    /// Requests the cancel of the change of the level that was sent, if any.
    pub(super) fn request_cancel(&mut self) {
        if let Some(sent) = self.sent_level() {
            sent.cancel = Cancel::Requested { samples: 0 };
            let cancel = Request::CancelChange { epoch: sent.epoch };
            self.requests.push(HostRequest::Request(cancel));
        }
    }

    /// Handles the refusal of a cancel: a busy device gets another one. One that has no such change
    /// sends samples of the new placement, or reports the scene before.
    pub(super) fn on_refused_cancel(&mut self, epoch: u32, refusal: &Refusal) {
        if let Some(sent) = self.sent_level().filter(|sent| sent.epoch == epoch) {
            sent.cancel = match refusal {
                Refusal::NoSuchChange => Cancel::Requested { samples: 0 },
                _ => Cancel::NotRequested,
            };
        }
    }

    /// Returns to the level before: the device has cancelled the change.
    pub(super) fn on_change_cancelled(&mut self) {
        let Some(automatic) = &mut self.automatic else {
            return;
        };
        let Some(sent) = automatic.sent.take() else {
            return;
        };
        automatic.back_off(sent.is_lifted);
        (self.now, self.terrain, self.number) = sent.before;
        self.bounds.coarser = sent.other_coarser;
        if let Stage::InContact { .. } = self.stage {
            self.stage = Stage::Idle;
        }
    }

    /// Prepares another request of a cancel that the device has not answered.
    pub(super) fn on_unanswered_cancel(&mut self) {
        if let Some(sent) = self.sent_level() {
            sent.cancel = Cancel::NotRequested;
        }
    }

    /// Begins a session. A restarted device has the latest placement; a resumed one may still wait
    /// for its terrain.
    pub(super) fn on_level_session(&mut self, resumed: bool, tick_hz: u32) {
        self.on_unanswered_cancel();
        if let Some(automatic) = &mut self.automatic {
            automatic.ticks_per_ms = (tick_hz / 1_000).max(1);
            automatic.last = None;
            automatic.sent = automatic.sent.take().filter(|_| resumed);
        }
    }
}
