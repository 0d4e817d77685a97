//! The proxy: where the hand would be if it could not enter the terrain.
//!
//! [`Contact::step`] takes the haptic interface point of one tick and answers
//! with the proxy. Read [`patch`] first, then [`crossing`] and `sweep` (from
//! free space into contact), then [`closest`] and `descent` (in contact),
//! [`presence`] (at the borders of the data), and `paper` for the rule as it
//! was published.

pub mod closest;
pub mod crossing;
pub mod patch;
pub mod presence;

mod descent;
#[cfg(test)]
mod dice;
mod paper;
mod spot;
mod sweep;
#[cfg(test)]
mod tests;
mod work;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use spot::Spot;
pub use work::WORK_PER_TICK;

use crate::grid::GridPoint;
use crate::terrain::{Altitude, Box2, Ground, Window};
use descent::{Descent, descend, tile_of};
use paper::Verdict;
use patch::Patch;
use spot::Hand;
use sweep::{Path, Sweep};
use work::Work;

/// Which contact rule is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rule {
    /// Continuous: the first true crossing starts a contact, and the proxy
    /// moves on the surface.
    #[default]
    Swept,
    /// As published, for comparison.
    Paper,
}

/// What happens when a tick cannot finish: a tile is missing, or the work is
/// spent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The loop goes on; the proxy waits, and a force that has to wait comes
    /// in gently.
    RealTime,
    /// The tick will be repeated with the same hand until it can finish, and
    /// only then counts; nothing of the wait is felt.
    LockStep,
}

/// What the proxy is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// The hand has not been seen above the surface yet: no force.
    #[default]
    Waiting,
    /// The proxy is free.
    Free,
    /// The proxy is on the surface and the hand below it.
    Touching,
}

/// One tick's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Felt {
    /// What the proxy is doing.
    pub state: State,
    /// Where the proxy is.
    pub proxy: GridPoint,
    /// From the hand to the proxy in cells, times the presence: what the
    /// spring feels. Zero unless touching.
    pub stretch: Vec3,
    /// Whether the tick did all there was to do for this hand.
    pub settled: bool,
    /// The tile (column, row) whose absence held the tick up.
    pub held_up_by: Option<[i32; 2]>,
    /// Units of work spent, at most [`WORK_PER_TICK`].
    pub work: u32,
}

// The path is most of a contact's state, and there is no heap to put it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum Phase {
    Waiting,
    Free,
    Sweeping(Path),
    Touching { spot: Spot, may_leave: bool },
}

/// The proxy and what it remembers from tick to tick.
#[derive(Clone, Debug)]
pub struct Contact {
    phase: Phase,
    hip: GridPoint,
    revision: u32,
    presence: f32,
    /// The proxy had to wait for terrain, so a force may not come at once.
    late: bool,
    /// Squared distance at which the last unfinished descent of this same
    /// hand stopped.
    reached: f32,
    /// The same hand over the same tiles will give the same answer.
    steady: bool,
    last: Felt,
}

impl Default for Contact {
    fn default() -> Self {
        Self::new()
    }
}

impl Contact {
    /// A contact that waits to see the hand above the surface.
    #[must_use]
    pub fn new() -> Self {
        Self {
            phase: Phase::Waiting,
            hip: GridPoint::default(),
            revision: 0,
            presence: 1.0,
            late: false,
            reached: f32::INFINITY,
            steady: false,
            last: Felt::default(),
        }
    }

    /// The patch the proxy is on, while touching.
    #[must_use]
    pub const fn patch(&self) -> Option<[i32; 2]> {
        match self.phase {
            Phase::Touching { spot, .. } => Some(spot.cell),
            _ => None,
        }
    }

