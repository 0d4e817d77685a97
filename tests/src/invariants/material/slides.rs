//! A proxy that slides over a plane, by docs/explanation/effects.md.

use glam::DVec3;
use hapterra_core::contact::ContactState;
use hapterra_core::guard::Limits;
use hapterra_core::scene::TickRecord;

use super::active_material::ActiveMaterial;
use super::{MaterialOracle, RATE_HZ};
use crate::invariants::Invariant;
use crate::invariants::observed_tick::ObservedTick;
use crate::invariants::oracle::Verdict;
use crate::invariants::surface::{Patch, distance};
use crate::scene::terrain::Kind;

/// Displacements of a proxy in a tick, and distances from the HIP, for which friction is checked,
/// cells.
const SLIDES: std::ops::Range<f64> = 1e-4..0.5;
const PRESSES: std::ops::Range<f64> = 1e-3..100.0;
/// Tolerance of the distance by which a proxy trails due to its speed, as a fraction.
const SLACK: f64 = 0.031;

impl MaterialOracle<'_> {
    /// Checks that a proxy that slides on a plane, not too fast, ends where friction holds it.
    pub(super) fn check_slides(
        &mut self,
        candidate: &ActiveMaterial,
        observed: &ObservedTick,
    ) -> Verdict {
        let (friction, [_, max]) = (candidate.friction(), candidate.friction_bounds());
        let Some(before) = self.before else {
            return Ok(());
        };
        let touches = |state| state == ContactState::Touching;
        let moved = distance(before.proxy, observed.proxy);
        let inside = |p: [f64; 3]| {
            let size = self.position_oracle.terrain.size.map(f64::from);
            (0..2).all(|axis| (1.0..size[axis] - 1.0).contains(&p[axis]))
        };
        let is_plane = matches!(self.kind, Kind::Flat | Kind::Slope);
        let is_whole = |sample: &TickRecord| !sample.limits.contains(Limits::EDGE_FADING);
        let is_reported = is_plane
            && touches(before.sample.state)
            && touches(observed.output.state)
            && is_whole(&before.sample)
            && [before.proxy, observed.proxy, observed.hip]
                .into_iter()
                .all(inside)
            && SLIDES.contains(&moved)
            && PRESSES.contains(&distance(observed.proxy, observed.hip));
        if !is_reported {
            return Ok(());
        }
        let [x, y, _] = observed.proxy;
        let Some(patch) = Patch::at(
            self.position_oracle.terrain,
            [x.floor() as i32, y.floor() as i32],
        ) else {
            return Ok(());
        };
        let [east, north] = patch.slopes(x, y);
        let normal = DVec3::new(-east, -north, 1.0).normalize();
        let displacement = DVec3::from_array(observed.hip) - DVec3::from_array(observed.proxy);
        let presses = -displacement.dot(normal);
        // A HIP in the surface does not press, so friction does not act.
        if presses < PRESSES.start {
            return Ok(());
        }
        let pulls = (displacement - normal * displacement.dot(normal)).length();
        let trails = f64::from(friction.viscous_s) * RATE_HZ * moved;
        let held = f64::from(friction.dynamic_mu) * presses + trails;
        self.counts.sliding += 1;
        // Heights of a slope and positions are rounded.
        let times = 1.0 + f64::from(friction.dynamic_mu + friction.viscous_s * RATE_HZ as f32);
        let place =
            observed.allowed_in_space(self.position_oracle.terrain) * (1.0 + east.hypot(north));
        let uncertainty = f64::from(max.viscous_s - friction.viscous_s) * RATE_HZ * moved;
        let allowed = uncertainty
            + 1e-3 * held
            + SLACK * trails
            + 3e-4 * displacement.length()
            + 8.0 * times * place;
        if (pulls - held).abs() > allowed {
            let detail = format!("pulled by {pulls}, {held} is held by {friction:?}: {observed:?}");
            return self.fail(Invariant::Slides, detail);
        }
        Ok(())
    }
}
