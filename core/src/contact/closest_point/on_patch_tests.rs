//! The search in one patch against bisection in f64.

use super::super::MAX_EVALUATIONS;
use super::*;
use crate::cases::cases;
use crate::contact::test_random::Random;

/// F′(v)/2 and the point of the ruling at `v`, in f64, for coefficients rounded to f32.
fn ruling64(patch: &Patch, hip: (f64, f64), v: f64) -> (f64, f64) {
    let [a, b, c, d] = [patch.a, patch.b[0], patch.c[0], patch.corners[0]].map(f64::from);
    let m = b + a * v;
    let free_z = (d + b * hip.0 + (c + a * hip.0) * v) / (1.0 + m * m);
    let free_u = hip.0 - m * free_z;
    let u = free_u.clamp(0.0, 1.0);
    let z = if u == free_u {
        free_z
    } else {
        d + b * u + (c + a * u) * v
    };
    (u, (v - hip.1) + z * (c + a * u))
}

fn height64(patch: &Patch, at: &Nearest) -> f64 {
    let [sw, se, nw, ne] = patch.corners.map(f64::from);
    let (u, v) = (f64::from(at.u), f64::from(at.v));
    (sw * (1.0 - u) + se * u) * (1.0 - v) + (nw * (1.0 - u) + ne * u) * v
}

/// The local minimum of F that lies downhill of `from`, in f64.
fn minimum64(patch: &Patch, hip: (f64, f64), from: f64) -> (f64, f64) {
    let slope = |v: f64| ruling64(patch, hip, v).1;
    let direction = if slope(from) < 0.0 { 1.0 } else { -1.0 };
    let (mut low, mut step) = (from, 1e-10);
    let mut high = loop {
        let next = (low + direction * step).clamp(0.0, 1.0);
        if slope(next) * direction >= 0.0 || next == 0.0 || next == 1.0 {
            break next;
        }
        (low, step) = (next, 2.0 * step);
    };
    if slope(high) * direction > 0.0 {
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if slope(middle) * direction < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
    }
    (ruling64(patch, hip, high).0, high)
}

/// Returns the curvature of F at its minimum: the error of a flat minimum is the
/// rounding of F′ over this.
fn conditioning(patch: &Patch, hip: (f64, f64), v: f64) -> f64 {
    let h = 1e-5;
    if v < h || v > 1.0 - h {
        return 1.0;
    }
    let slope = |v: f64| ruling64(patch, hip, v).1;
    ((slope(v + h) - slope(v - h)) / (2.0 * h)).abs().min(1.0)
}

struct Errors {
    /// Queries with an error of more than 2e-6 cell, conditioning included.
    off: u32,
    worst: f64,
    mean_evaluations: f64,
    max_evaluations: u32,
}

/// Random patches of a slope, HIPs at a depth below them, random starts.
fn survey(slope: f64, depth: f64, twist: f64) -> Errors {
    const QUERIES: u32 = cases(4000, 1);
    let mut random = Random(0x5EED);
    let (mut wrong, mut worst, mut total, mut max_evaluations) = (0, 0.0_f64, 0_u64, 0);
    for _ in 0..QUERIES {
        let flat = [0, 1, 2].map(|_| slope * random.between(-1.0, 1.0));
        let last = flat[1] + flat[2] - flat[0] + twist * random.between(-1.0, 1.0);
        let corners = [flat[0], flat[1], flat[2], last].map(|h| h as f32);
        let above = Patch::new(corners);
        let (u, v) = (random.unit() as f32, random.unit() as f32);
        let down = above.normal(u, v).normalize() * depth as f32;
        let hip = (u - down.x, v - down.y);
        let hip_z = above.height(u, v) - down.z;
        let patch = Patch::new(corners.map(|h| h - hip_z));
        let start = (random.unit() as f32, random.unit() as f32);
        let found = nearest_downhill(&patch, hip, start);
        total += u64::from(found.evaluations);
        max_evaluations = max_evaluations.max(found.evaluations);
        let hip = (f64::from(hip.0), f64::from(hip.1));
        let truth = minimum64(&patch, hip, f64::from(found.v));
        let error = (f64::from(found.u) - truth.0).hypot(f64::from(found.v) - truth.1);
        // Even close to an edge, the height is the surface's at that place.
        let off = (f64::from(found.z) - height64(&patch, &found)).abs();
        let steepness = f64::from(patch.slope_u(found.v)).hypot(f64::from(patch.slope_v(found.u)));
        let largest = patch
            .corners
            .iter()
            .fold(0.0_f32, |max, h| max.max(h.abs()));
        let rounding = 4.0 * f64::from(f32::EPSILON * largest);
        assert!(
            off < 1e-6 * steepness.hypot(1.0) + rounding,
            "{off:e}: {found:?}"
        );
        worst = worst.max(error);
        wrong += u32::from(error * conditioning(&patch, hip, truth.1) > 2e-6);
    }
    Errors {
        off: wrong,
        worst,
        mean_evaluations: total as f64 / f64::from(QUERIES),
        max_evaluations,
    }
}

