//! Beside the map: the key, the colour scale, where the map lies, and figures.

use plotters::element::{Circle, PathElement, Rectangle, Text};
use plotters::style::{Color, WHITE};
use plotters_backend::text_anchor::{HPos, Pos, VPos};

use super::axes::{self, Area};
use super::canvas::PictureError;
use super::map;
use super::relief::{self, Field, Relief};
use super::style::{self, HIP, INK, PROXY, SOFT_INK, SURFACE, TOUCHING, TOUCHING_INK, px, stroke};
use super::window::Window;

/// Height of a line of text, finished pixels.
const LINE_PX: i32 = 30;
/// Widest inset and colour scale.
const WIDE_PX: i32 = 330;

/// Writes the panel from the top down.
pub(super) fn draw(
    area: &Area<'_>,
    relief: &Relief,
    field: &Field<'_>,
    window: &Window,
    facts: &[(String, String)],
) -> Result<(), PictureError> {
    let mut y = px(8);
    y = key(area, y, relief.holes)? + px(16);
    y = scale(area, y, relief)? + px(20);
    y = figures(area, y, facts)? + px(20);
    if !window.shows_all(field.size_mm) {
        heading(area, y, "Where the map lies")?;
        let (width, height) = area.dim_in_pixel();
        let top = y + px(20);
        let rest = height.cast_signed() - top;
        if rest > px(60) {
            let width = width.cast_signed().min(px(WIDE_PX));
            let place = area.clone().shrink((0, top), (width, rest.min(px(300))));
            map::inset(&place, field, window)?;
        }
    }
    Ok(())
}

fn heading(area: &Area<'_>, y: i32, name: &str) -> Result<(), PictureError> {
    let font = style::bold(18, &INK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(name.to_owned(), (0, y), font))?;
    Ok(())
}

fn label(area: &Area<'_>, x: i32, y: i32, text: &str, side: HPos) -> Result<(), PictureError> {
    let font = style::text(18, &SOFT_INK).pos(Pos::new(side, VPos::Center));
    area.draw(&Text::new(text.to_owned(), (x, y), font))?;
    Ok(())
}

/// What the lines and colours mean.
fn key(area: &Area<'_>, top: i32, holes: bool) -> Result<i32, PictureError> {
    let (left, right, text) = (0, px(40), px(54));
    let across = |y: i32| vec![(left + px(3), y), (right - px(3), y)];
    let patch = |y: i32| [(left, y - px(8)), (right, y + px(8))];
    let mut y = top + px(4);
    area.draw(&PathElement::new(across(y), stroke(&HIP, 2.0)))?;
    label(area, text, y, "hand (haptic interface point)", HPos::Left)?;
    y += px(LINE_PX);
    area.draw(&PathElement::new(across(y), stroke(&PROXY, 5.5)))?;
    label(area, text, y, "proxy, while in contact", HPos::Left)?;
    y += px(LINE_PX);
    area.draw(&Rectangle::new(patch(y), style::GROUND.filled()))?;
    let rim = vec![(left, y - px(8)), (right, y - px(8))];
    area.draw(&PathElement::new(rim, stroke(&SURFACE, 2.0)))?;
    label(area, text, y, "surface under the hand", HPos::Left)?;
    y += px(LINE_PX);
    area.draw(&Rectangle::new(
        patch(y),
        TOUCHING.mix(TOUCHING_INK).filled(),
    ))?;
    label(area, text, y, "time in contact", HPos::Left)?;
    y += px(LINE_PX);
    for (x, inner) in [(px(10), WHITE), (px(30), HIP)] {
        area.draw(&Circle::new((x, y), px(7), HIP.filled()))?;
        area.draw(&Circle::new((x, y), px(4), inner.filled()))?;
    }
    label(area, text, y, "start and end", HPos::Left)?;
    y += px(LINE_PX);
    if holes {
        for row in 0..16 {
            for column in 0..40 {
                let at = (px(column), y + px(row - 8));
                let cell = [at, (at.0 + 1, at.1 + 1)];
                let color = relief::hole(column, row);
                area.draw(&Rectangle::new(cell, color.filled()))?;
            }
        }
        label(area, text, y, "no data (a hole)", HPos::Left)?;
        y += px(LINE_PX);
    }
    Ok(y)
}

/// The colours of the heights.
fn scale(area: &Area<'_>, top: i32, relief: &Relief) -> Result<i32, PictureError> {
    heading(area, top, "Height of the surface (mm)")?;
    let width = area.dim_in_pixel().0.cast_signed().min(px(WIDE_PX));
    let (bar_top, bar_bottom) = (top + px(18), top + px(34));
    for x in 0..width {
        let color = relief::tint(f64::from(x) / f64::from(width));
        area.draw(&Rectangle::new(
            [(x, bar_top), (x, bar_bottom)],
            color.filled(),
        ))?;
    }
    let y = bar_bottom + px(16);
    let (low, high) = relief.range_mm;
    // As many decimals as tell the middle from the ends.
    let decimals = (1.0 - (high - low).max(1e-9).log10())
        .ceil()
        .clamp(0.0, 9.0);
    let unit = 10f64.powf(-decimals);
    let text = |height: f64| axes::number(&((height / unit).round() * unit));
    label(area, 0, y, &text(low), HPos::Left)?;
    label(area, width / 2, y, &text(0.5 * (low + high)), HPos::Center)?;
    label(area, width, y, &text(high), HPos::Right)?;
    Ok(y + px(14))
}

/// Names on the left, values on the right.
fn figures(area: &Area<'_>, top: i32, facts: &[(String, String)]) -> Result<i32, PictureError> {
    if facts.is_empty() {
        return Ok(top);
    }
    heading(area, top, "Figures")?;
    let width = area.dim_in_pixel().0.cast_signed().min(px(WIDE_PX));
    let mut y = top + px(LINE_PX);
    for (name, value) in facts {
        label(area, 0, y, name, HPos::Left)?;
        let font = style::bold(18, &INK).pos(Pos::new(HPos::Right, VPos::Center));
        area.draw(&Text::new(value.clone(), (width, y), font))?;
        y += px(LINE_PX);
    }
    Ok(y)
}
