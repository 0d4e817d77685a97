//! The panel beside the map: the key, the colour scale, the map's position, and figures.

use plotters::element::{Circle, PathElement, Rectangle};
use plotters::style::{Color, ShapeStyle, WHITE};
use plotters_backend::text_anchor::HPos;

use super::axes::{self, Area};
use super::canvas::PictureError;
use super::map;
use super::map_view::MapView;
use super::relief::{self, Relief, Surface};
use super::style::{self, HIP, INK, PROXY, SOFT_INK, SURFACE, TOUCHING, TOUCHING_INK, px, stroke};

/// Height of a line of text, finished pixels.
const LINE_PX: i32 = 30;
/// Max width of the inset and colour scale.
const MAX_WIDTH_PX: i32 = 330;
/// Min height of the inset.
const MIN_INSET_PX: i32 = 120;

/// A heading, and the names and values under it.
pub(super) type Table<'a> = (&'a str, &'a [(String, String)]);

/// Writes the panel from the top down.
pub(super) fn draw(
    area: &Area<'_>,
    relief: &Relief,
    surface: &Surface<'_>,
    window: &MapView,
    tables: &[Table<'_>],
) -> Result<(), PictureError> {
    let mut y = px(8);
    y = key(area, y, relief.has_no_data)? + px(16);
    y = scale(area, y, relief)? + px(20);
    for (title, facts) in tables.iter().filter(|table| !table.1.is_empty()) {
        y = figures(area, y, title, facts)? + px(20);
    }
    if !window.shows_all(surface.size_mm) {
        draw_locator(area, y, surface, window)?;
    }
    Ok(())
}

/// Returns the height that the panel needs for these tables, a window and a terrain, finished
/// pixels.
pub(super) fn needed_px(surface: &Surface<'_>, window: &MapView, tables: &[Table<'_>]) -> i32 {
    let listed = tables.iter().filter(|table| !table.1.is_empty());
    let tables: i32 = listed
        .map(|(_, facts)| LINE_PX * (facts.len() as i32 + 1) + 20)
        .sum();
    let inset = match window.shows_all(surface.size_mm) {
        true => 0,
        false => 20 + MIN_INSET_PX,
    };
    // The key and the scale of heights with all optional lines.
    8 + 4 + 6 * LINE_PX + 16 + 18 + 16 + 16 + 24 + 14 + 20 + tables + inset
}

/// Draws the whole terrain with the map's window in it, in the remaining room.
fn draw_locator(
    area: &Area<'_>,
    y: i32,
    surface: &Surface<'_>,
    window: &MapView,
) -> Result<(), PictureError> {
    heading(area, y, "Where the map lies")?;
    let (width, height) = area.dim_in_pixel();
    let top = y + px(20);
    let rest = height.cast_signed() - top;
    let width = width.cast_signed().min(px(MAX_WIDTH_PX));
    let place = area.clone().shrink((0, top), (width, rest.min(px(300))));
    map::inset(&place, surface, window)
}

fn heading(area: &Area<'_>, y: i32, name: &str) -> Result<(), PictureError> {
    axes::write(area, name, (0, y), style::bold(18, &INK), HPos::Left)
}

fn label(area: &Area<'_>, x: i32, y: i32, text: &str, side: HPos) -> Result<(), PictureError> {
    axes::write(area, text, (x, y), style::text(18, &SOFT_INK), side)
}

