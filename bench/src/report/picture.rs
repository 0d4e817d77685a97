//! Run time against error, one point for each variant.

use std::path::Path;

use hapterra::picture::axes::{self, Area, Chart, Titles};
use hapterra::picture::style::{self, SERIES, px};
use hapterra::picture::{Canvas, PictureError};
use plotters::coord::combinators::{IntoLogRange, LogCoord};
use plotters::drawing::IntoDrawingArea;
use plotters::element::{Circle, EmptyElement, Text};
use plotters::style::{Color, RGBColor, TextStyle};
use plotters_backend::text_anchor::{HPos, Pos, VPos};

use super::labels::{self, Named, Rect};
use crate::compare::{Family, Row};
use crate::stats::quantiles;

/// Smaller errors are drawn here: no finer error can be sensed or distinguished.
const FLOOR: f64 = 1e-9;
/// Radius of a variant's point, pixels of the output.
const MARK_PX: i32 = 7;
/// Radius of a terrain's point, pixels of the output.
const DOT_PX: i32 = 3;

/// Draws one panel for each path on which a force is rendered. Small points are terrains, the large
/// one with the name their median.
///
/// # Errors
/// If the layout fails or the file cannot be written.
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
    for own in points {
        let color = color(own.family);
        let small = own
            .all
            .iter()
            .map(|at| Circle::new(*at, px(DOT_PX), color.mix(0.45).filled()));
        chart.draw_series(small)?;
    }
    for own in points {
        let mark = Circle::new(own.middle(), px(MARK_PX), color(own.family).filled());
        chart.draw_series([mark])?;
    }
    names(&mut chart, points)
}

/// Returns the names beside the large points.
fn names(
    chart: &mut Chart<'_, Logarithmic, Logarithmic>,
    points: &[Points<'_>],
) -> Result<(), PictureError> {
    let plot = chart.plotting_area();
    let named: Vec<Named> = points
        .iter()
        .map(|own| {
            let (width, height) = plot.estimate_text_size(own.name, &font(own))?;
            Ok(Named {
                at: chart.backend_coord(&own.middle()),
                radius: px(MARK_PX),
                size: (width as i32, height as i32 + px(4)),
            })
        })
        .collect::<Result<_, PictureError>>()?;
    let dots: Vec<Rect> = points
        .iter()
        .flat_map(|own| &own.all)
        .map(|at| {
            let ((x, y), r) = (chart.backend_coord(at), px(DOT_PX));
            [x - r, y - r, x + r, y + r]
        })
        .collect();
    let (x, y) = plot.get_pixel_range();
    let places = labels::place(&named, &dots, [x.start, y.start, x.end, y.end], px(6));
    for ((own, named), (left, top)) in points.iter().zip(&named).zip(places) {
        let off = (left - named.at.0, top + named.size.1 / 2 - named.at.1);
        let name = Text::new(own.name.to_owned(), off, font(own));
        chart.draw_series([EmptyElement::at(own.middle()) + name])?;
    }
    Ok(())
}

fn font(own: &Points<'_>) -> TextStyle<'static> {
    let color = color(own.family);
    let weight = if own.family == Family::Ours {
        style::bold(17, &color)
    } else {
        style::text(17, &color)
    };
    weight.pos(Pos::new(HPos::Left, VPos::Center))
}

fn color(family: Family) -> RGBColor {
    match family {
        Family::Ours => SERIES[1],
        Family::Paper => SERIES[0],
        Family::Triangles => SERIES[2],
        Family::Bound => SERIES[5],
    }
}
