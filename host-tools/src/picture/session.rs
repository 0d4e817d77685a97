//! The picture of one session: map, height and force, one above the other.

use plotters::drawing::IntoDrawingArea as _;
use plotters_backend::text_anchor::HPos;
use std::path::Path;

use super::axes::{self, Area, BELOW_PX, LEFT_PX};
use super::canvas::{Canvas, PictureError};
use super::ground_marks::GroundFacts;
use super::map_view::MapView;
use super::relief::Surface;
use super::style::{self, INK, SOFT_INK, px};
use super::{map, panel, timeline};
use crate::replay::Record;

/// The contents of a session's picture.
#[derive(Clone, Copy)]
pub struct SessionPicture<'a> {
    /// First line, large: the terrain.
    pub title: &'a str,
    /// Lines below it: the terrain's size and cells; the device.
    pub subtitles: [&'a str; 2],
    /// The terrain.
    pub surface: Surface<'a>,
    /// Records in order of time, terrain frame.
    pub records: &'a [Record],
    /// Further figures for the panel: short names, and values with their units.
    pub facts: &'a [(String, String)],
    /// The terrain's position on the ground, if it is shown.
    pub ground: Option<GroundFacts<'a>>,
}

const WIDTH_PX: i32 = 1600;
const MARGIN_PX: i32 = 30;
const HEADER_PX: i32 = 122;
const HEIGHTS_PX: i32 = 290;
const FORCES_PX: i32 = 300;
const GAP_PX: i32 = 26;

impl SessionPicture<'_> {
    /// Draws the picture and writes it as PNG.
    ///
    /// # Errors
    /// [`PictureError`] if the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), PictureError> {
        self.draw()?.save(path)
    }

    /// Draws the picture. Its width is fixed; its height depends on the map's.
    ///
    /// # Errors
    /// [`PictureError::Layout`] from `plotters`.
    pub fn draw(&self) -> Result<Canvas, PictureError> {
        let (surface, records) = (&self.surface, self.records);
        let path = MapView::around(records.iter().map(|r| [r.hip_mm[0], r.hip_mm[1]]));
        let window = MapView::choose(path, surface.size_mm, surface.cell_mm);
        let (map_width, map_height) = window.map_px();
        let lines = self.ground.map_or(&[][..], |ground| ground.lines);
        let figures = self.figures();
        let tables = [("Place and scale", lines), ("Figures", &figures[..])];
        let panel_height = panel::needed_px(surface, &window, &tables);
        let block = (map_height + BELOW_PX).max(panel_height);
        let below = HEADER_PX + block + GAP_PX;
        let height = below + HEIGHTS_PX + GAP_PX + FORCES_PX + MARGIN_PX;
        let mut canvas = Canvas::new(WIDTH_PX as u16, height as u16);
        let sheet = canvas.pen().into_drawing_area();
        let part = |x: i32, y: i32, width: i32, height: i32| {
            let (corner, size) = ((px(x), px(y)), (px(width), px(height)));
            sheet.clone().shrink(corner, size)
        };
        let inner = WIDTH_PX - 2 * MARGIN_PX;
        self.header(&part(MARGIN_PX, 0, inner, HEADER_PX))?;
        let (width, height) = (LEFT_PX + map_width, map_height + BELOW_PX);
        let map_area = part(MARGIN_PX, HEADER_PX, width, height);
        let relief = map::draw(&map_area, surface, &window, (records, self.ground.as_ref()))?;
        let panel_left = MARGIN_PX + width + 40;
        let panel_width = WIDTH_PX - MARGIN_PX - panel_left;
        let side = part(panel_left, HEADER_PX, panel_width, block);
        panel::draw(&side, &relief, surface, &window, &tables)?;
        let time = span(records);
        let heights = part(MARGIN_PX, below, inner, HEIGHTS_PX);
        timeline::heights(&heights, surface, records, &time)?;
        let forces = part(MARGIN_PX, below + HEIGHTS_PX + GAP_PX, inner, FORCES_PX);
        timeline::forces(&forces, records, &time)?;
        drop((sheet, map_area, side, heights, forces));
        Ok(canvas)
    }

    fn header(&self, area: &Area<'_>) -> Result<(), PictureError> {
        let (title, line) = (style::bold(32, &INK), style::text(20, &SOFT_INK));
        axes::write(area, self.title, (0, px(34)), title, HPos::Left)?;
        for (text, y) in self.subtitles.into_iter().zip([68, 94]) {
            axes::write(area, text, (0, px(y)), line.clone(), HPos::Left)?;
        }
        Ok(())
    }

    /// Returns the session's own figures, then the caller's.
    fn figures(&self) -> Vec<(String, String)> {
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let depth = |r: &Record| length(std::array::from_fn(|i| r.proxy_mm[i] - r.hip_mm[i]));
        let touched = self.records.iter().filter(|r| r.contact);
        let share = touched.clone().count() as f64 / self.records.len().max(1) as f64;
        let highest = |of: &dyn Fn(&Record) -> f64| touched.clone().map(of).fold(0.0, f64::max);
        let time = span(self.records);
        let own = [
            ("duration", format!("{:.1} s", time.end - time.start)),
            ("in contact", format!("{:.0} %", 100.0 * share)),
            (
                "highest force",
                format!("{:.2} N", highest(&|r| length(r.force_n))),
            ),
            ("deepest push", format!("{:.2} mm", highest(&depth))),
        ];
        let own = own.map(|(name, value)| (name.to_owned(), value));
        own.into_iter().chain(self.facts.iter().cloned()).collect()
    }
}

fn span(records: &[Record]) -> std::ops::Range<f64> {
    match (records.first(), records.last()) {
        (Some(first), Some(last)) if last.t_s > first.t_s => first.t_s..last.t_s,
        (Some(first), _) => first.t_s..first.t_s + 1.0,
        _ => 0.0..1.0,
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