#[test]
fn search_error_is_below_2e_6_cell_on_any_slope() {
    let slopes = [0.0, 0.1, 1.0, 10.0, 100.0, 1e3, 3e3];
    for slope in slopes.into_iter().step_by(cases(1, 3) as usize) {
        for depth in [1e-4, 0.01, 0.1, 1.0] {
            for twist in [0.0, 1e-9, slope, 3.0 * slope] {
                let errors = survey(slope, depth, twist);
                let at = std::format!("slope {slope} depth {depth} twist {twist}");
                // The few are HIPs at the centre of curvature of a steep patch, where f32 cannot
                // resolve the downhill direction.
                let few = if slope > 1.0 { 4 } else { 0 };
                assert!(errors.off <= few, "{} of 4000 off: {at}", errors.off);
                assert!(errors.worst < 1e-3, "{:e}: {at}", errors.worst);
                assert!(
                    errors.mean_evaluations < 12.0,
                    "{}: {at}",
                    errors.mean_evaluations
                );
                assert!(errors.max_evaluations <= MAX_EVALUATIONS, "{at}");
            }
        }
    }
}

#[test]
fn search_does_not_end_at_a_saddle() {
    // The HIP is under the middle of a strongly twisted patch: (½, ½) is stationary.
    let patch = Patch::new([4.0, -2.0, -2.0, 4.0].map(|h| h + 1.0));
    let found = nearest_downhill(&patch, (0.5, 0.5), (0.5, 0.5));
    assert!(
        (found.u - 0.5).abs() > 0.1 || (found.v - 0.5).abs() > 0.1,
        "{found:?}"
    );
    let at_saddle = patch.height(0.5, 0.5).powi(2);
    let distance_squared = (found.u - 0.5).powi(2) + (found.v - 0.5).powi(2) + found.z.powi(2);
    assert!(distance_squared < at_saddle);
}

#[test]
fn warm_start_takes_at_most_three_evaluations() {
    let patch = Patch::new([0.3, 0.1, 0.45, 0.35]);
    let first = nearest_downhill(&patch, (0.5, 0.5), (0.5, 0.5));
    let next = nearest_downhill(&patch, (0.51, 0.5), (first.u, first.v));
    assert!(next.evaluations <= 3, "{next:?}");
}

/// With a far HIP, the squared distance cannot decide which of two places is nearer, and on a steep
/// twist cancellation hides it as well.
#[test]
fn search_ends_at_minimum_despite_rounding_of_distances() {
    type PatchPoint = (f32, f32);
    let cases: [([f32; 4], PatchPoint, PatchPoint); 3] = [
        (
            [-14_186.715, 15_225.447, 11_851.875, -12_628.072],
            (0.482_250_2, 0.070_614_815),
            (1.0, 0.546_625_6),
        ),
        (
            [-234_027.72, 259_816.97, 264_532.16, -292_603.38],
            (63.794_304, 22.952_19),
            (0.458_400_9, 0.424_977_78),
        ),
        (
            [-89_562.125, 59_899.07, 115_499.164, -77_103.44],
            (-1_215.528_3, -26.418_83),
            (0.602_252_4, 0.561_781_17),
        ),
    ];
    for (corners, hip, start) in cases {
        let patch = Patch::new(corners);
        let found = nearest_downhill(&patch, hip, start);
        let far = f64::from(hip.0.abs().max(hip.1.abs()));
        let hip = (f64::from(hip.0), f64::from(hip.1));
        let truth = minimum64(&patch, hip, f64::from(found.v));
        let error = (f64::from(found.u) - truth.0).hypot(f64::from(found.v) - truth.1);
        let allowed = 2e-6_f64.max(4.0 * f64::from(f32::EPSILON) * (1.0 + far));
        assert!(error < allowed, "{error:e} of {allowed:e}: {found:?}");
    }
}
