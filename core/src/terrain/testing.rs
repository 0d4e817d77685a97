//! A field for tests: a window that can be filled from a function.

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use super::extent::FieldSize;
use super::index::{TileIndex, TileKey};
use super::tile::Tile;
use super::window::Window;
use crate::grid::Cell;

/// Buffers for a window of `D × D` tiles, and some spare ones.
pub(crate) fn buffers<const D: usize>() -> Vec<Tile> {
    vec![Tile::VACANT; D * D + 4]
}

/// A height function and a window over it.
pub(crate) struct Field<'t, const D: usize> {
    pub(crate) window: Window<'t, D>,
    size: FieldSize,
    base: i32,
    height: Box<dyn Fn(i32, i32) -> f32>,
    spare: Vec<&'t mut Tile>,
}

impl<'t, const D: usize> Field<'t, D> {
    /// An empty field in these buffers.
    pub(crate) fn empty(
        buffers: &'t mut [Tile],
        size: FieldSize,
        height: impl Fn(i32, i32) -> f32 + 'static,
    ) -> Self {
        let mut spare: Vec<_> = buffers.iter_mut().collect();
        let mut next = || spare.pop().expect("a buffer for every slot");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let mut window = Window::new(slots);
        window.reset(0, size, 1 << 28);
        Self {
            window,
            size,
            base: 0,
            height: Box::new(height),
            spare,
        }
    }

    /// A field with all of its tiles stored.
    pub(crate) fn filled(
        buffers: &'t mut [Tile],
        size: FieldSize,
        height: impl Fn(i32, i32) -> f32 + 'static,
    ) -> Self {
        let mut field = Self::empty(buffers, size, height);
        let last = size.last_tile();
        assert!(last.col.max(last.row) < D as i32, "the window is too small");
        size.tiles().for_each(|tile| field.store(tile));
        field
    }

    /// A square field of `size` cells, all stored, moved by `shift` cells (whole tiles) east, north
    /// and up, without terrain west and south of it.
    pub(crate) fn shifted(
        buffers: &'t mut [Tile],
        size: i32,
        shift: i32,
        height: fn(i32, i32) -> f32,
    ) -> Self {
        let whole = FieldSize::new(size + shift, size + shift);
        let mut field = Self::empty(buffers, whole, move |x, y| {
            if x < shift || y < shift {
                return f32::NAN;
            }
            height(x - shift, y - shift)
        });
        field.base = shift;
        let first = TileIndex::containing(Cell::new(shift, shift)).col;
        field.fill(first..first + D as i32, first..first + D as i32);
        field
    }

    /// Stores the existing ones of the D × D tiles around a cell.
    pub(crate) fn fill_around(&mut self, cell: Cell) {
        let TileIndex { col, row } = TileIndex::containing(cell);
        let reach = D as i32 / 2;
        self.fill(col - reach..col + reach, row - reach..row + reach);
    }

    fn fill(&mut self, cols: core::ops::Range<i32>, rows: core::ops::Range<i32>) {
        for row in rows {
            for col in cols.clone() {
                self.store(TileIndex::new(col, row));
            }
        }
    }

    fn store(&mut self, index: TileIndex) {
        let key = TileKey { level: 0, index };
        if self.window.occupant(key) != Some(key) && self.window.expects(key) {
            let spent = self.install(key);
            self.spare.push(spent);
        }
    }

    /// Installs a tile; the buffer that returns becomes spare.
    pub(crate) fn reinstall(&mut self, key: TileKey) {
        let spent = self.install(key);
        self.spare.push(spent);
    }

    /// Fills a buffer with the tile and installs it.
    pub(crate) fn install(&mut self, key: TileKey) -> &'t mut Tile {
        let tile = self.spare.pop().expect("a spare buffer");
        tile.fill_from(key, self.base, self.size, &self.height)
            .unwrap();
        self.window.install(tile)
    }
}
