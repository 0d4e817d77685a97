//! The samples: stored as 16-bit integers until one does not fit.

use std::io::Read;

use super::header::Header;
use super::tokens::Tokens;
use crate::numbers::number;
use crate::samples::{SampleValue, with_samples};
use crate::{RasterError, Samples};

/// Integers up to this size are exact in an `f32`.
const EXACT_IN_F32: f64 = 16_777_216.0;

/// Reads `columns × rows` numbers, and checks that no more follow.
pub(super) fn read<R: Read>(
    tokens: &mut Tokens<R>,
    header: &Header,
    columns: u32,
    rows: u32,
    file_bytes: u64,
) -> Result<Samples, RasterError> {
    // The cell size is checked first: the error of a wrong header explains more than that of a
    // wrong sample.
    header.cell()?;
    let stated = u64::from(columns) * u64::from(rows);
    let possible = stated.min(file_bytes / 2 + 1);
    let mut growing = Growing::new(usize::try_from(possible).unwrap_or(0));
    let mut count = 0;
    while let Some(word) = tokens.next()? {
        let place = || {
            format!(
                "row {}, column {}",
                count / u64::from(columns),
                count % u64::from(columns)
            )
        };
        if count == stated {
            return Err(RasterError::damaged(format!(
                "more numbers than the {columns} × {rows} of its header: '{word}' follows the last"
            )));
        }
        let value = number(word)
            .or_else(|| header.means_none(word).then_some(f64::NAN))
            .ok_or_else(|| {
                RasterError::damaged(format!("{}: '{word}' is not a number", place()))
            })?;
        growing.push(value);
        count += 1;
    }
    if count < stated {
        return Err(RasterError::Truncated(format!(
            "its header states {columns} × {rows} = {stated} numbers, {count} follow"
        )));
    }
    Ok(growing.samples)
}

/// Samples whose type widens when a number does not fit: int16, then int32, then float32, or
/// float64 if there are integers that a float32 would round.
struct Growing {
    samples: Samples,
    /// Max magnitude of the integers read.
    largest: f64,
}

impl Growing {
    fn new(capacity: usize) -> Self {
        Self {
            samples: Samples::I16(Vec::with_capacity(capacity)),
            largest: 0.0,
        }
    }

    fn push(&mut self, value: f64) {
        let whole = value.fract() == 0.0;
        if whole && value.abs() < 1e30 {
            self.largest = self.largest.max(value.abs());
        }
        let fits_i16 = whole && f64::from(value as i16) == value;
        let fits_i32 = whole && f64::from(value as i32) == value;
        let fits_f32 = self.largest <= EXACT_IN_F32;
        match &self.samples {
            Samples::I16(_) if fits_i16 => {}
            Samples::I16(_) if fits_i32 => self.widen::<i32>(),
            Samples::I32(_) if fits_i32 => {}
            Samples::I16(_) | Samples::I32(_) if fits_f32 => self.widen::<f32>(),
            Samples::F32(_) if fits_f32 => {}
            Samples::F64(_) => {}
            _ => self.widen::<f64>(),
        }
        match &mut self.samples {
            Samples::I16(values) => values.push(value as i16),
            Samples::I32(values) => values.push(value as i32),
            Samples::F32(values) => values.push(value as f32),
            Samples::F64(values) => values.push(value),
            _ => unreachable!("only these four are ever made here"),
        }
    }

    fn widen<T: SampleValue>(&mut self)
    where
        Samples: From<Vec<T>>,
    {
        self.samples = with_samples!(&self.samples, values => {
            let mut wider: Vec<T> = Vec::with_capacity(values.capacity());
            wider.extend(values.iter().map(|value| T::nearest(value.widen())));
            wider.into()
        });
    }
}
