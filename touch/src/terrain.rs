//! A height field of any size, and the tiles that are cut from it.

use alloc::sync::Arc;
use alloc::vec::Vec;

use hapterra_core::grid::MAX_CELL;
use hapterra_core::terrain::{FieldSize, MAX_STEP_CELLS, POSTS, TILE_CELLS, Tile, TileKey};

use crate::heights::{Array, Block, Height, Heights, RowOrder, Unread};
use crate::scale::{BadScale, Scale};

/// A height field: samples on a square grid, bilinear between them.
///
/// Lengths are millimetres: x east, y north, z up, from the south-west sample at height zero.
/// Sizes are counts of *samples*; four samples make the corners of a cell, and a cell with NaN at
/// one of them is a hole. Samples stay as they came (`f64`, `f32`, `i16`, ...), and tiles of 32 × 32
/// cells are cut where the terrain is touched. Clones share the samples.
///
/// ```
/// use hapterra_touch::{RowOrder, Terrain};
///
/// // 1.5 mm a cell; 3 × 2 samples, of which the first row is the northern one.
/// let heights = [5.0, 5.0, 5.0, 0.0, 1.0, 2.0];
/// let terrain = Terrain::from_slice(3, 2, 1.5, RowOrder::NorthFirst, &heights)?;
/// assert_eq!(terrain.height_mm(1.5, 0.0), Some(1.0));
/// assert_eq!(terrain.height_mm(1.5, 1.5), Some(5.0));
/// assert_eq!(terrain.height_mm(9.0, 0.0), None);
/// # Ok::<(), hapterra_touch::TerrainError>(())
/// ```
#[doc(alias = "height map")]
#[doc(alias = "heightmap")]
#[doc(alias = "DEM")]
#[derive(Clone)]
pub struct Terrain {
    heights: Arc<dyn Heights>,
    columns: u32,
    rows: u32,
    scale: Scale,
    /// Lowest and highest height; none of a source that is not in memory.
    range: Option<[f64; 2]>,
    /// Largest difference of neighbouring heights, and the sample.
    step: Option<Steepest>,
    materials: Option<Arc<Array<u8>>>,
    /// Heights are rounded to multiples of this, cells; 0 where they stay as they are.
    height_step: f64,
}

/// Heights that are no terrain.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// Too small or too large.
    #[error(
        "a terrain of {columns} × {rows} samples; from 2 × 2 to {MAX_CELL} × {MAX_CELL} can be touched"
    )]
    Size {
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// More or fewer samples than the size says.
    #[error("{given} samples for {columns} columns and {rows} rows: give columns times rows")]
    Count {
        /// Samples that were given.
        given: usize,
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// More samples than there is memory for.
    #[error("no memory for {columns} × {rows} samples: read them tile by tile")]
    Memory {
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// A row of another length than the first.
    #[error("row {row} has {given} samples and row 0 has {first}: make all rows as long")]
    Ragged {
        /// The row, as they were given.
        row: usize,
        /// Its samples.
        given: usize,
        /// Samples of the first row.
        first: usize,
    },
    /// The millimetres of a cell or of a vertical unit.
    #[error(transparent)]
    Scale(#[from] BadScale),
    /// Higher or lower than positions can be.
    #[error(
        "heights reach {cells:.4e} cells of {cell_mm} mm; at most ±{MAX_CELL} can be touched: scale the heights down, or make no-data NaN"
    )]
    TooTall {
        /// The largest height, cells.
        cells: f64,
        /// Millimetres a cell.
        cell_mm: f64,
    },
    /// Too steep.
    #[error(
        "sample {column}, {row}, from the south-west, differs from a neighbour by {cells:.3e} cells; at most {MAX_STEP_CELLS} can be touched: scale the heights down, or make the sample NaN"
    )]
    Step {
        /// Its column, from the west.
        column: u32,
        /// Its row, from the south.
        row: u32,
        /// The difference, cells.
        cells: f64,
    },
}

/// A difference of neighbouring heights, and its sample.
type Steepest = (f64, [u32; 2]);

/// A tile that could not be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoTile {
    Unread(Unread),
    Step,
}

