//! Friction, checked by a search over all directions in which a proxy could move.

use hapterra_core::contact::ContactState;

use super::Invariant;
use super::observed_tick::ObservedTick;
use super::oracle::{TickOracle, Verdict};
use super::surface::{Patch, distance, patches_at};

/// Tolerance of the pull on a proxy that has slid, as a fraction of the friction.
const SLACK: f64 = 0.01;
/// Longer moves in a tick, in cells, may leave the checked area.
const SLIDES: f64 = 2.0;
/// Ticks at 1 kHz after which a proxy that does not move sticks by static friction.
const STICKS_AFTER: u32 = 21;
/// HIPs nearer than this, in cells, press too little for a check.
const NEAR: f64 = 1e-3;
/// For HIPs farther than this, in cells, rounding of the path decides.
const FAR: f64 = 1e4;
/// Largest slope at which single precision resolves a direction along the surface.
const STEEP: f64 = 1e3;

/// The vector from a proxy to the HIP: its length along the best direction of the surface, and the
/// rest.
#[derive(Clone, Copy, Debug)]
struct Pull {
    tangential: f64,
    normal: f64,
    /// Slope of the ground there.
    slope: f64,
    /// Tolerance of the height, from rounding of the position, and of the corner heights in a patch
    /// with a spike.
    rounding: f64,
}

