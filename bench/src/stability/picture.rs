//! The table as a picture: the energy from the surface in a tap by stiffness, one chart for each
//! rate, and the result of the press.

use plotters::coord::combinators::IntoLogRange;
use plotters::drawing::IntoDrawingArea;
use plotters::element::{Circle, Cross};
use plotters::style::{Color, RGBColor};
use plotters_backend::text_anchor::HPos;

use super::grasp::Grasp;
use super::map::{self, Map};
use super::setting::Column;
use super::tap::TAP_SPEEDS_M_S;
use super::trial::{Trial, Verdict};
use hapterra::picture::axes::{self, Area, Titles};
use hapterra::picture::style::{self, INK, SERIES, SOFT_INK, px, stroke};
use hapterra::picture::{Canvas, PictureError, line};

const WIDTH_PX: i32 = 1600;
const HEADER_PX: i32 = 110;
const CHART_PX: i32 = 420;
const MARGIN_PX: i32 = 30;
/// Range of energy in the drawing, mJ: values outside lie on the edge.
const GAINED_MJ: std::ops::Range<f64> = 0.01..100.0;
/// Speed of the taps in the drawing, as an index into [`TAP_SPEEDS_M_S`].
const DRAWN_SPEED: usize = 1;
const COLOURS: [RGBColor; 3] = [SERIES[1], SERIES[0], SERIES[2]];

/// Draws the table, at the largest friction of the arm.
///
/// # Errors
/// Any error of `plotters`.
pub fn draw(map: &Map) -> Result<Canvas, PictureError> {
    // A row for each rate, a column for each damping; with one damping, the rates in two columns.
    let mut columns = map.columns();
    // Less friction of the arm hardly changes a tap.
    let friction = columns.iter().map(|(.., part)| *part).fold(0.0, f64::max);
    columns.retain(|(.., part)| *part == friction);
    let across = match columns.len() / map.rates().len() {
        1 => 2,
        dampings => dampings,
    };
    let rows = columns.len().div_ceil(across) as i32;
    let across = across as i32;
    let height = HEADER_PX + rows * CHART_PX + MARGIN_PX;
    let mut canvas = Canvas::new(WIDTH_PX as u16, height as u16);
    let sheet = canvas.pen().into_drawing_area();
    let part = |x: i32, y: i32, width: i32, height: i32| {
        sheet
            .clone()
            .shrink((px(x), px(y)), (px(width), px(height)))
    };
    header(&part(MARGIN_PX, 0, WIDTH_PX - 2 * MARGIN_PX, HEADER_PX))?;
    let width = (WIDTH_PX - (across + 1) * MARGIN_PX) / across;
    for (i, column) in (0..).zip(columns) {
        let (left, top) = (
            MARGIN_PX + (i % across) * (width + MARGIN_PX),
            HEADER_PX + i / across * CHART_PX,
        );
        let area = part(left, top, width, CHART_PX - MARGIN_PX / 2);
        chart(&area, map, column)?;
    }
    drop(sheet);
    Ok(canvas)
}

fn header(area: &Area<'_>) -> Result<(), PictureError> {
    let (title, text) = (style::bold(32, &INK), style::text(20, &SOFT_INK));
    let name = "Energy that a surface adds in a tap, by its stiffness";
    axes::write(area, name, (0, px(34)), title, HPos::Left)?;
    let lines = format!(
        "taps at {} m/s; dot: a press with 1 N is still, ring: limit cycle, cross: unstable; grey: 2b/T (Colgate & Schenkel) and 2fc/Δ (Abbott & Okamura) of the arm alone",
        TAP_SPEEDS_M_S[DRAWN_SPEED]
    );
    axes::write(area, &lines, (0, px(68)), text, HPos::Left)?;
    let mut left = 0;
    for (grasp, colour) in Grasp::ALL.iter().zip(&COLOURS) {
        let style = style::bold(20, colour);
        let name = format!("{} grasp", grasp.name());
        axes::write(area, &name, (left, px(94)), style.clone(), HPos::Left)?;
        left += area.estimate_text_size(&name, &style)?.0 as i32 + px(24);
    }
    Ok(())
}

fn chart(
    area: &Area<'_>,
    map: &Map,
    column @ (rate, damping, part): Column,
) -> Result<(), PictureError> {
    let all = map
        .trials
        .iter()
        .map(|trial| trial.setting.stiffness_n_per_mm);
    let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(low, high), stiffness| {
        (low.min(stiffness), high.max(stiffness))
    });
    let range = 0.8 * low..1.25 * high;
    let title = map::name(damping);
    let x = format!(
        "stiffness (N/mm) at {} Hz, {}, {part} of the arm's friction",
        rate.hz(),
        title.trim_end_matches(':')
    );
    let titles = Titles {
        x: &x,
        y: "energy of a tap (mJ)",
    };
    let mut chart = axes::chart(
        area,
        range.clone().log_scale(),
        GAINED_MJ.log_scale(),
        titles,
    )?;
    for bound in [map.at_tip.by_damping(rate), map.at_tip.by_friction()] {
        if range.contains(&bound) {
            let upright = vec![(bound, GAINED_MJ.start), (bound, GAINED_MJ.end)];
            line::draw(&mut chart, &[upright], stroke(&SOFT_INK, 1.2))?;
        }
    }
    for (grasp, colour) in Grasp::ALL.into_iter().zip(COLOURS) {
        let points: Vec<_> = map.of(column, grasp).map(place).collect();
        line::draw(&mut chart, &[points], stroke(&colour, 2.0))?;
        for trial in map.of(column, grasp) {
            let at = place(trial);
            let (ring, dot) = (stroke(&colour, 2.0), colour.filled());
            match trial.press.verdict(map.at_tip.count_mm) {
                Verdict::Still => drop(chart.draw_series([Circle::new(at, px(4), dot)])?),
                Verdict::LimitCycle => drop(chart.draw_series([Circle::new(at, px(6), ring)])?),
                Verdict::Unstable => drop(chart.draw_series([Cross::new(at, px(7), ring)])?),
            }
        }
    }
    Ok(())
}

/// Returns the position of a trial in the chart: at the top if the guard switched the force off.
fn place(trial: &Trial) -> (f64, f64) {
    let gained_mj = trial.taps[DRAWN_SPEED].map_or(GAINED_MJ.end, |taps| taps.gained_mj);
    let gained_mj = gained_mj.clamp(GAINED_MJ.start, GAINED_MJ.end);
    (trial.setting.stiffness_n_per_mm, gained_mj)
}
