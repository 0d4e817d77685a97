//! Memory for a window, and a whole field in it.

use super::extent::FieldSize;
use super::index::{TILE_CELLS, TileKey};
use super::tile::{MAX_STEP_CELLS, Tile};
use super::window::Window;
use crate::grid::MAX_CELL;

/// Memory of a window of `D × D` tiles, 5.5 kB each; it can contain a whole field.
///
/// Without an allocator it is stored wherever its owner puts it. On a desktop, put large ones on
/// the heap: `Box::new(TileArena::<16>::new())`, then [`Self::fill`].
///
/// ```
/// use hapterra_core::grid::Cell;
/// use hapterra_core::terrain::{FieldSize, TileArena, CellContent};
///
/// // A ramp of 40 × 20 cells that rises by half a cell from cell to cell.
/// let size = FieldSize::new(40, 20);
/// let mut ramp = TileArena::<2>::from_fn(size, |x, _y| 0.5 * x as f32)?;
/// let window = ramp.window();
/// let CellContent::Patch(corners) = window.ground(Cell::new(10, 3)) else {
///     panic!("the field has a surface there");
/// };
/// assert_eq!(corners.heights, [5.0, 5.5, 5.0, 5.5]);
/// # Ok::<(), hapterra_core::terrain::FieldError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TileArena<const D: usize> {
    tiles: [[Tile; D]; D],
    size: FieldSize,
}

/// Reason why heights cannot be stored as a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// No cells, or more than fit.
    #[error("a field of {} × {} cells; this storage accepts 1 × 1 to {max} × {max}", size.columns, size.rows)]
    Size {
        /// The field's size.
        size: FieldSize,
        /// Maximum cells per side.
        max: i32,
    },
    /// The number of heights is wrong: a field of the size has this many.
    #[error("a field of this size has {0} heights: one more than cells in each direction")]
    Count(i32),
    /// The heights are too steep.
    #[error(
        "neighbouring samples differ by more than {MAX_STEP_CELLS} cells: scale the heights down, or fill the samples"
    )]
    Step,
}

impl<const D: usize> TileArena<D> {
    /// Maximum cells per side of a field.
    pub const MAX_CELLS: i32 = {
        assert!(
            D <= MAX_CELL as usize / TILE_CELLS,
            "that many cells cannot be addressed"
        );
        (D * TILE_CELLS) as i32
    };

