//! The map: relief, the paths of HIP and proxy, and an inset with the map's position.

use plotters::element::{Circle, Drawable, PointCollection, Rectangle};
use plotters::prelude::DrawingBackend;
use plotters::style::{Color, RGBColor, WHITE};
use plotters_backend::text_anchor::HPos;
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::axes::{self, Area, Chart, Titles};
use super::canvas::PictureError;
use super::ground_marks::{self, GroundFacts};
use super::line;
use super::map_view::MapView;
use super::relief::{self, Relief, Surface};
use super::style::{self, HIP, INK, PROXY, SCALE, px, stroke};
use crate::replay::Record;

/// Draws the map into an area whose chart part has the window's proportions.
pub(super) fn draw(
    area: &Area<'_>,
    surface: &Surface<'_>,
    window: &MapView,
    (records, ground_facts): (&[Record], Option<&GroundFacts<'_>>),
) -> Result<Relief, PictureError> {
    let titles = Titles {
        x: "east in the hand (mm)",
        y: "north in the hand (mm)",
    };
    let east = window.west..window.west + window.width;
    let north = window.south..window.south + window.height;
    let mut chart = axes::chart(area, east, north, titles)?;
    let (columns, rows) = window.map_px();
    let relief = relief::shade(surface, window, columns, rows);
    let ground = chart.plotting_area().strip_coord_spec();
    ground.draw(&Image(&relief))?;
    let pixel_mm = window.width / f64::from(columns);
    paths(&mut chart, records, pixel_mm)?;
    if let Some(facts) = ground_facts {
        ground_marks::draw(&ground, window, facts)?;
    }
    let (width, height) = ground.dim_in_pixel();
    let corner = (width.cast_signed() - 1, height.cast_signed() - 1);
    let frame = stroke(&style::SOFT_INK, 1.0);
    ground.draw(&Rectangle::new([(0, 0), corner], frame))?;
    Ok(relief)
}

/// Draws the proxy's path as a wide band and the HIP's as a line on it, so that both are visible
/// where they coincide.
fn paths(chart: &mut Chart<'_>, records: &[Record], pixel_mm: f64) -> Result<(), PictureError> {
    let flat = |p: [f64; 3]| (p[0], p[1]);
    let hip = line::path(records.iter().map(|r| Some(flat(r.hip_mm))), pixel_mm);
    let touched = records
        .iter()
        .map(|r| r.contact.then_some(flat(r.proxy_mm)));
    let proxy = line::path(touched, pixel_mm);
    line::draw(chart, &proxy, stroke(&WHITE, 8.0))?;
    line::draw(chart, &hip, stroke(&WHITE, 4.5))?;
    line::draw(chart, &proxy, stroke(&PROXY, 5.5))?;
    line::draw(chart, &hip, stroke(&HIP, 2.0))?;
    if let (Some(first), Some(last)) = (records.first(), records.last()) {
        mark(chart, flat(first.hip_mm), "start", WHITE)?;
        mark(chart, flat(last.hip_mm), "end", HIP)?;
    }
    Ok(())
}

/// Draws a dot with its name on a light plate.
fn mark(
    chart: &mut Chart<'_>,
    at: (f64, f64),
    name: &str,
    color: RGBColor,
) -> Result<(), PictureError> {
    let area = chart.plotting_area();
    let (ranges, (x, y)) = (area.get_pixel_range(), area.map_coordinate(&at));
    let plain = area.strip_coord_spec();
    let (x, y) = (x - ranges.0.start, y - ranges.1.start);
    plain.draw(&Circle::new((x, y), px(7), HIP.filled()))?;
    plain.draw(&Circle::new((x, y), px(4), color.filled()))?;
    let font = style::bold(18, &INK);
    let (width, _) = plain.estimate_text_size(name, &font)?;
    let (width, room) = (width.cast_signed(), plain.dim_in_pixel().0.cast_signed());
    // To the left of the dot if there is no room to its right.
    let left = if x + px(20) + width > room {
        x - px(18) - width
    } else {
        x + px(14)
    };
    let plate = [
        (left - px(4), y - px(12)),
        (left + width + px(4), y + px(12)),
    ];
    plain.draw(&Rectangle::new(plate, WHITE.mix(0.75).filled()))?;
    axes::write(&plain, name, (left, y), font, HPos::Left)
}

/// Draws the whole terrain, small, with a frame around the map's window; as large as the area
/// allows.
pub(super) fn inset(
    area: &Area<'_>,
    surface: &Surface<'_>,
    window: &MapView,
) -> Result<(), PictureError> {
    let whole = MapView::whole(surface.size_mm);
    let (room_x, room_y) = area.dim_in_pixel();
    let pixels = |n: u32| f64::from(n.cast_signed() / SCALE);
    let scale = (pixels(room_x) / whole.width).min(pixels(room_y) / whole.height);
    let size = |extent: f64| ((extent * scale) as i32).max(4);
    let relief = relief::shade(surface, &whole, size(whole.width), size(whole.height));
    area.draw(&Image(&relief))?;
    let place = |east: f64, north: f64| {
        let x = east * scale * f64::from(SCALE);
        let y = (whole.height - north) * scale * f64::from(SCALE);
        (x.round() as i32, y.round() as i32)
    };
    let (left, bottom) = place(window.west, window.south);
    let (right, top) = place(window.west + window.width, window.south + window.height);
    // A tiny window is enlarged to stay visible.
    let grow = (px(8) - (right - left).max(bottom - top)).max(0) / 2;
    let corners = [(left - grow, top - grow), (right + grow, bottom + grow)];
    area.draw(&Rectangle::new(corners, stroke(&WHITE, 5.0)))?;
    area.draw(&Rectangle::new(corners, stroke(&PROXY, 2.5)))?;
    let corner = (px(relief.columns) - 1, px(relief.rows) - 1);
    let frame = stroke(&style::SOFT_INK, 1.0);
    area.draw(&Rectangle::new([(0, 0), corner], frame))?;
    Ok(())
}

/// A relief at the upper left of an area, each of its pixels one finished pixel.
struct Image<'r>(&'r Relief);

impl<'a> PointCollection<'a, (i32, i32)> for &'a Image<'_> {
    type Point = (i32, i32);
    type IntoIter = [(i32, i32); 1];

    fn point_iter(self) -> Self::IntoIter {
        [(0, 0)]
    }
}

impl<DB: DrawingBackend> Drawable<DB> for Image<'_> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut at: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        let size = (self.0.columns as u32, self.0.rows as u32);
        at.try_for_each(|at| backend.blit_bitmap(at, size, &self.0.rgb))
    }
}
