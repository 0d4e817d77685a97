//! What the proxy remembers from tick to tick, and what both rules share.

use glam::Vec3;

use super::descent::Leave;
use super::paper::{self, Verdict};
use super::spot::{Hand, Spot, tile_of};
use super::sweep::Path;
use super::track::Track;
use super::work::Work;
use super::{Felt, Pace, Rule, State, presence};
use crate::grid::GridPoint;
use crate::guard::TickRate;
use crate::terrain::{Ground, Window};

// The path is most of a contact's state, and there is no heap to put it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
pub(super) enum Phase {
    /// The hand has not been above the surface yet.
    Waiting,
    /// The last tick ended free, with the proxy in the hand.
    Free,
    /// On a way through the air that is not at its end.
    Sweeping(Path),
    /// On the surface.
    Touching { spot: Spot, leave: Leave },
    /// On the surface, where the last tick came to rest, with nothing left to
    /// do and no fading, on a patch that the proxy can be followed over.
    Following(Track),
    /// What was touched ended: its last force fades away.
    LettingGo { proxy: GridPoint, stretch: Vec3 },
}

/// The proxy and what it remembers from tick to tick.
#[derive(Clone, Debug)]
pub struct Contact {
    pub(super) phase: Phase,
    pub(super) hip: GridPoint,
    /// The last answer is the answer again while the hand has not moved: there
    /// is nothing left to do, and no force is fading. (A field does not change;
    /// another one comes with a new contact.)
    pub(super) answered: bool,
    pub(super) presence: f32,
    /// A free proxy had to wait, for terrain or for work: the force of the next
    /// contact may not come at once.
    pub(super) late: bool,
    /// The nearest place at which an unfinished descent of this same hand
    /// stopped, and how many have got no nearer since.
    pub(super) reached: Option<(GridPoint, u32)>,
    /// Where the proxy is, when the descent of this same hand goes on from
    /// somewhere else: a hand that has moved finds it there.
    pub(super) ahead: Option<Spot>,
    /// The nearest place from which the proxy has left the surface for this same
    /// hand, and how often it has left since from no nearer.
    pub(super) left: Option<(GridPoint, u32)>,
    /// By the paper's rule: cells on the way to `sought` that were found to be no
    /// candidates before a tile was missing.
    passed: usize,
    sought: GridPoint,
    pub(super) last: Felt,
    /// What was felt before the general case had to look, which may take it
    /// several turns in lock-step.
    pub(super) before: Felt,
    /// Most that the presence may change in a tick.
    fade: f32,
}

impl Default for Contact {
    fn default() -> Self {
        Self::new()
    }
}

impl Contact {
    /// A contact that waits to see the hand above the surface, at 1 kHz.
    #[must_use]
    pub fn new() -> Self {
        Self::ticking(TickRate::DEFAULT)
    }

    /// The same at another rate.
    #[must_use]
    pub fn ticking(rate: TickRate) -> Self {
        Self {
            phase: Phase::Waiting,
            hip: GridPoint::default(),
            answered: false,
            presence: 1.0,
            late: false,
            reached: None,
            ahead: None,
            left: None,
            passed: 0,
            sought: GridPoint::default(),
            last: Felt::default(),
            before: Felt::default(),
            fade: presence::RATE_PER_S * rate.tick_s(),
        }
    }

    /// How much of the surface is there under the hand: less than 1 where its
    /// force is fading.
    #[must_use]
    pub const fn presence(&self) -> f32 {
        self.presence
    }

    /// The patch the proxy is on, while touching.
    #[must_use]
    pub fn patch(&self) -> Option<[i32; 2]> {
        match &self.phase {
            Phase::Touching { spot, .. } => Some(spot.cell),
            Phase::Following(track) => Some(track.spot.cell),
            _ => None,
        }
    }

