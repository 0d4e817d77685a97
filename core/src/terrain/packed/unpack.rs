//! Decoding of packed bytes, sample by sample.

use super::bits::BitReader;
use super::line::{Line, of_rank};
use super::prediction::Prediction;
use super::rice::{MAX_PARAMETER, Rice, read_run};
use super::{HEAD, LINE, NO_DATA, PARAMETER_SHIFT};

/// State of the decoding of a tile's heights.
pub(in crate::terrain) struct Unpacker<'b> {
    bits: BitReader<'b>,
    prediction: Prediction,
    rice: Rice,
    lines: u8,
    first: Line,
    second: Line,
    runs: Option<Runs>,
}

impl<'b> Unpacker<'b> {
    /// Reads the header before the codes; returns `None` if [`super::pack`] cannot have written it.
    pub(in crate::terrain) fn new(bytes: &'b [u8]) -> Option<Self> {
        let ([kind, predicted @ ..], bytes) = bytes.split_first_chunk::<HEAD>()?;
        let (lines, parameter) = (kind & 3, u32::from(kind >> PARAMETER_SHIFT));
        if lines > 2 || parameter > MAX_PARAMETER {
            return None;
        }
        let (first, bytes) = line(lines > 0, bytes)?;
        let (second, bytes) = line(lines > 1, bytes)?;
        let mut bits = BitReader::new(bytes);
        Some(Self {
            runs: (kind & NO_DATA != 0).then(|| Runs::new(&mut bits)),
            bits,
            prediction: Prediction::new(i32::from_le_bytes(*predicted)),
            rice: Rice::new(parameter),
            lines,
            first,
            second,
        })
    }

    /// Returns the height of the next sample, in the given column; NaN for no-data.
    #[inline]
    pub(in crate::terrain) fn next(&mut self, col: usize) -> f32 {
        let (rice, bits) = (&mut self.rice, &mut self.bits);
        if self.runs.as_mut().is_some_and(|runs| runs.is_no_data(bits)) {
            self.prediction.next(col, |_, west| west);
            return f32::NAN;
        }
        let number = self
            .prediction
            .next(col, |predicted, _| predicted.wrapping_add(rice.read(bits)));
        match self.lines {
            0 => of_rank(number),
            1 => self.first.at(number),
            // The cast saturates.
            _ => self.second.at(self.first.at(number) as i32),
        }
    }

    /// Returns true if the bytes end exactly after the samples decoded until now.
    pub(in crate::terrain) fn is_at_end(&self) -> bool {
        self.bits.is_at_end() && self.runs.as_ref().is_none_or(|runs| runs.remaining == 0)
    }
}

/// Reads a line before the codes, if there is one.
fn line(is_present: bool, bytes: &[u8]) -> Option<(Line, &[u8])> {
    if !is_present {
        return Some((Line::NONE, bytes));
    }
    let (line, rest) = bytes.split_first_chunk::<LINE>()?;
    Some((Line::read(*line)?, rest))
}

/// Runs of samples with and without a height, alternating.
struct Runs {
    /// Samples left in this run.
    remaining: u32,
    in_no_data: bool,
}

impl Runs {
    /// Reads the first bit, which defines the kind of the first run.
    fn new(bits: &mut BitReader<'_>) -> Self {
        Self {
            remaining: 0,
            in_no_data: bits.number(1) == 0,
        }
    }

    /// Returns true if the next sample is no-data.
    #[inline]
    fn is_no_data(&mut self, bits: &mut BitReader<'_>) -> bool {
        if self.remaining == 0 {
            self.in_no_data = !self.in_no_data;
            self.remaining = read_run(bits);
        }
        self.remaining -= 1; // a run is at least one
        self.in_no_data
    }
}
