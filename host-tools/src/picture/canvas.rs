//! A drawing backend for `plotters`: `tiny-skia` draws with antialiasing, `lettering` sets the
//! text.

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle,
};
use std::convert::Infallible;
use std::path::Path;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, PathBuilder, PixmapMut, Rect, Stroke, Transform,
};

use super::lettering::TextLine;
use super::style::SCALE;
use crate::output::{Output, OutputError};

/// A picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file could not be created or written.
    #[error("{0}: {source}", source = .0.source)]
    Write(OutputError),
    /// `plotters` failed, for example on an area without room.
    #[error("cannot draw the picture: {0}")]
    Layout(String),
}

impl<E: std::error::Error + Send + Sync> From<plotters::drawing::DrawingAreaErrorKind<E>>
    for PictureError
{
    fn from(error: plotters::drawing::DrawingAreaErrorKind<E>) -> Self {
        Self::Layout(error.to_string())
    }
}

/// The image for the drawing.
pub struct Canvas {
    width: u32,
    height: u32,
    /// Red, green, blue and an alpha that is always opaque, row by row from the top.
    rgba: Vec<u8>,
}

impl Canvas {
    /// Creates a white sheet of a finished size in pixels.
    #[must_use]
    pub fn new(width: u16, height: u16) -> Self {
        Self {
            width: width.into(),
            height: height.into(),
            rgba: vec![u8::MAX; 4 * usize::from(width) * usize::from(height)],
        }
    }

    /// Returns the backend for `plotters`.
    pub fn pen(&mut self) -> Pen<'_> {
        Pen { canvas: self }
    }

    /// Returns the finished size in pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the finished picture, RGB, row by row from the top.
    #[must_use]
    pub fn to_rgb(&self) -> Vec<u8> {
        let pixels = self.rgba.as_chunks::<4>().0;
        let rgb = pixels.iter().map(|[r, g, b, _]| [*r, *g, *b]);
        rgb.flatten().collect()
    }

    /// Writes the finished picture as a PNG file, which appears when it is complete.
    ///
    /// # Errors
    /// [`PictureError::Write`] if the file cannot be created or written.
    pub fn save(&self, path: &Path) -> Result<(), PictureError> {
        let mut output = Output::create(path).map_err(PictureError::Write)?;
        let encoded = self.encode(&mut output).map_err(|source| OutputError {
            path: path.to_owned(),
            source,
        });
        let finished = encoded.and_then(|()| output.finish());
        finished.map_err(PictureError::Write)
    }

    fn encode(&self, output: &mut Output) -> std::io::Result<()> {
        let mut encoder = png::Encoder::new(output, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.to_rgb())?;
        Ok(writer.finish()?)
    }

    /// Fills a path in drawing coordinates, transformed by `place`.
    fn fill(&mut self, path: Option<tiny_skia::Path>, ink: BackendColor, place: Transform) {
        let pixmap = PixmapMut::from_bytes(&mut self.rgba, self.width, self.height);
        if let Some((mut pixmap, path)) = pixmap.zip(path) {
            let place = place.post_concat(to_pixels());
            pixmap.fill_path(&path, &paint(ink), FillRule::Winding, place, None);
        }
    }

    /// Draws a path in drawing coordinates, with round joins and ends.
    fn stroke(&mut self, path: Option<tiny_skia::Path>, style: &impl BackendStyle) {
        let stroke = Stroke {
            width: style.stroke_width() as f32,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        let pixmap = PixmapMut::from_bytes(&mut self.rgba, self.width, self.height);
        if let Some((mut pixmap, path)) = pixmap.zip(path) {
            pixmap.stroke_path(&path, &paint(style.color()), &stroke, to_pixels(), None);
        }
    }
}

/// Returns the transformation from drawing coordinates to finished pixels.
fn to_pixels() -> Transform {
    let scale = 1.0 / SCALE as f32;
    Transform::from_scale(scale, scale)
}

fn paint(ink: BackendColor) -> Paint<'static> {
    let (r, g, b) = ink.rgb;
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * ink.alpha).round() as u8);
    paint
}

/// Returns a path through the centres of points.
fn polyline(points: impl IntoIterator<Item = BackendCoord>) -> PathBuilder {
    let mut path = PathBuilder::new();
    for (x, y) in points {
        let (x, y) = (x as f32 + 0.5, y as f32 + 0.5);
        if path.is_empty() {
            path.move_to(x, y);
        } else {
            path.line_to(x, y);
        }
    }
    path
}

fn set<T: BackendTextStyle>(text: &str, style: &T) -> TextLine {
    let bold = matches!(style.style(), FontStyle::Bold);
    TextLine::new(text, bold, style.size() as f32)
}

