//! Source of heights: an array, or a callback.

use alloc::vec::Vec;

/// The order of an array's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowOrder {
    /// The first row is the northernmost: images, GeoTIFF, `.npy` files of the `hapterra` command,
    /// `origin="upper"` of matplotlib.
    NorthFirst,
    /// The first row is the southernmost, so row `y` is at `y` cells north: `origin="lower"` of
    /// matplotlib.
    SouthFirst,
}

/// A rectangle of samples, counted from the south-west sample of the terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Its westernmost column.
    pub column: u32,
    /// Its southernmost row.
    pub row: u32,
    /// Samples from west to east.
    pub columns: u32,
    /// Samples from south to north.
    pub rows: u32,
}

/// Heights that could not be read, with an error number of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the source of the heights reported error {0}")]
pub struct Unread(pub u32);

/// A source of heights, read block by block where the terrain is touched.
///
/// A closure can be a source. It has to return the same height for a sample each time: a sample is
/// read once for each tile that shares it.
pub trait Heights: Send + Sync {
    /// Writes the heights of a block within the terrain, row by row from the south and each row
    /// from west to east, in the terrain's vertical unit. NaN is no-data.
    ///
    /// # Errors
    /// [`Unread`]; the step that needed the heights was not made then, and may be repeated.
    fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread>;
}

impl<F: Fn(Block, &mut [f64]) -> Result<(), Unread> + Send + Sync> Heights for F {
    fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        self(block, heights)
    }
}

/// A number type for heights: `f64`, `f32`, or an integer of up to 32 bits.
pub trait Height: Copy + Into<f64> + Send + Sync + 'static {}

impl<T: Copy + Into<f64> + Send + Sync + 'static> Height for T {}

/// An array in memory, in its original type and row order.
pub(crate) struct Array<T> {
    pub(crate) samples: Vec<T>,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    pub(crate) order: RowOrder,
}

impl<T: Copy> Array<T> {
    /// Returns a row of samples, counted from the south.
    pub(crate) fn row(&self, row: u32) -> &[T] {
        let stored = match self.order {
            RowOrder::SouthFirst => Some(row),
            RowOrder::NorthFirst => (self.rows - 1).checked_sub(row),
        };
        let first = stored.map(|row| row as usize * self.columns as usize);
        let row = first.and_then(|first| self.samples.get(first..));
        row.and_then(|row| row.get(..self.columns as usize))
            .unwrap_or(&[])
    }
}

/// A difference of neighbouring heights, and its sample.
pub(crate) type Steepest = (f64, [u32; 2]);

/// Returns the lowest and highest height, and the largest difference of neighbours with its sample.
pub(crate) fn survey<T: Height>(array: &Array<T>) -> (Option<[f64; 2]>, Option<Steepest>) {
    let (mut range, mut steepest) = (None, None::<Steepest>);
    for row in 0..array.rows {
        let line = array.row(row);
        // The last row has no northern neighbour.
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

impl<T: Height> Heights for Array<T> {
    fn read(&self, block: Block, heights: &mut [f64]) -> Result<(), Unread> {
        let lines = heights.chunks_exact_mut(block.columns.max(1) as usize);
        for (row, line) in (block.row..).zip(lines) {
            let samples = self.row(row).get(block.column as usize..).unwrap_or(&[]);
            for (height, sample) in line.iter_mut().zip(samples) {
                *height = (*sample).into();
            }
        }
        Ok(())
    }
}