    /// Moves the proxy for a hand at `hip`. Bounded work, finite output.
    pub fn step<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        rule: Rule,
        pace: Pace,
    ) -> Felt {
        let moved = hip != self.hip;
        if !moved && self.steady && self.revision == window.revision() {
            self.last.work = 0;
            return self.last;
        }
        self.revision = window.revision();
        let mut work = Work::new();
        let felt = match rule {
            Rule::Swept => self.swept(window, hip, moved, pace, &mut work),
            Rule::Paper => self.paper(window, hip, pace, &mut work),
        };
        if felt.settled || pace == Pace::RealTime || rule == Rule::Swept {
            self.hip = hip;
        }
        self.steady = felt.settled && self.presence == 1.0;
        self.last = Felt {
            work: work.spent(),
            ..felt
        };
        self.last
    }

    fn swept<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        moved: bool,
        pace: Pace,
        work: &mut Work,
    ) -> Felt {
        if moved {
            self.reached = f32::INFINITY;
            self.redirect(hip);
        }
        if matches!(self.phase, Phase::Waiting) && !self.sees_above(window, hip) {
            return self.waits(window, hip);
        }
        // Each turn either ends the tick or spends work, or goes from the air
        // to the surface at a point strictly nearer to the hand.
        loop {
            let ended = match &mut self.phase {
                Phase::Waiting | Phase::Free => self.fly(window, hip),
                Phase::Sweeping(_) => self.sweep(window, hip, pace, work),
                Phase::Touching { .. } => self.touch(window, hip, pace, work),
            };
            if let Some(felt) = ended {
                return felt;
            }
        }
    }

    /// The hand has moved: a way under way now leads to its new place.
    fn redirect(&mut self, hip: GridPoint) {
        match &mut self.phase {
            Phase::Sweeping(path) => *path = Path::through_air(path.at(), hip),
            Phase::Touching { may_leave, .. } => *may_leave = true,
            Phase::Waiting | Phase::Free => {}
        }
    }

    /// Waiting ends when the hand is above the patch it is over, or above
    /// everything.
    fn sees_above<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> bool {
        let hand = Hand::new(hip);
        let above = match hand.ground(window, hip.column()) {
            Ground::Patch(corners) => Patch::new(corners).height(hip.frac().x, hip.frac().y) < 0.0,
            Ground::Hole => hand.altitude().cell() >= window.top(),
            Ground::Missing => false,
        };
        if above {
            self.phase = Phase::Free;
            self.hip = hip;
        }
        above
    }

    fn waits<const D: usize>(&self, window: &Window<'_, D>, hip: GridPoint) -> Felt {
        let ground = Hand::new(hip).ground(window, hip.column());
        let missing = matches!(ground, Ground::Missing);
        Felt {
            state: State::Waiting,
            proxy: hip,
            settled: !missing,
            held_up_by: missing.then(|| tile_of(hip.column())),
            ..Felt::default()
        }
    }

    /// In free space the proxy is the hand; one look tells whether it still is.
    fn fly<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Option<Felt> {
        let from = self.hip;
        let low = if from.is_below(&hip) { &from } else { &hip };
        let span = Box2::around(from.column(), hip.column());
        if window.is_clear(span, Altitude::new(low.cell()[2], low.frac().z)) {
            return Some(self.flies(hip));
        }
        self.phase = Phase::Sweeping(Path::through_air(from, hip));
        None
    }

    fn flies(&mut self, hip: GridPoint) -> Felt {
        self.phase = Phase::Free;
        self.late = false;
        Felt {
            state: State::Free,
            proxy: hip,
            settled: true,
            ..Felt::default()
        }
    }

    fn sweep<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        pace: Pace,
        work: &mut Work,
    ) -> Option<Felt> {
        let Phase::Sweeping(path) = &mut self.phase else {
            return None;
        };
        let held_up_by = match path.advance(window, work) {
            Sweep::Clear => return Some(self.flies(hip)),
            Sweep::Under => {
                self.let_go();
                return Some(self.waits(window, hip));
            }
            Sweep::Hit { spot, progress } => {
                self.presence = if self.late { 0.0 } else { 1.0 };
                self.phase = Phase::Touching {
                    spot,
                    may_leave: progress,
                };
                return None;
            }
            Sweep::HeldUp(tile) => Some(tile),
            Sweep::Unfinished => None,
        };
        self.late |= pace == Pace::RealTime;
        Some(Felt {
            state: State::Free,
            proxy: path.at(),
            held_up_by,
            ..Felt::default()
        })
    }

    fn touch<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        pace: Pace,
        work: &mut Work,
    ) -> Option<Felt> {
        let Phase::Touching { spot, may_leave } = self.phase else {
            return None;
        };
        let hand = Hand::new(hip);
        let mut resume = None;
        let mut held_up_by = None;
        let mut settled = true;
        let (spot, patch) = match descend(window, &hand, spot, may_leave, work) {
            Descent::Rests(spot, patch) => (spot, patch),
            Descent::Leaves(spot) => {
                let from = self.point_on(window, &hand, &spot);
                self.phase = Phase::Sweeping(Path::off_surface(from, hip));
                return None;
            }
            Descent::Lost(tile) => {
                self.let_go();
                let felt = self.waits(window, hip);
                return Some(Felt {
                    held_up_by: felt.held_up_by.or(tile),
                    ..felt
                });
            }
            Descent::HeldUp {
                at,
                patch,
                entry,
                tile,
            } => {
                (resume, held_up_by, settled) = (Some(entry), Some(tile), false);
                (at, patch)
            }
            Descent::Unfinished(spot, patch, f) => {
                // No nearer than after the tick before: rounding, not a way.
                settled = f >= self.reached * (1.0 - 1e-6);
                self.reached = f;
                (spot, patch)
            }
        };
        self.phase = Phase::Touching {
            spot: resume.unwrap_or(spot),
            may_leave,
        };
        Some(self.touches(window, hip, (spot, patch), settled, held_up_by, pace))
    }

    /// The answer in contact, faded where the surface ends.
    fn touches<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        (spot, patch): (Spot, Patch),
        settled: bool,
        held_up_by: Option<[i32; 2]>,
        pace: Pace,
    ) -> Felt {
        let (mut settled, mut held_up_by) = (settled, held_up_by);
        if settled || pace == Pace::RealTime {
            let target = self.presence_target(window, hip, &spot);
            if let (Pace::LockStep, Some(tile)) = (pace, target.missing) {
                (settled, held_up_by) = (false, Some(tile));
            } else {
                self.presence = presence::approach(self.presence, target.presence);
                if self.presence == 0.0 && target.presence == 0.0 {
                    self.let_go();
                    return self.waits(window, hip);
                }
            }
        }
        let hand = Hand::new(hip);
        let stretch = hand.stretch(&spot, &patch);
        Felt {
            state: State::Touching,
            proxy: hand.point_at(&spot, stretch.z),
            stretch: stretch * self.presence,
            settled,
            held_up_by,
            work: 0,
        }
    }

    /// Nearly always the hand is over the patch that the proxy is on.
    fn presence_target<const D: usize>(
        &self,
        window: &Window<'_, D>,
        hip: GridPoint,
        spot: &Spot,
    ) -> presence::Target {
        if spot.cell == hip.column() {
            return presence::Target {
                presence: 1.0,
                missing: None,
            };
        }
        presence::target(window, &hip)
    }

    fn let_go(&mut self) {
        self.phase = Phase::Waiting;
        self.presence = 1.0;
    }

    fn point_on<const D: usize>(
        &self,
        window: &Window<'_, D>,
        hand: &Hand,
        spot: &Spot,
    ) -> GridPoint {
        match hand.ground(window, spot.cell) {
            Ground::Patch(corners) => {
                hand.point_at(spot, Patch::new(corners).height(spot.u, spot.v))
            }
            // `descend` has just stood on it.
            Ground::Hole | Ground::Missing => self.last.proxy,
        }
    }

    fn paper<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        pace: Pace,
        work: &mut Work,
    ) -> Felt {
        let last = match self.phase {
            Phase::Touching { spot, .. } => Some(spot),
            _ => None,
        };
        if matches!(self.phase, Phase::Waiting) && !self.sees_above(window, hip) {
            return self.waits(window, hip);
        }
        match paper::update(window, last, &self.hip, &hip, work) {
            Verdict::Free => self.flies(hip),
            Verdict::Contact(spot, patch) => {
                if last.is_none() {
                    self.presence = if self.late { 0.0 } else { 1.0 };
                }
                self.phase = Phase::Touching {
                    spot,
                    may_leave: true,
                };
                self.touches(window, hip, (spot, patch), true, None, pace)
            }
            Verdict::HeldUp(tile) => {
                self.late |= pace == Pace::RealTime;
                Felt {
                    settled: false,
                    held_up_by: Some(tile),
                    ..self.last
                }
            }
        }
    }
}
