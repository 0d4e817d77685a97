//! A height field of any size, and the source of its samples.

use alloc::sync::Arc;
use alloc::vec::Vec;

use hapterra_core::grid::MAX_CELL;

use crate::checks::{TerrainError, check_count, check_size, reserve_samples};
use crate::heights::{Array, Block, Height, Heights, RowOrder, Steepest, Unread, survey};
use crate::scale::Scale;
use crate::tip::Ball;

/// A height field: samples on a square grid, bilinear between them.
///
/// Lengths are millimetres: x east, y north, z up, from the south-west sample at height zero. Sizes
/// are counts of *samples*; four samples are the corners of a cell, and a cell with NaN at one of
/// them is no-data. Samples keep their type (`f64`, `f32`, `i16`, ...), and tiles of 32 × 32 cells
/// are cut where the terrain is touched. Clones share the samples.
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
    pub(crate) heights: Arc<dyn Heights>,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    /// Scale of the samples.
    pub(crate) scale: Scale,
    /// Lowest and highest height; `None` for a source that is not in memory.
    pub(crate) range: Option<[f64; 2]>,
    /// Largest difference of neighbouring heights, and the sample.
    pub(crate) step: Option<Steepest>,
    pub(crate) materials: Option<Arc<Array<u8>>>,
    /// The ball that touches the terrain; `None` for a point.
    pub(crate) ball: Option<Ball>,
    tip_mm: f64,
    /// Heights are rounded to multiples of this, cells; 0 for no rounding.
    pub(crate) height_step: f64,
}

impl Terrain {
    /// Creates a terrain from a function of a sample's column (eastward) and row (northward), which
    /// is called once for each, row by row from the south.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn from_fn<T: Height>(
        columns: u32,
        rows: u32,
        cell_mm: f64,
        mut height: impl FnMut(u32, u32) -> T,
    ) -> Result<Self, TerrainError> {
        let mut samples = reserve_samples(columns, rows)?;
        for row in 0..rows {
            samples.extend((0..columns).map(|column| height(column, row)));
        }
        Self::from_vec(columns, rows, cell_mm, RowOrder::SouthFirst, samples)
    }

    /// Creates a terrain from an array, row by row, each row from west to east. The samples are
    /// copied.
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
        // The check comes before the copy.
        check_count(columns, rows, heights.len())?;
        let mut samples = reserve_samples(columns, rows)?;
        samples.extend_from_slice(heights);
        Self::from_vec(columns, rows, cell_mm, order, samples)
    }

    /// Creates a terrain as [`Self::from_slice`] does, without a copy.
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
            ball: None,
            tip_mm: 0.0,
            height_step: 0.0,
        })
    }

    /// Creates a terrain from rows of the same length, each from west to east.
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
        let mut samples = reserve_samples(columns, north)?;
        for row in rows {
            samples.extend_from_slice(row.as_ref());
        }
        Self::from_vec(columns, north, cell_mm, order, samples)
    }

    /// Creates a terrain whose heights are read block by block where it is touched, at most 33 × 33
    /// samples at a time or 52 × 52 under a tip. Only a window of 512 × 512 cells is kept.
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
            ball: None,
            tip_mm: 0.0,
            height_step: 0.0,
        })
    }

    /// Sets the millimetres of a vertical unit, for heights in another unit.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn with_height_scale(self, mm_per_unit: f64) -> Result<Self, TerrainError> {
        let scale = Scale::new(self.scale.cell_mm(), mm_per_unit)?;
        Ok(Self { scale, ..self })
    }

    /// Rounds the heights to multiples of a step in cells, 0 for none, as `hapterra replay` does
    /// where it interpolates between the samples of a file.
    #[must_use]
    pub fn with_height_step(self, cells: f64) -> Self {
        let height_step = if cells > 0.0 { cells } else { 0.0 };
        Self {
            height_step,
            ..self
        }
    }

    /// Sets a material for each sample: an index of the surface's table
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

    /// Sets the radius of the ball that touches the terrain, mm; 0 for a point.
    ///
    /// The centre of a ball on a height field is on another height field, which is touched by a
    /// point. **The HIP and the proxy are then the ball's centre**, which over flat ground is one
    /// radius above it, and so is [`Self::height_mm`]. The error of the centre is at most 2 % of
    /// the radius. Materials are those under the centre. Forces are equal to those of `hapterra
    /// replay --tip`, bit for bit.
    ///
    /// Haptic cells are a 32nd of the radius, and the window of a contact has 512 of them along a
    /// side. A proxy more than 15 radii behind its HIP, east or north, is released
    /// ([`State::Releasing`](crate::State::Releasing)), while a replay may restart beside the HIP.
    ///
    /// ```
    /// use hapterra_touch::Terrain;
    ///
    /// let pole = |x, y| if (x, y) == (10, 10) { 3.0 } else { 0.0 };
    /// let terrain = Terrain::from_fn(21, 21, 1.0, pole)?.with_tip(2.0)?;
    /// assert_eq!(terrain.height_mm(3.0, 3.0), Some(2.0));
    /// assert_eq!(terrain.height_mm(10.0, 10.0), Some(5.0));
    /// # Ok::<(), hapterra_touch::TerrainError>(())
    /// ```
    ///
    /// # Errors
    /// [`TerrainError::Tip`] for a radius below 0, larger than 8 cells or not a number: for larger
    /// balls, use every second sample. [`TerrainError::TipCells`] if there would be too many haptic
    /// cells.
    pub fn with_tip(self, tip_mm: f64) -> Result<Self, TerrainError> {
        let ball = Ball::new(tip_mm, self.scale.cell_mm())?;
        let parts = ball.as_ref().map_or(1, Ball::parts);
        let (columns, rows) = (self.columns, self.rows);
        let cells = u64::from(columns.max(rows) - 1) * u64::from(parts);
        match cells < MAX_CELL as u64 {
            true => Ok(Self {
                ball,
                tip_mm,
                ..self
            }),
            false => Err(TerrainError::TipCells {
                tip_mm,
                parts,
                columns,
                rows,
            }),
        }
    }

    /// Returns the radius of the ball that touches the terrain, mm; 0 for a point.
    #[must_use]
    pub const fn tip_mm(&self) -> f64 {
        self.tip_mm
    }

    /// Returns the number of samples from west to east, and from south to north.
    #[must_use]
    pub const fn samples(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Returns the extent east and north from the south-west sample, mm.
    #[must_use]
    pub fn size_mm(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|count| f64::from(count - 1) * self.scale.cell_mm())
    }

    /// Returns the millimetres of a cell and of a vertical unit.
    #[must_use]
    pub const fn scale(&self) -> &Scale {
        &self.scale
    }

    /// Writes the heights of a block, row by row from the south, in the vertical unit.
    ///
    /// # Errors
    /// [`Unread`] of a callback.
    ///
    /// # Panics
    /// A block beyond the terrain, or more heights than `heights` has room for.
    pub fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        self.heights.read(block, heights)
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
