//! Invariants from one tick to the next.

use hapterra_core::contact::ContactState;
use hapterra_core::contact::edge_fade::RATE;

use super::observed_tick::ObservedTick;
use super::oracle::{TickOracle, Verdict};
use super::surface::{distance, patches_at};
use super::{Invariant, crossing};
use crate::scene::terrain::{Kind, WALL, WALL_EVERY};

/// Distances that differ by less than this fraction count as equal: the product compares the
/// squared distance to 10⁻⁶ in each patch of a path.
const TIE: f64 = 4e-6;
/// Motion of the HIP in a tick, cells, up to which the contact is the same as before.
const NEAR: f64 = 0.1;
/// Motion of the HIP, as a fraction of its distance, up to which its direction counts as unchanged.
const AHEAD: f64 = 0.25;
/// Ticks in which a proxy in the air may make no progress: the longest path must be halved,
/// searched and halved again before its first part is traversed.
const STALLED: u32 = 4;

impl TickOracle<'_> {
    pub(super) fn check_seen_from_above(
        &self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        if before.output.state == ContactState::Unseeded && observed.is_touching() {
            return self.fail(
                Invariant::SeenAbove,
                format!("{before:?} then {observed:?}"),
            );
        }
        Ok(())
    }

    pub(super) fn check_fade(&self, before: &ObservedTick, observed: &ObservedTick) -> Verdict {
        let moved = distance(before.hip, observed.hip);
        let hopped = distance(before.proxy, observed.proxy);
        if !before.is_touching() || moved > NEAR {
            return Ok(()); // a new contact may begin at once
        }
        let rate = f64::from(RATE) + 1e-3;
        let broken = match (before.edge_fade(), observed.edge_fade()) {
            (Some(was), Some(is)) => hopped < 2.0 * NEAR && (is - was).abs() > rate,
            // A release ends when almost no force is left.
            (Some(was), None) => observed.output.state == ContactState::Unseeded && was > rate,
            (None, _) => false,
        };
        if broken {
            let detail = format!(
                "{:?} to {:?}: {before:?} then {observed:?}",
                before.edge_fade(),
                observed.edge_fade()
            );
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    /// Checks that a releasing force fades to zero in equal steps.
    pub(super) fn check_release(
        &mut self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        let output = |observed: &ObservedTick| observed.output.displacement.as_dvec3().length();
        let lets_go = |observed: &ObservedTick| observed.output.state == ContactState::Releasing;
        if lets_go(observed) && !lets_go(before) {
            self.released_from = output(before);
        }
        let step = output(before) - output(observed);
        let max = (f64::from(RATE) + 1e-3) * self.released_from;
        let ends = lets_go(before) || lets_go(observed);
        // The force decreases and does not turn.
        let [was, is] = [before, observed].map(|observed| observed.output.displacement.as_dvec3());
        let turned = was.cross(is).length() > 1e-6 * was.length() * is.length().max(1e-6);
        if ends && (turned || !(-1e-6..=max + 1e-6).contains(&step)) {
            let detail = format!("a step of {step:.3e}, {before:?} then {observed:?}");
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    pub(super) fn check_descent(&self, before: &ObservedTick, observed: &ObservedTick) -> Verdict {
        // A proxy that waits for a tile continues from its entry into the patch.
        let waited = before.output.missing_tile.is_some();
        if !(before.is_touching() && observed.is_touching()) || waited {
            return Ok(());
        }
        if self.is_farther(before, observed) {
            let [was, is] = [before, observed].map(|at| distance(at.proxy, observed.hip));
            let detail = format!("{is} after {was}: {before:?} then {observed:?}");
            return self.fail(Invariant::Descent, detail);
        }
        Ok(())
    }

    /// Returns true if a proxy is farther from the HIP than it was before.
    pub(super) fn is_farther(&self, before: &ObservedTick, observed: &ObservedTick) -> bool {
        let [was, is] = [before, observed].map(|at| distance(at.proxy, observed.hip));
        let allowed = |observed: &ObservedTick| observed.allowed_in_space(self.terrain);
        is > was * (1.0 + TIE) + allowed(observed) + allowed(before)
    }

    /// Only in real time: [`Invariant::Settles`] covers repeated ticks.
    pub(super) fn check_advance(
        &mut self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        let flies = |observed: &ObservedTick| {
            let output = &observed.output;
            output.state == ContactState::Free && !output.converged && output.missing_tile.is_none()
        };
        let moved = distance(before.hip, observed.hip);
        let ahead = moved < AHEAD * distance(observed.proxy, observed.hip);
        let stays = ahead && flies(before) && flies(observed) && before.proxy == observed.proxy;
        self.stalled = if stays { self.stalled + 1 } else { 0 };
        self.measured.stalled = self.measured.stalled.max(self.stalled);
        if self.stalled > STALLED {
            let detail = format!("{} ticks, {before:?} then {observed:?}", self.stalled);
            return self.fail(Invariant::Advances, detail);
        }
        Ok(())
    }

    pub(super) fn check_first_crossing(
        &mut self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        // Lowered by the rounding, the path meets the surface no later.
        let slope = patches_at(self.terrain, observed.proxy[0], observed.proxy[1])
            .map(|patch| patch.slope(observed.proxy[0], observed.proxy[1]))
            .fold(0.0, f64::max);
        let margin = 2.0 * (observed.allowed() + before.allowed()) * (1.0 + slope);
        let lowered = |[x, y, z]: [f64; 3]| [x, y, z - margin];
        let crossing = crossing::first(self.terrain, lowered(before.hip), lowered(observed.hip));
        match (crossing, observed.is_touching()) {
            (None, true) => {
                let detail = format!("nothing was crossed: {before:?} then {observed:?}");
                self.fail(Invariant::Freedom, detail)
            }
            (Some(crossing), true) => {
                let (from, is) = (
                    distance(crossing.at, lowered(observed.hip)),
                    distance(observed.proxy, observed.hip),
                );
                if is > from * (1.0 + TIE) + 2.0 * margin {
                    let detail =
                        format!("{is} after {from} at {crossing:?}: {before:?} then {observed:?}");
                    return self.fail(Invariant::FirstCrossing, detail);
                }
                Ok(())
            }
            (Some(crossing), false) => {
                self.measured.around += u64::from(observed.is_free() && crossing.depth > 1e-3);
                Ok(())
            }
            (None, false) => Ok(()),
        }
    }

    pub(super) fn check_no_wall_crossed(
        &self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        let inside = |p: [f64; 3]| {
            (0..2).all(|axis| (0.0..f64::from(self.terrain.size[axis])).contains(&p[axis]))
        };
        let held = |observed: &ObservedTick| observed.output.state != ContactState::Unseeded;
        // Any point on top of a wall is farther from the HIP than the proxy was.
        let out_of_reach = WALL - observed.hip[2] > distance(before.proxy, observed.hip) + 1.0;
        if self.terrain.kind != Kind::Walls
            || !(held(before) && held(observed) && out_of_reach)
            || !(inside(before.proxy) && inside(observed.proxy) && inside(observed.hip))
        {
            return Ok(());
        }
        let room =
            |p: [f64; 3]| [0, 1].map(|axis| (p[axis] / f64::from(WALL_EVERY)).floor() as i32);
        if room(before.proxy) != room(observed.proxy) {
            return self.fail(Invariant::Wall, format!("{before:?} then {observed:?}"));
        }
        Ok(())
    }
}