    /// Creates an arena without a field.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            tiles: [const { [const { Tile::VACANT }; D] }; D],
            size: FieldSize::new(0, 0),
        }
    }

    /// Creates the field of a function of a sample's column (eastward) and row (northward), both
    /// from 0 to the size inclusive: heights in cells, NaN for no-data. The function is called in
    /// rows from the south.
    ///
    /// # Errors
    /// Returns [`FieldError::Size`] if the size does not fit.
    pub fn from_fn(
        size: FieldSize,
        mut height: impl FnMut(i32, i32) -> f32,
    ) -> Result<Self, FieldError> {
        let mut storage = Self::new();
        let columns = size.columns.saturating_add(1).max(1);
        storage.fill(size, (0..).map(|i| height(i % columns, i / columns)))?;
        Ok(storage)
    }

    /// Creates a field of heights in cells, in rows from the south, each row from west to east. NaN
    /// is no-data.
    ///
    /// ```
    /// # use hapterra_core::terrain::{FieldError, FieldSize, TileArena};
    /// // Two cells side by side have three samples in each of two rows.
    /// let heights = [0.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    /// let field = TileArena::<1>::from_slice(FieldSize::new(2, 1), &heights)?;
    /// assert_eq!(field.top(), 2);
    /// let more = TileArena::<1>::from_slice(FieldSize::new(2, 2), &heights);
    /// assert_eq!(more.unwrap_err(), FieldError::Count(9));
    /// # Ok::<(), FieldError>(())
    /// ```
    ///
    /// # Errors
    /// Returns a [`FieldError`] if the size does not fit, or if the number of heights is not that
    /// of a field of this size.
    pub fn from_slice(size: FieldSize, heights: &[f32]) -> Result<Self, FieldError> {
        let mut storage = Self::new();
        let mut heights = heights.iter().copied();
        storage.fill(size, &mut heights)?;
        match heights.len() {
            0 => Ok(storage),
            _ => Err(FieldError::Count(samples(size))),
        }
    }

    /// Creates a field from rows of heights, as in [`Self::from_slice`].
    ///
    /// ```
    /// # use hapterra_core::terrain::{FieldError, FieldSize, TileArena};
    /// let rows = (0..=2).map(|y| [0.0, 0.5 * y as f32]);
    /// let field = TileArena::<1>::from_rows(FieldSize::new(1, 2), rows)?;
    /// assert_eq!(field.top(), 2);
    /// # Ok::<(), FieldError>(())
    /// ```
    ///
    /// # Errors
    /// The same as [`Self::from_slice`] for too few heights; extra ones are ignored.
    pub fn from_rows<R: IntoIterator<Item = f32>>(
        size: FieldSize,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<Self, FieldError> {
        let mut storage = Self::new();
        storage.fill(size, rows.into_iter().flatten())?;
        Ok(storage)
    }

    /// Replaces the stored field, in place: for an arena that is too large to be moved. The heights
    /// are in the order of [`Self::from_slice`].
    ///
    /// # Errors
    /// The same as [`Self::from_rows`]; the arena is then empty.
    pub fn fill(
        &mut self,
        size: FieldSize,
        heights: impl IntoIterator<Item = f32>,
    ) -> Result<(), FieldError> {
        self.size = FieldSize::new(0, 0);
        for tile in self.tiles.as_flattened_mut() {
            tile.clear();
        }
        let fits = |cells: i32| (1..=Self::MAX_CELLS).contains(&cells);
        if !fits(size.columns) || !fits(size.rows) {
            let max = Self::MAX_CELLS;
            return Err(FieldError::Size { size, max });
        }
        let mut heights = heights.into_iter();
        for y in 0..=size.rows {
            for x in 0..=size.columns {
                let height = heights.next().ok_or(FieldError::Count(samples(size)))?;
                self.set(x as usize, y as usize, height);
            }
        }
        self.size = size;
        let tiles = self.tiles.as_flattened().iter();
        if !tiles.into_iter().all(Tile::has_valid_steps) {
            self.size = FieldSize::new(0, 0);
            return Err(FieldError::Step);
        }
        for index in size.tiles() {
            let tile = &mut self.tiles[index.row as usize][index.col as usize];
            tile.complete(TileKey { level: 0, index }, 0);
        }
        Ok(())
    }

    /// Sets a sample in all tiles that share it.
    fn set(&mut self, x: usize, y: usize, height: f32) {
        for (row, v) in shares(y) {
            for (col, u) in shares(x) {
                if let Some(tile) = self.tiles.get_mut(row).and_then(|row| row.get_mut(col)) {
                    tile.set(u, v, height);
                }
            }
        }
    }

    /// Returns the size of the stored field; without cells if there is none.
    #[must_use]
    pub const fn size(&self) -> FieldSize {
        self.size
    }

    /// Returns an upper bound of all samples, in whole cells.
    #[must_use]
    pub fn top(&self) -> i32 {
        let tiles = self.tiles.as_flattened().iter();
        let tiles = tiles.filter(|tile| tile.key().is_some());
        tiles.map(Tile::top).max().unwrap_or(i32::MIN)
    }

    /// Returns a window over the stored field, without missing tiles.
    pub fn window(&mut self) -> Window<'_, D> {
        let (size, top) = (self.size, self.top());
        let tiles = self.tiles.each_mut();
        Window::filled(tiles.map(<[Tile; D]>::each_mut), size, top)
    }

    /// Returns buffers for [`Window::new`] and for the loop, which fill them tile by tile. Discards
    /// the stored field.
    pub fn slots(&mut self) -> [[&mut Tile; D]; D] {
        self.size = FieldSize::new(0, 0);
        self.tiles.each_mut().map(<[Tile; D]>::each_mut)
    }
}

