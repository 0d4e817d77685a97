//! Colours, sizes and type: what makes the pictures look alike.

use ab_glyph::{Font, FontRef, PxScaleFont, ScaleFont};
use plotters::style::{
    Color, FontStyle, FontTransform, IntoTextStyle, RGBColor, ShapeStyle, TextStyle,
};
use plotters_backend::BackendTextStyle;
use plotters_backend::text_anchor::{HPos, VPos};
use std::sync::{LazyLock, Once};

use super::canvas::SCALE;

/// The sheet.
pub const PAPER: RGBColor = RGBColor(255, 255, 255);
/// Titles.
pub const INK: RGBColor = RGBColor(30, 34, 42);
/// Labels.
pub const SOFT_INK: RGBColor = RGBColor(92, 98, 110);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(226, 228, 233);
/// The haptic interface point, where the hand is.
pub const HIP: RGBColor = RGBColor(24, 78, 163);
/// The proxy, what the hand touches.
pub const PROXY: RGBColor = RGBColor(226, 84, 28);
/// The surface in a profile.
pub const SURFACE: RGBColor = RGBColor(120, 105, 82);
/// Ground under the surface in a profile.
pub const GROUND: RGBColor = RGBColor(233, 226, 212);
/// Behind the times of contact, laid on with [`TOUCHING_INK`].
pub const TOUCHING: RGBColor = RGBColor(248, 205, 165);
/// How much of [`TOUCHING`] covers what is below.
pub const TOUCHING_INK: f64 = 0.32;
/// For the points and curves of other pictures: six hues that differ in
/// lightness too.
pub const SERIES: [RGBColor; 6] = [
    HIP,
    PROXY,
    RGBColor(46, 139, 110),
    RGBColor(148, 82, 160),
    RGBColor(200, 152, 22),
    RGBColor(86, 92, 104),
];

/// The type family's name inside `plotters`.
const FAMILY: &str = "Noto Sans";

static REGULAR: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::REGULAR_TTF).ok());
static BOLD: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::BOLD_TTF).ok());

/// Finished pixels to drawing coordinates.
#[must_use]
pub const fn px(pixels: i32) -> i32 {
    pixels * SCALE
}

/// A line in a colour, its width in finished pixels.
#[must_use]
pub fn stroke(color: &RGBColor, pixels: f64) -> ShapeStyle {
    ShapeStyle {
        color: color.to_rgba(),
        filled: false,
        stroke_width: (pixels * f64::from(SCALE)).round() as u32,
    }
}

/// Regular type of a size in finished pixels.
#[must_use]
pub fn text(size: i32, color: &RGBColor) -> TextStyle<'static> {
    (FAMILY, px(size))
        .with_color(color)
        .into_text_style(&(1, 1))
}

/// Bold type of a size in finished pixels.
#[must_use]
pub fn bold(size: i32, color: &RGBColor) -> TextStyle<'static> {
    (FAMILY, px(size), FontStyle::Bold)
        .with_color(color)
        .into_text_style(&(1, 1))
}

/// Makes the typeface known to `plotters`, once.
pub(super) fn register_fonts() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let files = [
            (FontStyle::Normal, notosans::REGULAR_TTF),
            (FontStyle::Bold, notosans::BOLD_TTF),
        ];
        for (style, file) in files {
            // A broken file inside a crate cannot happen; text would be missing.
            let _ = plotters::style::register_font(FAMILY, style, file);
        }
    });
}

fn face<T: BackendTextStyle>(style: &T) -> Option<PxScaleFont<&'static FontRef<'static>>> {
    let bold = matches!(style.style(), FontStyle::Bold);
    let font = if bold { &*BOLD } else { &*REGULAR };
    font.as_ref().map(|f| f.as_scaled(style.size() as f32))
}

/// Advance width and cap height of a line of type, in drawing coordinates.
pub(super) fn text_size<T: BackendTextStyle>(text: &str, style: &T) -> (f32, f32) {
    let Some(face) = face(style) else {
        return (0.0, 0.0);
    };
    let end = pen_positions(&face, text)
        .last()
        .map_or(0.0, |(_, _, end)| end);
    (end, cap_height(&face))
}

