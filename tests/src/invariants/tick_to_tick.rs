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
    pub(super) fn was_seen_above(&self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        if before.output.state == ContactState::Unseeded && seen.is_touching() {
            return self.fail(Invariant::SeenAbove, format!("{before:?} then {seen:?}"));
        }
        Ok(())
    }

    pub(super) fn fades(&self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        let moved = distance(before.hip, seen.hip);
        let hopped = distance(before.proxy, seen.proxy);
        if !before.is_touching() || moved > NEAR {
            return Ok(()); // a new contact may begin at once
        }
        let rate = f64::from(RATE) + 1e-3;
        let broken = match (before.edge_fade(), seen.edge_fade()) {
            (Some(was), Some(is)) => hopped < 2.0 * NEAR && (is - was).abs() > rate,
            // A release ends when almost no force is left.
            (Some(was), None) => seen.output.state == ContactState::Unseeded && was > rate,
            (None, _) => false,
        };
        if broken {
            let detail = format!(
                "{:?} to {:?}: {before:?} then {seen:?}",
                before.edge_fade(),
                seen.edge_fade()
            );
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    /// Checks that a releasing force fades to zero in equal steps.
    pub(super) fn lets_go_gently(&mut self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        let output = |seen: &ObservedTick| seen.output.displacement.as_dvec3().length();
        let lets_go = |seen: &ObservedTick| seen.output.state == ContactState::Releasing;
        if lets_go(seen) && !lets_go(before) {
            self.let_go_from = output(before);
        }
        let step = output(before) - output(seen);
        let most = (f64::from(RATE) + 1e-3) * self.let_go_from;
        let ends = lets_go(before) || lets_go(seen);
        // The force decreases and does not turn.
        let [was, is] = [before, seen].map(|seen| seen.output.displacement.as_dvec3());
        let turned = was.cross(is).length() > 1e-6 * was.length() * is.length().max(1e-6);
        if ends && (turned || !(-1e-6..=most + 1e-6).contains(&step)) {
            let detail = format!("a step of {step:.3e}, {before:?} then {seen:?}");
            return self.fail(Invariant::Fade, detail);
        }
        Ok(())
    }

    pub(super) fn descends(&self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        // A proxy that waits for a tile continues from its entry into the patch.
        let waited = before.output.missing_tile.is_some();
        if !(before.is_touching() && seen.is_touching()) || waited {
            return Ok(());
        }
        if self.is_farther(before, seen) {
            let [was, is] = [before, seen].map(|at| distance(at.proxy, seen.hip));
            let detail = format!("{is} after {was}: {before:?} then {seen:?}");
            return self.fail(Invariant::Descent, detail);
        }
        Ok(())
    }

    /// Returns true if a proxy is farther from the HIP than it was before.
    pub(super) fn is_farther(&self, before: &ObservedTick, seen: &ObservedTick) -> bool {
        let [was, is] = [before, seen].map(|at| distance(at.proxy, seen.hip));
        let allowed = |seen: &ObservedTick| seen.allowed_in_space(self.terrain);
        is > was * (1.0 + TIE) + allowed(seen) + allowed(before)
    }

    /// Only in real time: [`Invariant::Settles`] covers repeated ticks.
    pub(super) fn advances(&mut self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        let flies = |seen: &ObservedTick| {
            let output = &seen.output;
            output.state == ContactState::Free && !output.converged && output.missing_tile.is_none()
        };
        let moved = distance(before.hip, seen.hip);
        let ahead = moved < AHEAD * distance(seen.proxy, seen.hip);
        let stays = ahead && flies(before) && flies(seen) && before.proxy == seen.proxy;
        self.stalled = if stays { self.stalled + 1 } else { 0 };
        self.measured.stalled = self.measured.stalled.max(self.stalled);
        if self.stalled > STALLED {
            let detail = format!("{} ticks, {before:?} then {seen:?}", self.stalled);
            return self.fail(Invariant::Advances, detail);
        }
        Ok(())
    }

    pub(super) fn first_crossing(&mut self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        // Lowered by the rounding, the path meets the surface no later.
        let slope = patches_at(self.terrain, seen.proxy[0], seen.proxy[1])
            .map(|patch| patch.slope(seen.proxy[0], seen.proxy[1]))
            .fold(0.0, f64::max);
        let margin = 2.0 * (seen.allowed() + before.allowed()) * (1.0 + slope);
        let lowered = |[x, y, z]: [f64; 3]| [x, y, z - margin];
        let met = crossing::first(self.terrain, lowered(before.hip), lowered(seen.hip));
        match (met, seen.is_touching()) {
            (None, true) => {
                let detail = format!("nothing was crossed: {before:?} then {seen:?}");
                self.fail(Invariant::Freedom, detail)
            }
            (Some(met), true) => {
                let (from, is) = (
                    distance(met.at, lowered(seen.hip)),
                    distance(seen.proxy, seen.hip),
                );
                if is > from * (1.0 + TIE) + 2.0 * margin {
                    let detail = format!("{is} after {from} at {met:?}: {before:?} then {seen:?}");
                    return self.fail(Invariant::FirstCrossing, detail);
                }
                Ok(())
            }
            (Some(met), false) => {
                self.measured.around += u64::from(seen.is_free() && met.depth > 1e-3);
                Ok(())
            }
            (None, false) => Ok(()),
        }
    }

    pub(super) fn passes_no_wall(&self, before: &ObservedTick, seen: &ObservedTick) -> Verdict {
        let inside = |p: [f64; 3]| {
            (0..2).all(|axis| (0.0..f64::from(self.terrain.size[axis])).contains(&p[axis]))
        };
        let held = |seen: &ObservedTick| seen.output.state != ContactState::Unseeded;
        // Any point on top of a wall is farther from the HIP than the proxy was.
        let out_of_reach = WALL - seen.hip[2] > distance(before.proxy, seen.hip) + 1.0;
        if self.terrain.kind != Kind::Walls
            || !(held(before) && held(seen) && out_of_reach)
            || !(inside(before.proxy) && inside(seen.proxy) && inside(seen.hip))
        {
            return Ok(());
        }
        let room =
            |p: [f64; 3]| [0, 1].map(|axis| (p[axis] / f64::from(WALL_EVERY)).floor() as i32);
        if room(before.proxy) != room(seen.proxy) {
            return self.fail(Invariant::Wall, format!("{before:?} then {seen:?}"));
        }
        Ok(())
    }
}
