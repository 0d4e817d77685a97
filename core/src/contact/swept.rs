//! The swept rule: continuous in the air, downhill on the surface.

use glam::Vec3;

use super::closest::RESOLUTION;
use super::descent::{Descent, Leave, descend};
use super::gentle::Gentle;
use super::patch::Patch;
use super::presence::is_far;
use super::proxy::{Contact, Phase};
use super::spot::{Hand, Spot};
use super::sweep::{Path, Sweep};
use super::track::Track;
use super::work::Work;
use super::{Felt, Pace, State};
use crate::grid::GridPoint;
use crate::terrain::{Altitude, Ground, Window};

/// Times in a row that a proxy may leave the surface for one hand from where it
/// is no nearer to it: more is rounding, from a place to another and back.
const LEAPS: u32 = 32;
/// Ticks in a row that get a descent no nearer until it is taken to be at its
/// end: at the foot of a wall of 10⁶ a place knows its distance only to 10⁻².
const IDLE: u32 = 4;

impl Contact {
    /// One tick by the swept rule.
    pub(super) fn swept<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        moved: bool,
        pace: Pace,
        work: &mut Work,
    ) -> Felt {
        if moved {
            (self.reached, self.left) = (None, None);
            self.redirect(hip);
        }
        if matches!(self.phase, Phase::LettingGo { .. }) {
            return self.fades(window, hip);
        }
        if matches!(self.phase, Phase::Waiting) && !self.sees_above(window, hip) {
            return self.waits(window, hip);
        }
        // Each turn either ends the tick or spends work, or goes from the air
        // to the surface at a point strictly nearer to the hand.
        loop {
            let ended = match &mut self.phase {
                Phase::Waiting | Phase::Free | Phase::LettingGo { .. } => {
                    self.fly(window, hip, pace, work)
                }
                Phase::Sweeping(_) => self.sweep(window, hip, pace, work),
                Phase::Touching { .. } | Phase::Following(_) => self.touch(window, hip, pace, work),
            };
            if let Some(felt) = ended {
                return felt;
            }
        }
    }

    /// The hand has moved: a way under way now leads to its new place.
    fn redirect(&mut self, hip: GridPoint) {
        let ahead = self.ahead.take();
        match &mut self.phase {
            Phase::Sweeping(path) => *path = Path::through_air(path.at(), hip),
            Phase::Touching { spot, leave } => {
                (*spot, *leave) = (ahead.unwrap_or(*spot), Leave::Anywhere);
            }
            _ => {}
        }
    }

    /// In free space the proxy is the hand, if it still is.
    ///
    /// Most ways end within the tick; those are not worth storing.
    fn fly<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        pace: Pace,
        work: &mut Work,
    ) -> Option<Felt> {
        let from = self.hip;
        let mut path = Path::through_air(from, hip);
        let ended = path.advance(window, work);
        let at = path.at();
        if matches!(ended, Sweep::HeldUp(_) | Sweep::Unfinished) {
            self.phase = Phase::Sweeping(path);
        }
        self.arrives(window, hip, ended, at, pace)
    }

    /// Goes on with a way from an earlier tick, or off the surface.
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
        let ended = path.advance(window, work);
        let at = path.at();
        self.arrives(window, hip, ended, at, pace)
    }

    /// What a way that ended like this, at `at`, comes to; `None` on the surface.
    fn arrives<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        ended: Sweep,
        at: GridPoint,
        pace: Pace,
    ) -> Option<Felt> {
        let held_up_by = match ended {
            Sweep::Clear => return Some(self.flies(hip)),
            Sweep::Under => return Some(self.loses(window, hip)),
            Sweep::Hit(spot) => {
                // A hop from the surface to the surface keeps what it had.
                if core::mem::take(&mut self.late) {
                    self.presence = 0.0;
                }
                self.phase = Phase::Touching {
                    spot,
                    leave: self.may_leave(window, &hip, spot),
                };
                return None;
            }
            Sweep::HeldUp(tile) => Some(tile),
            Sweep::Unfinished => None,
        };
        self.late |= pace == Pace::RealTime;
        Some(Felt {
            state: State::Free,
            proxy: at,
            held_up_by,
            ..Felt::default()
        })
    }

    /// Where a proxy that has hit the surface may leave it again.
    fn may_leave<const D: usize>(
        &self,
        window: &Window<'_, D>,
        hip: &GridPoint,
        hit: Spot,
    ) -> Leave {
        match &self.left {
            Some((_, LEAPS..)) => Leave::Nowhere,
            Some((was, _)) if !is_nearer(&self.point_on(window, &hit), was, hip) => {
                Leave::ButAt(hit)
            }
            _ => Leave::Anywhere,
        }
    }

    fn touch<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        pace: Pace,
        work: &mut Work,
    ) -> Option<Felt> {
        let Phase::Touching { spot, leave } = self.phase else {
            return None;
        };
        self.ahead = None;
        let hand = Hand::new(hip);
        let mut held_up_by = None;
        let mut settled = true;
        let (spot, z, entry) = match descend(window, &hand, spot, leave, work) {
            Descent::Rests { at, z, entry } => (at, z, entry),
            Descent::Leaves(spot) => {
                let from = self.point_on(window, &spot);
                gets_no_nearer(&mut self.left, from, &hip);
                self.phase = Phase::Sweeping(Path::off_surface(from, hip));
                return None;
            }
            Descent::Lost(tile) => {
                let felt = self.loses(window, hip);
                return Some(Felt {
                    held_up_by: felt.held_up_by.or(tile),
                    ..felt
                });
            }
            Descent::HeldUp { at, z, entry, tile } => {
                (held_up_by, settled) = (Some(tile), false);
                (at, z, entry)
            }
            Descent::Unfinished { at, z, entry } => {
                let there = self.point_at(window, &hand, &at, z);
                settled = gets_no_nearer(&mut self.reached, there, &hip) >= IDLE;
                (at, z, entry)
            }
        };
        let goes_on = !settled;
        self.phase = Phase::Touching { spot, leave };
        let felt = self.touches(window, hip, (spot, z), settled, held_up_by, pace);
        let waits = goes_on || felt.held_up_by.is_some();
        if waits && matches!(self.phase, Phase::Touching { .. }) {
            // To be taken up again, so that the wait leaves no trace.
            self.phase = Phase::Touching { spot: entry, leave };
            self.ahead = Some(spot);
        }
        if felt.settled && self.presence == 1.0 {
            self.lay_track(window, hip.column());
        }
        Some(felt)
    }

    /// Remembers the patch of a proxy at rest for the ticks to come.
    fn lay_track<const D: usize>(&mut self, window: &Window<'_, D>, over: [i32; 2]) {
        let Phase::Touching { spot, .. } = self.phase else {
            return;
        };
        let known = if is_far(spot.cell, over) {
            spot.cell
        } else {
            over
        };
        // At the very border of a hole the presence is 1, too.
        if matches!(window.ground(known), Ground::Patch(_))
            && let Ground::Patch(corners) = window.ground(spot.cell)
            && let Some(gentle) = Gentle::new(&corners)
        {
            self.phase = Phase::Following(Track::new(gentle, known, spot));
        }
    }

    /// The point of the surface at a spot, `z` cells above the hand: up a wall that
    /// height is known better than the place tells it, of a far hand worse.
    fn point_at<const D: usize>(
        &self,
        window: &Window<'_, D>,
        hand: &Hand,
        spot: &Spot,
        z: f32,
    ) -> GridPoint {
        if let Ground::Patch(corners) = window.ground(spot.cell) {
            let patch = Patch::new(corners.heights);
            let steep = patch.slope_u(spot.v).abs() + patch.slope_v(spot.u).abs();
            if z.abs() > steep {
                return self.point_on(window, spot);
            }
        }
        hand.point_at(spot, z)
    }

    /// The point of the surface at a spot, no matter how far the hand is.
    fn point_on<const D: usize>(&self, window: &Window<'_, D>, spot: &Spot) -> GridPoint {
        match window.ground(spot.cell) {
            Ground::Patch(corners) => {
                // Counted from a cell nearby: of a high place the fraction has no bits.
                let patch = Patch::new(corners.heights);
                let up = corners
                    .base
                    .saturating_add(patch.height(spot.u, spot.v) as i32);
                let near = patch.seen_from(Altitude::new(up, 0.0), corners.base);
                let height = near.height(spot.u, spot.v);
                let [x, y] = spot.cell;
                GridPoint::new([x, y, up], Vec3::new(spot.u, spot.v, height))
            }
            // `descend` has just stood on it.
            Ground::Hole | Ground::Missing => self.last.proxy,
        }
    }
}

/// How often in a row a proxy has come to a place no nearer to the hand than the
/// nearest one, which is kept.
fn gets_no_nearer(nearest: &mut Option<(GridPoint, u32)>, at: GridPoint, hip: &GridPoint) -> u32 {
    if let Some((was, times)) = nearest
        && !is_nearer(&at, was, hip)
    {
        *times += 1;
        return *times;
    }
    *nearest = Some((at, 0));
    0
}

/// Whether one point is nearer to a hand than another was, by more than the last
/// places of the two may be off: of a far hand the squared distances themselves
/// would not tell.
fn is_nearer(is: &GridPoint, was: &GridPoint, hand: &GridPoint) -> bool {
    let (way, left) = (was.to(is), is.to(hand));
    let noise = 2.0 * RESOLUTION * (way.abs() + left.abs()).element_sum();
    way.dot(way + 2.0 * left) > noise
}
