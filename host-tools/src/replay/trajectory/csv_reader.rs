//! Rows of a CSV file, after its comments.

use std::io::{self, Read, Seek, SeekFrom};

use csv::{ByteRecord, ReaderBuilder, Trim};

use super::comments::{self, Rewound};
use super::{COLUMNS, Row, TrajectoryFault, VIEW, columns_of, row};

/// Rows of a CSV file, read one by one.
pub(super) struct Rows<R> {
    reader: csv::Reader<Rewound<R>>,
    record: ByteRecord,
    /// The columns to read.
    read: &'static [&'static str],
    columns: usize,
    was_cut: bool,
    /// Index of the column with the placement's number, if there is one.
    view: Option<usize>,
}

impl<R: Read + Seek> Rows<R> {
    /// Reads a stream up to the first row. Also returns the comments before the header.
    pub(super) fn open(stream: R) -> Result<(Self, String), TrajectoryFault> {
        let (text, stream) = comments::split(stream).map_err(TrajectoryFault::Unreadable)?;
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(stream);
        let mut rows = Self {
            reader,
            record: ByteRecord::new(),
            read: &COLUMNS,
            columns: 0,
            was_cut: false,
            view: None,
        };
        rows.read_header()?;
        Ok((rows, text))
    }

    fn read_header(&mut self) -> Result<(), TrajectoryFault> {
        self.read_record()?;
        let names: Vec<_> = self.record.iter().map(String::from_utf8_lossy).collect();
        self.columns = names.len();
        self.view = names.iter().position(|name| name == VIEW);
        let Some(read) = columns_of(&names) else {
            let found = shown(&names.join(","));
            let at = self.place();
            return Err(TrajectoryFault::Header { at, found });
        };
        self.read = read;
        Ok(())
    }

    /// Returns the next row; `None` after the last.
    pub(super) fn next(&mut self) -> Result<Option<Row>, TrajectoryFault> {
        if !self.read_record()? {
            return Ok(None);
        }
        if self.record.len() < self.columns && self.columns > self.read.len() && self.is_cut() {
            self.was_cut = true;
            return Ok(None);
        }
        if self.record.len() != self.columns {
            return Err(TrajectoryFault::Columns {
                at: self.place(),
                found: self.record.len(),
                expected: self.columns,
            });
        }
        let mut numbers = [0.0; COLUMNS.len()];
        let numbers = numbers.get_mut(..self.read.len()).unwrap_or_default();
        for (column, number) in numbers.iter_mut().enumerate() {
            *number = self.number(column)?;
        }
        let view = match self.view {
            Some(column) => self.view(column)?,
            None => 0,
        };
        Ok(Some(row(numbers, view)))
    }

    fn view(&mut self, column: usize) -> Result<u32, TrajectoryFault> {
        let field = String::from_utf8_lossy(self.record.get(column).unwrap_or(&[]));
        let Ok(view) = field.parse() else {
            let what = format!("`{}` is no number of a view", shown(&field));
            let (at, column) = (self.place(), VIEW);
            return Err(TrajectoryFault::Field { at, column, what });
        };
        Ok(view)
    }

    /// Returns true if the file ended in the middle of a row, as after the end of a killed
    /// recording. That row is not returned.
    pub(super) const fn was_cut(&self) -> bool {
        self.was_cut
    }

    /// Returns true if the file ends in the middle of the present row. No row can be read
    /// afterwards.
    fn is_cut(&mut self) -> bool {
        let Some(begin) = self.record.position().map(csv::Position::byte) else {
            return false;
        };
        let stream = self.reader.get_mut();
        stream.seek(SeekFrom::Start(begin)).is_ok() && comments::row_is_cut(stream)
    }

    fn read_record(&mut self) -> Result<bool, TrajectoryFault> {
        let read = self.reader.read_byte_record(&mut self.record);
        read.map_err(|error| TrajectoryFault::Unreadable(io::Error::other(error)))
    }

    /// Returns the line of the present row, for a message. No row can be read afterwards.
    pub(super) fn place(&mut self) -> String {
        let Some(position) = self.record.position() else {
            return "line 1".into();
        };
        // A record's position is the end of the last one: before the empty lines and comments in
        // between, and before the LF of a CR LF.
        let stream = self.reader.get_mut();
        let mut line = position.line();
        if stream.seek(SeekFrom::Start(position.byte())).is_ok() {
            line += comments::lines_before_a_row(stream);
        }
        format!("line {line}")
    }

    fn number(&mut self, column: usize) -> Result<f64, TrajectoryFault> {
        let field = self.record.get(column).unwrap_or(&[]);
        let text = std::str::from_utf8(field).ok();
        let number = text.and_then(|text| text.parse().ok());
        if let Some(number) = number.filter(|x: &f64| x.is_finite()) {
            return Ok(number);
        }
        let found = shown(&String::from_utf8_lossy(field));
        Err(TrajectoryFault::Field {
            at: self.place(),
            column: self.read.get(column).copied().unwrap_or_default(),
            what: format!("`{found}` is not a finite number"),
        })
    }
}

/// Returns the beginning of an arbitrary text.
fn shown(text: &str) -> String {
    const MAX: usize = 60;
    let mut short: String = text.chars().take(MAX).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}
