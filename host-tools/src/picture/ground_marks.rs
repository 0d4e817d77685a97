//! Marks of the ground on a map: a scale bar, and the coordinates of two corners.

use plotters::element::Rectangle;
use plotters::style::{Color, WHITE};
use plotters_backend::text_anchor::HPos;

use super::axes::{self, Area};
use super::canvas::PictureError;
use super::map_view::MapView;
use super::style::{self, INK, px};

/// Facts about the ground for a picture.
#[derive(Clone, Copy)]
pub struct GroundFacts<'a> {
    /// Ground metres for each device millimetre, if the terrain has a size.
    pub metres_per_mm: Option<f64>,
    /// Returns the coordinates of a place in device millimetres east and north, as short text.
    pub place_of: &'a dyn Fn(f64, f64) -> String,
    /// Scale and place for the panel: short names, and values with their units.
    pub lines: &'a [(String, String)],
}

/// Max share of the map's width for the bar.
const BAR_SHARE: f64 = 0.25;
/// Distance of the marks from the map's sides, and padding around their text, finished pixels.
const MARK_MARGIN_PX: i32 = 10;
const PADDING_PX: i32 = 6;
/// Height of a line of text, and of the bar, finished pixels.
const LINE_PX: i32 = 22;
const BAR_PX: i32 = 6;

/// Draws the marks on the map's area.
pub(super) fn draw(
    area: &Area<'_>,
    window: &MapView,
    facts: &GroundFacts<'_>,
) -> Result<(), PictureError> {
    let (width, height) = area.dim_in_pixel();
    let (width, height) = (width.cast_signed(), height.cast_signed());
    let (east, north) = (window.west + window.width, window.south + window.height);
    let line = px(LINE_PX + 2 * PADDING_PX);
    let south_west = (facts.place_of)(window.west, window.south);
    let north_east = (facts.place_of)(east, north);
    plate(
        area,
        &south_west,
        (px(MARK_MARGIN_PX), height - px(MARK_MARGIN_PX) - line),
        HPos::Left,
    )?;
    plate(
        area,
        &north_east,
        (width - px(MARK_MARGIN_PX), px(MARK_MARGIN_PX)),
        HPos::Right,
    )?;
    if let Some(metres_per_mm) = facts.metres_per_mm {
        let pixels_a_mm = f64::from(width) / window.width;
        let bar = Bar::of(window.width, metres_per_mm);
        bar.draw(area, pixels_a_mm, (width, height))?;
    }
    Ok(())
}

/// Draws text on a light plate, with an upper corner (`side`) at `at`.
fn plate(area: &Area<'_>, text: &str, at: (i32, i32), side: HPos) -> Result<(), PictureError> {
    let font = style::text(18, &INK);
    let wide = area.estimate_text_size(text, &font)?.0.cast_signed() + 2 * px(PADDING_PX);
    let left = match side {
        HPos::Right => at.0 - wide,
        _ => at.0,
    };
    let high = px(LINE_PX + 2 * PADDING_PX);
    paper(area, [(left, at.1), (left + wide, at.1 + high)])?;
    axes::write(
        area,
        text,
        (left + px(PADDING_PX), at.1 + high / 2),
        font,
        HPos::Left,
    )
}

fn paper(area: &Area<'_>, corners: [(i32, i32); 2]) -> Result<(), PictureError> {
    Ok(area.draw(&Rectangle::new(corners, WHITE.mix(0.78).filled()))?)
}

/// A round length on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bar {
    metres: f64,
    mm: f64,
}

impl Bar {
    /// Returns the longest round length within its share of a map's width, mm.
    fn of(width_mm: f64, metres_per_mm: f64) -> Self {
        let max_m = BAR_SHARE * width_mm * metres_per_mm;
        let power = 10f64.powf(max_m.log10().floor());
        let digit = [5.0, 2.0, 1.0]
            .into_iter()
            .find(|digit| digit * power <= max_m);
        let metres = digit.unwrap_or(1.0) * power;
        Self {
            metres,
            mm: metres / metres_per_mm,
        }
    }

    /// Returns its length on the ground and in device millimetres.
    fn text(&self) -> String {
        let ground = match self.metres {
            metres if metres >= 1000.0 => format!("{} km", axes::number(&(metres / 1000.0))),
            metres => format!("{} m", axes::number(&metres)),
        };
        let decimals = (2.0 - self.mm.max(1e-9).log10().floor()).clamp(0.0, 4.0);
        let unit = 10f64.powf(decimals);
        format!(
            "{ground} = {} mm",
            axes::number(&((self.mm * unit).round() / unit))
        )
    }

    fn draw(
        &self,
        area: &Area<'_>,
        pixels_a_mm: f64,
        (width, height): (i32, i32),
    ) -> Result<(), PictureError> {
        let text = self.text();
        let font = style::bold(18, &INK);
        let long = (self.mm * pixels_a_mm).round() as i32;
        let wide = area
            .estimate_text_size(&text, &font)?
            .0
            .cast_signed()
            .max(long);
        let (right, bottom) = (width - px(MARK_MARGIN_PX), height - px(MARK_MARGIN_PX));
        let left = right - wide - 2 * px(PADDING_PX);
        let top = bottom - px(LINE_PX + BAR_PX + 3 * PADDING_PX);
        paper(area, [(left, top), (right, bottom)])?;
        let middle = (left + right) / 2;
        let text_at = (middle, top + px(PADDING_PX + LINE_PX / 2));
        axes::write(area, &text, text_at, font, HPos::Center)?;
        let bar = [
            (middle - long / 2, bottom - px(PADDING_PX + BAR_PX)),
            (middle - long / 2 + long, bottom - px(PADDING_PX)),
        ];
        Ok(area.draw(&Rectangle::new(bar, INK.filled()))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bar_is_a_round_length_within_its_limit() {
        for (width_mm, metres_per_mm, metres, text) in [
            (300.0, 10.0, 500.0, "500 m = 50 mm"),
            (300.0, 30.0, 2000.0, "2 km = 66.7 mm"),
            (100.0, 0.002, 0.05, "0.05 m = 25 mm"),
            (250.0, 1600.0, 1e5, "100 km = 62.5 mm"),
        ] {
            let bar = Bar::of(width_mm, metres_per_mm);
            assert!((bar.metres / metres - 1.0).abs() < 1e-12, "{bar:?}");
            assert!(bar.mm <= BAR_SHARE * width_mm * (1.0 + 1e-12), "{bar:?}");
            assert_eq!(bar.text(), text);
        }
    }
}
