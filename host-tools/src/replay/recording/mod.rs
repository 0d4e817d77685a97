//! Recordings: one row for each tick, and the settings of the session.
//!
//! The format is CSV, or Parquet if the file's name ends in `.parquet`. Both have the same columns
//! and the same settings.

mod columns;
mod csv_writer;
mod parquet_writer;

use std::fmt;
use std::path::Path;

use hapterra_core::contact::ContactState;
use hapterra_core::scene::TickRecord;

pub use columns::{COLUMNS, TICK_COLUMNS};

use super::marks::Mark;
use super::settings::{PlacementSettings, Settings};
use crate::output::{Output, OutputError};
use crate::terrain::Scale;

/// The columns of every recording with fractional numbers, in order.
pub(super) const NUMBERS: [&str; 10] = [
    "t_s",
    "x_mm",
    "y_mm",
    "z_mm",
    "proxy_x_mm",
    "proxy_y_mm",
    "proxy_z_mm",
    "force_x_n",
    "force_y_n",
    "force_z_n",
];
/// The column of every recording with 1 for contact, otherwise 0.
pub(super) const CONTACT: &str = "contact";
/// Number of [`NUMBERS`] before [`CONTACT`].
const BEFORE_CONTACT: usize = 4;
/// Extension of a Parquet recording.
const PARQUET: &str = "parquet";

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Time, s.
    pub t_s: f64,
    /// The HIP, mm; terrain frame.
    pub hip_mm: [f64; 3],
    /// True if the tick was in contact.
    pub contact: bool,
    /// The proxy, mm; at the HIP if there is no contact.
    pub proxy_mm: [f64; 3],
    /// Force on the hand, N.
    pub force_n: [f64; 3],
}

impl Record {
    /// Creates the record of a tick of a device with `tick_hz` ticks a second.
    #[must_use]
    pub fn of_tick(sample: &TickRecord, tick_hz: u32, scale: &Scale) -> Self {
        let t_s = f64::from(sample.tick) / f64::from(tick_hz.max(1));
        Self::new(t_s, scale.to_mm(&sample.hip), sample, scale)
    }

    /// Creates the record at a time, s, with the HIP at a position, mm.
    #[must_use]
    pub fn new(t_s: f64, hip_mm: [f64; 3], sample: &TickRecord, scale: &Scale) -> Self {
        let contact = sample.state == ContactState::Touching;
        Self {
            t_s,
            hip_mm,
            contact,
            proxy_mm: if contact {
                scale.to_mm(&sample.proxy)
            } else {
                hip_mm
            },
            force_n: sample.force_n.to_array().map(f64::from),
        }
    }

    /// Returns the values of [`NUMBERS`].
    fn numbers(&self) -> [f64; NUMBERS.len()] {
        let ([x, y, z], [px, py, pz], [fx, fy, fz]) = (self.hip_mm, self.proxy_mm, self.force_n);
        [self.t_s, x, y, z, px, py, pz, fx, fy, fz]
    }
}

/// An additional column of some recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// Words.
    Text(&'static str),
    /// Whole numbers.
    Count(&'static str),
}

impl Column {
    /// Returns the name in the header.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Text(name) | Self::Count(name) => name,
        }
    }
}

/// A value of a [`Column`], with the same type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value<'v> {
    /// Words, without comma, quote or line end.
    Text(&'v str),
    /// A whole number.
    Count(u32),
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Count(count) => write!(f, "{count}"),
        }
    }
}

/// A recording being written. Without [`Recording::finish`] it leaves no file.
pub struct Recording(Form);

/// The two file formats.
enum Form {
    Csv(csv_writer::Csv),
    Parquet(Box<parquet_writer::Parquet>),
}

impl Recording {
    /// Begins a recording with the additional columns `more`, in Parquet if the output's name ends
    /// in `.parquet`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(output: Output, more: &[Column]) -> Result<Self, OutputError> {
        let form = match is_parquet(output.path()) {
            true => Form::Parquet(Box::new(parquet_writer::Parquet::new(output, more)?)),
            false => Form::Csv(csv_writer::Csv::new(output, more)),
        };
        Ok(Self(form))
    }

    /// Adds the settings of the rows. Call it before the first row.
    pub fn describe(&mut self, settings: &Settings) {
        match &mut self.0 {
            Form::Csv(csv) => csv.describe(settings),
            Form::Parquet(parquet) => parquet.describe(settings),
        }
    }

    /// Starts another placement for the following rows.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn view(&mut self, view: &PlacementSettings) -> Result<(), OutputError> {
        match &mut self.0 {
            Form::Csv(csv) => csv.view(view),
            Form::Parquet(parquet) => {
                parquet.view(view);
                Ok(())
            }
        }
    }

    /// Adds a mark, before the latest row or the header.
    pub fn mark(&mut self, mark: &Mark) {
        match &mut self.0 {
            Form::Csv(csv) => csv.mark(mark),
            Form::Parquet(parquet) => parquet.mark(mark),
        }
    }

    /// Appends a row; `more` are the values of the additional columns, in order.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, record: &Record, more: &[Value<'_>]) -> Result<(), OutputError> {
        match &mut self.0 {
            Form::Csv(csv) => csv.write(record, more),
            Form::Parquet(parquet) => parquet.write(record, more),
        }
    }

    /// Moves the complete file to its place.
    ///
    /// # Errors
    /// When the rest cannot be written.
    pub fn finish(self) -> Result<(), OutputError> {
        match self.0 {
            Form::Csv(csv) => csv.finish(),
            Form::Parquet(parquet) => parquet.finish(),
        }
    }
}

fn is_parquet(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case(PARQUET)
}

#[cfg(test)]
mod tests;
