//! Height and force against time.

use plotters::element::{Polygon, Rectangle, Text};
use plotters::style::{Color, RGBColor, ShapeStyle};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

use super::axes::{self, Area, Chart, Titles};
use super::canvas::PictureError;
use super::line;
use super::relief::{self, Surface};
use super::style::{
    self, GROUND, HIP, INK, PROXY, SCALE, SERIES, SURFACE, TOUCHING, TOUCHING_INK, px, stroke,
};
use crate::replay::Record;

/// Draws the heights of the surface under the HIP, of the HIP and of the proxy.
pub(super) fn heights(
    area: &Area<'_>,
    surface: &Surface<'_>,
    records: &[Record],
    time: &Range<f64>,
) -> Result<(), PictureError> {
    let below = |r: &Record| (surface.height_mm)(r.hip_mm[0], r.hip_mm[1], 0.0);
    let heights = records
        .iter()
        .flat_map(|r| [Some(r.hip_mm[2]), Some(r.proxy_mm[2]), below(r)]);
    let range = axes::spread(heights.flatten(), 0.08);
    let titles = Titles {
        x: "",
        y: "height (mm)",
    };
    let mut plot = Plot::new(area, records, time, range, titles)?;
    plot.bands(|r| below(r).is_none(), relief::NO_DATA.filled())?;
    plot.fill_below(below)?;
    plot.line(below, stroke(&SURFACE, 1.5))?;
    plot.line(|r| r.contact.then_some(r.proxy_mm[2]), stroke(&PROXY, 4.0))?;
    plot.line(|r| Some(r.hip_mm[2]), stroke(&HIP, 1.8))
}

/// Draws the magnitude of the force, and its components as thin lines.
pub(super) fn forces(
    area: &Area<'_>,
    records: &[Record],
    time: &Range<f64>,
) -> Result<(), PictureError> {
    let size = |f: [f64; 3]| f.iter().map(|v| v * v).sum::<f64>().sqrt();
    let all = records
        .iter()
        .flat_map(|r| r.force_n.into_iter().chain([size(r.force_n), 0.0, 0.5]));
    let range = axes::spread(all, 0.06);
    // Room for the key.
    let range = range.start..range.end + 0.12 * (range.end - range.start);
    let titles = Titles {
        x: "time (s)",
        y: "force (N)",
    };
    let mut plot = Plot::new(area, records, time, range, titles)?;
    for (axis, (_, color)) in PARTS.iter().enumerate() {
        plot.line(|r| Some(r.force_n[axis]), stroke(color, 1.5))?;
    }
    plot.line(|r| Some(size(r.force_n)), stroke(&INK, 2.2))?;
    key(&plot.chart)
}

/// The components of the force: name and colour.
const PARTS: [(&str, RGBColor); 3] = [("east", SERIES[2]), ("north", SERIES[3]), ("up", SERIES[4])];

/// Writes the names of the force's lines, in their colours, at the upper right.
fn key(chart: &Chart<'_>) -> Result<(), PictureError> {
    let area = chart.plotting_area().strip_coord_spec();
    let mut right = area.dim_in_pixel().0.cast_signed() - px(12);
    let names = PARTS.iter().rev().copied().chain([("total", INK)]);
    for (name, color) in names {
        let font = style::bold(18, &color).pos(Pos::new(HPos::Right, VPos::Top));
        area.draw(&Text::new(name, (right, px(10)), font.clone()))?;
        right -= area.estimate_text_size(name, &font)?.0.cast_signed() + px(18);
    }
    Ok(())
}

/// A chart of quantities against time.
struct Plot<'a, 'r> {
    chart: Chart<'a>,
    records: &'r [Record],
    time: &'r Range<f64>,
    /// Range of the vertical axis.
    range: Range<f64>,
    /// Width in finished pixels.
    columns: u32,
}

impl<'a, 'r> Plot<'a, 'r> {
    /// Draws axes, and light bands behind the times of contact.
    fn new(
        area: &Area<'a>,
        records: &'r [Record],
        time: &'r Range<f64>,
        range: Range<f64>,
        titles: Titles<'_>,
    ) -> Result<Self, PictureError> {
        let mut plot = Self {
            chart: axes::chart(area, time.clone(), range.clone(), titles)?,
            records,
            time,
            range,
            columns: area.dim_in_pixel().0 / SCALE as u32,
        };
        plot.bands(|r| r.contact, TOUCHING.mix(TOUCHING_INK).filled())?;
        Ok(plot)
    }

    /// Draws a band from top to bottom for each run of times.
    fn bands(
        &mut self,
        when: impl Fn(&Record) -> bool,
        style: ShapeStyle,
    ) -> Result<(), PictureError> {
        let points = self.records.iter().map(|r| (r.t_s, when(r)));
        let runs = line::runs(points, (self.time.end - self.time.start) * 2e-3);
        let Range { start, end } = self.range;
        let bands = runs.into_iter();
        let bands = bands.map(|(from, to)| Rectangle::new([(from, start), (to, end)], style));
        self.chart.draw_series(bands)?;
        Ok(())
    }

    /// Fills the ground under a profile.
    fn fill_below(&mut self, profile: impl Fn(&Record) -> Option<f64>) -> Result<(), PictureError> {
        let floor = self.range.start;
        let ground = self.curve(profile).into_iter().map(|piece| {
            let (first, last) = (piece[0].0, piece[piece.len() - 1].0);
            let floor = [(last, floor), (first, floor)];
            Polygon::new([&piece[..], &floor].concat(), GROUND.filled())
        });
        self.chart.draw_series(ground)?;
        Ok(())
    }

    fn line(
        &mut self,
        value: impl Fn(&Record) -> Option<f64>,
        style: ShapeStyle,
    ) -> Result<(), PictureError> {
        let curve = self.curve(value);
        line::draw(&mut self.chart, &curve, style)
    }

    fn curve(&self, value: impl Fn(&Record) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
        let points = self.records.iter().map(|r| (r.t_s, value(r)));
        line::curve(points, self.time, self.columns)
    }
}
