//! The header: keys in any order and case, each followed by its number.

use std::io::BufRead;

use super::tokens::Tokens;
use crate::raster::Fault;

/// What Esri takes for no data where the header does not say.
const DEFAULT_NO_DATA: f64 = -9999.0;

/// The header's numbers, unchecked.
#[derive(Debug, Default)]
pub(super) struct Header {
    columns: Option<f64>,
    rows: Option<f64>,
    cell: Option<f64>,
    cell_east: Option<f64>,
    cell_north: Option<f64>,
    west: Option<f64>,
    south: Option<f64>,
    no_data: Option<f64>,
}

/// Whether a file begins with a header's key.
pub(in crate::raster) fn looks_like_header(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let text = String::from_utf8_lossy(head);
    let mut words = text.split_ascii_whitespace();
    words
        .next()
        .is_some_and(|word| Header::default().slot(&word.to_lowercase()).is_some())
        && words.next().is_some_and(|word| number(word).is_some())
}

/// A number as these files write them: also with a decimal comma.
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| {
        let one_comma = word.matches(',').count() == 1 && !word.contains('.');
        word.replace(',', ".").parse().ok().filter(|_| one_comma)
    })
}

impl Header {
    /// Reads keys and numbers up to the first sample.
    pub(super) fn read<R: BufRead>(tokens: &mut Tokens<R>) -> Result<Self, Fault> {
        let mut header = Self::default();
        while let Some(word) = tokens.next()? {
            let key = word.trim_start_matches('\u{feff}').to_lowercase();
            let is_key =
                key.starts_with(|c: char| c.is_ascii_alphabetic()) && number(&key).is_none();
            if !is_key {
                tokens.put_back();
                break;
            }
            let Some(slot) = header.slot(&key) else {
                return Err(Fault::damaged(format!("unknown header key '{key}'")));
            };
            let value = tokens
                .next()?
                .ok_or_else(|| Fault::Truncated(format!("it ends after the header key '{key}'")))?;
            *slot = Some(number(value).ok_or_else(|| {
                Fault::damaged(format!("header: {key} is '{value}', not a number"))
            })?);
        }
        Ok(header)
    }

    fn slot(&mut self, key: &str) -> Option<&mut Option<f64>> {
        Some(match key {
            "ncols" => &mut self.columns,
            "nrows" => &mut self.rows,
            "cellsize" => &mut self.cell,
            "dx" | "xdim" => &mut self.cell_east,
            "dy" | "ydim" => &mut self.cell_north,
            "xllcorner" | "xllcenter" | "xllcentre" => &mut self.west,
            "yllcorner" | "yllcenter" | "yllcentre" => &mut self.south,
            "nodata_value" | "nodata" => &mut self.no_data,
            _ => return None,
        })
    }

    /// Columns and rows, as far as numbers of samples go.
    pub(super) fn size(&self) -> Result<(u32, u32), Fault> {
        Ok((count("ncols", self.columns)?, count("nrows", self.rows)?))
    }

    /// Size of a cell, west to east and south to north.
    pub(super) fn cell(&self) -> Result<(f64, f64), Fault> {
        let east = positive("cellsize", self.cell_east.or(self.cell))?;
        let north = positive("cellsize", self.cell_north.or(self.cell))?;
        Ok((east, north))
    }

    /// The south-west corner. Whether it is that of the field or of the centre of
    /// its first sample makes no difference here.
    pub(super) fn corner(&self) -> Option<(f64, f64)> {
        self.west.zip(self.south)
    }

    /// The value that means no data.
    pub(super) fn no_data(&self) -> f64 {
        self.no_data.unwrap_or(DEFAULT_NO_DATA)
    }
}

fn count(key: &str, value: Option<f64>) -> Result<u32, Fault> {
    let value = value.ok_or_else(|| Fault::damaged(format!("the header has no {key}")))?;
    if value.fract() != 0.0 || value < 1.0 {
        return Err(Fault::damaged(format!("header: {key} is {value}")));
    }
    if value > f64::from(i32::MAX) {
        return Err(Fault::AbsurdSize(format!("{key} is {value}")));
    }
    Ok(value as u32)
}

fn positive(key: &str, value: Option<f64>) -> Result<f64, Fault> {
    let value = value.ok_or_else(|| Fault::damaged(format!("the header has no {key}")))?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Fault::damaged(format!("header: {key} is {value}")))
    }
}
