//! Shaded relief: a colour for height, a shade for slope.
//!
//! The work depends only on the picture's size: each pixel gets the mean of at most 3 × 3 heights
//! spread over its ground, whatever the size of the surface, and nothing is copied.

use plotters::style::RGBColor;

use super::map_view::MapView;
use super::style::{self, PAPER};

/// The surface of a picture.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    /// Height in mm at (east, north) in mm, sampled at a distance in mm (third argument); `None` in
    /// no-data and off the data.
    pub height_mm: &'a dyn Fn(f64, f64, f64) -> Option<f64>,
    /// Extent east and north from the south-west sample, mm.
    pub size_mm: [f64; 2],
    /// One cell, mm.
    pub cell_mm: f64,
}

/// Max samples of a pixel in each direction.
const MAX_SAMPLES: u32 = 3;
/// Slopes are exaggerated until this share of them is below 45°.
const BELOW_45_SHARE: f64 = 0.85;
/// Max exaggeration of slopes.
const MAX_EXAGGERATION: f64 = 30.0;
/// Directions towards the lights (east, north, up) and their strengths: the main light is in the
/// north-west, as on maps.
const LIGHTS: [([f64; 3], f64); 3] = [
    ([-0.5, 0.5, 0.707], 0.65),
    ([-0.77, -0.2, 0.6], 0.2),
    ([0.3, 0.74, 0.6], 0.15),
];
/// Colours from low to high.
const TINTS: [RGBColor; 6] = [
    RGBColor(104, 142, 124),
    RGBColor(146, 170, 132),
    RGBColor(196, 200, 152),
    RGBColor(226, 210, 170),
    RGBColor(206, 180, 150),
    RGBColor(245, 241, 236),
];
/// Colour of no-data, and of the stripes on it.
pub(super) const NO_DATA: RGBColor = RGBColor(232, 234, 240);
const STRIPE: RGBColor = RGBColor(178, 184, 198);

/// A finished relief.
pub(super) struct Relief {
    pub(super) columns: i32,
    pub(super) rows: i32,
    /// RGB, row by row from the north.
    pub(super) rgb: Vec<u8>,
    /// Heights of the first and last tint, mm.
    pub(super) range_mm: (f64, f64),
    /// The lowest and the highest pixel, mm; heights beyond the tints are clipped.
    pub(super) ends_mm: (f64, f64),
    pub(super) has_no_data: bool,
}

/// Share of the pixels lower than the first tint, and share higher than the last.
pub(super) const CLIPPED_SHARE: f64 = 0.002;

/// Returns the tint of a height, `t` from 0 (low) to 1 (high).
pub(super) fn tint(t: f64) -> RGBColor {
    let at = t.clamp(0.0, 1.0) * (TINTS.len() - 1) as f64;
    let below = (at as usize).min(TINTS.len() - 2);
    style::mix(TINTS[below], TINTS[below + 1], at - below as f64)
}

/// Returns the colour of a no-data pixel.
pub(super) fn no_data_color(x: i32, y: i32) -> RGBColor {
    if (x + y).rem_euclid(8) < 2 {
        STRIPE
    } else {
        NO_DATA
    }
}

/// Shades a window of a surface into an image.
pub(super) fn shade(surface: &Surface<'_>, window: &MapView, columns: i32, rows: i32) -> Relief {
    let grid = PixelHeights::sample(surface, window, columns, rows);
    let (range_mm, ends_mm) = grid.ranges();
    let exaggeration = grid.exaggeration();
    let mut rgb = Vec::with_capacity((columns * rows * 3) as usize);
    let mut has_no_data = false;
    for (x, y) in places(columns, rows, 1) {
        let RGBColor(r, g, b) = match grid.at(x, y) {
            Some(height) => {
                let t = (height - range_mm.0) / (range_mm.1 - range_mm.0).max(1e-9);
                lit(tint(t), grid.slope(x, y).map(|s| s * exaggeration))
            }
            None if grid.outside(surface, window, x, y) => PAPER,
            None => {
                has_no_data = true;
                no_data_color(x, y)
            }
        };
        rgb.extend([r, g, b]);
    }
    Relief {
        columns,
        rows,
        rgb,
        range_mm,
        ends_mm,
        has_no_data,
    }
}

