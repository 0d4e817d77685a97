//! The header: keys in any order and case, each followed by a number.

use std::collections::HashMap;
use std::io::Read;

use super::tokens::Tokens;
use crate::RasterError;
use crate::numbers::number;

/// Key of the no-data value.
const NO_DATA: &str = "nodata";
/// Esri's default no-data value.
const DEFAULT_NO_DATA: f64 = -9999.0;

/// The header's numbers, unchecked, by the first spelling of each key.
#[derive(Debug, Default)]
pub(super) struct Header {
    numbers: HashMap<&'static str, f64>,
    /// Its no-data value, if it is a word and not a number: samples use the same word.
    pub(super) no_data_word: Option<String>,
}

/// Returns the first spelling of a lower-case key; `None` if it is unknown.
fn known_key(key: &str) -> Option<&'static str> {
    Some(match key {
        "ncols" => "ncols",
        "nrows" => "nrows",
        "cellsize" => "cellsize",
        "dx" | "xdim" => "dx",
        "dy" | "ydim" => "dy",
        "xllcorner" => "xllcorner",
        "yllcorner" => "yllcorner",
        "xllcenter" | "xllcentre" => "xllcenter",
        "yllcenter" | "yllcentre" => "yllcenter",
        "nodata_value" | "nodata" => NO_DATA,
        _ => return None,
    })
}

/// Returns true if a file begins with a header's key.
pub(super) fn is_header(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let text = String::from_utf8_lossy(head);
    let mut words = text.split_ascii_whitespace();
    words
        .next()
        .is_some_and(|word| known_key(&word.to_lowercase()).is_some())
        && words.next().is_some_and(|word| number(word).is_some())
}

impl Header {
    /// Reads keys and numbers up to the first sample.
    pub(super) fn read<R: Read>(tokens: &mut Tokens<R>) -> Result<Self, RasterError> {
        let mut header = Self::default();
        while let Some(word) = tokens.next()? {
            let key = word.trim_start_matches('\u{feff}').to_lowercase();
            let is_key =
                key.starts_with(|c: char| c.is_ascii_alphabetic()) && number(&key).is_none();
            if !is_key {
                tokens.put_back();
                break;
            }
            let known = known_key(&key)
                .ok_or_else(|| RasterError::Unfamiliar(format!("header key '{key}'")))?;
            let value = tokens.next()?.ok_or_else(|| {
                RasterError::Truncated(format!("it ends after the header key '{key}'"))
            })?;
            match number(value) {
                Some(value) => {
                    header.numbers.insert(known, value);
                }
                None if known == NO_DATA => header.no_data_word = Some(value.to_owned()),
                None => {
                    let what = format!("header: {key} is '{value}', not a number");
                    return Err(RasterError::damaged(what));
                }
            }
        }
        Ok(header)
    }

    fn get(&self, key: &str) -> Option<f64> {
        self.numbers.get(key).copied()
    }

    /// Returns columns and rows.
    pub(super) fn size(&self) -> Result<(u32, u32), RasterError> {
        Ok((self.count("ncols")?, self.count("nrows")?))
    }

    /// Returns the size of a cell, west to east and south to north.
    pub(super) fn cell(&self) -> Result<(f64, f64), RasterError> {
        let east = self.side("dx")?;
        let north = self.side("dy")?;
        Ok((east, north))
    }

    /// Returns the south-west corner of the field of `east × north` cells, stated as a corner or as
    /// the centre of its cell.
    pub(super) fn south_west(&self, (east, north): (f64, f64)) -> Option<(f64, f64)> {
        let side = |corner, centre, step: f64| {
            let by_centre = || self.get(centre).map(|at| at - step / 2.0);
            self.get(corner).or_else(by_centre)
        };
        let west = side("xllcorner", "xllcenter", east)?;
        Some((west, side("yllcorner", "yllcenter", north)?))
    }

    /// Returns the no-data value.
    pub(super) fn no_data(&self) -> f64 {
        self.get(NO_DATA).unwrap_or(DEFAULT_NO_DATA)
    }

    /// Returns true if a word is the header's word for no-data.
    pub(super) fn means_none(&self, word: &str) -> bool {
        self.no_data_word.as_deref() == Some(word)
    }

    fn count(&self, key: &str) -> Result<u32, RasterError> {
        match self.get(key).ok_or_else(|| missing(key))? {
            value if value.fract() != 0.0 || value < 1.0 => Err(invalid(key, value)),
            value if value > f64::from(i32::MAX) => {
                Err(RasterError::AbsurdSize(format!("{key} is {value}")))
            }
            value => Ok(value as u32),
        }
    }

    /// Returns a cell's side, by its own key or the key of both sides.
    fn side(&self, key: &str) -> Result<f64, RasterError> {
        let both = "cellsize";
        match self
            .get(key)
            .or(self.get(both))
            .ok_or_else(|| missing(both))?
        {
            value if value.is_finite() && value > 0.0 => Ok(value),
            value => Err(invalid(both, value)),
        }
    }
}

fn missing(key: &str) -> RasterError {
    RasterError::damaged(format!("the header has no {key}"))
}

fn invalid(key: &str, value: f64) -> RasterError {
    RasterError::damaged(format!("header: {key} is {value}"))
}
