//! Run time against error, every variant a point.

use std::path::Path;

use hapterra::picture::axes::{self, Area, Chart, Titles};
use hapterra::picture::style::{self, SERIES, px};
use hapterra::picture::{Canvas, PictureError};
use plotters::coord::combinators::{IntoLogRange, LogCoord};
use plotters::drawing::IntoDrawingArea;
use plotters::element::{Circle, EmptyElement, Text};
use plotters::style::{Color, RGBColor};
use plotters_backend::text_anchor::{HPos, Pos, VPos};

use crate::compare::{Family, Row};
use crate::stats::quantiles;

/// Errors below this are drawn here: nothing finer can be felt or told apart.
const FLOOR: f64 = 1e-9;
/// Distance between labels, finished pixels.
const LABEL_PX: i32 = 20;

/// Draws one panel for each path on which something is felt. Small points are
/// terrains, the large one with the name their median.
///
/// # Errors
/// When the picture cannot be laid out or written.
pub fn draw(rows: &[Row], file: &Path) -> Result<(), PictureError> {
    let panels = ["slide 0.01", "slide 0.5", "tapping", "random"];
    let mut canvas = Canvas::new(1900, 1300);
    {
        let sheet = canvas.pen().into_drawing_area();
        let (title, charts) = sheet.split_vertically(px(60));
        let font = style::bold(28, &style::INK).pos(Pos::new(HPos::Left, VPos::Center));
        let text = "Run time against error: lower left is better";
        title.draw(&Text::new(text, (px(24), px(34)), font))?;
        for (area, path) in charts.split_evenly((2, 2)).iter().zip(panels) {
            let points = points(rows, path);
            panel(&area.margin(px(10), px(10), px(10), px(24)), path, &points)?;
        }
    }
    canvas.save(file)
}

/// A variant: its terrains as (ns, cells).
struct Points<'a> {
    name: &'a str,
    family: Family,
    all: Vec<(f64, f64)>,
}

impl Points<'_> {
    fn middle(&self) -> (f64, f64) {
        let median = |values: Vec<f64>| quantiles(values, [0.5])[0];
        (
            median(self.all.iter().map(|p| p.0).collect()),
            median(self.all.iter().map(|p| p.1).collect()),
        )
    }
}

fn points<'a>(rows: &'a [Row], path: &str) -> Vec<Points<'a>> {
    let mut points: Vec<Points<'a>> = Vec::new();
    for row in rows.iter().filter(|row| row.path == path) {
        let Some(error) = row.error else { continue };
        let at = (row.ns[1], error.p99.max(FLOOR));
        match points.iter_mut().find(|p| p.name == row.label.name) {
            Some(known) => known.all.push(at),
            None => points.push(Points {
                name: row.label.name,
                family: row.label.family,
                all: vec![at],
            }),
        }
    }
    points
}

type Logarithmic = LogCoord<f64>;

fn panel(area: &Area<'_>, path: &str, points: &[Points<'_>]) -> Result<(), PictureError> {
    let all = || points.iter().flat_map(|p| &p.all);
    let decades = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        10_f64.powf(low.log10().floor())..10_f64.powf(high.log10().ceil())
    };
    if all().next().is_none() {
        return Ok(());
    }
    let mut ns = decades(&mut all().map(|p| p.0));
    // Room for the names.
    ns.end *= 3.0;
    let cells = decades(&mut all().map(|p| p.1));
    let x = format!("{path}: median time for a tick (ns)");
    let titles = Titles {
        x: &x,
        y: "error, 99 % below (cells)",
    };
    let mut chart = axes::chart(area, ns.log_scale(), cells.log_scale(), titles)?;
    let mut taken: Vec<(i32, i32)> = Vec::new();
    for own in points {
        let color = color(own.family);
        let small = own
            .all
            .iter()
            .map(|at| Circle::new(*at, px(3), color.mix(0.45).filled()));
        chart.draw_series(small)?;
        name(&mut chart, own, &color, &mut taken)?;
    }
    Ok(())
}

/// The large point and the name beside it, moved down or up to where no other is.
fn name(
    chart: &mut Chart<'_, Logarithmic, Logarithmic>,
    own: &Points<'_>,
    color: &RGBColor,
    taken: &mut Vec<(i32, i32)>,
) -> Result<(), PictureError> {
    let middle = own.middle();
    let (x, y) = chart.backend_coord(&middle);
    let is_free = |shift: i32| {
        let near = |(other_x, other_y): &(i32, i32)| {
            (other_x - x).abs() < px(220) && (other_y - (y + shift)).abs() < px(LABEL_PX)
        };
        !taken.iter().any(near)
    };
    let shifts = (0..40).flat_map(|i| [i * px(5), -i * px(5)]);
    let shift = shifts
        .into_iter()
        .find(|shift| is_free(*shift))
        .unwrap_or(0);
    taken.push((x, y + shift));
    let weight = if own.family == Family::Ours {
        style::bold(17, color)
    } else {
        style::text(17, color)
    };
    let font = weight.pos(Pos::new(HPos::Left, VPos::Center));
    let mark = EmptyElement::at(middle)
        + Circle::new((0, 0), px(7), color.filled())
        + Text::new(own.name.to_owned(), (px(13), shift), font);
    chart.draw_series([mark])?;
    Ok(())
}

fn color(family: Family) -> RGBColor {
    match family {
        Family::Ours => SERIES[1],
        Family::Paper => SERIES[0],
        Family::Triangles => SERIES[2],
        Family::Bound => SERIES[5],
    }
}