/// Returns a tint under the lights; a level surface keeps its tint.
fn lit(tint: RGBColor, slope: [f64; 2]) -> RGBColor {
    let [east, north] = slope;
    let length = (east * east + north * north + 1.0).sqrt();
    let mut light = 0.0;
    let mut level = 0.0;
    for ([x, y, z], strength) in LIGHTS {
        light += strength * ((z - x * east - y * north) / length).max(0.0);
        level += strength * z;
    }
    let shade = light / level;
    if shade < 1.0 {
        style::mix(RGBColor(34, 40, 62), tint, 0.12 + 0.88 * shade)
    } else {
        style::mix(
            tint,
            RGBColor(255, 252, 244),
            ((shade - 1.0) * 1.6).min(0.85),
        )
    }
}

/// Mean heights of the pixels, row 0 in the north.
struct PixelHeights {
    columns: i32,
    rows: i32,
    pixel_mm: f64,
    heights: Vec<Option<f64>>,
}

impl PixelHeights {
    fn sample(surface: &Surface<'_>, window: &MapView, columns: i32, rows: i32) -> Self {
        let step = [
            window.width / f64::from(columns),
            window.height / f64::from(rows),
        ];
        let cells = (step[0] / surface.cell_mm).ceil().max(1.0);
        let samples = (cells as u32).min(MAX_SAMPLES);
        let north = window.south + window.height;
        let heights = places(columns, rows, 1).map(|(x, y)| {
            let west = window.west + f64::from(x) * step[0];
            let south = north - f64::from(y + 1) * step[1];
            mean(surface, [west, south], step, samples)
        });
        Self {
            columns,
            rows,
            pixel_mm: step[0],
            heights: heights.collect(),
        }
    }

    fn at(&self, x: i32, y: i32) -> Option<f64> {
        let inside = (0..self.columns).contains(&x) && (0..self.rows).contains(&y);
        inside.then(|| self.heights[(y * self.columns + x) as usize])?
    }

    /// Returns the slope towards the east and the north, from the known neighbours.
    fn slope(&self, x: i32, y: i32) -> [f64; 2] {
        let here = self.at(x, y);
        let rise = |low: Option<f64>, high: Option<f64>| match (low, here, high) {
            (Some(low), _, Some(high)) => (high - low) / (2.0 * self.pixel_mm),
            (Some(low), Some(here), None) => (here - low) / self.pixel_mm,
            (None, Some(here), Some(high)) => (high - here) / self.pixel_mm,
            _ => 0.0,
        };
        [
            rise(self.at(x - 1, y), self.at(x + 1, y)),
            rise(self.at(x, y + 1), self.at(x, y - 1)),
        ]
    }

    /// Returns the range of nearly all pixels, so that one spike does not leave the rest in one
    /// colour, and the range of all.
    fn ranges(&self) -> ((f64, f64), (f64, f64)) {
        let known = sorted(self.heights.iter().flatten().copied());
        let between = |clipped: f64| {
            let low = quantile(&known, clipped);
            low.zip(quantile(&known, 1.0 - clipped))
                .unwrap_or((0.0, 1.0))
        };
        (between(CLIPPED_SHARE), between(0.0))
    }

    fn exaggeration(&self) -> f64 {
        let slopes = places(self.columns, self.rows, 3)
            .filter(|&(x, y)| self.at(x, y).is_some())
            .map(|(x, y)| self.slope(x, y));
        let steepness = slopes.map(|[east, north]| east.hypot(north));
        let slope = quantile(&sorted(steepness.filter(|s| *s > 0.0)), BELOW_45_SHARE);
        slope.map_or(1.0, |slope| (1.0 / slope).clamp(0.2, MAX_EXAGGERATION))
    }

    /// Returns true if a pixel's centre lies off the data, rather than in no-data.
    fn outside(&self, surface: &Surface<'_>, window: &MapView, x: i32, y: i32) -> bool {
        let east = window.west + (f64::from(x) + 0.5) * self.pixel_mm;
        let north = window.south + window.height - (f64::from(y) + 0.5) * self.pixel_mm;
        !(0.0..=surface.size_mm[0]).contains(&east) || !(0.0..=surface.size_mm[1]).contains(&north)
    }
}

/// Returns every `step`-th pixel of every `step`-th row, row by row from the north.
fn places(columns: i32, rows: i32, step: usize) -> impl Iterator<Item = (i32, i32)> {
    let rows = (0..rows).step_by(step);
    rows.flat_map(move |y| (0..columns).step_by(step).map(move |x| (x, y)))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Returns the value that a `share` of sorted values does not exceed.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(last as f64 * share) as usize])
}

