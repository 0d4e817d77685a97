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

/// One position of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Position of the hand, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The same on the grid.
    pub hip: GridPoint,
}

/// What is wrong with a trajectory, and where.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// It cannot be read.
    #[error("cannot read the trajectory {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// The first line is not the header.
    #[error(
        "{}: line 1 is not the header of a trajectory: `{found}` where `t_s,x_mm,y_mm,z_mm` is expected",
        path.display()
    )]
    Header {
        /// The file.
        path: PathBuf,
        /// The line that was there.
        found: String,
    },
    /// A row has more or fewer columns than the header.
    #[error("{}: line {line} has {found} columns where the header has {expected}", path.display())]
    Columns {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// Columns there.
        found: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// Something that is not a finite number.
    #[error("{}: line {line}, column {column}: `{found}` is not a finite number", path.display())]
    Number {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// What was there.
        found: String,
    },
    /// A position farther out than can be addressed.
    #[error(
        "{}: line {line}, column {column}: {mm} mm is farther than {MAX_CELL} cells of {cell_mm} mm from the origin",
        path.display()
    )]
    FarAway {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The position.
        mm: f64,
        /// The cell.
        cell_mm: f64,
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
        let file = File::open(path).map_err(|source| TrajectoryError::Unreadable {
            path: path.to_owned(),
            source,
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
            return Err(TrajectoryError::Header {
                path: self.path.clone(),
                found: shown(&names.join(",")),
            });
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
            return Err(TrajectoryError::Columns {
                path: self.path.clone(),
                line: self.line(),
                found: self.record.len(),
                expected: self.columns,
            });
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
        self.reader
            .read_byte_record(&mut self.record)
            .map_err(|error| TrajectoryError::Unreadable {
                path: self.path.clone(),
                source: io::Error::other(error),
            })
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
        Err(TrajectoryError::Number {
            path: self.path.clone(),
            line: self.line(),
            column: COLUMNS[column],
            found,
        })
    }

    fn far(&mut self, hip_mm: [f64; 3]) -> TrajectoryError {
        let far = |mm: &f64| (mm / self.scale.cell_mm()).abs() > f64::from(MAX_CELL);
        let axis = hip_mm.iter().position(far).unwrap_or(0);
        TrajectoryError::FarAway {
            path: self.path.clone(),
            line: self.line(),
            column: COLUMNS[axis + 1],
            mm: hip_mm[axis],
            cell_mm: self.scale.cell_mm(),
        }
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
