//! Costs of streaming against the size of the terrain.

use std::path::Path;

use hapterra::picture::axes::{self, Area, Titles};
use hapterra::picture::style::{self, SERIES, SOFT_INK, px, stroke};
use hapterra::picture::{Canvas, PictureError};
use plotters::coord::combinators::IntoLogRange;
use plotters::drawing::IntoDrawingArea;
use plotters::element::{Circle, PathElement};
use plotters::style::{Color, RGBColor};
use plotters_backend::text_anchor::HPos;

use crate::streaming::{RATES, Reading, Row, SPEEDS};

/// Radius of a point, pixels of the output.
const DOT_PX: i32 = 5;
/// Position of a zero on the logarithmic axis.
const FLOOR: f64 = 0.1;
/// Samples along the axis.
const SAMPLES: std::ops::Range<f64> = 5e5..2e10;

/// Content of a panel.
struct Panel {
    y: String,
    range: std::ops::Range<f64>,
    figure: fn(&Row) -> Option<f64>,
}

/// Draws a panel for each figure against the samples, and a line for each latency; files read as a
/// whole have a line of their own. All figures are for the faster link.
///
/// # Errors
/// If the layout fails or the file cannot be written.
pub fn draw_streaming(rows: &[Row], file: &Path) -> Result<(), PictureError> {
    let mut canvas = Canvas::new(1900, 1250);
    {
        let sheet = canvas.pen().into_drawing_area();
        let (head, charts) = sheet.split_vertically(px(100));
        header(&head, rows)?;
        let areas = charts.split_evenly((2, 3));
        for (area, panel) in areas.iter().zip(panels()) {
            draw(&area.margin(px(8), px(8), px(8), px(20)), &panel, rows)?;
        }
    }
    canvas.save(file)
}

fn panels() -> [Panel; 6] {
    let missing = format!("missing ticks, turning, {} cells/s", SPEEDS[2]);
    let panel = |y: &str, range, figure| Panel {
        y: y.to_owned(),
        range,
        figure,
    };
    [
        panel("opening and first force (ms)", 1.0..1e5, |row| {
            Some(row.open_ms + row.first_force_ms)
        }),
        panel("most memory (MB)", 10.0..1e3, |row| row.peak_mb),
        panel("read or fetched (kB)", 1e2..1e6, |row| {
            Some((row.open_bytes? + row.way_bytes.unwrap_or(0)) as f64 / 1e3)
        }),
        panel("bytes a tile, mean", 1e2..1e4, |row| row.tile_bytes_mean),
        panel("sustained straight speed (cells/s)", 1e2..2e4, |row| {
            row.held_straight
        }),
        panel(&missing, FLOOR..1e4, |row| {
            row.missing_turning_5000.map(f64::from)
        }),
    ]
}

/// Returns the latencies of the rows, each once.
fn latencies(rows: &[Row]) -> Vec<u32> {
    let mut all: Vec<u32> = rows.iter().map(|row| row.latency_ms).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn color(index: usize) -> RGBColor {
    SERIES[index % SERIES.len()]
}

fn header(area: &Area<'_>, rows: &[Row]) -> Result<(), PictureError> {
    let text = format!("Cost against samples, link of {} kB/s", RATES[0]);
    let title = style::bold(28, &style::INK);
    axes::write(area, &text, (px(24), px(34)), title, HPos::Left)?;
    let mut names: Vec<(String, RGBColor)> = vec![("read as a whole".to_owned(), SOFT_INK)];
    for (index, latency) in latencies(rows).iter().enumerate() {
        let name = match latency {
            0 => "file on disk".to_owned(),
            latency => format!("server, {latency} ms"),
        };
        names.push((name, color(index)));
    }
    for (index, (name, color)) in names.iter().enumerate() {
        let left = px(30 + 260 * index as i32);
        let dot = Circle::new((left, px(76)), px(DOT_PX), color.filled());
        area.draw(&dot)?;
        axes::write(
            area,
            name,
            (left + px(14), px(76)),
            style::text(20, color),
            HPos::Left,
        )?;
    }
    Ok(())
}

fn draw(area: &Area<'_>, panel: &Panel, rows: &[Row]) -> Result<(), PictureError> {
    let titles = Titles {
        x: "samples",
        y: &panel.y,
    };
    let y = panel.range.clone().log_scale();
    let mut chart = axes::chart(area, SAMPLES.log_scale(), y, titles)?;
    let whole = (Reading::Whole, 0, SOFT_INK);
    let blocks = latencies(rows);
    let blocks = blocks.iter().enumerate();
    let blocks = blocks.map(|(index, latency)| (Reading::Blocks, *latency, color(index)));
    for (reading, latency, color) in std::iter::once(whole).chain(blocks) {
        let is = |row: &&Row| {
            row.reading == reading && row.latency_ms == latency && row.link_kb_per_s == RATES[0]
        };
        let points = rows.iter().filter(is).filter_map(|row| {
            let value = (panel.figure)(row)?;
            let formatted = value.clamp(panel.range.start, panel.range.end);
            Some((row.samples as f64, formatted))
        });
        let mut points: Vec<(f64, f64)> = points.collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let dots = points
            .iter()
            .map(|at| Circle::new(*at, px(DOT_PX), color.filled()));
        chart.draw_series(dots)?;
        chart.draw_series([PathElement::new(points, stroke(&color, 2.0))])?;
    }
    Ok(())
}
