//! Changes of the placement by the user, applied to a device.

mod automatic_level;

use std::time::{Duration, Instant};

use hapterra_core::clutch::ClutchMode;
use hapterra_core::contact::ContactState;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::{ContactMap, SceneChange, Source, TickRecord};
use hapterra_core::terrain::TileIndex;
use hapterra_core::wire::request::Request;

use self::automatic_level::AutomaticLevel;
use super::Steer;
use crate::link::{Event, HostRequest};
use crate::place::{Bounds, Changed, Hand, Measure, PlacedSurface, PlacementChange};
use crate::terrain::Terrain;

/// Maximum number of changes that wait for the clutch to open; they are then applied together.
const MAX_WAITING: usize = 64;
/// Samples after which a clutch that has not opened counts as failed; it opens in 100 ticks of a
/// millisecond.
const MAX_SAMPLES_TO_OPEN: u32 = 5_000;

/// Samples after which the clutch is opened for a placement that was to change in contact. Its
/// coarse tiles usually arrive within 50 ms.
const MAX_SAMPLES_IN_CONTACT: u32 = 300;

/// Samples to wait for the ground of the new placement with the clutch closed, or for the tile under
/// the hand in the current one; a sample is a millisecond.
const MAX_SAMPLES_WITHOUT_GROUND: u32 = 300;

/// Samples to wait for the force to turn to that of the current placement.
const MAX_SAMPLES_TURNING: u32 = 2_000;

/// Limits under which a placement does not change in contact.
const NOT_IN_CONTACT: Limits = Limits::CLUTCH_INPUT
    .union(Limits::CLUTCH_OPEN)
    .union(Limits::CLUTCH_MOVES)
    .union(Limits::EDGE_FADING)
    .union(Limits::TERRAIN_MISSING);

/// Maximum wait for the ground under the hand in the new placement, with the clutch open.
const MAX_GROUND_WAIT: Duration = Duration::from_secs(2);

/// A placement to set on the device.
pub struct PlacementUpdate<'r> {
    /// Message to the device.
    pub view: SceneChange,
    /// The terrain that it is rendered on.
    pub terrain: Terrain<'r>,
    /// Place, scale and surface parameters.
    pub placed_surface: PlacedSurface,
    /// The place about which the placement changes, device millimetres of the new one.
    /// `None` if its height is unknown.
    place_mm: Option<[f64; 3]>,
}

/// Placement computed for the pressing hand.
enum InContact<'r> {
    /// It can change in contact.
    Ready(Box<PlacementUpdate<'r>>),
    /// Its ground has not been read yet.
    Waits,
    /// It changes with an open clutch.
    NeedsClutch,
    /// The changes are impossible, for this reason.
    Impossible(String),
}

/// Stage of a change.
enum Stage<'r> {
    /// The clutch is closed, by the last report.
    Idle,
    /// The clutch was requested `samples` samples ago. `answered` distinguishes this hold from the
    /// board's clutch input, which may hold the clutch open already and release it before the
    /// request arrives.
    Opening { samples: u32, answered: bool },
    /// The clutch is open.
    Open,
    /// This placement was sent; with its terrain. It changes in contact, or with an open clutch.
    Applying {
        next: Box<(PlacedSurface, Terrain<'r>)>,
        /// The changes, if the placement changes in contact; none for a change of the level.
        in_contact: Option<Vec<PlacementChange>>,
    },
    /// The device was sent a placement that changes in contact, and had rendered the one before in
    /// `samples` samples since then.
    InContact { samples: u32 },
    /// The clutch was released, and is still reported open.
    Closing,
}

/// Engine behind keys and commands: turns each [`Steer`] into requests to a device, by its samples.
pub struct Steering<'r> {
    bounds: Bounds,
    now: PlacedSurface,
    terrain: Terrain<'r>,
    /// Number of the current placement on the device.
    number: u8,
    waiting: Vec<PlacementChange>,
    /// The user holds the clutch.
    held: bool,
    /// The board's clutch input holds it open.
    by_input: bool,
    /// The user has held the clutch, and may be far from where the cells were measured.
    must_measure: bool,
    /// Requested hold of the clutch.
    requested_hold: ClutchMode,
    /// Start of the wait for the ground of the new placement.
    waiting_since: Option<Instant>,
    /// Samples of the present wait for the ground, with the clutch closed.
    without_ground: u32,
    /// Samples since the force began to turn to that of the current placement.
    turning: u32,
    stage: Stage<'r>,
    /// Changes of the level by the hand's speed, if the user has chosen them.
    automatic: Option<AutomaticLevel<'r>>,
    requests: Vec<HostRequest>,
    update: Option<PlacementUpdate<'r>>,
    lines: Vec<String>,
}