    /// Moves the proxy for a hand at `hip`. Bounded work, finite output.
    #[inline]
    pub fn step<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
        rule: Rule,
        pace: Pace,
    ) -> &Felt {
        if self.answered && self.hip.is_same(hip) {
            self.last.work = 0;
        } else if rule == Rule::Swept && self.goes_on(window, hip, pace) {
            self.hip = *hip;
        } else {
            self.feel_anew(window, *hip, rule, pace);
        }
        &self.last
    }

    /// The general case.
    #[inline(never)]
    fn feel_anew<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        rule: Rule,
        pace: Pace,
    ) {
        let mut work = Work::new();
        if self.last.settled || pace == Pace::RealTime {
            self.before = self.last;
        }
        if let Phase::Following(track) = &self.phase {
            self.phase = Phase::Touching {
                spot: track.spot,
                leave: Leave::Anywhere,
            };
        }
        let felt = match rule {
            Rule::Swept => self.swept(window, hip, hip != self.hip, pace, &mut work),
            Rule::Paper => self.paper(window, hip, pace, &mut work),
        };
        if felt.settled || pace == Pace::RealTime || rule == Rule::Swept {
            self.hip = hip;
        }
        self.answered = felt.settled && self.presence == 1.0;
        self.last = Felt {
            work: work.spent(),
            ..felt
        };
    }

    /// Waiting ends when the hand is above the patch it is over, or above
    /// everything.
    pub(super) fn sees_above<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) -> bool {
        let hand = Hand::new(hip);
        let above_it = || match window.ground(hip.column()) {
            Ground::Patch(corners) => hand.patch(&corners).height(hip.frac().x, hip.frac().y) < 0.0,
            Ground::Hole | Ground::Missing => false,
        };
        let above = hand.altitude().cell() >= window.top() || above_it();
        if above {
            self.phase = Phase::Free;
            self.hip = hip;
        }
        above
    }

    pub(super) fn waits<const D: usize>(&self, window: &Window<'_, D>, hip: GridPoint) -> Felt {
        let missing = matches!(window.ground(hip.column()), Ground::Missing);
        Felt {
            state: State::Waiting,
            proxy: hip,
            settled: !missing,
            held_up_by: missing.then(|| tile_of(hip.column())),
            ..Felt::default()
        }
    }

    pub(super) fn flies(&mut self, hip: GridPoint) -> Felt {
        self.phase = Phase::Free;
        self.late = false;
        self.presence = 1.0;
        Felt {
            state: State::Free,
            proxy: hip,
            settled: true,
            ..Felt::default()
        }
    }

    /// The answer in contact, faded where the surface ends.
    pub(super) fn touches<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        (spot, z): (Spot, f32),
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
                self.presence = presence::approach(self.presence, target.presence, self.fade);
                if self.presence == 0.0 && target.presence == 0.0 {
                    return self.starts_anew(window, hip);
                }
            }
        }
        let hand = Hand::new(hip);
        Felt {
            state: State::Touching,
            proxy: hand.point_at(&spot, z),
            stretch: hand.stretch(&spot, z) * self.presence,
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
        if spot.cell == hip.column() || presence::is_far(spot.cell, hip.column()) {
            return presence::Target {
                presence: 1.0,
                missing: None,
            };
        }
        presence::target(window, &hip)
    }

    /// Nothing is felt any more. The hand may be above the surface already; to
    /// look now and not in the next tick is what makes a missing tile leave no
    /// trace.
    fn starts_anew<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Felt {
        self.phase = Phase::Waiting;
        self.presence = 1.0;
        if self.sees_above(window, hip) {
            return self.flies(hip);
        }
        self.waits(window, hip)
    }

    /// The contact is lost: what was felt fades away where it was.
    pub(super) fn loses<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Felt {
        if self.before.state == State::Touching {
            self.presence = 1.0;
            self.phase = Phase::LettingGo {
                proxy: self.before.proxy,
                stretch: self.before.stretch,
            };
            return self.fades(window, hip);
        }
        self.starts_anew(window, hip)
    }

    /// A tick of letting go.
    pub(super) fn fades<const D: usize>(&mut self, window: &Window<'_, D>, hip: GridPoint) -> Felt {
        self.presence = presence::approach(self.presence, 0.0, self.fade);
        let Phase::LettingGo { proxy, stretch } = self.phase else {
            return self.waits(window, hip);
        };
        if self.presence == 0.0 {
            return self.starts_anew(window, hip);
        }
        Felt {
            state: State::LettingGo,
            proxy,
            stretch: stretch * self.presence,
            settled: true,
            ..Felt::default()
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
        if hip != self.sought || self.last.settled {
            (self.passed, self.sought) = (0, hip);
        }
        if matches!(self.phase, Phase::Waiting) && !self.sees_above(window, hip) {
            return self.waits(window, hip);
        }
        let previous = self.hip;
        match paper::update(window, last, &previous, &hip, &mut self.passed, work) {
            Verdict::Free => self.flies(hip),
            Verdict::Contact { spot, z, settled } => {
                if core::mem::take(&mut self.late) {
                    self.presence = 0.0;
                }
                self.phase = Phase::Touching {
                    spot,
                    leave: Leave::Anywhere,
                };
                self.touches(window, hip, (spot, z), settled, None, pace)
            }
            Verdict::HeldUp(tile) if last.is_some() => Felt {
                settled: false,
                held_up_by: Some(tile),
                ..self.last
            },
            Verdict::HeldUp(tile) => {
                self.late |= pace == Pace::RealTime;
                Felt {
                    state: State::Free,
                    proxy: previous,
                    held_up_by: Some(tile),
                    ..Felt::default()
                }
            }
        }
    }
}
