//! The picture of one session: map, height and force, one above the other.

use plotters::drawing::IntoDrawingArea as _;
use plotters::element::Text;
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

use super::axes::{BELOW_PX, LEFT_PX};
use super::canvas::{Canvas, PictureError};
use super::relief::Field;
use super::style::{self, INK, SOFT_INK, px};
use super::window::Window;
use super::{map, panel, timeline};

/// One tick of what was felt, terrain frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub t_s: f64,
    /// Where the hand was, mm.
    pub hip_mm: [f64; 3],
    /// Where the proxy was, mm.
    pub proxy_mm: [f64; 3],
    /// Force on the hand, N.
    pub force_n: [f64; 3],
    /// Whether the surface was touched.
    pub contact: bool,
}

/// All that a picture shows.
#[derive(Clone, Copy)]
pub struct Session<'a> {
    /// First line, large: what was touched.
    pub title: &'a str,
    /// Second line: how, where, how large a cell is in the hand.
    pub subtitle: &'a str,
    /// The terrain.
    pub field: Field<'a>,
    /// The ticks in order of time.
    pub samples: &'a [Sample],
    /// Further figures for the panel, name and value with its unit, short.
    pub facts: &'a [(String, String)],
}

const WIDTH_PX: i32 = 1600;
const MARGIN_PX: i32 = 30;
const HEADER_PX: i32 = 96;
const PANEL_LEAST_PX: i32 = 620;
const HEIGHTS_PX: i32 = 290;
const FORCES_PX: i32 = 300;
const GAP_PX: i32 = 26;

/// Draws the picture and writes it as PNG.
///
/// # Errors
/// [`PictureError`] if the file cannot be written.
pub fn save_session(path: &Path, session: &Session<'_>) -> Result<(), PictureError> {
    draw_session(session)?.save(path)
}

/// Draws the picture. Its width is fixed, its height follows the map's.
///
/// # Errors
/// [`PictureError::Layout`] as `plotters` reports it.
pub fn draw_session(session: &Session<'_>) -> Result<Canvas, PictureError> {
    let flat = |p: [f64; 3]| [p[0], p[1]];
    let path = Window::around(session.samples.iter().map(|s| flat(s.hip_mm)));
    let field = &session.field;
    let window = Window::choose(path, field.size_mm, field.cell_mm);
    let (map_width, map_height) = window.map_px();
    let block = (map_height + BELOW_PX).max(PANEL_LEAST_PX);
    let below = HEADER_PX + block + GAP_PX;
    let height = below + HEIGHTS_PX + GAP_PX + FORCES_PX + MARGIN_PX;
    let mut canvas = Canvas::new(WIDTH_PX as u16, height as u16);
    {
        let sheet = canvas.pen().into_drawing_area();
        let part = |x: i32, y: i32, width: i32, height: i32| {
            sheet
                .clone()
                .shrink((px(x), px(y)), (px(width), px(height)))
        };
        let inner = WIDTH_PX - 2 * MARGIN_PX;
        header(&part(MARGIN_PX, 0, inner, HEADER_PX), session)?;
        let map_area = part(
            MARGIN_PX,
            HEADER_PX,
            LEFT_PX + map_width,
            map_height + BELOW_PX,
        );
        let relief = map::draw(&map_area, field, &window, session.samples)?;
        let panel_left = MARGIN_PX + LEFT_PX + map_width + 40;
        let panel_width = WIDTH_PX - MARGIN_PX - panel_left;
        let side = part(panel_left, HEADER_PX, panel_width, block);
        panel::draw(&side, &relief, field, &window, &figures(session))?;
        let time = span(session.samples);
        let heights = part(MARGIN_PX, below, inner, HEIGHTS_PX);
        timeline::heights(&heights, field, session.samples, &time)?;
        let forces = part(MARGIN_PX, below + HEIGHTS_PX + GAP_PX, inner, FORCES_PX);
        timeline::forces(&forces, session.samples, &time)?;
    }
    Ok(canvas)
}

fn header(area: &super::axes::Area<'_>, session: &Session<'_>) -> Result<(), PictureError> {
    let left = Pos::new(HPos::Left, VPos::Center);
    let title = style::bold(32, &INK).pos(left);
    area.draw(&Text::new(session.title, (0, px(34)), title))?;
    let line = style::text(20, &SOFT_INK).pos(left);
    area.draw(&Text::new(session.subtitle, (0, px(68)), line))?;
    Ok(())
}

fn span(samples: &[Sample]) -> std::ops::Range<f64> {
    match (samples.first(), samples.last()) {
        (Some(first), Some(last)) if last.t_s > first.t_s => first.t_s..last.t_s,
        (Some(first), _) => first.t_s..first.t_s + 1.0,
        _ => 0.0..1.0,
    }
}

/// The session's own figures, then the caller's.
fn figures(session: &Session<'_>) -> Vec<(String, String)> {
    let samples = session.samples;
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let depth = |s: &Sample| length(std::array::from_fn(|i| s.proxy_mm[i] - s.hip_mm[i]));
    let touched = samples.iter().filter(|s| s.contact);
    let share = touched.clone().count() as f64 / samples.len().max(1) as f64;
    let highest = |of: &dyn Fn(&Sample) -> f64| touched.clone().map(of).fold(0.0, f64::max);
    let time = span(samples);
    let mut figures = vec![
        (
            "duration".to_owned(),
            format!("{:.1} s", time.end - time.start),
        ),
        ("in contact".to_owned(), format!("{:.0} %", 100.0 * share)),
        (
            "highest force".to_owned(),
            format!("{:.2} N", highest(&|s| length(s.force_n))),
        ),
        (
            "deepest push".to_owned(),
            format!("{:.2} mm", highest(&depth)),
        ),
    ];
    figures.extend_from_slice(session.facts);
    figures
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