impl<'r> Steering<'r> {
    /// Creates an engine with the initial placement.
    #[must_use]
    pub fn new(bounds: Bounds, terrain: Terrain<'r>) -> Self {
        Self {
            bounds,
            now: bounds.first,
            terrain,
            number: 0,
            waiting: vec![],
            held: false,
            by_input: false,
            must_measure: false,
            requested_hold: ClutchMode::Released,
            waiting_since: None,
            without_ground: 0,
            turning: 0,
            stage: Stage::Idle,
            automatic: None,
            requests: vec![],
            update: None,
            lines: vec![],
        }
    }

    /// Returns the current placement, by the last report, and its surface parameters.
    #[must_use]
    pub const fn now(&self) -> &PlacedSurface {
        &self.now
    }

    /// Returns the terrain of the current placement.
    #[must_use]
    pub const fn terrain(&self) -> &Terrain<'r> {
        &self.terrain
    }

    /// Returns true if no request of the user is pending.
    #[must_use]
    pub const fn is_settled(&self) -> bool {
        let is_at_rest = match self.stage {
            Stage::Idle => !self.held,
            Stage::Applying { .. } | Stage::InContact { .. } if self.changes_level() => !self.held,
            Stage::Open => self.held,
            _ => false,
        };
        is_at_rest && self.waiting.is_empty() && !self.must_measure
    }

    /// Queues a request of the user.
    pub fn steer(&mut self, steer: Steer) {
        match steer {
            Steer::Clutch(held) => {
                self.must_measure |= held && !self.held;
                self.held = held;
            }
            Steer::Change(change) if self.waiting.len() < MAX_WAITING => self.waiting.push(change),
            // Only a stuck key fills the queue.
            Steer::Change(_) => {}
        }
    }

    /// Returns the pending lines for the user, in order.
    pub fn lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lines)
    }

    /// Returns the pending requests to the device.
    pub fn requests(&mut self) -> Vec<HostRequest> {
        std::mem::take(&mut self.requests)
    }

    /// Returns the placement to set now, if any.
    pub fn take_update(&mut self) -> Option<PlacementUpdate<'r>> {
        self.update.take()
    }

    /// Handles an event of the device.
    pub fn on_event(&mut self, event: &Event<'_>) {
        match event {
            Event::Sample(sample) => self.on_sample(sample),
            Event::SceneChangeResult { view, accepted } => {
                self.on_scene_change_result(view, *accepted);
            }
            Event::ChangeCancelled => self.on_change_cancelled(),
            Event::Opened { resumed, device } => {
                self.on_level_session(*resumed, device.tick_hz);
                // A session's end releases its clutch, and a restarted device starts with this
                // placement.
                self.requested_hold = ClutchMode::Released;
                self.requests.clear();
                self.update = None;
                // A resumed device may still wait for the terrain of the latest placement.
                self.stage = match resumed {
                    true => Stage::InContact { samples: 0 },
                    false => Stage::Idle,
                };
                if !resumed {
                    self.number = 0;
                }
            }
            Event::Answered {
                request: Request::Clutch { hold },
                result: Ok(()),
            } if *hold != ClutchMode::Released => {
                if let Stage::Opening { answered, .. } = &mut self.stage {
                    *answered = true;
                }
            }
            Event::Unanswered(HostRequest::Request(Request::CancelChange { .. })) => {
                self.on_unanswered_cancel();
            }
            Event::Answered {
                request: Request::CancelChange { epoch },
                result: Err(refusal),
            } => self.on_refused_cancel(*epoch, refusal),
            Event::Unanswered(HostRequest::Request(Request::Clutch { .. })) => {
                self.give_up("the device does not answer: no further change is made");
            }
            _ => {}
        }
    }

    fn give_up(&mut self, why: &str) {
        self.lines.push(why.to_owned());
        self.waiting.clear();
        (self.held, self.must_measure) = (false, false);
        if let Stage::Applying { in_contact, .. } = &mut self.stage {
            // The answer to the change is still to arrive. A refused one is not sent again.
            if let Some(changes) = in_contact {
                changes.clear();
            }
            return self.request_clutch(ClutchMode::Released);
        }
        self.release_clutch();
        // Behind the clutch, which replaces earlier cancels in the queue.
        self.request_cancel();
    }

    fn request_clutch(&mut self, hold: ClutchMode) {
        self.requested_hold = hold;
        self.requests
            .push(HostRequest::Request(Request::Clutch { hold }));
    }

    /// Holds the clutch. For the user the terrain follows the hand; only for a change of placement
    /// it stays in its place.
    fn hold_clutch(&mut self) {
        self.request_clutch(match self.held {
            true => ClutchMode::WithHand,
            false => ClutchMode::InPlace,
        });
    }

    fn open_clutch(&mut self) {
        self.hold_clutch();
        self.stage = Stage::Opening {
            samples: 0,
            answered: false,
        };
    }

    /// Waits for the clutch if the user has taken it while a change was sent.
    fn continue_clutch(&mut self) {
        if self.requested_hold != ClutchMode::Released {
            self.open_clutch();
        }
    }

    fn release_clutch(&mut self) {
        self.request_clutch(ClutchMode::Released);
        self.stage = Stage::Closing;
    }

    fn on_sample(&mut self, sample: &TickRecord) {
        let is_open = sample.limits.contains(Limits::CLUTCH_OPEN);
        let by_input = sample.limits.contains(Limits::CLUTCH_INPUT);
        let is_held_by_input = by_input && is_open;
        self.follow_hand(sample);
        if matches!(self.stage, Stage::InContact { .. }) && sample.view == self.number {
            self.stage = Stage::Idle;
        }
        // After a change that is under way, the measurement is of the new placement.
        if matches!(self.stage, Stage::Idle) {
            if is_held_by_input && !self.by_input {
                self.must_measure |= self.hand(sample).has_other_cell_size(&self.terrain);
            }
            self.by_input = is_held_by_input;
        }
        self.by_input &= is_held_by_input;
        // The user has taken the clutch during a change of placement: the terrain follows the hand.
        if self.held && self.requested_hold == ClutchMode::InPlace {
            self.hold_clutch();
        }
        // The user does not wait for the device's answer to a change of the level.
        let applies_level = matches!(self.stage, Stage::Applying { .. }) && self.changes_level();
        if self.held && applies_level && self.requested_hold == ClutchMode::Released {
            self.hold_clutch();
        }
        let is_turning = sample.limits.contains(Limits::CLUTCH_MOVES) && !by_input;
        let is_idle = matches!(self.stage, Stage::Idle) && !self.held;
        if is_idle && (self.waits_for_turn(is_turning) || self.changes_in_contact(sample)) {
            return;
        }
        self.waiting_since = self.waiting_since.filter(|_| !is_idle);
        (self.without_ground, self.turning) = (0, 0);
        match &mut self.stage {
            Stage::Idle if self.held || self.must_measure || !self.waiting.is_empty() => {
                self.open_clutch();
            }
            Stage::Idle => self.change_level(sample),
            Stage::InContact { samples } => {
                *samples += 1;
                let samples = *samples;
                if self.changes_level() {
                    self.wait_for_level(sample, samples);
                } else if self.held || !presses(sample) || samples > MAX_SAMPLES_IN_CONTACT {
                    self.open_clutch();
                }
            }
            Stage::Opening { answered: true, .. } if is_open && sample.view == self.number => {
                self.stage = Stage::Open;
                self.advance(sample);
            }
            Stage::Opening { samples, .. } => {
                *samples += 1;
                if *samples > MAX_SAMPLES_TO_OPEN {
                    self.give_up("the device does not open its clutch: no further change is made");
                }
            }
            Stage::Open if sample.view == self.number => self.advance(sample),
            // The board's clutch input may still hold the clutch open.
            Stage::Closing if !is_open || by_input => {
                self.stage = match self.changes_level() {
                    true => Stage::InContact { samples: 0 },
                    false => Stage::Idle,
                };
            }
            _ => {}
        }
    }

    /// Returns true if the force still turns to that of the current placement. The wait has an end:
    /// the force does not turn while the tile under the hand is late.
    fn waits_for_turn(&mut self, is_turning: bool) -> bool {
        self.turning = match is_turning {
            true => self.turning + 1,
            false => 0,
        };
        is_turning && self.turning <= MAX_SAMPLES_TURNING
    }

    /// Continues with an open clutch: sends the next placement, or releases the clutch.
    fn advance(&mut self, sample: &TickRecord) {
        // The ground height is unknown until the proxy has landed.
        if sample.missing_tile.is_some() {
            return;
        }
        let must_measure = std::mem::take(&mut self.must_measure)
            && self.hand(sample).has_other_cell_size(&self.terrain);
        if self.waiting.is_empty() && !must_measure {
            if !self.held {
                self.release_clutch();
            }
            return;
        }
        let changes = std::mem::take(&mut self.waiting);
        let waited = self
            .waiting_since
            .get_or_insert_with(Instant::now)
            .elapsed();
        let next = self.next_view(
            (&self.bounds, Measure::Again),
            &changes,
            (sample, waited < MAX_GROUND_WAIT),
        );
        if let Ok(None) = next {
            (self.waiting, self.must_measure) = (changes, must_measure);
            return;
        }
        self.waiting_since = None;
        match next {
            Ok(None) => {}
            Ok(Some(update)) => {
                self.apply(update, None);
            }
            Err(why) => self.refuse(&why),
        }
    }

    /// Prints the reason why the changes are not made.
    fn refuse(&mut self, why: &str) {
        self.lines
            .push(format!("the placement stays as it was: {why}"));
    }

    /// Sends a placement; with its changes if it changes in contact.
    fn apply(&mut self, update: PlacementUpdate<'r>, in_contact: Option<Vec<PlacementChange>>) {
        self.stage = Stage::Applying {
            next: Box::new((update.placed_surface, update.terrain.clone())),
            in_contact,
        };
        self.update = Some(update);
    }

    /// Sends the changes that wait, if they can be made under the pressing hand, or waits for its
    /// new ground. Impossible changes are refused. Returns false if the clutch has to be opened for
    /// them.
    fn changes_in_contact(&mut self, sample: &TickRecord) -> bool {
        let is_free = !self.held && !self.must_measure && !self.waiting.is_empty();
        if !is_free || !self.may_change_in_contact(sample) {
            return false;
        }
        self.without_ground += 1;
        let waits = self.without_ground <= MAX_SAMPLES_WITHOUT_GROUND;
        if sample.limits.contains(Limits::TERRAIN_COARSE) {
            // The proxy is on another surface than the ground that the change is computed from.
            return waits;
        }
        match self.update_in_contact((&self.bounds, Measure::Again), &self.waiting, sample) {
            InContact::Ready(update) => {
                let changes = std::mem::take(&mut self.waiting);
                self.without_ground = 0;
                self.apply(*update, Some(changes));
                true
            }
            InContact::Waits => waits,
            InContact::NeedsClutch => false,
            InContact::Impossible(why) => {
                self.waiting.clear();
                self.without_ground = 0;
                self.refuse(&why);
                true
            }
        }
    }

    /// Returns true if the hand presses on the current placement with the full force.
    fn may_change_in_contact(&self, sample: &TickRecord) -> bool {
        let is_current = sample.view == self.number && !sample.limits.intersects(NOT_IN_CONTACT);
        is_current && presses(sample)
    }

    /// Returns the changed placement for the pressing hand.
    fn update_in_contact(
        &self,
        (bounds, measure): (&Bounds, Measure),
        changes: &[PlacementChange],
        sample: &TickRecord,
    ) -> InContact<'r> {
        let mut update = match self.next_view((bounds, measure), changes, (sample, true)) {
            Ok(Some(update)) => update,
            Ok(None) => return InContact::Waits,
            Err(why) => return InContact::Impossible(why),
        };
        let Some(in_contact) = self.contact_map(&update, sample) else {
            return InContact::NeedsClutch;
        };
        let (view, reach_mm) = (&mut update.view, update.placed_surface.view.reach_mm);
        let touched = in_contact.to.column();
        // The window has the tiles around the proxy; those elsewhere may have no room beside them.
        let tile = |point: &GridPoint| TileIndex::containing(point.column());
        view.keeps_tiles &= tile(&in_contact.from) == tile(&in_contact.to);
        view.scene = update
            .terrain
            .with_fallback_around(view.scene, reach_mm, touched);
        let may_turn = view.may_turn_from(&self.now.params);
        if !may_turn || view.scene.fallback.is_none() || view.scene.materials.is_some() {
            return InContact::NeedsClutch;
        }
        view.in_contact = Some(in_contact);
        InContact::Ready(Box::new(update))
    }

    /// Returns the map of the proxy to the new placement.
    fn contact_map(&self, update: &PlacementUpdate<'r>, sample: &TickRecord) -> Option<ContactMap> {
        let side = |terrain: &Terrain<'_>| {
            let cells = terrain.scale().cell_mm() / terrain.scale_of_level_0().cell_mm();
            terrain.grid().side_m().unwrap_or(1.0) * cells
        };
        let across = side(&self.terrain) / side(&update.terrain);
        // Height of a unit, in cells.
        let unit = |terrain: &Terrain<'_>| {
            terrain.scale().height_mm_per_unit() / terrain.scale().cell_mm()
        };
        let up = unit(&update.terrain) / unit(&self.terrain);
        Some(ContactMap {
            from: sample.proxy,
            to: update.terrain.scale().to_grid(update.place_mm?)?,
            scale: [across, across, up].map(|scale| scale as f32).into(),
        })
    }

    /// Returns the position of the hand in a sample, in the current placement.
    fn hand(&self, sample: &TickRecord) -> Hand {
        let scale = self.terrain.scale();
        let touches = sample.state == ContactState::Touching;
        Hand {
            hip_mm: scale.to_mm(&sample.hip),
            proxy_mm: touches.then(|| scale.to_mm(&sample.proxy)),
        }
    }

    /// Returns the placement after the changes; `None` if its ground has not been read yet and
    /// `waits` is true.
    fn next_view(
        &self,
        (bounds, measure): (&Bounds, Measure),
        changes: &[PlacementChange],
        (sample, waits): (&TickRecord, bool),
    ) -> Result<Option<PlacementUpdate<'r>>, String> {
        let hand = self.hand(sample);
        let changed = bounds.apply(&self.terrain, &self.now, changes, (&hand, measure));
        let Changed {
            placed_surface,
            terrain,
            hip_mm,
            place_mm,
            ground_is_known,
        } = changed.map_err(|why| why.to_string())?;
        if waits && !ground_is_known {
            return Ok(None);
        }
        let on_grid = |mm| {
            let point = terrain.scale().to_grid(mm);
            point.ok_or("that is too far from the first sample")
        };
        let (hip, home) = (on_grid(hip_mm)?, on_grid(placed_surface.view.home_mm)?);
        let scene = terrain.scene(placed_surface.params, Source::Encoders, home);
        let view = SceneChange {
            number: self.number.wrapping_add(1),
            scene: terrain.with_fallback(scene, placed_surface.view.reach_mm),
            hip,
            keeps_tiles: terrain.has_tiles_of(&self.terrain),
            in_contact: None,
        };
        Ok(Some(PlacementUpdate {
            view,
            terrain,
            placed_surface,
            place_mm,
        }))
    }

    fn on_scene_change_result(&mut self, view: &SceneChange, accepted: bool) {
        let stage = std::mem::replace(&mut self.stage, Stage::Open);
        let Stage::Applying { next, in_contact } = stage else {
            self.stage = stage;
            return;
        };
        match in_contact {
            _ if accepted => {
                self.on_level_result(true);
                self.number = view.number;
                (self.now, self.terrain) = *next;
                if in_contact.is_some() {
                    self.stage = Stage::InContact { samples: 0 };
                    self.continue_clutch();
                }
            }
            // The level, or changes that were given up.
            Some(changes) if changes.is_empty() => {
                self.stage = Stage::Idle;
                self.on_level_result(false);
                self.continue_clutch();
            }
            Some(changes) => {
                self.waiting.splice(..0, changes);
                self.open_clutch();
            }
            None => {
                let line = "the device refused the placement: it stays as it was";
                self.lines.push(line.to_owned());
            }
        }
    }
}

/// Returns true if the hand presses into the terrain with the force of an armed arm.
fn presses(sample: &TickRecord) -> bool {
    sample.state == ContactState::Touching && sample.mode == Mode::Armed
}

#[cfg(test)]
#[path = "engine_tests.rs"]
mod tests;