impl Terrain {
    /// A terrain of a function of a sample's column (eastward) and row (northward), which is called
    /// once for each, row by row from the south.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_fn<T: Height>(
        columns: u32,
        rows: u32,
        cell_mm: f64,
        mut height: impl FnMut(u32, u32) -> T,
    ) -> Result<Self, TerrainError> {
        let mut samples = room_for(columns, rows)?;
        for row in 0..rows {
            samples.extend((0..columns).map(|column| height(column, row)));
        }
        Self::from_vec(columns, rows, cell_mm, RowOrder::SouthFirst, samples)
    }

    /// A terrain of an array, row by row, each row from west to east. The samples are copied.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_slice<T: Height>(
        columns: u32,
        rows: u32,
        cell_mm: f64,
        order: RowOrder,
        heights: &[T],
    ) -> Result<Self, TerrainError> {
        // Before they are copied.
        check_count(columns, rows, heights.len())?;
        let mut samples = room_for(columns, rows)?;
        samples.extend_from_slice(heights);
        Self::from_vec(columns, rows, cell_mm, order, samples)
    }

    /// As [`Self::from_slice`], without a copy.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_vec<T: Height>(
        columns: u32,
        rows: u32,
        cell_mm: f64,
        order: RowOrder,
        samples: Vec<T>,
    ) -> Result<Self, TerrainError> {
        check_count(columns, rows, samples.len())?;
        let array = Array {
            samples,
            columns,
            rows,
            order,
        };
        let (range, step) = survey(&array);
        Ok(Self {
            heights: Arc::new(array),
            columns,
            rows,
            scale: Scale::new(cell_mm, 1.0)?,
            range,
            step,
            materials: None,
            height_step: 0.0,
        })
    }

    /// A terrain of rows of the same length, each from west to east.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_rows<T: Height, R: AsRef<[T]>>(
        cell_mm: f64,
        order: RowOrder,
        rows: &[R],
    ) -> Result<Self, TerrainError> {
        let first = rows.first().map_or(0, |row| row.as_ref().len());
        let lengths = rows.iter().map(|row| row.as_ref().len());
        if let Some((row, given)) = lengths.enumerate().find(|(_, given)| *given != first) {
            return Err(TerrainError::Ragged { row, given, first });
        }
        let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let (columns, north) = (count(first), count(rows.len()));
        let mut samples = room_for(columns, north)?;
        for row in rows {
            samples.extend_from_slice(row.as_ref());
        }
        Self::from_vec(columns, north, cell_mm, order, samples)
    }

    /// A terrain whose heights are read block by block where it is touched, at most 33 × 33 samples
    /// at a time, and never kept but for a window of 512 × 512 cells.
    ///
    /// ```
    /// use hapterra_touch::{Block, Terrain, Unread};
    ///
    /// let waves = |block: Block, heights: &mut [f64]| -> Result<(), Unread> {
    ///     for (at, height) in heights.iter_mut().enumerate() {
    ///         let column = block.column + at as u32 % block.columns;
    ///         *height = f64::from(column % 8);
    ///     }
    ///     Ok(())
    /// };
    /// let terrain = Terrain::from_tiles(100_000_000, 100_000_000, 0.5, waves)?;
    /// assert_eq!(terrain.height_mm(1.75, 30_000_000.0), Some(3.5));
    /// # Ok::<(), hapterra_touch::TerrainError>(())
    /// ```
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_tiles(
        columns: u32,
        rows: u32,
        cell_mm: f64,
        heights: impl Heights + 'static,
    ) -> Result<Self, TerrainError> {
        check_size(columns, rows)?;
        Ok(Self {
            heights: Arc::new(heights),
            columns,
            rows,
            scale: Scale::new(cell_mm, 1.0)?,
            range: None,
            step: None,
            materials: None,
            height_step: 0.0,
        })
    }

    /// The same samples with other millimetres a vertical unit, where heights are not millimetres.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn with_height_scale(self, mm_per_unit: f64) -> Result<Self, TerrainError> {
        let scale = Scale::new(self.scale.cell_mm(), mm_per_unit)?;
        Ok(Self { scale, ..self })
    }

    /// The same terrain with heights rounded to multiples of a step in cells, 0 for none:
    /// `hapterra replay` does so where it interpolates between the samples of a file.
    #[must_use]
    pub fn with_height_step(self, cells: f64) -> Self {
        let height_step = if cells > 0.0 { cells } else { 0.0 };
        Self {
            height_step,
            ..self
        }
    }

    /// The same ground with a material for each sample: an index of the surface's table
    /// ([`Surface::with_materials`](crate::Surface::with_materials)), 0 for the surface itself.
    ///
    /// # Errors
    /// [`TerrainError::Count`] unless there is one for each sample.
    pub fn with_materials(self, order: RowOrder, materials: Vec<u8>) -> Result<Self, TerrainError> {
        let (columns, rows) = (self.columns, self.rows);
        check_count(columns, rows, materials.len())?;
        let array = Array {
            samples: materials,
            columns,
            rows,
            order,
        };
        Ok(Self {
            materials: Some(Arc::new(array)),
            ..self
        })
    }

    /// Samples from west to east, and from south to north.
    #[must_use]
    pub const fn samples(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Extent east and north from the south-west sample, mm.
    #[must_use]
    pub fn size_mm(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|count| f64::from(count - 1) * self.scale.cell_mm())
    }

    /// Millimetres a cell and a vertical unit.
    #[must_use]
    pub const fn scale(&self) -> &Scale {
        &self.scale
    }

    /// The height of the surface at a place in millimetres, mm. `None` in a hole, off the terrain,
    /// and where it cannot be read.
    #[must_use]
    pub fn height_mm(&self, east_mm: f64, north_mm: f64) -> Option<f64> {
        let cell_mm = self.scale.cell_mm();
        let (column, u) = place(east_mm / cell_mm, self.columns - 1)?;
        let (row, v) = place(north_mm / cell_mm, self.rows - 1)?;
        let mut corners = [f64::NAN; 4];
        let block = Block {
            column,
            row,
            columns: 2,
            rows: 2,
        };
        self.heights.read(block, &mut corners).ok()?;
        let mm = corners.map(|height| height * self.scale.height_mm_per_unit());
        let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
        let [sw, se, nw, ne] = mm;
        // Every corner counts: a cell with a hole at one is a hole.
        let hole = mm.iter().any(|height| !height.is_finite());
        (!hole).then(|| mix(mix(sw, se, u), mix(nw, ne, u), v))
    }

    /// Writes the heights of a block as they came, row by row from the south, in the vertical unit.
    ///
    /// # Errors
    /// [`Unread`] of a callback.
    ///
    /// # Panics
    /// A block beyond the terrain, or more heights than `heights` has room for.
    pub fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        self.heights.read(block, heights)
    }

    pub(crate) fn size(&self) -> FieldSize {
        // Checked: at most MAX_CELL samples.
        FieldSize::new(self.columns as i32 - 1, self.rows as i32 - 1)
    }

    /// A whole height in cells that no sample exceeds.
    pub(crate) fn top(&self) -> i32 {
        let Some(range) = self.range else {
            return MAX_CELL + 1;
        };
        let ends = range.map(|height| self.scale.height_cells(height));
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        // Rounded to `f32` above the base, a sample reaches the next whole number at most; from 2^23
        // on, up to 2^30, by as much as its last place.
        let rounding = if high - low < f64::from(1 << 23) {
            0
        } else {
            64
        };
        (libm::ceil(high) as i32 + rounding).min(MAX_CELL + 1)
    }

    /// The largest material that a sample has; none where all are of one.
    pub(crate) fn last_material(&self) -> Option<u8> {
        let materials = self.materials.as_ref()?;
        materials.samples.iter().copied().max()
    }

    /// Cuts a tile of the terrain into a buffer, with its materials if the table has any. `room` is
    /// for its samples.
    pub(crate) fn cut(
        &self,
        key: TileKey,
        materials: usize,
        room: &mut Vec<f64>,
        tile: &mut Tile,
    ) -> Result<(), NoTile> {
        let first = |index: i32| index.max(0) as u32 * TILE_CELLS as u32;
        let (column, row) = (first(key.index.col), first(key.index.row));
        let block = Block {
            column,
            row,
            columns: self.columns.saturating_sub(column).min(POSTS as u32),
            rows: self.rows.saturating_sub(row).min(POSTS as u32),
        };
        room.clear();
        room.resize((block.columns * block.rows) as usize, f64::NAN);
        let read = self.heights.read(block, room);
        read.map_err(NoTile::Unread)?;
        for height in room.iter_mut() {
            let cells = self.scale.height_cells(*height);
            let is_within = cells.abs() <= f64::from(MAX_CELL);
            *height = match self.height_step {
                _ if !is_within => f64::NAN,
                0.0 => cells,
                step => libm::round(cells / step) * step,
            };
        }
        let base = base(room);
        let width = block.columns as usize;
        let filled = tile.fill(key, base, |col, row| {
            let cells = (col < width).then(|| room.get(row * width + col)).flatten();
            cells.map_or(f32::NAN, |cells| (cells - f64::from(base)) as f32)
        });
        filled.map_err(|_| NoTile::Step)?;
        if materials > 0
            && let Some(of) = &self.materials
        {
            let samples = (0..POSTS as u32).flat_map(|v| {
                let line = of.row(row + v).get(column as usize..).unwrap_or(&[]);
                (0..POSTS).map(move |u| line.get(u).copied().unwrap_or(0))
            });
            // Checked when they were put together.
            let set = tile.set_materials(materials, samples);
            set.map_err(|_| NoTile::Step)?;
        }
        Ok(())
    }

    /// Checks that the heights can be touched at the scale; those of a callback are checked tile by
    /// tile.
    pub(crate) fn check_heights(&self) -> Result<(), TerrainError> {
        let cell_mm = self.scale.cell_mm();
        for height in self.range.into_iter().flatten() {
            let cells = self.scale.height_cells(height);
            if cells.is_nan() || cells.abs() > f64::from(MAX_CELL) {
                return Err(TerrainError::TooTall { cells, cell_mm });
            }
        }
        if let Some((step, [column, row])) = self.step {
            let cells = self.scale.height_cells(step).abs();
            if cells > f64::from(MAX_STEP_CELLS) {
                return Err(TerrainError::Step { column, row, cells });
            }
        }
        Ok(())
    }
}