impl TickOracle<'_> {
    /// Checks that a proxy that has slid or was held is inside the friction cone.
    pub(super) fn check_cone(&mut self, observed: &ObservedTick) -> Verdict {
        let Some((min, _)) = self.pulls(observed.proxy, observed.hip) else {
            return Ok(());
        };
        let slid = self.slip_start_of(observed);
        // Dynamic friction holds a proxy that slid, static friction one after a contact onset.
        let mu = f64::from(match slid {
            Some(_) => self.friction.dynamic_mu,
            None => self.friction.static_mu,
        });
        let viscous = f64::from(self.friction.viscous_s) * 1e3;
        let place = observed.allowed() + min.rounding;
        let travelled = match (slid, self.before) {
            (Some(start), _) => distance(start, observed.proxy),
            // The contact onset may be at any point nearer to the HIP than the proxy was.
            (None, Some(before)) => {
                distance(before.proxy, observed.hip) + distance(observed.proxy, observed.hip)
            }
            (None, None) if viscous > 0.0 => return Ok(()),
            (None, None) => 0.0,
        };
        let trail = viscous * (travelled + 4.0 * observed.allowed() * (1.0 + min.slope));
        let holds = mu * min.normal + trail;
        if min.tangential <= holds * (1.0 + SLACK) + 4.0 * place * (1.0 + mu) {
            return Ok(());
        }
        let detail = format!("{min:?} where {holds:.3e} is held: {observed:?}");
        self.fail(Invariant::Cone, detail)
    }

    /// Checks that a proxy that has slid moved no farther than friction allows.
    pub(super) fn check_held_back(&mut self, observed: &ObservedTick) -> Verdict {
        let Some(start) = self.slip_start_of(observed) else {
            return Ok(());
        };
        if self.pulls(observed.proxy, observed.hip).is_none() {
            return Ok(());
        }
        let mu = f64::from(self.friction.dynamic_mu);
        let viscous = f64::from(self.friction.viscous_s) * 1e3;
        let travelled = distance(start, observed.proxy);
        // On an edge it may have come from any of the patches that meet there.
        let falls_short = |(start, patch): &([f64; 2], Patch)| {
            let displacement = [0, 1, 2].map(|i| observed.hip[i] - observed.proxy[i]);
            let [east, north] = patch.slopes(start[0], start[1]);
            let norm = (1.0 + east * east + north * north).sqrt();
            let normal =
                (displacement[2] - east * displacement[0] - north * displacement[1]).abs() / norm;
            let whole: f64 = displacement.iter().map(|c| c * c).sum();
            let tangential = (whole - normal * normal).max(0.0).sqrt();
            let place = observed.allowed() + self.rounding(patch, *start, observed.hip[2]);
            let trail =
                viscous * (travelled - 4.0 * observed.allowed() * (1.0 + east.hypot(north)));
            let holds = mu * normal + trail.max(0.0);
            tangential < holds * (1.0 - SLACK) - 4.0 * place * (1.0 + mu)
        };
        if !self.nearby(observed.proxy).all(|at| falls_short(&at)) {
            return Ok(());
        }
        let detail = format!("let go: {start:?} then {observed:?}");
        self.fail(Invariant::Cone, detail)
    }

    /// Returns the position of the proxy at the start of its motion for this HIP, which may take
    /// several ticks.
    pub(super) fn slip_start(&self, before: &ObservedTick, observed: &ObservedTick) -> [f64; 3] {
        match before.output.converged || before.hip != observed.hip {
            true => before.proxy,
            false => self.began,
        }
    }

    /// Returns the start of a slide over the surface alone: around start and end the HIP is clearly
    /// below every tangent plane, so that nothing lifts the proxy off.
    fn slip_start_of(&self, observed: &ObservedTick) -> Option<[f64; 3]> {
        const SAMPLES: u32 = 12;
        /// Largest distance of a slide from the straight path, cells.
        const OFFSET: f64 = 0.25;
        let before = self.before?;
        let start = self.slip_start(&before, observed);
        let touches = before.is_touching() && observed.is_touching() && observed.output.converged;
        let displacement = [0, 1].map(|i| observed.proxy[i] - start[i]);
        let is_near = displacement[0].hypot(displacement[1]) < SLIDES;
        if !touches || !is_near || before.output.proxy == observed.output.proxy {
            return None;
        }
        let at = |axis: usize, sample: u32| {
            let (from, to) = (start[axis], observed.proxy[axis]);
            let (min, max) = (from.min(to) - OFFSET, from.max(to) + OFFSET);
            min + (max - min) * f64::from(sample) / f64::from(SAMPLES)
        };
        let is_pressed = (0..=SAMPLES).all(|column| {
            (0..=SAMPLES).all(|row| self.is_pressed_at([at(0, column), at(1, row)], observed.hip))
        });
        is_pressed.then_some(start)
    }

    /// Returns true if there is ground at a point, and the HIP is clearly below its tangent plane.
    fn is_pressed_at(&self, [x, y]: [f64; 2], hip: [f64; 3]) -> bool {
        let mut patches = patches_at(self.terrain, x, y).peekable();
        patches.peek().is_some()
            && patches.all(|patch| {
                let [east, north] = patch.slopes(x, y);
                let above = patch.height(x, y) + east * (hip[0] - x) + north * (hip[1] - y);
                above - hip[2] > 0.01 * (1.0 + east.hypot(north))
            })
    }

    /// Returns the tolerance of the height at a point of a patch, from rounding of the position,
    /// and of the corner heights in a patch with a spike.
    fn rounding(&self, patch: &Patch, [x, y]: [f64; 2], hip: f64) -> f64 {
        f64::from(f32::EPSILON) * (patch.slope(x, y) + 4.0 * patch.mixed_size(x, y, hip))
    }

    /// Checks that a proxy inside the cone does not move. A proxy that was in the air slides first,
    /// even if it returns to its old position.
    pub(super) fn check_sticks(
        &mut self,
        before: &ObservedTick,
        observed: &ObservedTick,
    ) -> Verdict {
        let touches = |observed: &ObservedTick| {
            observed.output.state == ContactState::Touching && observed.output.converged
        };
        let moved = before.output.proxy != observed.output.proxy;
        let still = self.still;
        self.still = if observed.stays(before) { still + 1 } else { 0 };
        if !(moved && touches(before) && touches(observed)) {
            return Ok(());
        }
        let Some((_, max)) = self.pulls(before.proxy, observed.hip) else {
            return Ok(());
        };
        let mu = match still >= STICKS_AFTER {
            true => self.friction.static_mu,
            false => self.friction.dynamic_mu,
        };
        let place = observed.allowed() + max.rounding;
        let max_held = f64::from(mu) * max.normal * (1.0 - 1e-3) - 4.0 * place;
        if max.tangential < max_held {
            let detail = format!("{max:?} of {max_held:.3e}: {before:?} then {observed:?}");
            return self.fail(Invariant::Stuck, detail);
        }
        Ok(())
    }

    /// Returns the smallest and largest pull of the HIP on a proxy, over the points that single
    /// precision cannot distinguish; `None` if the HIP is not below, too near or too far, or the
    /// ground is too steep.
    fn pulls(&self, proxy: [f64; 3], hip: [f64; 3]) -> Option<(Pull, Pull)> {
        if !(NEAR..FAR).contains(&distance(proxy, hip)) {
            return None;
        }
        let displacement = [0, 1, 2].map(|i| hip[i] - proxy[i]);
        let mut places: Vec<([f64; 2], Pull)> = Vec::new();
        for (start, patch) in self.nearby(proxy) {
            let [east, north] = patch.slopes(start[0], start[1]);
            let above = displacement[2] - east * displacement[0] - north * displacement[1];
            if above > -NEAR || patch.slope(start[0], start[1]) > STEEP {
                return None;
            }
            let tangential = max_tangential(&patch, start, displacement);
            let whole: f64 = displacement.iter().map(|c| c * c).sum();
            let normal = (whole - tangential * tangential).max(0.0).sqrt();
            let slope = patch.slope(start[0], start[1]);
            let pull = Pull {
                tangential,
                normal,
                slope,
                rounding: self.rounding(&patch, start, hip[2]),
            };
            match places.iter_mut().find(|(at, _)| *at == start) {
                Some((_, max)) if tangential > max.tangential => *max = pull,
                Some(_) => {}
                None => places.push((start, pull)),
            }
        }
        let by = |a: &Pull, b: &Pull| a.tangential.total_cmp(&b.tangential);
        let min = places.iter().map(|(_, pull)| *pull).min_by(by)?;
        let max = places.iter().map(|(_, pull)| *pull).max_by(by)?;
        Some((min, max))
    }
}

