//! The encoder, used by a host.

use super::bits::BitWriter;
use super::line::{Line, of_rank, rank};
use super::prediction::Prediction;
use super::rice::{MAX_PARAMETER, Rice, write_run};
use super::{HEAD, LINE, NO_DATA, PARAMETER_SHIFT};
use crate::grid::MAX_CELL;
use crate::terrain::TILE_SAMPLES;

/// Height in cells above the base below which single precision resolves 2⁻⁴⁴ of a cell: as exact as
/// `f64` above a high base.
const TINY: f64 = 1.0 / (1 << 20) as f64;
/// Samples of a tile.
const SAMPLES: usize = TILE_SAMPLES * TILE_SAMPLES;

/// Maximum packed length, bytes: one less than the unpacked samples.
pub const MAX_PACKED: usize = 4 * SAMPLES - 1;

/// Unit of heights that are whole multiples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeightStep {
    /// A height is a multiple of this many cells.
    Cells(f64),
    /// A height is a multiple of `unit`, rounded to single precision, times `cells`: for example a
    /// file in centimetres that stores `f32` metres.
    Single {
        /// The unit, in the file's vertical unit.
        unit: f64,
        /// Cells per vertical unit.
        cells: f64,
    },
}

/// Packs the heights of a tile, in cells above `base`, in rows from the south; NaN is no-data, and
/// so is a height beyond ±[`MAX_CELL`].
///
/// Uses the first of the `steps` that reproduces every height bit for bit; if none does, packs the
/// bits of the heights. Returns `None` if the packed form does not fit `buffer`: with
/// [`MAX_PACKED`] bytes, if packing saves nothing.
pub fn pack<'b>(
    heights: &[f32; SAMPLES],
    base: i32,
    steps: &[HeightStep],
    buffer: &'b mut [u8],
) -> Option<&'b [u8]> {
    let first = heights.iter().position(|height| !is_no_data(*height))?;
    let mut numbers = [0; SAMPLES];
    let known = || heights.iter().filter(|height| !is_no_data(**height));
    let nearest = known().fold(f32::INFINITY, |nearest, height| {
        if height.abs() < nearest.abs() {
            *height
        } else {
            nearest
        }
    });
    let mut fitted = steps.iter().filter_map(|step| {
        let lines = Lines::of(step, heights, nearest, f64::from(base))?;
        lines.number(heights, &mut numbers).then_some(lines)
    });
    let lines = fitted.next();
    if lines.is_none() {
        for (number, height) in numbers.iter_mut().zip(heights) {
            *number = rank(*height);
        }
    }
    write(
        heights,
        &numbers,
        numbers[first],
        lines.as_ref().map_or(&[], |lines| lines.written()),
        buffer,
    )
}

fn is_no_data(height: f32) -> bool {
    height.is_nan() || height.abs() > MAX_CELL as f32
}

/// The lines that compute heights from multiples of a step.
struct Lines {
    lines: [Line; 2],
    count: usize,
    /// The number of a height is `(height + up) · per_cell - from`.
    up: f64,
    per_cell: f64,
    from: f64,
}

impl Lines {
    /// Creates the lines of a step; `height` is the one nearest to the base.
    fn of(step: &HeightStep, heights: &[f32; SAMPLES], height: f32, base: f64) -> Option<Self> {
        let known = || heights.iter().filter(|height| !is_no_data(**height));
        let above = |height: f32| f64::from(height) + base;
        let span = known().fold(0.0, |span: f64, other| {
            span.max((f64::from(*other) - f64::from(height)).abs())
        });
        let (step_cells, unit) = match *step {
            HeightStep::Cells(cells) => (cells, cells),
            HeightStep::Single { unit, cells } => (unit * cells, unit),
        };
        let from = libm::rint(above(height) / step_cells);
        // A height this near to the base is exact only as it is: the product would be rounded.
        let there = |number: f64, cells: f64| match f64::from(height) {
            tiny if tiny.abs() < TINY => tiny,
            _ => libm::fma(number, cells, -base),
        };
        let lines = match *step {
            HeightStep::Cells(cells) => {
                let line = Line::through(0, there(from, cells), cells, span / cells)?;
                [line, Line::NONE]
            }
            HeightStep::Single { cells, .. } => {
                let in_file = |height: f32| (above(height) / cells).abs();
                let min_height = known()
                    .map(|height| in_file(*height))
                    .filter(|height| *height > 0.5 * unit)
                    .fold(f64::INFINITY, f64::min);
                if !min_height.is_finite() {
                    return None;
                }
                // The last place of the lowest height in single precision.
                let place = libm::ldexp(1.0, libm::ilogb(min_height) - 23);
                let single = |number: f64| f64::from((number * unit) as f32) / place;
                let (middle, step, cell) = (single(from), unit / place, place * cells);
                let span_file = (span / cells).abs();
                [
                    Line::through(-from as i64, 0.0, step, from.abs() + span_file / unit)?,
                    Line::through(middle as i64, there(middle, cell), cell, span_file / place)?,
                ]
            }
        };
        Some(Self {
            lines,
            count: match step {
                HeightStep::Cells(_) => 1,
                HeightStep::Single { .. } => 2,
            },
            up: base,
            per_cell: 1.0 / step_cells,
            from,
        })
    }