impl core::fmt::Debug for Terrain {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            columns,
            rows,
            scale,
            range,
            ..
        } = self;
        f.debug_struct("Terrain")
            .field("samples", &[columns, rows])
            .field("scale", scale)
            .field("range", range)
            .finish_non_exhaustive()
    }
}

fn check_size(columns: u32, rows: u32) -> Result<(), TerrainError> {
    let ok = |samples: u32| (2..=MAX_CELL as u32).contains(&samples);
    match ok(columns) && ok(rows) {
        true => Ok(()),
        false => Err(TerrainError::Size { columns, rows }),
    }
}

fn check_count(columns: u32, rows: u32, given: usize) -> Result<(), TerrainError> {
    check_size(columns, rows)?;
    match u64::from(columns) * u64::from(rows) == given as u64 {
        true => Ok(()),
        false => Err(TerrainError::Count {
            given,
            columns,
            rows,
        }),
    }
}

/// Memory for the samples.
fn room_for<T>(columns: u32, rows: u32) -> Result<Vec<T>, TerrainError> {
    check_size(columns, rows)?;
    let mut samples = Vec::new();
    let count = usize::try_from(u64::from(columns) * u64::from(rows)).unwrap_or(usize::MAX);
    let reserved = samples.try_reserve_exact(count);
    reserved.map_err(|_| TerrainError::Memory { columns, rows })?;
    Ok(samples)
}

