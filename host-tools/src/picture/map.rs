//! The map: relief, the path of the hand and of the proxy, where the map lies.

use plotters::element::{Circle, Drawable, PointCollection, Rectangle, Text};
use plotters::prelude::DrawingBackend;
use plotters::style::{Color, RGBColor, WHITE};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::axes::{self, Area, Chart, Titles};
use super::canvas::{PictureError, SCALE};
use super::line;
use super::relief::{self, Field, Relief};
use super::session::Sample;
use super::style::{self, HIP, INK, PROXY, px, stroke};
use super::window::Window;

/// Draws the map into an area whose chart part has the window's proportions.
pub(super) fn draw(
    area: &Area<'_>,
    field: &Field<'_>,
    window: &Window,
    samples: &[Sample],
) -> Result<Relief, PictureError> {
    let titles = Titles {
        x: "east (mm)",
        y: "north (mm)",
    };
    let east = window.west..window.west + window.width;
    let north = window.south..window.south + window.height;
    let mut chart = axes::chart(area, east, north, titles)?;
    let (columns, rows) = window.map_px();
    let relief = relief::shade(field, window, columns, rows);
    let ground = chart.plotting_area().strip_coord_spec();
    ground.draw(&Image::of(&relief))?;
    let pixel_mm = window.width / f64::from(columns);
    paths(&mut chart, samples, pixel_mm)?;
    let (width, height) = ground.dim_in_pixel();
    let corner = (width.cast_signed() - 1, height.cast_signed() - 1);
    let frame = stroke(&style::SOFT_INK, 1.0);
    ground.draw(&Rectangle::new([(0, 0), corner], frame))?;
    Ok(relief)
}

/// The proxy as a ribbon and the hand as a line on it, so that both are seen
/// where they lie over each other.
fn paths(chart: &mut Chart<'_>, samples: &[Sample], pixel_mm: f64) -> Result<(), PictureError> {
    let flat = |p: [f64; 3]| (p[0], p[1]);
    let hand = line::path(samples.iter().map(|s| Some(flat(s.hip_mm))), pixel_mm);
    let touched = samples
        .iter()
        .map(|s| s.contact.then_some(flat(s.proxy_mm)));
    let proxy = line::path(touched, pixel_mm);
    line::draw(chart, &proxy, stroke(&WHITE, 8.0))?;
    line::draw(chart, &hand, stroke(&WHITE, 4.5))?;
    line::draw(chart, &proxy, stroke(&PROXY, 5.5))?;
    line::draw(chart, &hand, stroke(&HIP, 2.0))?;
    for (sample, name, color) in [
        (samples.first(), "start", WHITE),
        (samples.last(), "end", HIP),
    ] {
        if let Some(sample) = sample {
            mark(chart, flat(sample.hip_mm), name, color)?;
        }
    }
    Ok(())
}

/// A dot with its name on a light plate.
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
    let font = style::bold(18, &INK).pos(Pos::new(HPos::Left, VPos::Center));
    let (width, _) = plain.estimate_text_size(name, &font)?;
    let (width, room) = (width.cast_signed(), plain.dim_in_pixel().0.cast_signed());
    // To the left of the dot where there is no room to its right.
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
    plain.draw(&Text::new(name.to_owned(), (left, y), font))?;
    Ok(())
}

/// The whole terrain, small, with the map's window framed; as large as the
/// area allows.
pub(super) fn inset(
    area: &Area<'_>,
    field: &Field<'_>,
    window: &Window,
) -> Result<(), PictureError> {
    let whole = Window::whole(field.size_mm);
    let (room_x, room_y) = area.dim_in_pixel();
    let pixels = |n: u32| f64::from(n.cast_signed() / SCALE);
    let scale = (pixels(room_x) / whole.width).min(pixels(room_y) / whole.height);
    let size = |extent: f64| ((extent * scale) as i32).max(4);
    let relief = relief::shade(field, &whole, size(whole.width), size(whole.height));
    area.draw(&Image::of(&relief))?;
    let place = |east: f64, north: f64| {
        let x = east * scale * f64::from(SCALE);
        let y = (whole.height - north) * scale * f64::from(SCALE);
        (x.round() as i32, y.round() as i32)
    };
    let (left, bottom) = place(window.west, window.south);
    let (right, top) = place(window.west + window.width, window.south + window.height);
    // A window smaller than a few pixels is still to be found.
    let grow = (px(8) - (right - left).max(bottom - top)).max(0) / 2;
    let corners = [(left - grow, top - grow), (right + grow, bottom + grow)];
    area.draw(&Rectangle::new(corners, stroke(&WHITE, 5.0)))?;
    area.draw(&Rectangle::new(corners, stroke(&PROXY, 2.5)))?;
    let corner = (px(relief.columns) - 1, px(relief.rows) - 1);
    let frame = stroke(&style::SOFT_INK, 1.0);
    area.draw(&Rectangle::new([(0, 0), corner], frame))?;
    Ok(())
}

/// A relief at the upper left of an area, each of its pixels one finished
/// pixel.
struct Image {
    corner: [(i32, i32); 1],
    size: (u32, u32),
    rgb: Vec<u8>,
}

impl Image {
    fn of(relief: &Relief) -> Self {
        let scale = SCALE as usize;
        let row_bytes = relief.columns as usize * 3;
        let mut rgb = Vec::with_capacity(relief.rgb.len() * scale * scale);
        for row in relief.rgb.chunks_exact(row_bytes.max(1)) {
            let wide: Vec<u8> = row
                .as_chunks::<3>()
                .0
                .iter()
                .flat_map(|pixel| std::iter::repeat_n(*pixel, scale).flatten())
                .collect();
            (0..scale).for_each(|_| rgb.extend_from_slice(&wide));
        }
        Self {
            corner: [(0, 0)],
            size: (px(relief.columns) as u32, px(relief.rows) as u32),
            rgb,
        }
    }
}

impl<'a> PointCollection<'a, (i32, i32)> for &'a Image {
    type Point = &'a (i32, i32);
    type IntoIter = std::slice::Iter<'a, (i32, i32)>;

    fn point_iter(self) -> Self::IntoIter {
        self.corner.iter()
    }
}

impl<DB: DrawingBackend> Drawable<DB> for Image {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut at: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        match at.next() {
            Some(at) => backend.blit_bitmap(at, self.size, &self.rgb),
            None => Ok(()),
        }
    }
}
