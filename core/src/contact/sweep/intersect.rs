//! The first crossing of a straight line from above a patch to below it.

/// Returns the first root of the height gap along a segment, as a fraction of it, from the gap's
/// Bernstein coefficients: at the start, blossom, at the end.
///
/// The gap is surface minus line: negative while the line is above. The start must be above or on
/// the surface; a start that is not above is a crossing at 0. Nothing cancels and nothing is
/// divided by the twist: flat, sloped and twisted patches are one case (Kahan's form of the
/// quadratic), and a segment that stays clear is recognised without a root.
#[must_use]
#[inline]
pub fn first_crossing(start: f32, middle: f32, end: f32) -> Option<f32> {
    if start >= 0.0 {
        return Some(0.0);
    }
    if end < 0.0 {
        if middle <= 0.0 {
            return None;
        }
        let d = middle * middle - start * end;
        // Both roots are in the segment; the first one touches from above.
        return (d >= 0.0).then(|| start / (start - (middle + libm::sqrtf(d))));
    }
    let root = libm::sqrtf(middle * middle - start * end);
    Some(if middle >= 0.0 {
        start / (start - (middle + root))
    } else {
        let t = root - middle;
        t / (t + end)
    })
}

/// Does the same as [`first_crossing`], for a line that starts *on* the surface and leaves it
/// upward: the start is no crossing. Returns `None` also if the line does not leave.
#[must_use]
#[inline]
pub fn next_crossing(middle: f32, end: f32) -> Option<f32> {
    // 2·middle·(1−s) + end·s = 0
    (middle < 0.0 && end >= 0.0).then(|| 2.0 * middle / (2.0 * middle - end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;

    fn gap(f: (f64, f64, f64), s: f64) -> f64 {
        f.0 * (1.0 - s) * (1.0 - s) + 2.0 * f.1 * s * (1.0 - s) + f.2 * s * s
    }

    #[test]
    fn first_crossing_agrees_with_a_dense_search() {
        const POINTS: u32 = cases(4000, 50);
        let points = f64::from(POINTS);
        let values = [-3.0, -0.7, -1e-3, -1e-20, 0.0, 1e-20, 1e-3, 0.4, 2.0];
        for start in values.into_iter().filter(|v| *v < 0.0) {
            for middle in values {
                for end in values {
                    let f = (f64::from(start), f64::from(middle), f64::from(end));
                    let dense = (0..=POINTS).find(|i| gap(f, f64::from(*i) / points) >= 0.0);
                    match (first_crossing(start, middle, end), dense) {
                        (Some(s), Some(i)) => {
                            let (s, i) = (f64::from(s), f64::from(i) / points);
                            assert!(
                                s <= i + 1e-6 && s >= i - 1.0 / points - 1e-6,
                                "{f:?} {s} {i}"
                            );
                        }
                        // A graze between two samples of the dense search.
                        (Some(s), None) => assert!(gap(f, f64::from(s)).abs() < 1e-6, "{f:?} {s}"),
                        (None, Some(i)) => panic!("missed {f:?} at {i}/{POINTS}"),
                        (None, None) => {}
                    }
                }
            }
        }
    }

    #[test]
    fn first_crossing_is_exact_on_flat_patches() {
        // Straight descent: the gap is linear, D is a perfect square.
        let s = first_crossing(-0.1, 0.1, 0.3).unwrap();
        assert!((s - 0.25).abs() < 1e-7);
    }

    #[test]
    fn next_crossing_exists_only_if_the_line_leaves_and_returns() {
        assert_eq!(next_crossing(-0.5, -1.0), None);
        assert_eq!(next_crossing(0.5, 1.0), None);
        let s = next_crossing(-0.5, 1.0).unwrap();
        assert!((s - 0.5).abs() < 1e-7);
    }
}
