//! Friction, judged by trying every direction in which a proxy could go.

use hapterra_core::contact::ContactState;

use super::Invariant;
use super::judge::{Judge, Verdict};
use super::seen::Seen;
use super::surface::{Patch, distance};

/// Part by which a proxy that has slid may be pulled more than its friction holds.
const SLACK: f64 = 0.0302;
/// Ticks at 1 kHz after which a proxy that does not move sticks by static friction.
const STICKS_AFTER: u32 = 21;
/// HIPs nearer than this, in cells, press with nothing worth a cone.
const NEAR: f64 = 1e-3;
/// HIPs farther than this are so far that the last places of the way decide.
const FAR: f64 = 1e4;
/// Steepness up to which single precision tells a direction along the surface.
const STEEP: f64 = 1e3;

/// The way from a proxy to the HIP: how long it is along the best direction of the
/// surface, and what is left of it.
#[derive(Clone, Copy, Debug)]
struct Pull {
    along: f64,
    rest: f64,
    /// How steep the ground is there.
    slope: f64,
    /// What the height may be off by: the place is rounded, and of a patch with a needle at a
    /// corner the heights that are mixed are.
    rounding: f64,
}

impl Judge<'_> {
    /// A proxy that has slid, or was held, is inside the friction cone.
    pub(super) fn is_in_cone(&mut self, seen: &Seen) -> Verdict {
        let Some((least, _)) = self.pulls(seen.proxy, seen.hip) else {
            return Ok(());
        };
        let mu = f64::from(self.friction.static_mu);
        // What the viscous part holds is told by how far the proxy went in the tick.
        let viscous = f64::from(self.friction.viscous_s) * 1e3;
        let place = seen.allowed() + least.rounding;
        let most = |from: [f64; 3]| {
            let gone = distance(from, seen.proxy);
            let trail = match viscous > 0.0 {
                true => viscous * (gone + 4.0 * seen.allowed() * (1.0 + least.slope)),
                false => 0.0,
            };
            mu * least.rest * (1.0 + SLACK) + trail + 4.0 * place * (1.0 + mu)
        };
        // A free one that has work left over goes first through a piece of its way to the last HIP:
        // where it meets the surface, and slides from, is not told.
        let before = (self.before).filter(|before| before.felt.converged || before.is_touching());
        if before.is_none() && viscous > 0.0 {
            return Ok(());
        }
        let from = before.map_or(seen.proxy, |before| before.proxy);
        if least.along <= most(from) {
            return Ok(());
        }
        // It may have been in the air meanwhile.
        if let (Some(before), Some(told)) = (before, seen.slid_from)
            && !seen.stays(&before)
            && least.along <= most(told)
        {
            return self.came_down(&before, seen, told);
        }
        let detail = format!("{least:?} where {:.3e} is held: {seen:?}", most(from));
        self.fail(Invariant::Cone, detail)
    }

    /// Whether a proxy may have come down where the contact says so: on the surface, no farther from
    /// the HIP than it was, and with the HIP below.
    fn came_down(&mut self, before: &Seen, seen: &Seen, at: [f64; 3]) -> Verdict {
        let landed = Seen { proxy: at, ..*seen };
        self.is_on_surface(&landed)?;
        self.is_hip_below(&landed)?;
        if self.is_farther(before, &landed) {
            let detail = format!("came down farther away: {before:?} then {seen:?}");
            return self.fail(Invariant::Cone, detail);
        }
        Ok(())
    }

    /// A proxy inside the cone does not move. One that was in the air slides at first, also where it
    /// comes back to where it was.
    pub(super) fn sticks(&mut self, before: &Seen, seen: &Seen) -> Verdict {
        let touches =
            |seen: &Seen| seen.felt.state == ContactState::Touching && seen.felt.converged;
        let moved = before.felt.proxy != seen.felt.proxy;
        let still = self.still;
        self.still = if seen.stays(before) { still + 1 } else { 0 };
        if !(moved && touches(before) && touches(seen)) {
            return Ok(());
        }
        let Some((_, most)) = self.pulls(before.proxy, seen.hip) else {
            return Ok(());
        };
        let mu = match still >= STICKS_AFTER {
            true => self.friction.static_mu,
            false => self.friction.dynamic_mu,
        };
        let place = seen.allowed() + most.rounding;
        let held = f64::from(mu) * most.rest * (1.0 - 1e-3) - 4.0 * place;
        if most.along < held {
            let detail = format!("{most:?} of {held:.3e}: {before:?} then {seen:?}");
            return self.fail(Invariant::Stuck, detail);
        }
        Ok(())
    }

    /// The least and the most that the HIP pulls a proxy by, over the places that single
    /// precision cannot tell apart; `None` where the HIP is not below, or too near, too far
    /// or the ground too steep to tell.
    fn pulls(&self, proxy: [f64; 3], hip: [f64; 3]) -> Option<(Pull, Pull)> {
        if !(NEAR..FAR).contains(&distance(proxy, hip)) {
            return None;
        }
        let way = [0, 1, 2].map(|i| hip[i] - proxy[i]);
        let mut places: Vec<([f64; 2], Pull)> = Vec::new();
        for (start, patch) in self.nearby(proxy) {
            let [east, north] = patch.slopes(start[0], start[1]);
            let above = way[2] - east * way[0] - north * way[1];
            if above > -NEAR || patch.slope(start[0], start[1]) > STEEP {
                return None;
            }
            let along = most_along(&patch, start, way);
            let whole: f64 = way.iter().map(|c| c * c).sum();
            let rest = (whole - along * along).max(0.0).sqrt();
            let slope = patch.slope(start[0], start[1]);
            let heights = patch.mixed_size(start[0], start[1], hip[2]);
            let pull = Pull {
                along,
                rest,
                slope,
                rounding: f64::from(f32::EPSILON) * (slope + 4.0 * heights),
            };
            match places.iter_mut().find(|(at, _)| *at == start) {
                Some((_, most)) if along > most.along => *most = pull,
                Some(_) => {}
                None => places.push((start, pull)),
            }
        }
        let by = |a: &Pull, b: &Pull| a.along.total_cmp(&b.along);
        let least = places.iter().map(|(_, pull)| *pull).min_by(by)?;
        let most = places.iter().map(|(_, pull)| *pull).max_by(by)?;
        Some((least, most))
    }
}

