//! Recordings: one row a tick, with what was felt.

use std::fmt::Display;
use std::io::Write;

use hapterra_core::contact::ContactState;
use hapterra_core::scene::Sample;

use crate::output::{Output, OutputError};
use crate::terrain::Scale;

/// The columns of every recording; more may follow.
const COLUMNS: &str =
    "t_s,x_mm,y_mm,z_mm,contact,proxy_x_mm,proxy_y_mm,proxy_z_mm,force_x_n,force_y_n,force_z_n";

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Time, s.
    pub t_s: f64,
    /// Where the HIP was, mm; terrain frame.
    pub hip_mm: [f64; 3],
    /// Whether the surface was touched.
    pub contact: bool,
    /// Where the proxy was, mm: at the HIP unless touching.
    pub proxy_mm: [f64; 3],
    /// Force on the hand, N.
    pub force_n: [f64; 3],
}

impl Record {
    /// What was felt in a tick of a device with `tick_hz` ticks a second.
    #[must_use]
    pub fn of_tick(sample: &Sample, tick_hz: u32, scale: &Scale) -> Self {
        let t_s = f64::from(sample.tick) / f64::from(tick_hz.max(1));
        Self::new(t_s, scale.to_mm(&sample.hip), sample, scale)
    }

    /// What was felt at a time, s, with the HIP at a place, mm.
    #[must_use]
    pub fn new(t_s: f64, hip_mm: [f64; 3], sample: &Sample, scale: &Scale) -> Self {
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
}

/// A recording being written.
pub struct Recording {
    output: Output,
    line: Vec<u8>,
}

impl Recording {
    /// Begins a recording with `more` columns after the usual ones.
    #[must_use]
    pub fn new(output: Output, more: &[&str]) -> Self {
        let header = std::iter::once(&COLUMNS).chain(more).copied();
        let mut line = header.collect::<Vec<_>>().join(",").into_bytes();
        line.push(b'\n');
        Self { output, line }
    }

    /// Appends a row; `more` are the values of the further columns.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, record: &Record, more: &[&dyn Display]) -> Result<(), OutputError> {
        self.flush_line()?;
        let contact = f64::from(u8::from(record.contact));
        let place = [record.t_s]
            .into_iter()
            .chain(record.hip_mm)
            .chain([contact]);
        for number in place.chain(record.proxy_mm).chain(record.force_n) {
            // The shortest digits that read back to the same value. Writing to
            // a vector cannot fail.
            let _ = write!(self.line, "{number},");
        }
        for value in more {
            let _ = write!(self.line, "{value},");
        }
        self.line.pop();
        self.line.push(b'\n');
        Ok(())
    }

    /// Puts the complete file in its place.
    ///
    /// # Errors
    /// When it cannot be written to the end.
    pub fn finish(mut self) -> Result<(), OutputError> {
        self.flush_line()?;
        self.output.finish()
    }

    fn flush_line(&mut self) -> Result<(), OutputError> {
        let written = self.output.write_all(&self.line);
        self.line.clear();
        written.map_err(|source| OutputError {
            path: self.output.path().to_owned(),
            source,
        })
    }
}
