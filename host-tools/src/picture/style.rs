//! Colours, sizes and fonts of all pictures.

use plotters::style::{Color, FontStyle, IntoTextStyle, RGBColor, ShapeStyle, TextStyle};

/// Drawing coordinates per pixel of the finished picture.
pub const SCALE: i32 = 2;

/// The sheet.
pub const PAPER: RGBColor = RGBColor(255, 255, 255);
/// Titles.
pub const INK: RGBColor = RGBColor(30, 34, 42);
/// Labels.
pub const SOFT_INK: RGBColor = RGBColor(92, 98, 110);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(226, 228, 233);
/// The haptic interface point (HIP).
pub const HIP: RGBColor = RGBColor(24, 78, 163);
/// The proxy.
pub const PROXY: RGBColor = RGBColor(226, 84, 28);
/// The surface in a profile.
pub const SURFACE: RGBColor = RGBColor(120, 105, 82);
/// Ground under the surface in a profile.
pub const GROUND: RGBColor = RGBColor(233, 226, 212);
/// Background of the times of contact, drawn with the opacity [`TOUCHING_INK`].
pub const TOUCHING: RGBColor = RGBColor(248, 205, 165);
/// Opacity of [`TOUCHING`].
pub const TOUCHING_INK: f64 = 0.32;
/// For the points and curves of other pictures: six hues that also differ in lightness.
pub const SERIES: [RGBColor; 6] = [
    HIP,
    PROXY,
    RGBColor(46, 139, 110),
    RGBColor(148, 82, 160),
    RGBColor(200, 152, 22),
    RGBColor(86, 92, 104),
];

/// Name of the only font in `plotters`.
const FAMILY: &str = "Noto Sans";

/// Converts finished pixels to drawing coordinates.
#[must_use]
pub const fn px(pixels: i32) -> i32 {
    pixels * SCALE
}

/// Returns a line style; its width is in finished pixels.
#[must_use]
pub fn stroke(color: &RGBColor, pixels: f64) -> ShapeStyle {
    ShapeStyle {
        color: color.to_rgba(),
        filled: false,
        stroke_width: (pixels * f64::from(SCALE)).round() as u32,
    }
}

/// Returns regular text of a size in finished pixels.
#[must_use]
pub fn text(size: i32, color: &RGBColor) -> TextStyle<'static> {
    (FAMILY, px(size))
        .with_color(color)
        .into_text_style(&(1, 1))
}

/// Returns bold text of a size in finished pixels.
#[must_use]
pub fn bold(size: i32, color: &RGBColor) -> TextStyle<'static> {
    (FAMILY, px(size), FontStyle::Bold)
        .with_color(color)
        .into_text_style(&(1, 1))
}

/// Returns a colour between two, `t` from 0 to 1.
#[must_use]
pub fn mix(a: RGBColor, b: RGBColor, t: f64) -> RGBColor {
    let part = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * t).round() as u8;
    RGBColor(part(a.0, b.0), part(a.1, b.1), part(a.2, b.2))
}