/// The most that a way has in any direction of the surface into a patch.
fn most_along(patch: &Patch, start: [f64; 2], way: [f64; 3]) -> f64 {
    const TRIED: u32 = 720;
    let [east, north] = patch.slopes(start[0], start[1]);
    let along = |angle: f64| {
        let (y, x) = angle.sin_cos();
        let snap = |c: f64| if c.abs() < 1e-12 { 0.0 } else { c };
        let (x, y) = (snap(x), snap(y));
        let leads_in = [x, y].into_iter().enumerate().all(|(axis, c)| {
            let place = start[axis] - f64::from(patch.cell[axis]);
            (place > 0.0 || c >= 0.0) && (place < 1.0 || c <= 0.0)
        });
        let z = east * x + north * y;
        let length = (1.0 + z * z).sqrt();
        leads_in.then(|| (way[0] * x + way[1] * y + way[2] * z) / length)
    };
    let step = std::f64::consts::TAU / f64::from(TRIED);
    let Some((best, angle)) = (0..TRIED)
        .filter_map(|n| along(f64::from(n) * step).map(|most| (most, f64::from(n) * step)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
    else {
        return 0.0;
    };
    let (mut low, mut high) = (angle - step, angle + step);
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        let [at_a, at_b] = [a, b].map(|angle| along(angle).unwrap_or(f64::NEG_INFINITY));
        if at_a < at_b { low = a } else { high = b }
    }
    along(0.5 * (low + high)).unwrap_or(best).max(best).max(0.0)
}
