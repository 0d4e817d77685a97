//! The samples of a file, row by row, so that a terrain may be larger than memory.

use std::io::{self, Write};

use super::Synth;

/// Size of a written terrain, in samples and on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Samples from west to east, at least 2.
    pub columns: u32,
    /// Samples from south to north, at least 2.
    pub rows: u32,
    /// Side of a cell in metres; heights are also in metres.
    pub cell_m: f64,
}

/// The caller stopped the operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// The rows of a grid, computed one by one from north to south.
pub(super) struct Rows<'a> {
    synth: &'a Synth,
    pub(super) grid: &'a Grid,
    should_continue: &'a mut dyn FnMut() -> bool,
    /// Number of remaining rows.
    pub(super) left: u32,
    heights: Vec<f32>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(
        synth: &'a Synth,
        grid: &'a Grid,
        should_continue: &'a mut dyn FnMut() -> bool,
    ) -> Self {
        Self {
            synth,
            grid,
            should_continue,
            left: grid.rows,
            heights: Vec::new(),
        }
    }

    /// Returns the next row's heights; `None` after the southernmost.
    pub(super) fn next(&mut self) -> Result<Option<&[f32]>, Interrupted> {
        let Some(row) = self.left.checked_sub(1) else {
            return Ok(None);
        };
        self.left = row;
        self.heights.clear();
        append_row(self.synth, self.grid.columns, row, &mut self.heights);
        if (self.should_continue)() {
            Ok(Some(&self.heights))
        } else {
            Err(Interrupted)
        }
    }
}

/// Appends a row's heights; rows are counted from the south.
pub(super) fn append_row(synth: &Synth, columns: u32, row: u32, heights: &mut Vec<f32>) {
    heights.extend((0..columns).map(|column| synth.height(column, row)));
}

/// Writes one row as text.
pub(super) fn write_asc_row(out: &mut dyn Write, heights: &[f32]) -> io::Result<()> {
    for (column, height) in heights.iter().enumerate() {
        let separator = if column == 0 { "" } else { " " };
        write!(out, "{separator}{height}")?;
    }
    writeln!(out)
}
