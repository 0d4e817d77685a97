//! Changes of the placement by the user, applied to a device.

use std::time::{Duration, Instant};

use hapterra_core::clutch::ClutchHold;
use hapterra_core::contact::ContactState;
use hapterra_core::guard::Limits;
use hapterra_core::scene::{SceneChange, Source, TickRecord};
use hapterra_core::wire::request::Request;

use super::Steer;
use crate::link::{Event, HostRequest};
use crate::place::{Bounds, Changed, Hand, Laid, PlacementChange};
use crate::terrain::Terrain;

/// Maximum number of changes that wait for the clutch to open; they are then applied together.
const WAITING: usize = 64;
/// Samples after which a clutch that has not opened counts as failed; it opens in 100 ticks of a
/// millisecond.
const SAMPLES_TO_OPEN: u32 = 5_000;

/// Maximum wait for the ground under the hand in the new placement, with the clutch open.
const GROUND_WITHIN: Duration = Duration::from_secs(2);

/// A placement to set on the device.
pub struct Put<'r> {
    /// Message to the device.
    pub view: SceneChange,
    /// The terrain that it is rendered on.
    pub terrain: Terrain<'r>,
    /// Place, scale and surface parameters.
    pub laid: Laid,
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
    /// This placement was sent; with its terrain.
    Putting(Box<(Laid, Terrain<'r>)>),
    /// The clutch was released, and is still reported open.
    Closing,
}

/// Engine behind keys and commands: turns each [`Steer`] into requests to a device, by its samples.
pub struct Steering<'r> {
    bounds: Bounds,
    now: Laid,
    terrain: Terrain<'r>,
    /// Number of the current placement on the device.
    number: u8,
    waiting: Vec<PlacementChange>,
    /// The user holds the clutch.
    held: bool,
    /// The board's clutch input holds it open.
    by_input: bool,
    /// The user has held the clutch, and may be far from where the cells were measured.
    measures: bool,
    /// Requested hold of the clutch.
    asked: ClutchHold,
    /// Start of the wait for the ground of the new placement.
    awaits: Option<Instant>,
    stage: Stage<'r>,
    asks: Vec<HostRequest>,
    put: Option<Put<'r>>,
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
            measures: false,
            asked: ClutchHold::LetGo,
            awaits: None,
            stage: Stage::Idle,
            asks: vec![],
            put: None,
            lines: vec![],
        }
    }

    /// Returns the current placement, by the last report, and its surface parameters.
    #[must_use]
    pub const fn now(&self) -> &Laid {
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
        let rests = match self.stage {
            Stage::Idle => !self.held,
            Stage::Open => self.held,
            _ => false,
        };
        rests && self.waiting.is_empty() && !self.measures
    }

    /// Queues a request of the user.
    pub fn steer(&mut self, steer: Steer) {
        match steer {
            Steer::Clutch(held) => {
                self.measures |= held && !self.held;
                self.held = held;
            }
            Steer::Change(change) if self.waiting.len() < WAITING => self.waiting.push(change),
            // Only a stuck key fills the queue.
            Steer::Change(_) => {}
        }
    }

    /// Returns the pending lines for the user, in order.
    pub fn lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lines)
    }

    /// Returns the pending requests to the device.
    pub fn asks(&mut self) -> Vec<HostRequest> {
        std::mem::take(&mut self.asks)
    }

    /// Returns the placement to set now, if any.
    pub fn take_put(&mut self) -> Option<Put<'r>> {
        self.put.take()
    }

    /// Handles an event of the device.
    pub fn on_event(&mut self, event: &Event<'_>) {
        match event {
            Event::Sample(sample) => self.on_sample(sample),
            Event::SceneChangeResult { view, accepted } => self.on_viewed(view, *accepted),
            Event::Opened { resumed, .. } => {
                // A session's end releases its clutch, and a restarted device starts with this
                // placement.
                self.stage = Stage::Idle;
                self.asked = ClutchHold::LetGo;
                if !resumed {
                    self.number = 0;
                }
            }
            Event::Answered {
                request: Request::Clutch { hold },
                result: Ok(()),
            } if *hold != ClutchHold::LetGo => {
                if let Stage::Opening { answered, .. } = &mut self.stage {
                    *answered = true;
                }
            }
            Event::Unanswered(HostRequest::Request(Request::Clutch { .. })) => {
                self.give_up("the device does not answer: the view stays as it was");
            }
            _ => {}
        }
    }

    fn give_up(&mut self, why: &str) {
        self.lines.push(why.to_owned());
        self.waiting.clear();
        (self.held, self.measures) = (false, false);
        self.let_go();
    }

    fn clutch(&mut self, hold: ClutchHold) {
        self.asked = hold;
        self.asks
            .push(HostRequest::Request(Request::Clutch { hold }));
    }

    /// Holds the clutch. For the user the terrain follows the hand; only for a change of placement
    /// it stays in its place.
    fn hold(&mut self) {
        self.clutch(match self.held {
            true => ClutchHold::WithHand,
            false => ClutchHold::InPlace,
        });
    }

    fn let_go(&mut self) {
        self.clutch(ClutchHold::LetGo);
        self.stage = Stage::Closing;
    }

    fn on_sample(&mut self, sample: &TickRecord) {
        let is_open = sample.limits.contains(Limits::CLUTCH_OPEN);
        let by_input = sample.limits.contains(Limits::CLUTCH_INPUT);
        let is_taken = by_input && is_open;
        if is_taken && !self.by_input && matches!(self.stage, Stage::Idle) {
            self.measures = self.hand(sample).is_far_from_measure(&self.terrain);
        }
        self.by_input = is_taken;
        // The user has taken the clutch during a change of placement: the terrain follows the hand.
        if self.held && self.asked == ClutchHold::InPlace {
            self.hold();
        }
        match &mut self.stage {
            Stage::Idle if self.held || self.measures || !self.waiting.is_empty() => {
                self.hold();
                self.stage = Stage::Opening {
                    samples: 0,
                    answered: false,
                };
            }
            Stage::Opening { answered: true, .. } if is_open && sample.view == self.number => {
                self.stage = Stage::Open;
                self.go_on(sample);
            }
            Stage::Opening { samples, .. } => {
                *samples += 1;
                if *samples > SAMPLES_TO_OPEN {
                    self.give_up("the device does not open its clutch: the view stays as it was");
                }
            }
            Stage::Open if sample.view == self.number => self.go_on(sample),
            // The board's clutch input may still hold the clutch open.
            Stage::Closing if !is_open || by_input => self.stage = Stage::Idle,
            _ => {}
        }
    }

    /// Continues with an open clutch: sends the next placement, or releases the clutch.
    fn go_on(&mut self, sample: &TickRecord) {
        // The ground height is unknown until the proxy has landed.
        if sample.missing_tile.is_some() {
            return;
        }
        let measures = std::mem::take(&mut self.measures)
            && self.hand(sample).is_far_from_measure(&self.terrain);
        if self.waiting.is_empty() && !measures {
            if !self.held {
                self.let_go();
            }
            return;
        }
        let changes = std::mem::take(&mut self.waiting);
        let waited = self.awaits.get_or_insert_with(Instant::now).elapsed();
        let next = self.next_view(&changes, sample, waited < GROUND_WITHIN);
        if let Ok(None) = next {
            (self.waiting, self.measures) = (changes, measures);
            return;
        }
        self.awaits = None;
        match next {
            Ok(None) => {}
            Ok(Some(put)) => {
                self.stage = Stage::Putting(Box::new((put.laid, put.terrain.clone())));
                self.put = Some(put);
            }
            Err(why) => self.lines.push(format!("the view stays as it was: {why}")),
        }
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
        changes: &[PlacementChange],
        sample: &TickRecord,
        waits: bool,
    ) -> Result<Option<Put<'r>>, String> {
        let hand = self.hand(sample);
        let changed = self.bounds.apply(&self.terrain, &self.now, changes, &hand);
        let Changed {
            laid,
            terrain,
            hip_mm,
            ground_is_known,
        } = changed.map_err(|why| why.to_string())?;
        if waits && !ground_is_known {
            return Ok(None);
        }
        let on_grid = |mm| {
            let point = terrain.scale().to_grid(mm);
            point.ok_or("that is too far from the first sample")
        };
        let (hip, home) = (on_grid(hip_mm)?, on_grid(laid.view.home_mm)?);
        let scene = terrain.scene(laid.params, Source::Encoders, home);
        let view = SceneChange {
            number: self.number.wrapping_add(1),
            scene: terrain.underlaid(scene, laid.view.reach_mm),
            hip,
            keeps_tiles: terrain.has_tiles_of(&self.terrain),
        };
        Ok(Some(Put {
            view,
            terrain,
            laid,
        }))
    }

    fn on_viewed(&mut self, view: &SceneChange, accepted: bool) {
        let Stage::Putting(put) = &self.stage else {
            return;
        };
        if accepted {
            self.number = view.number;
            (self.now, self.terrain) = (**put).clone();
        } else {
            let line = "the device refused the placement: it stays as it was";
            self.lines.push(line.to_owned());
        }
        self.stage = Stage::Open;
    }
}

#[cfg(test)]
#[path = "engine_tests.rs"]
mod tests;
