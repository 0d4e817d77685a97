//! Height and force against time.

use plotters::element::{Rectangle, Text};
use plotters::style::{Color, RGBColor, ShapeStyle};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

use super::axes::{self, Area, Chart, Titles};
use super::canvas::{PictureError, SCALE};
use super::line;
use super::relief::{self, Field};
use super::session::Sample;
use super::style::{
    self, GROUND, HIP, INK, PROXY, SERIES, SURFACE, TOUCHING, TOUCHING_INK, px, stroke,
};

/// Height of the surface under the hand, of the hand and of the proxy.
pub(super) fn heights(
    area: &Area<'_>,
    field: &Field<'_>,
    samples: &[Sample],
    time: &Range<f64>,
) -> Result<(), PictureError> {
    let surface = |s: &Sample| (field.height_mm)(s.hip_mm[0], s.hip_mm[1]);
    let seen = samples
        .iter()
        .flat_map(|s| [Some(s.hip_mm[2]), Some(s.proxy_mm[2]), surface(s)]);
    let range = axes::spread(seen.flatten(), 0.08);
    let titles = Titles {
        x: "",
        y: "height (mm)",
    };
    let mut chart = axes::chart(area, time.clone(), range.clone(), titles)?;
    let columns = area.dim_in_pixel().0 / SCALE as u32;
    touching(&mut chart, samples, time, &range)?;
    let holes = samples.iter().map(|s| (s.t_s, surface(s).is_none()));
    bands(&mut chart, holes, time, &range, relief::HOLE.filled())?;
    let ground = line::curve(samples.iter().map(|s| (s.t_s, surface(s))), time, columns);
    fill_below(&mut chart, &ground, range.start)?;
    let touched = |s: &Sample| s.contact.then_some(s.proxy_mm[2]);
    let proxy = line::curve(samples.iter().map(|s| (s.t_s, touched(s))), time, columns);
    let hand = samples.iter().map(|s| (s.t_s, Some(s.hip_mm[2])));
    let hand = line::curve(hand, time, columns);
    line::draw(&mut chart, &ground, stroke(&SURFACE, 1.5))?;
    line::draw(&mut chart, &proxy, stroke(&PROXY, 4.0))?;
    line::draw(&mut chart, &hand, stroke(&HIP, 1.8))
}

/// The force's size, and its parts as thin lines.
pub(super) fn forces(
    area: &Area<'_>,
    samples: &[Sample],
    time: &Range<f64>,
) -> Result<(), PictureError> {
    let size = |f: [f64; 3]| f.iter().map(|v| v * v).sum::<f64>().sqrt();
    let all = samples
        .iter()
        .flat_map(|s| s.force_n.into_iter().chain([size(s.force_n), 0.0, 0.5]));
    let range = axes::spread(all, 0.06);
    // Room for the key.
    let range = range.start..range.end + 0.12 * (range.end - range.start);
    let titles = Titles {
        x: "time (s)",
        y: "force (N)",
    };
    let mut chart = axes::chart(area, time.clone(), range.clone(), titles)?;
    let columns = area.dim_in_pixel().0 / SCALE as u32;
    touching(&mut chart, samples, time, &range)?;
    for (axis, color) in PARTS.iter().enumerate() {
        let part = samples.iter().map(|s| (s.t_s, Some(s.force_n[axis])));
        let part = line::curve(part, time, columns);
        line::draw(&mut chart, &part, stroke(&color.1, 1.5))?;
    }
    let whole = samples.iter().map(|s| (s.t_s, Some(size(s.force_n))));
    let whole = line::curve(whole, time, columns);
    line::draw(&mut chart, &whole, stroke(&INK, 2.2))?;
    key(&chart)
}

/// The parts of the force: name and colour.
const PARTS: [(&str, RGBColor); 3] = [("east", SERIES[2]), ("north", SERIES[3]), ("up", SERIES[4])];

/// Names of the force's lines, in their colours, at the upper right.
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

/// Light bands behind the times of contact.
fn touching(
    chart: &mut Chart<'_>,
    samples: &[Sample],
    time: &Range<f64>,
    range: &Range<f64>,
) -> Result<(), PictureError> {
    let when = samples.iter().map(|s| (s.t_s, s.contact));
    bands(
        chart,
        when,
        time,
        range,
        TOUCHING.mix(TOUCHING_INK).filled(),
    )
}

/// A band from top to bottom for each run of times.
fn bands(
    chart: &mut Chart<'_>,
    when: impl Iterator<Item = (f64, bool)>,
    time: &Range<f64>,
    range: &Range<f64>,
    style: ShapeStyle,
) -> Result<(), PictureError> {
    let runs = line::runs(when, (time.end - time.start) * 2e-3);
    chart.draw_series(
        runs.into_iter()
            .map(|(from, to)| Rectangle::new([(from, range.start), (to, range.end)], style)),
    )?;
    Ok(())
}

/// Ground under a profile.
fn fill_below(
    chart: &mut Chart<'_>,
    profile: &[Vec<(f64, f64)>],
    floor: f64,
) -> Result<(), PictureError> {
    let strips = profile.iter().flat_map(|piece| piece.windows(2));
    chart.draw_series(strips.map(|pair| {
        let top = 0.5 * (pair[0].1 + pair[1].1);
        Rectangle::new([(pair[0].0, top), (pair[1].0, floor)], GROUND.filled())
    }))?;
    Ok(())
}
