//! Trajectory files: `t_s,x_mm,y_mm,z_mm`.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use csv::{ByteRecord, ReaderBuilder, Trim};
use hapterra_core::grid::{GridPoint, MAX_CELL};

use crate::terrain::Scale;

/// The columns, in this order. A recording begins with them, too, and further
/// columns are passed over, so what was recorded can be replayed.
pub(super) const COLUMNS: [&str; 4] = ["t_s", "x_mm", "y_mm", "z_mm"];

/// One position of the HIP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Position of the HIP, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The same on the grid.
    pub hip: GridPoint,
}

/// What is wrong with which trajectory.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct TrajectoryError {
    path: PathBuf,
    fault: TrajectoryFault,
}

/// What is wrong with a trajectory, and where. Lines count from 1.
#[derive(Debug, thiserror::Error)]
enum TrajectoryFault {
    #[error("cannot read the trajectory: {0}")]
    Unreadable(io::Error),
    #[error(
        "line 1 is not the header of a trajectory: `{0}` where `t_s,x_mm,y_mm,z_mm` is expected"
    )]
    Header(String),
    #[error("line {line} has {found} columns where the header has {expected}")]
    Columns {
        line: u64,
        found: usize,
        expected: usize,
    },
    #[error("line {line}, column {column}: {what}")]
    Field {
        line: u64,
        column: &'static str,
        what: String,
    },
}

/// A trajectory that is read row by row.
pub struct Trajectory<R> {
    path: PathBuf,
    reader: csv::Reader<R>,
    record: ByteRecord,
    columns: usize,
    scale: Scale,
    latest_s: f64,
}

impl Trajectory<File> {
    /// Opens a trajectory file and checks its header.
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn open(path: &Path, scale: Scale) -> Result<Self, TrajectoryError> {
        let file = File::open(path).map_err(|error| TrajectoryError {
            path: path.to_owned(),
            fault: TrajectoryFault::Unreadable(error),
        })?;
        Self::read(file, path, scale)
    }
}

impl<R: Read + Seek> Trajectory<R> {
    /// Reads a trajectory from a stream; `path` is for messages.
    ///
    /// # Errors
    /// [`TrajectoryError`].
    pub fn read(stream: R, path: &Path, scale: Scale) -> Result<Self, TrajectoryError> {
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(stream);
        let mut trajectory = Self {
            path: path.to_owned(),
            reader,
            record: ByteRecord::new(),
            columns: 0,
            scale,
            latest_s: f64::NEG_INFINITY,
        };
        trajectory.read_header()?;
        Ok(trajectory)
    }

    fn read_header(&mut self) -> Result<(), TrajectoryError> {
        self.read_record()?;
        let names: Vec<_> = self.record.iter().map(String::from_utf8_lossy).collect();
        let fits = names.len() >= COLUMNS.len() && names.iter().zip(COLUMNS).all(|(a, b)| a == b);
        if !fits {
            let found = shown(&names.join(","));
            return Err(self.wrong(TrajectoryFault::Header(found)));
        }
        self.columns = names.len();
        Ok(())
    }

    /// The next row; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] names the line and the column.
    pub fn next_row(&mut self) -> Result<Option<Row>, TrajectoryError> {
        if !self.read_record()? {
            return Ok(None);
        }
        if self.record.len() != self.columns {
            let fault = TrajectoryFault::Columns {
                line: self.line(),
                found: self.record.len(),
                expected: self.columns,
            };
            return Err(self.wrong(fault));
        }
        let t_s = self.number(0)?;
        let hip_mm = [self.number(1)?, self.number(2)?, self.number(3)?];
        let Some(hip) = self.scale.to_grid(hip_mm) else {
            return Err(self.far(hip_mm));
        };
        self.watch_time(t_s);
        Ok(Some(Row { t_s, hip_mm, hip }))
    }

    fn read_record(&mut self) -> Result<bool, TrajectoryError> {
        let read = self.reader.read_byte_record(&mut self.record);
        read.map_err(|error| self.wrong(TrajectoryFault::Unreadable(io::Error::other(error))))
    }

    fn wrong(&self, fault: TrajectoryFault) -> TrajectoryError {
        TrajectoryError {
            path: self.path.clone(),
            fault,
        }
    }

    fn wrong_field(&mut self, column: usize, what: String) -> TrajectoryError {
        let (line, column) = (self.line(), COLUMNS[column]);
        self.wrong(TrajectoryFault::Field { line, column, what })
    }

    /// The line of the present row, for a message: the reader is not usable
    /// afterwards.
    fn line(&mut self) -> u64 {
        let Some(position) = self.record.position() else {
            return 0;
        };
        // A record counts from where the last one ended: before the empty
        // lines in between, and before the second half of a CR LF.
        let stream = self.reader.get_mut();
        let mut line = position.line();
        if stream.seek(SeekFrom::Start(position.byte())).is_ok() {
            let bytes = io::BufReader::new(stream).bytes().map_while(Result::ok);
            let ends = bytes.take_while(|b| matches!(b, b'\r' | b'\n'));
            line += ends.filter(|b| *b == b'\n').count() as u64;
        }
        line
    }

