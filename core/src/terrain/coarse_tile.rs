//! A tile with coarser samples than the scene's level, as part of a fallback.
//!
//! Its 33 × 33 samples are [`CoarseTile::spacing`] cells of the scene's level apart, with linear
//! interpolation along rows and columns. Between coarse samples this is again a bilinear patch,
//! also in each finer cell of the level. So contact on it is as exact as anywhere else.

use serde::{Deserialize, Serialize};

use super::index::{TILE_CELLS, TileIndex, TileKey};
use super::tile::Tile;
use crate::grid::{Cell, MAX_CELL};

/// Index and level of a coarse tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CoarseTile {
    /// The cell of the scene's level whose south-west sample is the first of the tile.
    pub first: Cell,
    /// Cells between two samples, as a power of two.
    pub shift: u8,
}

impl CoarseTile {
    /// Minimum shift: with a finer tile, the check of an arriving tile would read more samples than
    /// a tick has time for.
    pub const MIN_SHIFT: u8 = 2;
    /// Maximum shift: a tile as large as the range of positions.
    pub const MAX_SHIFT: u8 = 24;

    /// Returns true if the tile is valid in a scene of this level.
    #[must_use]
    pub fn is_valid(&self, level: u8) -> bool {
        let Cell { x, y } = self.first;
        (Self::MIN_SHIFT..=Self::MAX_SHIFT).contains(&self.shift)
            && level.checked_add(self.shift).is_some()
            && x.unsigned_abs().max(y.unsigned_abs()) <= MAX_CELL.unsigned_abs()
    }

    /// Returns the cells of the scene's level from sample to sample.
    #[must_use]
    pub const fn spacing(&self) -> i32 {
        1 << self.shift
    }

    /// Returns the key of its tile on the link, in a scene of this level: coarser by
    /// [`Self::shift`], the first of its own grid.
    #[must_use]
    pub const fn key(&self, level: u8) -> TileKey {
        TileKey {
            level: level.saturating_add(self.shift),
            index: TileIndex::new(0, 0),
        }
    }

    /// Returns the coarse cell that contains a sample of the scene's level, and the sample's place
    /// in it, eastward and northward from 0 to 1; `None` beyond the tile.
    #[inline(never)]
    fn place(&self, sample: Cell) -> Option<([usize; 2], [f32; 2])> {
        let span = (TILE_CELLS as i32) << self.shift;
        let along = |at: i32, first: i32| {
            let off = at
                .checked_sub(first)
                .filter(|off| (0..=span).contains(off))?;
            // The last sample belongs to the last cell.
            let cell = (off >> self.shift).min(TILE_CELLS as i32 - 1);
            let share = (off - (cell << self.shift)) as f32 / self.spacing() as f32;
            Some((cell as usize, share))
        };
        let (col, east) = along(sample.x, self.first.x)?;
        let (row, north) = along(sample.y, self.first.y)?;
        Some(([col, row], [east, north]))
    }

    /// Returns true if the tile covers all of a tile of the scene's level.
    pub(super) fn covers(&self, index: TileIndex) -> bool {
        let first = index.first_cell();
        let last = first.offset(TILE_CELLS as i32, TILE_CELLS as i32);
        self.place(first).is_some() && self.place(last).is_some()
    }

    /// Returns two flags: true if the tile covers a cell of the scene's level, and true if it
    /// covers at least one of the cell's corners.
    pub(super) fn coverage(&self, cell: Cell) -> [bool; 2] {
        let span = (TILE_CELLS as i32) << self.shift;
        let off = [(cell.x, self.first.x), (cell.y, self.first.y)];
        let off = off.map(|(at, first)| at.wrapping_sub(first));
        [
            off.iter().all(|off| (0..span).contains(off)),
            off.iter().all(|off| (-1..=span).contains(off)),
        ]
    }