/// Draws the key to lines and colours.
fn key(area: &Area<'_>, top: i32, has_no_data: bool) -> Result<i32, PictureError> {
    let right = px(40);
    let mut y = top + px(4);
    let mut entry = |name: &str, sign: &dyn Fn(i32) -> Result<(), PictureError>| {
        sign(y)?;
        label(area, px(54), y, name, HPos::Left)?;
        y += px(LINE_PX);
        Ok::<(), PictureError>(())
    };
    let line = |from: i32, to: i32, y: i32, style: ShapeStyle| {
        Ok(area.draw(&PathElement::new(vec![(from, y), (to, y)], style))?)
    };
    let patch = |y: i32, style: ShapeStyle| {
        Ok(area.draw(&Rectangle::new([(0, y - px(8)), (right, y + px(8))], style))?)
    };
    entry("HIP (haptic interface point)", &|y| {
        line(px(3), right - px(3), y, stroke(&HIP, 2.0))
    })?;
    entry("proxy, while in contact", &|y| {
        line(px(3), right - px(3), y, stroke(&PROXY, 5.5))
    })?;
    entry("surface under the HIP", &|y| {
        patch(y, style::GROUND.filled())?;
        line(0, right, y - px(8), stroke(&SURFACE, 2.0))
    })?;
    entry("time in contact", &|y| {
        patch(y, TOUCHING.mix(TOUCHING_INK).filled())
    })?;
    entry("start and end", &|y| {
        for (x, inner) in [(px(10), WHITE), (px(30), HIP)] {
            area.draw(&Circle::new((x, y), px(7), HIP.filled()))?;
            area.draw(&Circle::new((x, y), px(4), inner.filled()))?;
        }
        Ok(())
    })?;
    if has_no_data {
        entry("no data", &|y| {
            for (row, column) in (0..16).flat_map(|row| (0..40).map(move |column| (row, column))) {
                let (x, y) = (px(column), y + px(row - 8));
                let pixel = [(x, y), (x + px(1) - 1, y + px(1) - 1)];
                area.draw(&Rectangle::new(
                    pixel,
                    relief::no_data_color(column, row).filled(),
                ))?;
            }
            Ok(())
        })?;
    }
    Ok(y)
}

/// Draws the colours of the heights.
fn scale(area: &Area<'_>, top: i32, relief: &Relief) -> Result<i32, PictureError> {
    heading(area, top, "Height of the surface (mm)")?;
    let width = area.dim_in_pixel().0.cast_signed().min(px(MAX_WIDTH_PX));
    let (bar_top, bar_bottom) = (top + px(18), top + px(34));
    for x in (0..width).step_by(px(1) as usize) {
        let color = relief::tint(f64::from(x) / f64::from(width));
        let strip = [(x, bar_top), (x + px(1) - 1, bar_bottom)];
        area.draw(&Rectangle::new(strip, color.filled()))?;
    }
    let y = bar_bottom + px(16);
    let (low, high) = relief.range_mm;
    // Enough decimals to distinguish the middle from the ends.
    let decimals = (1.0 - (high - low).max(1e-9).log10())
        .ceil()
        .clamp(0.0, 9.0);
    let unit = 10f64.powf(-decimals);
    let text = |height: f64| axes::number(&((height / unit).round() * unit));
    label(area, 0, y, &text(low), HPos::Left)?;
    label(area, width / 2, y, &text(0.5 * (low + high)), HPos::Center)?;
    label(area, width, y, &text(high), HPos::Right)?;
    let (lowest, highest) = relief.ends_mm;
    if lowest >= low && highest <= high {
        return Ok(y + px(14));
    }
    let y = y + px(24);
    let clipped = 100.0 * relief::CLIPPED_SHARE;
    let (lowest, highest) = (text(lowest), text(highest));
    let note = format!("{clipped} % clipped at each end: {lowest} to {highest} in all");
    label(area, 0, y, &note, HPos::Left)?;
    Ok(y + px(14))
}

/// Writes names on the left, values on the right.
fn figures(
    area: &Area<'_>,
    top: i32,
    title: &str,
    facts: &[(String, String)],
) -> Result<i32, PictureError> {
    if facts.is_empty() {
        return Ok(top);
    }
    heading(area, top, title)?;
    let width = area.dim_in_pixel().0.cast_signed().min(px(MAX_WIDTH_PX));
    let mut y = top + px(LINE_PX);
    for (name, value) in facts {
        label(area, 0, y, name, HPos::Left)?;
        axes::write(area, value, (width, y), style::bold(18, &INK), HPos::Right)?;
        y += px(LINE_PX);
    }
    Ok(y)
}