/// Returns the largest component of a vector along the surface, over all directions into a patch.
fn max_tangential(patch: &Patch, start: [f64; 2], displacement: [f64; 3]) -> f64 {
    const MAX_TRIED: u32 = 720;
    let [east, north] = patch.slopes(start[0], start[1]);
    let tangential = |angle: f64| {
        let (y, x) = angle.sin_cos();
        let snap = |c: f64| if c.abs() < 1e-12 { 0.0 } else { c };
        let (x, y) = (snap(x), snap(y));
        let leads_in = [x, y].into_iter().enumerate().all(|(axis, c)| {
            let place = start[axis] - f64::from(patch.cell[axis]);
            (place > 0.0 || c >= 0.0) && (place < 1.0 || c <= 0.0)
        });
        let z = east * x + north * y;
        let length = (1.0 + z * z).sqrt();
        leads_in.then(|| (displacement[0] * x + displacement[1] * y + displacement[2] * z) / length)
    };
    let step = std::f64::consts::TAU / f64::from(MAX_TRIED);
    let Some((best, angle)) = (0..MAX_TRIED)
        .filter_map(|n| tangential(f64::from(n) * step).map(|max| (max, f64::from(n) * step)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
    else {
        return 0.0;
    };
    let (mut low, mut high) = (angle - step, angle + step);
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        let [at_a, at_b] = [a, b].map(|angle| tangential(angle).unwrap_or(f64::NEG_INFINITY));
        if at_a < at_b { low = a } else { high = b }
    }
    tangential(0.5 * (low + high))
        .unwrap_or(best)
        .max(best)
        .max(0.0)
}