/// Calls `ink(x, y, coverage)` for the pixels of a line of type, relative to
/// its anchor. `plotters`' own setter drops side bearings and kerning.
pub(super) fn set_type<T: BackendTextStyle>(
    text: &str,
    style: &T,
    mut ink: impl FnMut(i32, i32, f32),
) {
    let Some(face) = face(style) else {
        return;
    };
    let (width, height) = text_size(text, style);
    let anchor = style.anchor();
    let left = match anchor.h_pos {
        HPos::Left => 0.0,
        HPos::Center => -0.5 * width,
        HPos::Right => -width,
    };
    let baseline = match anchor.v_pos {
        VPos::Top => height,
        VPos::Center => 0.5 * height,
        VPos::Bottom => 0.0,
    };
    let turn = style.transform();
    for (letter, from, _) in pen_positions(&face, text) {
        let mut glyph = face.scaled_glyph(letter);
        glyph.position = ab_glyph::point(left + from, baseline);
        let Some(outline) = face.outline_glyph(glyph) else {
            continue;
        };
        let corner = outline.px_bounds().min;
        let (x0, y0) = (corner.x as i32, corner.y as i32);
        outline.draw(|x, y, coverage| {
            let (x, y) = turned(&turn, x0 + x.cast_signed(), y0 + y.cast_signed());
            ink(x, y, coverage);
        });
    }
}

fn turned(turn: &FontTransform, x: i32, y: i32) -> (i32, i32) {
    turn.transform(x, y)
}

fn cap_height(face: &PxScaleFont<&FontRef<'_>>) -> f32 {
    face.outline_glyph(face.scaled_glyph('H'))
        .map_or(0.0, |h| h.px_bounds().height())
}

/// Each letter with where its pen starts and ends.
fn pen_positions<'a>(
    face: &'a PxScaleFont<&'static FontRef<'static>>,
    text: &'a str,
) -> impl Iterator<Item = (char, f32, f32)> + 'a {
    let mut at = 0.0;
    let mut before = None;
    text.chars().map(move |letter| {
        let id = face.glyph_id(letter);
        at += before.map_or(0.0, |b| face.kern(b, id));
        let from = at;
        at += face.h_advance(id);
        before = Some(id);
        (letter, from, at)
    })
}

/// A colour between two, `t` from 0 to 1.
#[must_use]
pub fn mix(a: RGBColor, b: RGBColor, t: f64) -> RGBColor {
    let part = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * t).round() as u8;
    RGBColor(part(a.0, b.0), part(a.1, b.1), part(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn type_has_ink_inside_its_box_and_turns() {
        let style = text(20, &INK);
        let (width, height) = text_size("Height 0.5 µm", &style);
        assert!(width > 100.0 && height > 10.0);
        let mut ink = 0.0;
        set_type("Height 0.5 µm", &style, |x, y, coverage| {
            ink += coverage;
            assert!((-2..width as i32 + 2).contains(&x), "{x}");
            assert!((-10..height as i32 + 14).contains(&y), "{y}");
        });
        assert!(ink > 300.0);
        let upright = style.transform(FontTransform::Rotate270);
        set_type("H", &upright, |x, y, _| {
            assert!(x >= -1 && y <= 1, "{x} {y}");
        });
    }

    #[test]
    fn both_faces_are_readable() {
        assert!(REGULAR.is_some() && BOLD.is_some());
        // None of what the pictures write comes out as an empty box.
        for letter in "aZ09.,:−×·µ°()%±".chars() {
            for font in [&REGULAR, &BOLD] {
                let known = font.as_ref().map(|f| f.glyph_id(letter).0 != 0);
                assert_eq!(known, Some(true), "{letter}");
            }
        }
        let wide = text_size("mm", &bold(20, &INK)).0;
        assert!(wide > text_size("mm", &text(20, &INK)).0);
    }
}
