//! Text as outlines: Noto Sans (SIL Open Font License), from the `notosans` crate.

use ab_glyph::{Font, FontRef, OutlineCurve, Point, ScaleFont};
use std::sync::LazyLock;
use tiny_skia::{Path, PathBuilder};

static REGULAR: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::REGULAR_TTF).ok());
static BOLD: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(notosans::BOLD_TTF).ok());

/// A line of text, y downwards, its pen starting at the origin on the baseline.
#[derive(Default)]
pub(super) struct TextLine {
    /// Outline that is filled with ink; `None` for blanks.
    pub(super) outline: Option<Path>,
    /// Advance of the pen.
    pub(super) width: f32,
    /// Height of its capitals.
    pub(super) height: f32,
}

impl TextLine {
    /// Sets a text with kerning, at a `size` from the lowest to the highest letter.
    pub(super) fn new(text: &str, bold: bool, size: f32) -> Self {
        // The font is part of the crate, so it is valid; otherwise text would be missing.
        let Some(font) = (if bold { &*BOLD } else { &*REGULAR }) else {
            return Self::default();
        };
        let face = font.as_scaled(size);
        let (scale, mut pen, mut before) = (face.h_scale_factor(), 0.0, None);
        let mut path = PathBuilder::new();
        for letter in text.chars().map(|letter| font.glyph_id(letter)) {
            pen += before.map_or(0.0, |before| face.kern(before, letter));
            for curve in font
                .outline(letter)
                .map_or(vec![], |outline| outline.curves)
            {
                append(&mut path, curve, |p| (pen + scale * p.x, -scale * p.y));
            }
            pen += face.h_advance(letter);
            before = Some(letter);
        }
        let capital = font.outline(font.glyph_id('H'));
        Self {
            outline: path.finish(),
            width: pen,
            height: capital.map_or(0.0, |h| scale * h.bounds.height().abs()),
        }
    }
}

/// Appends a curve; it starts a new contour if it does not start at the end of the last.
fn append(path: &mut PathBuilder, curve: OutlineCurve, place: impl Fn(Point) -> (f32, f32)) {
    let (OutlineCurve::Line(from, _)
    | OutlineCurve::Quad(from, ..)
    | OutlineCurve::Cubic(from, ..)) = curve;
    let (x, y) = place(from);
    if path.last_point() != Some(tiny_skia::Point::from_xy(x, y)) {
        path.move_to(x, y);
    }
    match curve {
        OutlineCurve::Line(_, to) => {
            let (x, y) = place(to);
            path.line_to(x, y);
        }
        OutlineCurve::Quad(_, by, to) => {
            let ((x1, y1), (x, y)) = (place(by), place(to));
            path.quad_to(x1, y1, x, y);
        }
        OutlineCurve::Cubic(_, by, then_by, to) => {
            let ((x1, y1), (x2, y2), (x, y)) = (place(by), place(then_by), place(to));
            path.cubic_to(x1, y1, x2, y2, x, y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_outline_lies_inside_its_box() {
        let line = TextLine::new("Height 0.5 µm", false, 40.0);
        assert!(line.width > 100.0 && line.height > 10.0);
        let bounds = line.outline.expect("letters").bounds();
        assert!(bounds.left() > -2.0 && bounds.right() < line.width + 2.0);
        assert!(bounds.top() > -line.height - 10.0 && bounds.bottom() < 14.0);
    }

    #[test]
    fn both_fonts_can_be_parsed() {
        assert!(REGULAR.is_some() && BOLD.is_some());
        // The font has all characters of the pictures.
        for letter in "aZ09.,:−×·µ°()%±".chars() {
            for font in [&REGULAR, &BOLD] {
                let known = font.as_ref().map(|f| f.glyph_id(letter).0 != 0);
                assert_eq!(known, Some(true), "{letter}");
            }
        }
        let width = |bold| TextLine::new("mm", bold, 40.0).width;
        assert!(width(true) > width(false));
    }
}
