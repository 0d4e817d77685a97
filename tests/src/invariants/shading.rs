//! The force with shading.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use super::Invariant;
use super::observed_tick::ObservedTick;
use super::oracle::{TickOracle, Verdict};
use super::surface::Patch;
use crate::scene::terrain::Terrain;

/// Tolerance of the length, as a fraction.
const LENGTH: f64 = 1e-5;
/// Shorter displacements have no reliable direction, cells.
const SHORT: f64 = 1e-2;
/// Rounding of a direction, rad.
const ANGLE: f64 = 1e-3;
/// Distance from a border of patches, cells, within which the proxy may be on it.
const BORDER: f64 = 1e-5;
/// Largest angle by which a force is turned, rad.
const MAX_TURN: f64 = 60.0 / 45.0 * FRAC_PI_4;
/// Bends up to which the direction changes along a whole edge, and from which along a fifth.
const GENTLE: f64 = FRAC_PI_4;
const SHARP: f64 = 75.0 / 45.0 * FRAC_PI_4;

impl TickOracle<'_> {
    /// Checks the length, and without friction the direction inside a patch.
    pub(super) fn check_shading(&self, observed: &ObservedTick) -> Verdict {
        let Some(shaded) = observed.shaded else {
            return Ok(());
        };
        let is_whole = shaded.is_whole;
        let shaded = shaded.displacement.as_dvec3();
        let plain = observed.output.displacement.as_dvec3();
        let off = (shaded.length() - plain.length()).abs();
        let is_long_enough = off <= LENGTH * plain.length() + 1e-30;
        if !is_long_enough {
            return self.fail(Invariant::Shading, format!("{shaded} of {plain}"));
        }
        let [x, y, _] = observed.proxy;
        let inside = |c: f64| (BORDER..1.0 - BORDER).contains(&(c - c.floor()));
        let is_reported = is_whole
            && observed.is_touching()
            && observed.output.converged
            && plain.length() > SHORT;
        if !is_reported || !inside(x) || !inside(y) || !self.friction.is_none() {
            return Ok(());
        }
        let Some(smoothed) = smoothed_normal(self.terrain, [x, y]) else {
            return Ok(());
        };
        let Some(patch) = Patch::at(self.terrain, [x.floor() as i32, y.floor() as i32]) else {
            return Ok(());
        };
        let [east, north] = patch.slopes(x, y);
        let normal = DVec3::new(-east, -north, 1.0);
        // Without shading the force already deviates from its normal by this much.
        let allowed = ANGLE + angle(plain, normal);
        let expected = angle(normal, smoothed).min(MAX_TURN);
        let left = (angle(normal, smoothed) - expected).max(0.0);
        let off = angle(shaded, smoothed);
        if (off - left).abs() > allowed || shaded.dot(normal) < 0.0 {
            let detail =
                format!("{shaded} is {off} rad from {smoothed}, {left} wanted: {observed:?}");
            return self.fail(Invariant::Shading, detail);
        }
        Ok(())
    }
}

/// Returns the angle between two vectors, rad.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// Returns the normal from the samples around; `None` next to no-data or the border, or if a step
/// is so high that rounding decides.
fn smoothed_normal(terrain: &Terrain, [x, y]: [f64; 2]) -> Option<DVec3> {
    let (col, row) = (x.floor() as i32, y.floor() as i32);
    let (u, v) = (x - x.floor(), y - y.floor());
    let line = |at: fn(i32, i32) -> [i32; 2], across: i32, place: f64| {
        let post = |along: i32| {
            let [east, north] = at(along, across);
            f64::from(terrain.post(col + east, row + north))
        };
        smoothed_slope([-1, 0, 1, 2].map(post), place)
    };
    let eastward = |across| line(|along, across| [along, across], across, u);
    let northward = |across| line(|along, across| [across, along], across, v);
    let east = eastward(0)? * (1.0 - v) + eastward(1)? * v;
    let north = northward(0)? * (1.0 - u) + northward(1)? * u;
    Some(DVec3::new(-east, -north, 1.0))
}

/// Returns the slope at a point between the middle two of four samples.
fn smoothed_slope(posts: [f64; 4], place: f64) -> Option<f64> {
    let angle = |i: usize| (posts[i + 1] - posts[i]).atan();
    let [before, own, after] = [angle(0), angle(1), angle(2)];
    if !(before + own + after).is_finite() || posts.iter().any(|post| post.abs() > 1e4) {
        return None;
    }
    let reach = |bend: f64| {
        let part = (bend.cos() - SHARP.cos()) / (GENTLE.cos() - SHARP.cos());
        0.2 + 0.8 * part.clamp(0.0, 1.0)
    };
    // Directions are blended, not angles.
    let part = |bend: f64, away: f64| 0.5 * (1.0 - away / reach(bend)).max(0.0);
    let (first, last) = (part(before - own, place), part(after - own, 1.0 - place));
    let mix = |of: fn(f64) -> f64| {
        of(own) + first * (of(before) - of(own)) + last * (of(after) - of(own))
    };
    Some(mix(f64::sin) / mix(f64::cos))
}
