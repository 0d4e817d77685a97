//! Chart frames: axes with titles, ticks and a pale grid.

use plotters::chart::{ChartBuilder, ChartContext, MeshStyle};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingArea;
use plotters::element::Text;
use plotters::style::{TRANSPARENT, TextStyle};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

use super::canvas::{Pen, PictureError};
use super::style::{self, px, stroke};

/// An area of the sheet.
pub type Area<'a> = DrawingArea<Pen<'a>, Shift>;
/// A chart, with linear axes by default.
pub type Chart<'a, X = RangedCoordf64, Y = RangedCoordf64> =
    ChartContext<'a, Pen<'a>, Cartesian2d<X, Y>>;

/// Width of the labels left of a chart, finished pixels.
pub const LEFT_PX: i32 = 80;
/// Height of the labels below a chart, finished pixels.
pub const BELOW_PX: i32 = 52;

/// Titles of the axes.
#[derive(Clone, Copy, Debug)]
pub struct Titles<'a> {
    /// Title of the x axis, with its unit; an empty one leaves the axis without text.
    pub x: &'a str,
    /// Title of the y axis, with its unit.
    pub y: &'a str,
}

/// Creates a chart that fills an area, with axes, ready for its curves. Ranges may be linear or any
/// other `plotters` range of numbers, such as `(1..9).log_scale()`.
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

/// Writes a line of text, vertically centred on `at`, with its `side` there.
///
/// # Errors
/// As `plotters`.
pub fn write(
    area: &Area<'_>,
    text: &str,
    at: (i32, i32),
    style: TextStyle<'_>,
    side: HPos,
) -> Result<(), PictureError> {
    let style = style.pos(Pos::new(side, VPos::Center));
    Ok(area.draw(&Text::new(text.to_owned(), at, style))?)
}

/// Formats a number for an axis: at most six digits, and powers of ten from a million on and below
/// a ten-thousandth.
#[must_use]
pub fn number(value: &f64) -> String {
    let size = value.abs();
    // Ticks are sums of steps: a remainder near zero is rounding.
    if size < 1e-13 {
        return "0".to_owned();
    }
    // A true minus sign.
    let sign = if *value < 0.0 { "−" } else { "" };
    let scientific = format!("{size:.5e}");
    let (mantissa, power) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    if (-4..6).contains(&power) {
        let decimals = usize::try_from(5 - power).unwrap_or(0);
        return format!("{sign}{}", bare(&format!("{size:.decimals$}")));
    }
    let power = power.to_string().replace('-', "−");
    format!("{sign}{}e{power}", bare(mantissa))
}

/// Returns the digits without trailing zeros.
fn bare(digits: &str) -> &str {
    if digits.contains('.') {
        digits.trim_end_matches('0').trim_end_matches('.')
    } else {
        digits
    }
}

/// Returns a range that contains all finite values with a margin; it is never empty.
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
    fn axis_numbers_have_no_superfluous_digits() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (2.0, "2"),
            (-0.5, "−0.5"),
            (1.4e-16, "0"),
            (0.30000000000000004, "0.3"),
            (12500.0, "12500"),
            (0.0005, "0.0005"),
            (2e6, "2e6"),
            (1e-6, "1e−6"),
            (-9.999999999999999e-5, "−0.0001"),
            (1e-23, "0"),
            (1e12, "1e12"),
        ];
        for (value, text) in cases {
            assert_eq!(number(&value), text);
        }
    }

    /// Test of a picture of run time against error.
    #[test]
    fn logarithmic_axes_accept_points_and_lines() {
        use plotters::prelude::*;
        let mut canvas = super::super::Canvas::new(800, 600);
        let sheet = canvas.pen().into_drawing_area();
        let titles = Titles {
            x: "time (ns)",
            y: "error (cells)",
        };
        let ranges = ((1.0..1e4).log_scale(), (1e-8..1.0).log_scale());
        let mut chart = chart(&sheet, ranges.0, ranges.1, titles).expect("room");
        let line = vec![(10.0, 1e-6), (1e3, 1e-2)];
        let style = style::stroke(&style::SERIES[2], 2.0);
        super::super::line::draw(&mut chart, &[line], style).expect("drawn");
        let dot = Circle::new((10.0, 1e-6), px(6), style::SERIES[1].filled());
        chart.draw_series([dot]).expect("drawn");
        drop((chart, sheet));
        let rgb = canvas.to_rgb();
        let RGBColor(r, g, b) = style::SERIES[1];
        assert!(rgb.as_chunks::<3>().0.contains(&[r, g, b]));
    }

    #[test]
    fn range_is_never_empty() {
        assert_eq!(spread([].into_iter(), 0.1), 0.0..1.0);
        let flat = spread([3.0, 3.0].into_iter(), 0.1);
        assert!(flat.start < 3.0 && flat.end > 3.0);
        assert_eq!(spread([0.0, f64::NAN, 10.0].into_iter(), 0.1), -1.0..11.0);
    }
}