    fn number(&mut self, column: usize) -> Result<f64, TrajectoryError> {
        let field = self.record.get(column).unwrap_or(&[]);
        let text = std::str::from_utf8(field).ok();
        let number = text.and_then(|text| text.parse().ok());
        if let Some(number) = number.filter(|x: &f64| x.is_finite()) {
            return Ok(number);
        }
        let found = shown(&String::from_utf8_lossy(field));
        Err(self.wrong_field(column, format!("`{found}` is not a finite number")))
    }

    fn far(&mut self, hip_mm: [f64; 3]) -> TrajectoryError {
        let cell_mm = self.scale.cell_mm();
        let far = |mm: &f64| (mm / cell_mm).abs() > f64::from(MAX_CELL);
        let axis = hip_mm.iter().position(far).unwrap_or(0);
        let what = format!(
            "{} mm is farther than {MAX_CELL} cells of {cell_mm} mm from the origin",
            hip_mm[axis]
        );
        self.wrong_field(axis + 1, what)
    }

    /// Time is passed on, not used; that it runs backwards is worth a word.
    fn watch_time(&mut self, t_s: f64) {
        if t_s < self.latest_s {
            tracing::warn!(
                "{}: time runs backwards at {t_s} s; rows are felt in the order of the file",
                self.path.display()
            );
            self.latest_s = f64::INFINITY; // said once
        } else if self.latest_s < f64::INFINITY {
            self.latest_s = t_s;
        }
    }
}

/// The beginning of a text that may be anything.
fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short: String = text.chars().take(LONGEST).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Result<Vec<Row>, TrajectoryError> {
        let scale = Scale::new(1.0, 1.0).expect("valid");
        let mut trajectory = Trajectory::read(io::Cursor::new(text), Path::new("t.csv"), scale)?;
        let mut rows = Vec::new();
        while let Some(row) = trajectory.next_row()? {
            rows.push(row);
        }
        Ok(rows)
    }

    fn message(text: &str) -> String {
        rows(text).expect_err("is wrong").to_string()
    }

    #[test]
    fn forgiving_about_white_space_line_ends_and_marks() {
        let plain = rows("t_s,x_mm,y_mm,z_mm\n0,1,2.5,-3e1\n0.001,4,5,6\n").expect("plain");
        assert_eq!(plain.len(), 2);
        assert_eq!(plain[0].hip_mm, [1.0, 2.5, -30.0]);
        for same in [
            "t_s,x_mm,y_mm,z_mm\r\n0,1,2.5,-3e1\r\n0.001,4,5,6",
            "\u{feff}t_s,x_mm,y_mm,z_mm\n0,1,2.5,-3e1\n\n0.001,4,5,6\n",
            " t_s , x_mm,y_mm ,z_mm\n 0, 1,\t2.5 ,-3e1 \n0.001,4,5,6\n",
            "t_s,x_mm,y_mm,z_mm,note\n0,1,2.5,-3e1,a\n0.001,4,5,6,\n",
            "\"t_s\",\"x_mm\",\"y_mm\",\"z_mm\"\n\"0\",1,2.5,-3e1\n0.001,4,5,6\n",
        ] {
            assert_eq!(rows(same).expect(same), plain, "{same:?}");
        }
        assert_eq!(rows("t_s,x_mm,y_mm,z_mm").expect("header only"), []);
    }

    #[test]
    fn says_what_is_wrong_and_where() {
        let cases = [
            ("", "line 1 is not the header"),
            ("0,1,2,3\n", "line 1 is not the header"),
            ("t_s,x_mm,z_mm,y_mm\n", "line 1 is not the header"),
            ("0,1,2\n", "line 2 has 3 columns where the header has 4"),
            ("0,1,2,3\n0,1,2,3,4\n", "line 3 has 5 columns"),
            ("0,1,2,3\n\n0,one,2,3\n", "line 4, column x_mm: `one`"),
            ("0,1,2,3\r\n0,1,2,x\r\n", "line 3, column z_mm: `x`"),
            ("0,1,nan,3\n", "line 2, column y_mm: `nan`"),
            ("inf,1,2,3\n", "line 2, column t_s: `inf`"),
            ("0,1,2,\n", "line 2, column z_mm: ``"),
            (
                "0,1,-6e8,3\n",
                "line 2, column y_mm: -600000000 mm is farther",
            ),
            ("0,1,2,1e300\n", "line 2, column z_mm"),
        ];
        for (text, expected) in cases {
            let whole = match expected.contains("header") && !expected.contains("has") {
                true => text.to_owned(),
                false => format!("t_s,x_mm,y_mm,z_mm\n{text}"),
            };
            let message = message(&whole);
            assert!(message.starts_with("t.csv: "), "{message}");
            assert!(message.contains(expected), "{message}");
        }
    }
}