/// The `plotters` backend of a [`Canvas`].
pub struct Pen<'a> {
    canvas: &'a mut Canvas,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let scale = SCALE.unsigned_abs();
        (self.canvas.width * scale, self.canvas.height * scale)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        self.draw_rect(at, at, &color, true)
    }

    /// Draws a line; a horizontal or vertical one is aligned to the finished pixels, to be sharp.
    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        let width = style.stroke_width().cast_signed();
        let sharp = |at: i32| {
            let first = at.div_euclid(SCALE) * SCALE - (width / 2).div_euclid(SCALE) * SCALE;
            [first, first + width - 1]
        };
        let along = |a: i32, b: i32| [a.min(b), a.max(b)];
        let ([left, right], [top, bottom]) = match (from.0 == to.0, from.1 == to.1) {
            (_, true) => (along(from.0, to.0), sharp(from.1)),
            (true, false) => (sharp(from.0), along(from.1, to.1)),
            (false, false) => return self.draw_path([from, to], style),
        };
        self.draw_rect((left, top), (right, bottom), &style.color(), true)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if fill {
            let [left, top] = [left, top].map(|edge| edge as f32);
            let [right, bottom] = [right, bottom].map(|edge| edge as f32 + 1.0);
            let path = Rect::from_ltrb(left, top, right, bottom).map(PathBuilder::from_rect);
            self.canvas.fill(path, style.color(), Transform::identity());
            return Ok(());
        }
        self.draw_line((left, top), (right, top), style)?;
        self.draw_line((left, bottom), (right, bottom), style)?;
        self.draw_line((left, top), (left, bottom), style)?;
        self.draw_line((right, top), (right, bottom), style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        self.canvas.stroke(polyline(path).finish(), style);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (x, y) = (center.0 as f32 + 0.5, center.1 as f32 + 0.5);
        let path = PathBuilder::from_circle(x, y, radius as f32);
        if fill {
            self.canvas.fill(path, style.color(), Transform::identity());
        } else {
            self.canvas.stroke(path, style);
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Drawn {
        let path = polyline(corners).finish();
        self.canvas.fill(path, style.color(), Transform::identity());
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Drawn {
        let line = set(text, style);
        let anchor = style.anchor();
        let left = match anchor.h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * line.width,
            HPos::Right => -line.width,
        };
        let baseline = match anchor.v_pos {
            VPos::Top => line.height,
            VPos::Center => 0.5 * line.height,
            VPos::Bottom => 0.0,
        };
        let turn = style.transform();
        let ((ax, ay), (bx, by)) = (turn.transform(1, 0), turn.transform(0, 1));
        let [ax, ay, bx, by, x, y] = [ax, ay, bx, by, at.0, at.1].map(|v| v as f32);
        let place = Transform::from_row(ax, ay, bx, by, x, y).pre_translate(left, baseline);
        self.canvas.fill(line.outline, style.color(), place);
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        style: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let line = set(text, style);
        Ok((line.width.ceil() as u32, line.height.ceil() as u32))
    }

    /// Copies each pixel of the bitmap to one finished pixel.
    fn blit_bitmap(&mut self, at: BackendCoord, size: (u32, u32), rgb: &[u8]) -> Drawn {
        let (x, y) = (at.0 / SCALE, at.1 / SCALE);
        let (width, height) = (self.canvas.width as i32, self.canvas.height as i32);
        let rows = rgb.chunks_exact(3 * size.0.max(1) as usize);
        for (y, row) in (y..height).zip(rows).filter(|(y, _)| *y >= 0) {
            let pixels = (x..width).zip(row.as_chunks::<3>().0);
            for (x, pixel) in pixels.filter(|(x, _)| *x >= 0) {
                let place = 4 * (y * width + x) as usize;
                self.canvas.rgba[place..place + 3].copy_from_slice(pixel);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::style;
    use plotters::prelude::*;

    fn pixel(canvas: &Canvas, x: u32, y: u32) -> [u8; 3] {
        let at = ((y * canvas.size().0 + x) * 3) as usize;
        canvas.to_rgb()[at..at + 3].try_into().expect("three bytes")
    }

    #[test]
    fn ruled_line_is_sharp_and_slanted_line_is_smooth() {
        let mut canvas = Canvas::new(40, 40);
        {
            let area = canvas.pen().into_drawing_area();
            let slanted = PathElement::new(vec![(4, 60), (76, 76)], style::stroke(&BLACK, 1.0));
            area.draw(&slanted).expect("drawn");
        }
        let mut pen = canvas.pen();
        pen.draw_line((0, 20), (79, 20), &style::stroke(&BLACK, 1.0))
            .expect("drawn");
        assert_eq!(pixel(&canvas, 20, 10), [0; 3]);
        assert_eq!(pixel(&canvas, 20, 9), [255; 3]);
        assert_eq!(pixel(&canvas, 20, 11), [255; 3]);
        let column: Vec<u8> = (28..40).map(|y| pixel(&canvas, 21, y)[0]).collect();
        assert!(column.iter().any(|v| (100..254).contains(v)), "{column:?}");
    }

    #[test]
    fn drawing_past_the_edge_is_cut_off() {
        let mut canvas = Canvas::new(10, 10);
        let mut pen = canvas.pen();
        pen.draw_line((-50, -20), (90, 70), &style::stroke(&RED, 2.5))
            .expect("drawn");
        pen.draw_circle((0, 0), 30, &RED, true).expect("drawn");
        pen.draw_rect((-9, -9), (99, 99), &RED, true)
            .expect("drawn");
        assert!(
            canvas
                .to_rgb()
                .as_chunks::<3>()
                .0
                .iter()
                .all(|p| *p == [255, 0, 0])
        );
    }

    #[test]
    fn failed_save_names_the_file() {
        let path = Path::new("/nonexistent-folder/picture.png");
        let error = Canvas::new(2, 2).save(path).expect_err("no folder");
        assert!(
            error
                .to_string()
                .contains("/nonexistent-folder/picture.png")
        );
    }
}
