//! Recordings as CSV: the settings behind `# `, a header, one line for each row.

use std::io::Write;

use super::{BEFORE_CONTACT, CONTACT, Column, NUMBERS, Record, Value};
use crate::output::{Output, OutputError};
use crate::replay::marks::Mark;
use crate::replay::settings::{PlacementSettings, Settings};

/// A CSV recording being written.
pub(super) struct Csv {
    output: Output,
    /// The latest row, or the header before the first one; not written yet.
    row: Vec<u8>,
    /// Comments to write before it.
    remarks: Vec<u8>,
}

impl Csv {
    /// Creates a recording that begins with the header.
    pub(super) fn new(output: Output, more: &[Column]) -> Self {
        let (before, after) = NUMBERS.split_at(BEFORE_CONTACT);
        let names = before.iter().chain([&CONTACT]).chain(after).copied();
        let names = names.chain(more.iter().map(Column::name));
        let mut row = names.collect::<Vec<_>>().join(",").into_bytes();
        row.push(b'\n');
        Self {
            output,
            row,
            remarks: vec![],
        }
    }

    /// Adds the settings before the header.
    pub(super) fn describe(&mut self, settings: &Settings) {
        self.remark(&settings.of_beginning().to_toml());
    }

    /// Adds a mark before the latest row: readers may ignore a comment after the last row.
    pub(super) fn mark(&mut self, mark: &Mark) {
        self.remark(&mark.to_toml());
    }

    /// Adds comments between two rows: the rows after them belong to another placement. Readers
    /// that skip comments skip these, and all comments together are the settings.
    pub(super) fn view(&mut self, view: &PlacementSettings) -> Result<(), OutputError> {
        self.flush()?;
        self.remark(&view.to_toml());
        Ok(())
    }

    fn remark(&mut self, text: &str) {
        for line in text.lines() {
            let space = if line.is_empty() { "" } else { " " };
            self.remarks.extend(format!("#{space}{line}\n").bytes());
        }
    }

    pub(super) fn write(&mut self, record: &Record, more: &[Value<'_>]) -> Result<(), OutputError> {
        self.flush()?;
        let contact = f64::from(u8::from(record.contact));
        let numbers = record.numbers();
        let (before, after) = numbers.split_at(BEFORE_CONTACT);
        for number in before.iter().chain([&contact]).chain(after) {
            // The shortest digits that are read back as the same value. Writing to a vector cannot
            // fail.
            let _ = write!(self.row, "{number},");
        }
        for value in more {
            let _ = write!(self.row, "{value},");
        }
        self.row.pop();
        self.row.push(b'\n');
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), OutputError> {
        self.flush()?;
        self.output.finish()
    }

    fn flush(&mut self) -> Result<(), OutputError> {
        let remarks = self.output.write_all(&self.remarks);
        let written = remarks.and_then(|()| self.output.write_all(&self.row));
        self.remarks.clear();
        self.row.clear();
        written.map_err(|source| OutputError {
            path: self.output.path().to_owned(),
            source,
        })
    }
}