/// Returns the mean of the known among `samples`² heights in a pixel; `None` if half of them are
/// no-data.
fn mean(surface: &Surface<'_>, corner: [f64; 2], step: [f64; 2], samples: u32) -> Option<f64> {
    let (mut sum, mut known) = (0.0, 0);
    let apart = step[0].abs().min(step[1].abs()) / f64::from(samples);
    let at =
        |i: u32, axis: usize| corner[axis] + (f64::from(i) + 0.5) / f64::from(samples) * step[axis];
    for j in 0..samples {
        for i in 0..samples {
            let height = (surface.height_mm)(at(i, 0), at(j, 1), apart).filter(|h| h.is_finite());
            sum += height.unwrap_or(0.0);
            known += u32::from(height.is_some());
        }
    }
    (2 * known > samples * samples).then(|| sum / f64::from(known))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn brightness(relief: &Relief, x: i32, y: i32) -> u32 {
        let at = ((y * relief.columns + x) * 3) as usize;
        relief.rgb[at..at + 3].iter().map(|v| u32::from(*v)).sum()
    }

    #[test]
    fn relief_is_lit_from_north_west_and_no_data_is_striped() {
        // A cone with no-data at its top.
        let height = |x: f64, y: f64, _: f64| {
            let r = (x - 50.0).hypot(y - 50.0);
            (r > 12.0).then_some(100.0 - r)
        };
        let field = Surface {
            height_mm: &height,
            size_mm: [100.0, 100.0],
            cell_mm: 1.0,
        };
        let relief = shade(&field, &MapView::whole(field.size_mm), 100, 100);
        assert!(brightness(&relief, 30, 30) > brightness(&relief, 70, 70) + 100);
        assert!(relief.has_no_data);
        let RGBColor(r, ..) = no_data_color(50, 50);
        assert_eq!(relief.rgb[(50 * 100 + 50) * 3], r);
    }

    #[test]
    fn spike_widens_reported_extremes_but_not_colour_range() {
        let height = |x: f64, y: f64, _: f64| {
            let on_spike = x.hypot(y) < 2.0;
            Some(if on_spike { 900.0 } else { x })
        };
        let field = Surface {
            height_mm: &height,
            size_mm: [100.0, 100.0],
            cell_mm: 1.0,
        };
        let relief = shade(&field, &MapView::whole(field.size_mm), 100, 100);
        assert!(relief.range_mm.1 < 101.0, "{:?}", relief.range_mm);
        assert!(relief.ends_mm.1 > 800.0, "{:?}", relief.ends_mm);
    }

    #[test]
    fn pixel_is_no_data_if_most_of_its_area_is() {
        let field = |known: &'static dyn Fn(f64) -> bool| {
            let height = move |x: f64, _: f64, _: f64| known(x).then_some(2.0);
            let field = Surface {
                height_mm: &height,
                size_mm: [3.0, 3.0],
                cell_mm: 1.0,
            };
            mean(&field, [0.0, 0.0], [3.0, 3.0], 3)
        };
        assert_eq!(field(&|x| x < 1.0), None);
        assert_eq!(field(&|x| x < 2.0), Some(2.0));
    }

    #[test]
    fn work_is_bounded_by_the_picture_not_the_field() {
        let calls = Cell::new(0u64);
        let height = |x: f64, y: f64, _: f64| {
            calls.set(calls.get() + 1);
            Some(x.sin() + y.cos())
        };
        let field = Surface {
            height_mm: &height,
            size_mm: [1e6, 1e6],
            cell_mm: 1.0,
        };
        shade(&field, &MapView::whole(field.size_mm), 200, 100);
        assert!(calls.get() <= 200 * 100 * 9);
    }

    #[test]
    fn field_of_only_no_data_or_extreme_heights_still_shades() {
        for height in [None, Some(f64::INFINITY), Some(0.0), Some(1e30)] {
            let field = Surface {
                height_mm: &|_, _, _| height,
                size_mm: [10.0, 10.0],
                cell_mm: 1.0,
            };
            let relief = shade(&field, &MapView::whole(field.size_mm), 20, 20);
            assert_eq!(relief.rgb.len(), 1200);
        }
    }
}
