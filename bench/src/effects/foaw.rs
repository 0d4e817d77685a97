//! First-order adaptive windowing with the best-fit slope, in f64, as in the paper (Janabi-Sharifi,
//! Hayward and Chen 2000): each length of the window is tried with all its readings.

/// Longest window: readings before the newest.
const WINDOW: usize = 15;
/// Error of two readings together, counts.
const NOISE_COUNTS: f64 = 1.0;
/// Tolerance of the bound for a slope, by rounding.
const TIE: f64 = 1e-5;

/// Returns the rates of change from readings, newest last, in counts a reading: with ties accepted,
/// and with ties rejected.
pub(super) fn slopes(readings: &[f64]) -> [f64; 2] {
    [TIE, -TIE].map(|tie| slope(readings, NOISE_COUNTS + tie))
}

fn slope(readings: &[f64], noise: f64) -> f64 {
    let newest = readings.len() - 1;
    let max_length = newest.min(WINDOW);
    let tried = (1..=max_length).map_while(|length| {
        let window = &readings[newest - length..];
        let (low, high) = slope_range(window, noise);
        (low <= high).then(|| best_fit(window).clamp(low, high))
    });
    tried.last().unwrap_or(0.0)
}

/// Returns the range of slopes through the newest reading that fit all readings within the noise.
fn slope_range(window: &[f64], noise: f64) -> (f64, f64) {
    let newest = window[window.len() - 1];
    let age = window.iter().rev().enumerate().skip(1);
    age.fold((f64::MIN, f64::MAX), |(low, high), (age, reading)| {
        let (rise, age) = (newest - reading, age as f64);
        (
            low.max((rise - noise) / age),
            high.min((rise + noise) / age),
        )
    })
}

/// Returns the slope of the least-squares line.
fn best_fit(window: &[f64]) -> f64 {
    let middle = 0.5 * (window.len() - 1) as f64;
    let mean = window.iter().sum::<f64>() / window.len() as f64;
    let offset = |i: usize| i as f64 - middle;
    let sum = |of: &dyn Fn(usize) -> f64| (0..window.len()).map(of).sum::<f64>();
    sum(&|i| offset(i) * (window[i] - mean)) / sum(&|i| offset(i) * offset(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foaw_fits_steady_motion_and_shortens_window_on_jerk() {
        let even: Vec<f64> = (0..20).map(|i| (0.3 * f64::from(i)).round()).collect();
        for slope in slopes(&even) {
            assert!((slope - 0.3).abs() < 0.11, "{slope}");
        }
        let jerk: Vec<f64> = (0..20).map(|i| f64::from((i - 17).max(0) * 10)).collect();
        assert_eq!(slopes(&jerk).map(f64::round), [10.0; 2]);
        assert_eq!(slopes(&[4.0]), [0.0; 2]);
    }
}
