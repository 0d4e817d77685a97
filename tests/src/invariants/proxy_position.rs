//! Invariants of the proxy's position.

use super::observed_tick::{ERROR, ObservedTick};
use super::oracle::{TickOracle, Verdict};
use super::surface::{Patch, distance, patches_at};
use super::{Invariant, descent};

/// Distance of the HIP from the surface, cells, beyond which all distances to points near the proxy
/// count as equal.
const FAR: f64 = 1e4;

/// An exact local closest point.
struct Minimum {
    at: [f64; 3],
    /// Distance of the proxy from it, cells.
    off: f64,
    /// Start of the descent to it, with its patch.
    start: [f64; 2],
    patch: Patch,
}

impl TickOracle<'_> {
    pub(super) fn check_on_surface(&mut self, observed: &ObservedTick) -> Verdict {
        let [x, y, z] = observed.proxy;
        let rounding = observed.rounding_of_corners(self.terrain);
        let off = patches_at(self.terrain, x, y).map(|patch| {
            let above = (z - patch.height(x, y)).abs();
            (above - rounding).max(0.0) / patch.slope(x, y).hypot(1.0)
        });
        let off = off.fold(f64::INFINITY, f64::min);
        if off > observed.allowed() {
            let detail = format!("by {off:.3e} of {:.3e}: {observed:?}", observed.allowed());
            return self.fail(Invariant::OnSurface, detail);
        }
        if observed.allowed() == ERROR {
            self.measured.off_surface = self.measured.off_surface.max(off);
        }
        Ok(())
    }

    pub(super) fn check_local_minimum(&mut self, observed: &ObservedTick) -> Verdict {
        let minima = self.minima(observed.proxy, observed.hip);
        let error = minima.first().map(|nearest| nearest.off);
        let Some(error) = error else {
            return Ok(()); // off the surface: reported before
        };
        self.measured.compared += 1;
        // Within the error bound of the HIP itself there is no force to check.
        if !(ERROR..=FAR).contains(&distance(observed.proxy, observed.hip)) {
            return Ok(());
        }
        let allowed = observed.allowed();
        if error <= allowed {
            if allowed == ERROR {
                self.measured.off_minimum = self.measured.off_minimum.max(error);
            }
            return Ok(());
        }
        self.measured.beyond += 1;
        // On a steep slope, rounding of the height decides which of two minima is nearer.
        let tie = error + observed.rounding_of_corners(self.terrain);
        let near = minima.iter().take_while(|minimum| minimum.off <= tie);
        let verdicts = near.map(|minimum| self.check_near_in_plane(observed, minimum));
        verdicts.reduce(Verdict::or).unwrap_or(Ok(()))
    }

    /// On steep ground a unit in the last place of a coordinate is a large height, so the bound
    /// applies in the plane. It includes the motion of the minimum due to rounding of the HIP and
    /// of the corner heights.
    fn check_near_in_plane(&self, observed: &ObservedTick, minimum: &Minimum) -> Verdict {
        let Minimum {
            at, start, patch, ..
        } = *minimum;
        let allowed = observed.allowed();
        let moved = |axis: usize, by: f64| {
            let mut hip = observed.hip;
            hip[axis] += by;
            level(descent::from(self.terrain, hip, start, patch).at, at)
        };
        let heights = patch.mixed_size(at[0], at[1], observed.hip[2]);
        let up = allowed.max(4.0 * f64::from(f32::EPSILON) * heights);
        let moves = [(0, allowed), (1, allowed), (2, up)]
            .into_iter()
            .flat_map(|(axis, by)| [moved(axis, by), moved(axis, -by)]);
        let condition = moves.fold(0.0, f64::max);
        let error = level(at, observed.proxy);
        if error > 4.0 * (allowed + condition) {
            let detail = format!(
                "{error:.3e} of {allowed:.3e} from {at:?}, truth moves {condition:.1e}: {observed:?}"
            );
            return self.fail(Invariant::LocalMinimum, detail);
        }
        Ok(())
    }

    /// Checks that no contact pulls on a HIP that is free to leave: from no point of the proxy may
    /// the straight line to it start above the ground.
    pub(super) fn check_hip_below(&self, observed: &ObservedTick) -> Verdict {
        let above = starts(observed.proxy).map(|start| self.height_along(observed, start));
        let above = above.fold(f64::INFINITY, |min, above| {
            // Over no-data there is no ground: the proxy is held at its edge.
            min.min(above.unwrap_or(f64::NEG_INFINITY))
        });
        if above > 4.0 * observed.allowed() {
            return self.fail(Invariant::HipBelow, format!("by {above:.3e}: {observed:?}"));
        }
        Ok(())
    }

    /// Returns the height of the HIP above the tangent plane of the patch into which the straight
    /// line from a point to it leads, or `None` if it leads into none.
    fn height_along(&self, observed: &ObservedTick, start: [f64; 2]) -> Option<f64> {
        let displacement = [0, 1, 2].map(|i| observed.hip[i] - observed.proxy[i]);
        let level = displacement[0].hypot(displacement[1]);
        let patches = patches_at(self.terrain, start[0], start[1]);
        let above = patches.filter(|patch| leads_into(start, displacement, patch));
        let above = above.map(|patch| {
            let [east, north] = patch.slopes(start[0], start[1]);
            // Rounding of the corner heights, and of the slope at a rounded position.
            let heights = patch.mixed_size(start[0], start[1], observed.hip[2]);
            let rounding = 4.0 * f64::from(f32::EPSILON) * heights;
            let unsure = rounding + 4.0 * ERROR * patch.twist().abs() * level;
            let above = displacement[2] - east * displacement[0] - north * displacement[1];
            (above - unsure) / east.hypot(north).hypot(1.0)
        });
        above.reduce(f64::min)
    }

    /// Returns the patches that contain the proxy to single precision, and its point in each.
    pub(super) fn nearby(&self, proxy: [f64; 3]) -> impl Iterator<Item = ([f64; 2], Patch)> + '_ {
        starts(proxy).flat_map(|start| {
            patches_at(self.terrain, start[0], start[1]).map(move |patch| (start, patch))
        })
    }

    /// Returns the exact closest points from the patches that contain the proxy to single
    /// precision, nearest first.
    fn minima(&self, proxy: [f64; 3], hip: [f64; 3]) -> Vec<Minimum> {
        let minimum = |(start, patch)| {
            let at = descent::from(self.terrain, hip, start, patch).at;
            let off = distance(at, proxy);
            Minimum {
                at,
                off,
                start,
                patch,
            }
        };
        let mut minima: Vec<_> = self.nearby(proxy).map(minimum).collect();
        minima.sort_by(|a, b| a.off.total_cmp(&b.off));
        minima
    }

    pub(super) fn check_above(
        &self,
        observed: &ObservedTick,
        before: Option<&ObservedTick>,
    ) -> Verdict {
        let [x, y, z] = observed.hip;
        // On a grid line the HIP is over the patch to the north-east.
        let Some(patch) = Patch::at(self.terrain, [x.floor() as i32, y.floor() as i32]) else {
            return Ok(());
        };
        let below = (patch.height(x, y) - z) / patch.slope(x, y).hypot(1.0);
        let before = before.map_or(z, |before| before.hip[2]);
        let fall = z.abs().max((z - before).abs());
        if below > ERROR.max(4.0 * f64::from(f32::EPSILON) * fall) {
            return self.fail(
                Invariant::AboveSurface,
                format!("by {below:.3e}: {observed:?}"),
            );
        }
        Ok(())
    }
}

/// Returns true if a direction at a point of a patch leads into the patch, or along its border.
fn leads_into(start: [f64; 2], displacement: [f64; 3], patch: &Patch) -> bool {
    (0..2).all(|axis| {
        let place = start[axis] - f64::from(patch.cell[axis]);
        (place > 0.0 || displacement[axis] >= 0.0) && (place < 1.0 || displacement[axis] <= 0.0)
    })
}

/// Returns the distance in the plane.
fn level(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Returns the points that equal the proxy to single precision.
fn starts(proxy: [f64; 3]) -> impl Iterator<Item = [f64; 2]> {
    let [xs, ys] = [sides(proxy[0]), sides(proxy[1])];
    xs.into_iter()
        .flat_map(move |x| ys.clone().into_iter().map(move |y| [x, y]))
}

/// Returns a coordinate, and the border of a patch if it equals it to single precision: from a
/// sharp ridge its two sides lead to different valleys.
fn sides(x: f64) -> Vec<f64> {
    const ROUNDING: f64 = 1e-6;
    let border = x.round();
    if x == border || (x - border).abs() > ROUNDING {
        return vec![x];
    }
    vec![x, border]
}