/// Lowest and highest height, and the largest difference of neighbours with its sample.
fn survey<T: Height>(array: &Array<T>) -> (Option<[f64; 2]>, Option<Steepest>) {
    let (mut range, mut steepest) = (None, None::<Steepest>);
    for row in 0..array.rows {
        let line = array.row(row);
        // North of the last row there is none.
        let north = array.row(row + 1);
        for (column, sample) in line.iter().enumerate() {
            let height: f64 = (*sample).into();
            if height.is_nan() {
                continue;
            }
            let [low, high] = range.unwrap_or([height; 2]);
            range = Some([low.min(height), high.max(height)]);
            let beside = [line.get(column + 1), north.get(column)];
            for neighbour in beside.into_iter().flatten() {
                let step = ((*neighbour).into() - height).abs();
                if step > steepest.map_or(0.0, |(most, _)| most) {
                    steepest = Some((step, [column as u32, row]));
                }
            }
        }
    }
    (range, steepest)
}

/// The patch and the place in it of a coordinate in cells.
fn place(cells: f64, patches: u32) -> Option<(u32, f64)> {
    if !(0.0..=f64::from(patches)).contains(&cells) {
        return None;
    }
    // The last sample belongs to the last patch.
    let patch = libm::floor(cells).min(f64::from(patches - 1));
    Some((patch as u32, cells - patch))
}

/// The whole height that a tile counts from: the lowest sample's, or the middle where single heights
/// would leave what the contact can address.
fn base(cells: &[f64]) -> i32 {
    let known = cells.iter().copied().filter(|cells| !cells.is_nan());
    let range = known.fold(None, |range: Option<(f64, f64)>, h| {
        let (low, high) = range.unwrap_or((h, h));
        Some((low.min(h), high.max(h)))
    });
    let Some((low, high)) = range else {
        return 0;
    };
    let from_low = high - libm::floor(low) <= f64::from(MAX_CELL);
    let base = if from_low { low } else { 0.5 * (low + high) };
    libm::floor(base) as i32 // both within ±MAX_CELL
}
