//! The terrain for every variant: plain heights in cells.

use std::path::Path;

use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{HapticCells, HapticGrid};
use heightfield::{Raster, Wait};

/// Most samples along a side; of a larger field only the middle is used.
pub const MAX_SIDE: u32 = 4097;

/// Heights in cells, row by row from the south, without no-data.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Its name in tables.
    pub name: String,
    /// Patches eastward.
    pub columns: usize,
    /// Patches northward.
    pub rows: usize,
    /// `(columns + 1) × (rows + 1)` samples.
    pub posts: Vec<f32>,
    /// Changes of the data for the comparison, one sentence each.
    pub remarks: Vec<String>,
}

impl Grid {
    /// Creates a field of `columns × rows` patches.
    pub fn from_fn(
        name: &str,
        [columns, rows]: [usize; 2],
        mut height: impl FnMut(usize, usize) -> f32,
    ) -> Self {
        let mut posts = Vec::with_capacity((columns + 1) * (rows + 1));
        for row in 0..=rows {
            posts.extend((0..=columns).map(|column| height(column, row)));
        }
        Self {
            name: name.to_owned(),
            columns,
            rows,
            posts,
            remarks: Vec::new(),
        }
    }

    /// Creates synthetic mountains, with heights times `steepness`.
    pub fn fractal(name: &str, size: [usize; 2], seed: u64, steepness: f64) -> Self {
        let amplitude = steepness * Kind::Fractal.default_amplitude_cells();
        let synth = Synth::new(Kind::Fractal, seed, amplitude);
        Self::from_fn(name, size, |x, y| synth.height(x as u32, y as u32))
    }

    /// Returns a terrain file's field at true proportions if it states them, else one cell a
    /// vertical unit, times `steepness`.
    pub fn from_raster(path: &Path, raster: &Raster, steepness: f64) -> Self {
        let scale = HapticGrid::new(raster, HapticCells::Stored)
            .cells_per_vertical_unit()
            .unwrap_or(1.0)
            * steepness;
        let [width, height] = [raster.columns(), raster.rows()].map(|n| n.min(MAX_SIDE));
        let first = [(raster.columns() - width) / 2, (raster.rows() - height) / 2];
        let summary = raster.summary();
        let mut row_of = (u32::MAX, vec![0.0; width as usize]);
        let mut filled = 0_u64;
        let name = path.file_stem().unwrap_or(path.as_os_str());
        let size = [width as usize - 1, height as usize - 1];
        let mut grid = Self::from_fn(&name.to_string_lossy(), size, |x, y| {
            if row_of.0 != y as u32 {
                row_of.0 = y as u32;
                let row = first[1] + y as u32;
                // Heights that a server did not send are filled as well.
                let _ = raster.read_row(0, row, first[0], &mut row_of.1, Wait::UntilRead);
            }
            let height = row_of.1[x];
            filled += u64::from(height.is_nan());
            // Near zero, so that the plain versions keep their precision.
            let height = if height.is_nan() {
                summary.lowest
            } else {
                height
            };
            ((height - summary.lowest) * scale) as f32
        });
        if filled > 0 {
            grid.remarks.push(format!(
                "{filled} samples without data lie at the lowest height: not every opponent supports no data"
            ));
        }
        if width < raster.columns() || height < raster.rows() {
            let cut = format!("cut to {width} × {height} samples in its middle");
            grid.remarks.push(cut);
        }
        grid
    }

    /// Returns its middle: at most `side` patches along each side.
    #[must_use]
    pub fn middle(&self, side: usize) -> Self {
        let size = [self.columns, self.rows].map(|patches| patches.min(side));
        let [west, south] = [(self.columns - size[0]) / 2, (self.rows - size[1]) / 2];
        let height = |x: usize, y: usize| self.post(west + x, south + y);
        Self {
            remarks: self.remarks.clone(),
            ..Self::from_fn(&self.name, size, height)
        }
    }

    /// Returns the height of a sample.
    #[must_use]
    pub fn post(&self, column: usize, row: usize) -> f32 {
        self.posts[row * (self.columns + 1) + column]
    }

    /// Returns true if this patch exists.
    #[inline]
    #[must_use]
    pub fn has(&self, [x, y]: [i32; 2]) -> bool {
        (x as u32 as usize) < self.columns && (y as u32 as usize) < self.rows
    }

    /// Returns the corner heights of a patch that exists: south-west, south-east, north-west,
    /// north-east.
    #[inline]
    #[must_use]
    pub fn corners(&self, [x, y]: [i32; 2]) -> [f32; 4] {
        let stride = self.columns + 1;
        let south = y as usize * stride + x as usize;
        let (south, north) = (
            &self.posts[south..][..2],
            &self.posts[south + stride..][..2],
        );
        [south[0], south[1], north[0], north[1]]
    }

    /// Returns the height of the bilinear surface at a point inside the field.
    #[must_use]
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let column = (x as usize).min(self.columns - 1);
        let row = (y as usize).min(self.rows - 1);
        let (u, v) = (x - column as f64, y - row as f64);
        let [sw, se, nw, ne] = self.corners([column as i32, row as i32]).map(f64::from);
        let (south, north) = (sw + u * (se - sw), nw + u * (ne - nw));
        south + v * (north - south)
    }

    /// Returns the highest sample.
    #[must_use]
    pub fn top(&self) -> f32 {
        self.posts.iter().fold(f32::NEG_INFINITY, |a, b| a.max(*b))
    }
}