    fn written(&self) -> &[Line] {
        &self.lines[..self.count]
    }

    /// Computes the numbers of all heights. Returns true if the lines reproduce every height.
    fn number(&self, heights: &[f32; SAMPLES], numbers: &mut [i32; SAMPLES]) -> bool {
        numbers.iter_mut().zip(heights).all(|(number, height)| {
            let exact = (f64::from(*height) + self.up) * self.per_cell - self.from;
            // Saturates.
            *number = libm::rint(exact) as i32;
            is_no_data(*height) || height_of(self.written(), *number).to_bits() == height.to_bits()
        })
    }
}

fn height_of(lines: &[Line], number: i32) -> f32 {
    match lines {
        [] => of_rank(number),
        [line] => line.at(number),
        [first, second, ..] => second.at(first.at(number) as i32),
    }
}

fn write<'b>(
    heights: &[f32; SAMPLES],
    numbers: &[i32; SAMPLES],
    predicted: i32,
    lines: &[Line],
    buffer: &'b mut [u8],
) -> Option<&'b [u8]> {
    let has_no_data = heights.iter().any(|height| is_no_data(*height));
    let parameter = parameter(heights, numbers, predicted);
    let (head, _) = buffer.split_first_chunk_mut::<HEAD>()?;
    head[0] = lines.len() as u8
        | if has_no_data { NO_DATA } else { 0 }
        | (parameter as u8) << PARAMETER_SHIFT;
    head[1..].copy_from_slice(&predicted.to_le_bytes());
    let mut front = HEAD;
    for line in lines {
        buffer
            .get_mut(front..front + LINE)?
            .copy_from_slice(&line.write());
        front += LINE;
    }
    let mut bits = BitWriter::new(buffer.get_mut(front..)?);
    let mut prediction = Prediction::new(predicted);
    let mut rice = Rice::new(parameter);
    if has_no_data {
        bits.number(u32::from(is_no_data(heights[0])), 1)?;
    }
    let mut run = None;
    for (i, height) in heights.iter().enumerate() {
        let is_gap = is_no_data(*height);
        if has_no_data && run != Some(is_gap) {
            run = Some(is_gap);
            let rest = heights[i..].iter();
            let length = rest
                .take_while(|height| is_no_data(**height) == is_gap)
                .count();
            write_run(length as u32, &mut bits)?;
        }
        let mut difference = None;
        prediction.next(i % TILE_SAMPLES, |predicted, west| {
            if is_gap {
                return west;
            }
            difference = Some(numbers[i].wrapping_sub(predicted));
            numbers[i]
        });
        if let Some(difference) = difference {
            rice.write(difference, &mut bits)?;
        }
    }
    let length = front + bits.len();
    buffer.get(..length)
}

/// Returns the Rice parameter that suits the first samples with a height.
fn parameter(heights: &[f32; SAMPLES], numbers: &[i32; SAMPLES], predicted: i32) -> u32 {
    let known = heights.iter().zip(numbers);
    let known = known.filter(|(height, _)| !is_no_data(**height));
    let (mut sum, mut count, mut last) = (0_u64, 0_u64, predicted);
    for (_, number) in known.take(TILE_SAMPLES) {
        sum += 2 * u64::from(number.wrapping_sub(last).unsigned_abs());
        count += 1;
        last = *number;
    }
    (sum / count.max(1)).max(1).ilog2().min(MAX_PARAMETER)
}
