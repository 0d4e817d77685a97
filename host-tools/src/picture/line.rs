//! Curves with more points than pixels, reduced before they are drawn: the work is bounded and no
//! peak is lost.

use plotters::coord::ranged1d::Ranged;
use plotters::element::PathElement;
use plotters::style::ShapeStyle;

use super::axes::Chart;
use super::canvas::PictureError;

/// Draws polylines.
///
/// # Errors
/// As `plotters`.
pub fn draw<X, Y>(
    chart: &mut Chart<'_, X, Y>,
    pieces: &[Vec<(f64, f64)>],
    style: impl Into<ShapeStyle>,
) -> Result<(), PictureError>
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    let style = style.into();
    chart.draw_series(
        pieces
            .iter()
            .map(|points| PathElement::new(points.clone(), style)),
    )?;
    Ok(())
}

/// Reduces a curve over x (rising) to polylines of at most four points in each of `columns` equal
/// parts of the range: first, lowest, highest and last. A missing value makes a gap.
pub fn curve(
    points: impl Iterator<Item = (f64, Option<f64>)>,
    range: &std::ops::Range<f64>,
    columns: u32,
) -> Vec<Vec<(f64, f64)>> {
    let scale = f64::from(columns) / (range.end - range.start);
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut piece: Vec<(f64, f64)> = Vec::new();
    let mut bin: Vec<(f64, f64)> = Vec::new();
    let mut bin_index = None;
    for (x, y) in points {
        let index = y.map(|_| ((x - range.start) * scale) as i64);
        if index != bin_index {
            flush(&mut bin, &mut piece);
            bin_index = index;
        }
        match y {
            Some(y) => bin.push((x, y)),
            None => pieces.extend(finish_line(&mut piece)),
        }
    }
    flush(&mut bin, &mut piece);
    pieces.extend(finish_line(&mut piece));
    pieces
}

/// Reduces a path on a map: removes the points nearer than `step` to the last kept one. A missing
/// point makes a gap.
pub fn path(points: impl Iterator<Item = Option<(f64, f64)>>, step: f64) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<(f64, f64)> = Vec::new();
    for point in points {
        match (point, piece.last()) {
            (None, _) => pieces.extend(finish_line(&mut piece)),
            (Some(p), Some(last)) if (p.0 - last.0).hypot(p.1 - last.1) < step => {}
            (Some(p), _) => piece.push(p),
        }
    }
    pieces.extend(finish_line(&mut piece));
    pieces
}

/// Returns the runs of `true` over x, as ranges, joined if the gap is below `gap`.
pub fn runs(points: impl Iterator<Item = (f64, bool)>, gap: f64) -> Vec<(f64, f64)> {
    let mut runs: Vec<(f64, f64)> = Vec::new();
    for (x, _) in points.filter(|(_, on)| *on) {
        match runs.last_mut() {
            Some((_, end)) if x - *end <= gap => *end = x,
            _ => runs.push((x, x)),
        }
    }
    runs
}

/// Returns a segment as a line, and a single point as a dot.
fn finish_line(piece: &mut Vec<(f64, f64)>) -> Option<Vec<(f64, f64)>> {
    let mut piece = std::mem::take(piece);
    if let [only] = piece[..] {
        piece.push(only);
    }
    (!piece.is_empty()).then_some(piece)
}

fn flush(bin: &mut Vec<(f64, f64)>, piece: &mut Vec<(f64, f64)>) {
    if bin.len() > 4 {
        let by_height = |a: &usize, b: &usize| bin[*a].1.total_cmp(&bin[*b].1);
        let low = (0..bin.len()).min_by(by_height).unwrap_or(0);
        let high = (0..bin.len()).max_by(by_height).unwrap_or(0);
        let mut keep = [0, low.min(high), low.max(high), bin.len() - 1];
        keep.sort_unstable();
        piece.extend(keep.map(|i| bin[i]));
    } else {
        piece.append(bin);
    }
    bin.clear();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_spike_survives_thinning() {
        let points = (0..100_000).map(|i| {
            let y = if i == 77_123 { 9.0 } else { 0.0 };
            (f64::from(i), Some(y))
        });
        let pieces = curve(points, &(0.0..100_000.0), 500);
        assert_eq!(pieces.len(), 1);
        assert!(pieces[0].len() <= 2000);
        assert!(pieces[0].contains(&(77_123.0, 9.0)));
        assert!(pieces[0].windows(2).all(|w| w[0].0 <= w[1].0));
    }

    #[test]
    fn missing_values_make_gaps() {
        let points = [1.0, f64::NAN, 2.0, 3.0]
            .into_iter()
            .enumerate()
            .map(|(i, y)| (i as f64, y.is_finite().then_some(y)));
        let pieces = curve(points, &(0.0..4.0), 4);
        assert_eq!(pieces, [vec![(0.0, 1.0); 2], vec![(2.0, 2.0), (3.0, 3.0)]]);
        let gaps = path(
            [Some((0., 0.)), Some((9., 0.)), None, Some((1., 1.))].into_iter(),
            1.0,
        );
        assert_eq!(gaps.len(), 2);
    }

    #[test]
    fn runs_join_over_short_gaps() {
        let on = [true, true, false, true, false, false, false, true];
        let points = on.into_iter().enumerate().map(|(i, on)| (i as f64, on));
        assert_eq!(runs(points, 2.0), [(0.0, 3.0), (7.0, 7.0)]);
    }
}
