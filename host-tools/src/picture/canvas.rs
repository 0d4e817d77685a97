//! A drawing backend for `plotters`: strokes, discs and type with soft edges
//! on an RGB image twice the final size in each direction.

use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};
use std::convert::Infallible;
use std::path::{Path, PathBuf};

use super::style;

/// Drawing coordinates per pixel of the finished picture.
pub const SCALE: i32 = 2;

/// A picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file could not be made or filled.
    #[error("cannot write the picture {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// `plotters` gave up, for example on an area without room.
    #[error("cannot lay out the picture: {0}")]
    Layout(String),
}

impl<E: std::error::Error + Send + Sync> From<plotters::drawing::DrawingAreaErrorKind<E>>
    for PictureError
{
    fn from(error: plotters::drawing::DrawingAreaErrorKind<E>) -> Self {
        Self::Layout(error.to_string())
    }
}

/// The image that is drawn on.
pub struct Canvas {
    width: i32,
    height: i32,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A blank sheet of a finished size in pixels.
    #[must_use]
    pub fn new(width: u16, height: u16) -> Self {
        let (width, height) = (i32::from(width) * SCALE, i32::from(height) * SCALE);
        let plotters::style::RGBColor(r, g, b) = style::PAPER;
        Self {
            width,
            height,
            pixels: vec![[r, g, b]; width as usize * height as usize],
        }
    }

