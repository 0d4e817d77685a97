//! A field for tests: a window that can be filled from a function.

use std::boxed::Box;
use std::vec::Vec;

use super::{TILE_CELLS, Tile, TileKey, Window};

/// A height function and a window over it.
pub(crate) struct Field<const D: usize> {
    pub(crate) window: Window<'static, D>,
    size: [i32; 2],
    base: i32,
    height: Box<dyn Fn(i32, i32) -> f32>,
    spare: Vec<&'static mut Tile>,
}

impl<const D: usize> Field<D> {
    /// A field of `size` patches with nothing held yet.
    pub(crate) fn new(size: [i32; 2], height: impl Fn(i32, i32) -> f32 + 'static) -> Self {
        let mut window = Window::new(core::array::from_fn(|_| {
            core::array::from_fn(|_| Box::leak(Box::new(Tile::VACANT)))
        }));
        window.reset(0, size, 1 << 28);
        Self {
            window,
            size,
            base: 0,
            height: Box::new(height),
            spare: Vec::new(),
        }
    }

    /// A field with every tile of it held.
    pub(crate) fn held(size: [i32; 2], height: impl Fn(i32, i32) -> f32 + 'static) -> Self {
        let mut field = Self::new(size, height);
        let tiles = size.map(|s| (s - 1) / TILE_CELLS as i32);
        assert!(
            tiles.iter().all(|t| *t < D as i32),
            "the window is too small"
        );
        for row in 0..=tiles[1] {
            for col in 0..=tiles[0] {
                field.take(TileKey { level: 0, col, row });
            }
        }
        field
    }

    /// A square field of `size` patches, all held, moved by `shift` cells (whole
    /// tiles) east, north and up; nothing lies west and south of it.
    pub(crate) fn shifted(size: i32, shift: i32, height: fn(i32, i32) -> f32) -> Self {
        let mut field = Self::new([size + shift; 2], move |x, y| {
            if x < shift || y < shift {
                return f32::NAN;
            }
            height(x - shift, y - shift)
        });
        field.base = shift;
        let first = shift / TILE_CELLS as i32;
        for row in first..first + D as i32 {
            for col in first..first + D as i32 {
                field.take(TileKey { level: 0, col, row });
            }
        }
        field
    }

    /// Holds the D × D tiles around a cell, as far as they exist.
    pub(crate) fn hold_around(&mut self, cell: [i32; 2]) {
        let centre = TileKey::holding(0, cell);
        let reach = D as i32 / 2;
        for row in centre.row - reach..centre.row + reach {
            for col in centre.col - reach..centre.col + reach {
                self.take(TileKey { level: 0, col, row });
            }
        }
    }

    fn take(&mut self, key: TileKey) {
        if self.window.occupant(key) != Some(key) && self.window.expects(key) {
            let spent = self.install(key);
            self.spare.push(spent);
        }
    }

    /// Fills a buffer with the tile and installs it.
    pub(crate) fn install(&mut self, key: TileKey) -> &'static mut Tile {
        let tile = self
            .spare
            .pop()
            .unwrap_or_else(|| Box::leak(Box::new(Tile::VACANT)));
        let (west, south) = (key.col * TILE_CELLS as i32, key.row * TILE_CELLS as i32);
        let size = self.size;
        tile.fill(key, self.base, |col, row| {
            let (x, y) = (west + col as i32, south + row as i32);
            if x > size[0] || y > size[1] {
                return f32::NAN;
            }
            (self.height)(x, y)
        })
        .unwrap();
        self.window.install(tile)
    }
}
