//! Chart frames: axes with titles, ticks and a quiet grid.

use plotters::chart::{ChartBuilder, ChartContext, MeshStyle};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingArea;
use plotters::style::TRANSPARENT;
use std::ops::Range;

use super::canvas::{Pen, PictureError};
use super::style::{self, px, stroke};

/// A part of the sheet.
pub type Area<'a> = DrawingArea<Pen<'a>, Shift>;
/// A chart, with linear axes unless said otherwise.
pub type Chart<'a, X = RangedCoordf64, Y = RangedCoordf64> =
    ChartContext<'a, Pen<'a>, Cartesian2d<X, Y>>;

/// Room left of a chart for its labels, finished pixels.
pub const LEFT_PX: i32 = 80;
/// Room below a chart for its labels, finished pixels.
pub const BELOW_PX: i32 = 52;

/// What to write along the axes.
#[derive(Clone, Copy, Debug)]
pub struct Titles<'a> {
    /// Along x, with its unit; empty leaves the x axis without any text.
    pub x: &'a str,
    /// Along y, with its unit.
    pub y: &'a str,
}

/// A chart that fills an area, axes drawn, ready for its curves. Ranges may be
/// linear or any other `plotters` range of numbers, such as `(1..9).log_scale()`.
///
/// # Errors
/// [`PictureError::Layout`] if the area has no room.
pub fn chart<'a, X, Y>(
    area: &Area<'a>,
    x: X,
    y: Y,
    titles: Titles<'_>,
) -> Result<Chart<'a, X::CoordDescType, Y::CoordDescType>, PictureError>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let below = if titles.x.is_empty() { 0 } else { px(BELOW_PX) };
    let mut chart = ChartBuilder::on(area)
        .set_left_and_bottom_label_area_size(px(LEFT_PX))
        .x_label_area_size(below)
        .build_cartesian_2d(x, y)?;
    let label = style::text(18, &style::SOFT_INK);
    let title = style::text(20, &style::INK);
    let grid = stroke(&style::GRID, 1.0);
    let frame = stroke(&style::SOFT_INK, 1.0);
    let mut mesh: MeshStyle<'_, '_, _, _, _> = chart.configure_mesh();
    mesh.bold_line_style(grid)
        .light_line_style(TRANSPARENT)
        .axis_style(frame)
        .label_style(label)
        .axis_desc_style(title)
        .set_all_tick_mark_size(px(5))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_desc(titles.x)
        .y_desc(titles.y)
        .draw()?;
    Ok(chart)
}

/// A number as a person writes it on an axis: no more decimals than it has,
/// powers of ten past a million and below a ten-thousandth.
#[must_use]
pub fn number(value: &f64) -> String {
    let size = value.abs();
    // Ticks are sums of steps: what is left at zero is rounding.
    if size > 1e-13 && !(1e-4..1e6).contains(&size) {
        return format!("{value:e}");
    }
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    // A true minus sign, and no "-0".
    match text.strip_prefix('-') {
        Some("0") => "0".to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text.to_owned(),
    }
}

/// A range that shows all finite values with some air around, never empty.
#[must_use]
pub fn spread(values: impl Iterator<Item = f64>, air: f64) -> Range<f64> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::MAX, f64::MIN), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    if low > high {
        return 0.0..1.0;
    }
    let room = ((high - low) * air).max(high.abs().max(1.0) * 1e-3);
    (low - room)..(high + room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_written_by_hand() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (2.0, "2"),
            (-0.5, "−0.5"),
            (1.4e-16, "0"),
            (0.30000000000000004, "0.3"),
            (12500.0, "12500"),
            (2e6, "2e6"),
            (1e-6, "1e-6"),
        ];
        for (value, text) in cases {
            assert_eq!(number(&value), text);
        }
    }

    #[test]
    fn a_range_is_never_empty() {
        assert_eq!(spread([].into_iter(), 0.1), 0.0..1.0);
        let flat = spread([3.0, 3.0].into_iter(), 0.1);
        assert!(flat.start < 3.0 && flat.end > 3.0);
        assert_eq!(spread([0.0, f64::NAN, 10.0].into_iter(), 0.1), -1.0..11.0);
    }
}