    /// The backend to hand to `plotters`.
    pub fn pen(&mut self) -> Pen<'_> {
        style::register_fonts();
        Pen { canvas: self }
    }

    /// The finished size in pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        let pixels = |n: i32| (n / SCALE).unsigned_abs();
        (pixels(self.width), pixels(self.height))
    }

    /// The finished picture, RGB, row by row from the top.
    #[must_use]
    pub fn to_rgb(&self) -> Vec<u8> {
        let (width, height) = self.size();
        let (scale, stride) = (SCALE as usize, self.width as usize);
        let mut rgb = Vec::with_capacity((width * height * 3) as usize);
        for row in 0..height as usize {
            for column in 0..width as usize {
                let mut sum = [0u32; 3];
                for y in 0..scale {
                    let from = (row * scale + y) * stride + column * scale;
                    for pixel in &self.pixels[from..from + scale] {
                        for (sum, value) in sum.iter_mut().zip(pixel) {
                            *sum += u32::from(*value);
                        }
                    }
                }
                let count = (scale * scale) as u32;
                rgb.extend(sum.map(|s| ((s + count / 2) / count) as u8));
            }
        }
        rgb
    }

    /// Writes the finished picture as a PNG file.
    ///
    /// # Errors
    /// [`PictureError::Write`] if the file cannot be made or filled.
    pub fn save(&self, path: &Path) -> Result<(), PictureError> {
        self.encode(path).map_err(|source| PictureError::Write {
            path: path.to_owned(),
            source,
        })
    }

    fn encode(&self, path: &Path) -> std::io::Result<()> {
        let (width, height) = self.size();
        let file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.to_rgb())?;
        Ok(writer.finish()?)
    }

    fn blend(&mut self, x: i32, y: i32, rgb: (u8, u8, u8), alpha: f64) {
        if x < 0 || y < 0 || x >= self.width || y >= self.height || alpha <= 0.0 {
            return;
        }
        let pixel = &mut self.pixels[(y * self.width + x) as usize];
        let ink = [rgb.0, rgb.1, rgb.2];
        for (old, new) in pixel.iter_mut().zip(ink) {
            let mixed = f64::from(*old) + (f64::from(new) - f64::from(*old)) * alpha.min(1.0);
            *old = mixed.round() as u8;
        }
    }

    /// A line with round ends, from the distance of each pixel to it.
    fn stroke(&mut self, from: BackendCoord, to: BackendCoord, width: f64, ink: BackendColor) {
        let half = 0.5 * width;
        let reach = half.ceil() as i32 + 1;
        let (ax, ay) = (f64::from(from.0), f64::from(from.1));
        let (dx, dy) = (f64::from(to.0) - ax, f64::from(to.1) - ay);
        let length2 = dx * dx + dy * dy;
        for y in (from.1.min(to.1) - reach).max(0)..=(from.1.max(to.1) + reach).min(self.height - 1)
        {
            for x in
                (from.0.min(to.0) - reach).max(0)..=(from.0.max(to.0) + reach).min(self.width - 1)
            {
                let (px, py) = (f64::from(x) - ax, f64::from(y) - ay);
                let along = if length2 > 0.0 {
                    ((px * dx + py * dy) / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (px - along * dx).hypot(py - along * dy);
                self.blend(x, y, ink.rgb, ink.alpha * (half + 0.5 - distance).min(1.0));
            }
        }
    }

    /// A level or upright line, sharp on the finished picture's pixels.
    fn rule(&mut self, from: BackendCoord, to: BackendCoord, width: i32, ink: BackendColor) {
        let snap = |at: i32| at.div_euclid(SCALE) * SCALE - (width / 2).div_euclid(SCALE) * SCALE;
        let ((x0, y0), (x1, y1)) = if from.1 == to.1 {
            let top = snap(from.1);
            ((from.0.min(to.0), top), (from.0.max(to.0), top + width - 1))
        } else {
            let left = snap(from.0);
            (
                (left, from.1.min(to.1)),
                (left + width - 1, from.1.max(to.1)),
            )
        };
        self.fill((x0, y0), (x1, y1), ink);
    }

    fn fill(&mut self, upper_left: BackendCoord, bottom_right: BackendCoord, ink: BackendColor) {
        for y in upper_left.1.max(0)..=bottom_right.1.min(self.height - 1) {
            for x in upper_left.0.max(0)..=bottom_right.0.min(self.width - 1) {
                self.blend(x, y, ink.rgb, ink.alpha);
            }
        }
    }
}

/// The [`Canvas`] as `plotters` sees it.
pub struct Pen<'a> {
    canvas: &'a mut Canvas,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (
            self.canvas.width.unsigned_abs(),
            self.canvas.height.unsigned_abs(),
        )
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        self.canvas.blend(at.0, at.1, color.rgb, color.alpha);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        let (ink, width) = (style.color(), style.stroke_width());
        if from.0 == to.0 || from.1 == to.1 {
            self.canvas.rule(from, to, width.cast_signed(), ink);
        } else {
            self.canvas.stroke(from, to, f64::from(width), ink);
        }
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if fill {
            self.canvas.fill(upper_left, bottom_right, style.color());
            return Ok(());
        }
        let ((left, top), (right, bottom)) = (upper_left, bottom_right);
        let (ink, width) = (style.color(), style.stroke_width().cast_signed());
        for (from, to) in [
            ((left, top), (right, top)),
            ((left, bottom), (right, bottom)),
            ((left, top), (left, bottom)),
            ((right, top), (right, bottom)),
        ] {
            self.canvas.rule(from, to, width, ink);
        }
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let (ink, width) = (style.color(), f64::from(style.stroke_width()));
        let mut path = path.into_iter();
        let Some(mut from) = path.next() else {
            return Ok(());
        };
        for to in path {
            self.canvas.stroke(from, to, width, ink);
            from = to;
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (ink, radius) = (style.color(), f64::from(radius));
        if fill {
            self.canvas.stroke(center, center, 2.0 * radius, ink);
            return Ok(());
        }
        let half = 0.5 * f64::from(style.stroke_width());
        let reach = (radius + half).ceil() as i32 + 1;
        for y in -reach..=reach {
            for x in -reach..=reach {
                let off = (f64::from(x).hypot(f64::from(y)) - radius).abs();
                let alpha = ink.alpha * (half + 0.5 - off).min(1.0);
                self.canvas
                    .blend(center.0 + x, center.1 + y, ink.rgb, alpha);
            }
        }
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Drawn {
        let ink = style.color();
        style::set_type(text, style, |x, y, coverage| {
            let alpha = ink.alpha * f64::from(coverage);
            self.canvas.blend(at.0 + x, at.1 + y, ink.rgb, alpha);
        });
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        style: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let (width, height) = style::text_size(text, style);
        Ok((width.ceil() as u32, height.ceil() as u32))
    }

    fn blit_bitmap(&mut self, at: BackendCoord, size: (u32, u32), rgb: &[u8]) -> Drawn {
        let width = size.0.max(1) as usize;
        for (i, pixel) in rgb.as_chunks::<3>().0.iter().enumerate() {
            let (x, y) = ((i % width) as i32, (i / width) as i32);
            let ink = (pixel[0], pixel[1], pixel[2]);
            self.canvas.blend(at.0 + x, at.1 + y, ink, 1.0);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::prelude::*;

    fn pixel(canvas: &Canvas, x: u32, y: u32) -> [u8; 3] {
        let at = ((y * canvas.size().0 + x) * 3) as usize;
        canvas.to_rgb()[at..at + 3].try_into().expect("three bytes")
    }

    #[test]
    fn a_rule_fills_whole_pixels_and_a_slanted_stroke_is_soft() {
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
    fn says_which_file_it_cannot_write() {
        let path = Path::new("/nonexistent-folder/picture.png");
        let error = Canvas::new(2, 2).save(path).expect_err("no folder");
        assert!(
            error
                .to_string()
                .contains("/nonexistent-folder/picture.png")
        );
    }
}