impl<const D: usize> Default for TileArena<D> {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the number of samples of a field.
fn samples(size: FieldSize) -> i32 {
    (size.columns + 1).saturating_mul(size.rows + 1)
}

/// Returns the tiles' columns (or rows) that share a sample's, and its place in each: the first
/// sample of a tile is the last of the one before.
fn shares(sample: usize) -> impl Iterator<Item = (usize, usize)> {
    let (tile, place) = (sample / TILE_CELLS, sample % TILE_CELLS);
    let before = tile.checked_sub(1).filter(|_| place == 0);
    let before = before.map(|tile| (tile, TILE_CELLS));
    core::iter::once((tile, place)).chain(before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Altitude, Cell};
    use crate::terrain::{CellBox, CellContent, Corners};
    use std::format;

    fn rough(x: i32, y: i32) -> f32 {
        ((x * 31 + y * 17) % 23) as f32 * 0.25
    }

    #[test]
    fn patches_read_back_their_samples_across_tiles() {
        let mut storage = TileArena::<2>::from_fn(FieldSize::new(40, 33), rough).unwrap();
        let window = storage.window();
        for (x, y) in [(0, 0), (31, 31), (32, 31), (31, 32), (32, 32), (39, 32)] {
            let heights = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(u, v)| rough(x + u, y + v));
            let corners = Corners { base: 0, heights };
            assert_eq!(
                window.ground(Cell::new(x, y)),
                CellContent::Patch(corners),
                "{x} {y}"
            );
        }
        assert_eq!(window.ground(Cell::new(40, 0)), CellContent::NoData);
        assert_eq!(window.ground(Cell::new(0, 33)), CellContent::NoData);
    }

    #[test]
    fn arena_fills_whole_and_partial_tiles() {
        let mut storage = TileArena::<2>::new();
        for (columns, rows) in [(64, 64), (1, 1), (32, 33)] {
            let size = FieldSize::new(columns, rows);
            let heights = core::iter::repeat_n(2.5, ((columns + 1) * (rows + 1)) as usize);
            storage.fill(size, heights).unwrap();
            assert_eq!((storage.size(), storage.top()), (size, 3));
            let window = storage.window();
            let whole = CellBox::around(Cell::default(), Cell::new(columns - 1, rows - 1));
            assert!(window.is_clear(whole, Altitude::new(3, 0.0)));
            assert!(!window.is_clear(whole, Altitude::new(2, 0.25)));
            let last = window.ground(whole.to);
            assert!(matches!(last, CellContent::Patch(_)), "{last:?}");
        }
    }

    #[test]
    fn invalid_size_is_refused_and_leaves_the_field_empty() {
        let mut storage = TileArena::<1>::from_fn(FieldSize::new(5, 5), rough).unwrap();
        for (columns, rows) in [(33, 1), (1, i32::MAX), (0, 5), (5, i32::MIN)] {
            let size = FieldSize::new(columns, rows);
            let error = storage.fill(size, core::iter::repeat(0.0)).unwrap_err();
            assert_eq!(error, FieldError::Size { size, max: 32 });
            assert_eq!(
                storage.window().ground(Cell::default()),
                CellContent::NoData
            );
        }
        let size = FieldSize::new(2, 2);
        let few = TileArena::<1>::from_slice(size, &[0.0; 8]).unwrap_err();
        let many = TileArena::<1>::from_slice(size, &[0.0; 10]).unwrap_err();
        assert_eq!((few, many), (FieldError::Count(9), FieldError::Count(9)));
        assert_eq!(
            format!("{few}"),
            "a field of this size has 9 heights: one more than cells in each direction"
        );
    }

    #[test]
    fn field_with_too_steep_step_is_refused() {
        let size = FieldSize::new(40, 40);
        let wall = |height: f32| {
            TileArena::<2>::from_fn(size, move |x, _| if x > 32 { height } else { 0.0 })
        };
        assert!(wall(MAX_STEP_CELLS).is_ok());
        assert_eq!(wall(MAX_STEP_CELLS + 1.0).err(), Some(FieldError::Step));
        let mut tile = std::boxed::Box::new(Tile::VACANT);
        let refused = tile.fill(TileKey::new(0, 0, 0), 0, |_, row| {
            1e4 * row as f32 * row as f32
        });
        assert_eq!(
            (refused, tile.key()),
            (Err(crate::terrain::TileError::Step), None)
        );
    }
}
