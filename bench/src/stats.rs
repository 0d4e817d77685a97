//! Medians and shares, and the order of interleaved measurements.

/// Interleaves the measurements of `count` variants, beginning with another one each round. Returns
/// the results of each, round by round.
pub(crate) fn interleave(
    count: usize,
    rounds: usize,
    mut measure: impl FnMut(usize) -> f64,
) -> Vec<Vec<f64>> {
    let mut measured = vec![Vec::with_capacity(rounds); count];
    for round in 0..rounds {
        for turn in 0..count {
            let index = (turn + round) % count;
            let value = measure(index);
            measured[index].push(value);
        }
    }
    measured
}

/// Returns the quartiles of a measurement, and the median over the rounds of its ratio to another.
pub(crate) fn timing(own: &[f64], other: &[f64]) -> ([f64; 3], f64) {
    let ratios = own.iter().zip(other).map(|(own, other)| own / other);
    let [ratio] = quantiles(ratios.collect(), [0.5]);
    (quantiles(own.to_vec(), [0.25, 0.5, 0.75]), ratio)
}

/// Returns the share of true values.
pub(crate) fn part(of: impl Iterator<Item = bool>) -> f64 {
    let (mut yes, mut all) = (0_u32, 0_u32);
    for is in of {
        yes += u32::from(is);
        all += 1;
    }
    f64::from(yes) / f64::from(all.max(1))
}

/// Returns nearest-rank quantiles of at least one value.
pub(crate) fn quantiles<const N: usize>(mut values: Vec<f64>, at: [f64; N]) -> [f64; N] {
    values.sort_by(f64::total_cmp);
    at.map(|q| values[(q * (values.len() - 1) as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occurred() {
        let values = vec![5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!(quantiles(values, [0.0, 0.5, 1.0]), [1.0, 3.0, 5.0]);
    }

    #[test]
    fn variants_take_turns_at_being_first() {
        let mut order = Vec::new();
        let measured = interleave(3, 3, |index| {
            order.push(index);
            index as f64
        });
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1]);
        assert_eq!(measured, [vec![0.0; 3], vec![1.0; 3], vec![2.0; 3]]);
    }
}