    /// Returns the heights of `tile`, which must be this one, at the corners of a cell of the
    /// scene's level that it [covers](Self::coverage), in the order of [`Tile::corners`]. Each is
    /// equal to [`Self::height`] to the bit, except for the sign of zero. `None` beside its
    /// no-data.
    pub(super) fn corners(&self, tile: &Tile, cell: Cell) -> Option<[f32; 4]> {
        let off = [cell.x - self.first.x, cell.y - self.first.y];
        let [col, row] = off.map(|off| off >> self.shift);
        let [sw, se, nw, ne] = tile.corners(Cell::new(col, row));
        if (sw + se + nw + ne).is_nan() {
            return None;
        }
        // West and east borders of the cell, and south and north ones, in the coarse cell.
        let ([west, east], [south, north]) = (self.shares(off[0]), self.shares(off[1]));
        let [south_west, south_east] = between(sw, se, west, east);
        let [north_west, north_east] = between(nw, ne, west, east);
        let [west_south, west_north] = between(south_west, north_west, south, north);
        let [east_south, east_north] = between(south_east, north_east, south, north);
        Some([west_south, east_south, west_north, east_north])
    }

    /// Returns the start and the end of a cell in its coarse cell, from 0 to 1.
    fn shares(&self, off: i32) -> [f32; 2] {
        let remainder = off & (self.spacing() - 1);
        let per_cell = 1.0 / self.spacing() as f32;
        [remainder, remainder + 1].map(|remainder| remainder as f32 * per_cell)
    }

    /// Returns the height of `tile`, which must be this one, at a sample of the scene's level, in
    /// cells above the tile's base; NaN if a corner with weight is no-data, `None` beyond the tile.
    ///
    /// The result depends only on the sample, so two patches that share it agree to the bit.
    pub(super) fn height(&self, tile: &Tile, sample: Cell) -> Option<f32> {
        let (cell, [east, north]) = self.place(sample)?;
        let corners = tile.corners(Cell::new(cell[0] as i32, cell[1] as i32));
        Some(mix(along(&corners, east), north))
    }

    /// Returns the minimum and maximum of `tile`, which must be this one, over a tile of the
    /// scene's level, in cells above the base of `tile`; `None` if it has no height there.
    pub(super) fn range_over(&self, tile: &Tile, index: TileIndex) -> Option<[f32; 2]> {
        let first = index.first_cell();
        let along = |first: i32, own: i32| {
            let off = first.saturating_sub(own);
            let from = (off >> self.shift).max(0);
            let to = (off.saturating_add(TILE_CELLS as i32 - 1) >> self.shift)
                .saturating_add(1)
                .min(TILE_CELLS as i32);
            from..=to
        };
        let (columns, rows) = (along(first.x, self.first.x), along(first.y, self.first.y));
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for row in rows {
            for col in columns.clone() {
                let height = tile.sample(col as usize, row as usize);
                // Comparisons with NaN are false.
                if height < range[0] {
                    range[0] = height;
                }
                if height > range[1] {
                    range[1] = height;
                }
            }
        }
        (range[0] <= range[1]).then_some(range)
    }
}

/// Interpolates eastward between the corners of a patch: returns south and north.
fn along([sw, se, nw, ne]: &[f32; 4], east: f32) -> [f32; 2] {
    [mix([*sw, *se], east), mix([*nw, *ne], east)]
}

/// Interpolates between two heights, neither no-data, at a place before the end and at one that may
/// be the end: the same as [`mix`].
fn between(from: f32, to: f32, at: f32, or_at: f32) -> [f32; 2] {
    let up = to - from;
    let last = if or_at == 1.0 { to } else { from + up * or_at };
    [from + up * at, last]
}

/// Interpolates between two heights. A height without weight does not count, even NaN.
fn mix([from, to]: [f32; 2], share: f32) -> f32 {
    if share == 0.0 {
        from
    } else if share == 1.0 {
        to
    } else {
        from + (to - from) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::boxed::Box;

    const COARSE: CoarseTile = CoarseTile {
        first: Cell::new(-7, 100),
        shift: 3,
    };

    fn tile(height: impl FnMut(usize, usize) -> f32) -> Box<Tile> {
        let mut tile = Box::new(Tile::VACANT);
        tile.fill(COARSE.key(1), 40, height).expect("in range");
        tile
    }

    #[test]
    fn coarse_tile_reproduces_a_bilinear_field() {
        let field = |x: f32, y: f32| 3.0 + 0.5 * x - 0.25 * y + 0.125 * x * y;
        let coarse = tile(|col, row| field(col as f32, row as f32));
        for x in (-7..=249).step_by(5) {
            for y in (100..=356).step_by(3) {
                let (u, v) = ((x + 7) as f32 / 8.0, (y - 100) as f32 / 8.0);
                let height = COARSE.height(&coarse, Cell::new(x, y)).expect("there");
                assert!((height - field(u, v)).abs() < 1e-4, "{x} {y}: {height}");
            }
        }
    }

    #[test]
    fn coarse_tile_has_no_height_outside_and_keeps_no_data() {
        let coarse = tile(|col, row| if (col, row) == (2, 2) { f32::NAN } else { 1.0 });
        let height = |x, y| COARSE.height(&coarse, Cell::new(x, y));
        for beyond in [(-8, 200), (250, 200), (100, 99), (100, 357)] {
            assert_eq!(height(beyond.0, beyond.1), None);
        }
        assert_eq!((height(-7, 100), height(249, 356)), (Some(1.0), Some(1.0)));
        assert_eq!((height(i32::MIN, 100), height(i32::MAX, 100)), (None, None));
        // On the border of the no-data cells, no-data has no weight.
        assert_eq!((height(1, 116), height(17, 116)), (Some(1.0), Some(1.0)));
        let is_no_data = |x, y| height(x, y).is_some_and(f32::is_nan);
        assert!(is_no_data(2, 116) && is_no_data(9, 116));
    }

    #[test]
    fn corners_equal_heights_bit_for_bit_except_beside_no_data() {
        let rough = |col: usize, row: usize| ((col * 7919 + row * 104_729) % 997) as f32 / 7.0;
        let is_no_data = |col: usize, row: usize| (col, row) == (9, 4);
        let coarse = tile(|col, row| {
            if is_no_data(col, row) {
                f32::NAN
            } else {
                rough(col, row)
            }
        });
        for shift in [2, 3, 7] {
            let place = CoarseTile { shift, ..COARSE };
            let span = 32 << shift;
            let mut beside_no_data = 0;
            for at in 0..span * span {
                let cell = place.first.offset(at % span, at / span);
                assert_eq!(place.coverage(cell), [true; 2]);
                let Some(corners) = place.corners(&coarse, cell) else {
                    beside_no_data += 1;
                    continue;
                };
                for (corner, height) in (0..).zip(corners) {
                    let sample = cell.offset(corner & 1, corner >> 1);
                    let expected = place.height(&coarse, sample).expect("there");
                    assert_eq!(height.to_bits(), expected.to_bits(), "{cell:?} {corner}");
                }
            }
            assert_eq!(beside_no_data, 4 << (2 * shift));
            let coverage = |east, north| place.coverage(place.first.offset(east, north));
            assert_eq!(coverage(-1, span), [false, true]);
            assert_eq!(
                (coverage(-2, 0), coverage(0, span + 1)),
                ([false; 2], [false; 2])
            );
        }
        let far = Cell::new(i32::MIN, i32::MAX);
        assert_eq!(COARSE.coverage(far), [false; 2]);
    }

    #[test]
    fn range_over_a_tile_bounds_its_heights() {
        let hash = |col: usize, row: usize| ((col * 7919 + row * 104_729) % 101) as f32;
        let coarse = tile(hash);
        for shift in [2, 3, 5, 8] {
            let place = CoarseTile { shift, ..COARSE };
            for index in [
                TileIndex::new(0, 3),
                TileIndex::new(-1, 4),
                TileIndex::new(2, 9),
            ] {
                let range = place.range_over(&coarse, index);
                let first = index.first_cell();
                let mut known = 0;
                for sample in 0..33 * 33 {
                    let sample = first.offset(sample % 33, sample / 33);
                    let height = place.height(&coarse, sample).unwrap_or(f32::NAN);
                    if height.is_nan() {
                        continue;
                    }
                    known += 1;
                    let [low, high] = range.expect("some height");
                    assert!((low..=high).contains(&height), "{shift} {index:?} {height}");
                }
                assert!(
                    known > 0 || range.is_none() || shift == 2,
                    "{shift} {index:?}"
                );
            }
        }
    }

    #[test]
    fn level_shift_or_origin_out_of_range_is_invalid() {
        let with = |first, shift| CoarseTile { first, shift };
        assert!(COARSE.is_valid(0) && COARSE.is_valid(252));
        assert!(!COARSE.is_valid(253));
        assert!(!with(Cell::new(0, 0), 1).is_valid(0) && !with(Cell::new(0, 0), 25).is_valid(0));
        assert!(!with(Cell::new(i32::MIN, 0), 3).is_valid(0));
        assert_ne!(COARSE.key(4).level, 4);
    }
}
