//! The window: the tiles that a device stores, in a torus around the HIP.

mod late_tiles;

use super::blend_allowances::BlendAllowances;
use super::extent::{CellBox, FieldSize};
use super::fallback::FallbackSlots;
use super::index::{BLOCK_SHIFT, TILE_SHIFT, TileIndex, TileKey, wrap};
use super::max_pyramid::MaxPyramid;
use super::tile::Tile;
use crate::grid::{Altitude, Cell};

/// Content of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellContent {
    /// A patch.
    Patch(Corners),
    /// No surface: no-data, or outside the field.
    NoData,
    /// The tile has not arrived yet.
    Missing,
}

/// The corners of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners {
    /// Whole height, in cells, to which the corner heights are relative.
    pub base: i32,
    /// South-west, south-east, north-west, north-east, cells above the base.
    pub heights: [f32; 4],
}

impl Corners {
    /// Corners without a sample.
    pub(crate) const NONE: Self = Self {
        base: 0,
        heights: [f32::NAN; 4],
    };

    /// Returns the heights in cells above another base, exact to the last places of the largest.
    #[inline(never)]
    pub(crate) fn above(&self, base: i32) -> [f32; 4] {
        let lower = self.base.wrapping_sub(base) as f32;
        self.heights.map(|height| height + lower)
    }
}

/// `D × D` tiles; tile `(col, row)` is always stored in slot `(col mod D, row mod D)`. If `D` is
/// not a power of two, there are no maxima over several tiles.
///
/// ```
/// use hapterra_core::grid::{Altitude, Cell};
/// use hapterra_core::terrain::{
///     CellBox, CellContent, FieldSize, Tile, TileArena, TileKey, Window,
/// };
///
/// // A field far larger than the window, no sample of which exceeds 5 cells.
/// let size = FieldSize::new(10_000, 10_000);
/// let mut storage = TileArena::<2>::new();
/// let mut window = Window::new(storage.slots());
/// window.reset(0, size, 5);
/// let cell = Cell::new(7_000, 3_000);
/// assert_eq!(window.ground(cell), CellContent::Missing);
///
/// // A tile is installed, and a buffer for the next one is returned.
/// let mut spare = Tile::VACANT;
/// let key = TileKey::containing(0, cell);
/// spare.fill_from(key, 0, size, |_x, _y| 1.5).expect("base 0 is in range");
/// assert_eq!(window.install(&mut spare).key(), None);
/// let CellContent::Patch(corners) = window.ground(cell) else { panic!("a patch") };
/// assert_eq!(corners.heights, [1.5; 4]);
///
/// // Nothing around the cell reaches two cells up.
/// let around = CellBox::around(cell, cell.offset(3, 3));
/// assert!(window.is_clear(around, Altitude::new(2, 0.0)));
/// ```
///
/// The window owns its buffers as `&mut Tile`. Installing a tile swaps one reference, so a tick
/// reads either the old tile or the new one, and nothing is copied.
// Field order: fields that each tick reads first are within the offset range of its loads. The
// maxima and the allowances of a large window are beyond that range.
#[repr(C)]
pub struct Window<'t, const D: usize> {
    size: FieldSize,
    top: i32,
    level: u8,
    pub(super) slots: [[&'t mut Tile; D]; D],
    pyramid: MaxPyramid<D>,
    pub(super) fallback: FallbackSlots<'t>,
    pub(super) allowances: BlendAllowances<D>,
    /// The fallback of the next scene, and its level; it is not rendered.
    next: FallbackSlots<'t>,
    next_level: u8,
}

impl<'t, const D: usize> Window<'t, D> {
    /// Creates a window without a field: every cell is no-data. Discards the content of the tiles.
    #[must_use]
    pub fn new(slots: [[&'t mut Tile; D]; D]) -> Self {
        let none = FieldSize::default();
        let mut window = Self::filled(slots, none, i32::MIN);
        window.reset(0, none, i32::MIN);
        window
    }

    /// Creates a window over a field whose tiles are all in their slots.
    pub(super) fn filled(slots: [[&'t mut Tile; D]; D], size: FieldSize, top: i32) -> Self {
        let mut window = Self {
            slots,
            pyramid: MaxPyramid::unknown(),
            level: 0,
            size,
            top,
            fallback: FallbackSlots::EMPTY,
            next: FallbackSlots::EMPTY,
            next_level: 0,
            allowances: BlendAllowances::NONE,
        };
        for key in size.tiles() {
            window.slots[wrap::<D>(key.row)][wrap::<D>(key.col)].mark_as_surface();
            if let Some(top) = window.surface_tile(key).map(Tile::top) {
                window.update_maxima(key, top);
            }
        }
        window
    }

    /// Discards every tile and sets a new field without fallback ([`Self::set_fallback`]): its
    /// level, its size, and an upper bound of its samples in whole cells.
    // Not inlined: the loop over the tiles would be unrolled in each caller.
    #[inline(never)]
    pub fn reset(&mut self, level: u8, size: FieldSize, top: i32) {
        for tile in self.slots.as_flattened_mut() {
            tile.vacate();
        }
        self.pyramid = MaxPyramid::unknown();
        self.level = level;
        self.size = size;
        self.top = top;
        self.set_fallback(None);
    }

    /// Puts `tile` in its slot and returns the replaced buffer; returns `tile` itself if it is
    /// vacant, of another level, or outside.
    ///
    /// The tile is rendered unchanged at once; [`Self::take`] is for tiles over a fallback.
    ///
    /// A returned buffer with a key contains a tile that is not stored. If the same tile is
    /// installed again, the returned buffer is therefore vacant.
    #[must_use]
    pub fn install(&mut self, tile: &'t mut Tile) -> &'t mut Tile {
        self.put(tile, false)
    }

    /// [`Self::install`] for a tile that blends in from the fallback if `blends` is true.
    pub(super) fn put(&mut self, tile: &'t mut Tile, blends: bool) -> &'t mut Tile {
        let Some(key) = tile.key().filter(|key| self.expects(*key)) else {
            return tile;
        };
        let top = tile.top();
        let slot = &mut self.slots[wrap::<D>(key.index.row)][wrap::<D>(key.index.col)];
        let spent = core::mem::replace(slot, tile);
        let was_here = spent.key() == Some(key);
        if was_here {
            spent.vacate();
        }
        self.record_arrival(key.index, blends, was_here);
        self.update_maxima(key.index, top);
        spent
    }

    /// Returns true if `key` names a tile of this field.
    #[must_use]
    pub fn expects(&self, key: TileKey) -> bool {
        key.level == self.level && self.size.has_tile(key.index)
    }

    /// Returns the field's level.
    #[must_use]
    pub const fn level(&self) -> u8 {
        self.level
    }

    /// Returns an upper bound of the field's samples, whole cells.
    #[must_use]
    pub const fn top(&self) -> i32 {
        self.top
    }

    /// Returns the key of the tile in the slot to which `key` belongs.
    #[must_use]
    pub fn occupant(&self, key: TileKey) -> Option<TileKey> {
        self.slots[wrap::<D>(key.index.row)][wrap::<D>(key.index.col)].key()
    }

    /// Returns the content of `cell`.
    #[must_use]
    #[inline]
    pub fn ground(&self, cell: Cell) -> CellContent {
        if !self.has_cell(cell) {
            return CellContent::NoData;
        }
        let Some(tile) = self.surface_tile(TileIndex::containing(cell)) else {
            return self.blended_ground(cell);
        };
        let heights = tile.corners(cell);
        let [sw, se, nw, ne] = heights;
        if (sw + se + nw + ne).is_nan() {
            return CellContent::NoData;
        }
        CellContent::Patch(Corners {
            base: tile.base(),
            heights,
        })
    }

    /// Returns the samples at the corners of a cell, NaN for no-data. `None` if the tile has not
    /// arrived yet.
    #[inline(never)]
    pub(crate) fn corners(&self, cell: Cell) -> Option<Corners> {
        if !self.has_cell(cell) {
            return Some(Corners::NONE);
        }
        let Some(tile) = self.surface_tile(TileIndex::containing(cell)) else {
            return match self.blended_ground(cell) {
                CellContent::Patch(corners) => Some(corners),
                CellContent::NoData => Some(Corners::NONE),
                CellContent::Missing => None,
            };
        };
        Some(Corners {
            base: tile.base(),
            heights: tile.corners(cell),
        })
    }

    /// Returns true if everything in the box is certainly below `low`.
    ///
    /// `false` may also mean that the cheap test is not conclusive. Compares one number for the
    /// whole field, then at most four nodes.
    #[must_use]
    #[inline]
    pub fn is_clear(&self, span: CellBox, low: Altitude) -> bool {
        low.cell() >= self.top || self.box_is_clear(span.clipped(self.size), low)
    }

    /// Returns true if all samples around a box of at most 2 × 2 patches are certainly below
    /// `low`, by a comparison of the nine samples themselves.
    ///
    /// `false` also if the box is larger, or not inside one stored tile.
    #[must_use]
    #[inline]
    pub fn is_clear_nearby(&self, span: CellBox, low: Altitude) -> bool {
        let CellBox { from, to } = span;
        let tile = TileIndex::containing(from);
        let small = (to.x - from.x) | (to.y - from.y) <= 1;
        small
            && TileIndex::containing(to) == tile
            && self
                .surface_tile(tile)
                .is_some_and(|tile| tile.is_below_around(from, to, low))
    }

    fn box_is_clear(&self, span: CellBox, low: Altitude) -> bool {
        if span.is_empty() {
            return true;
        }
        let shift = span.cover_shift(BLOCK_SHIFT);
        if shift > MaxPyramid::<D>::TOP_SHIFT {
            return false;
        }
        let node = |cell: Cell| (cell.x >> shift, cell.y >> shift);
        let ((west, south), (east, north)) = (node(span.from), node(span.to));
        let is_below = |col, row| self.node_is_below(shift, col, row, low);
        is_below(west, south)
            && (east == west || is_below(east, south))
            && (north == south || is_below(west, north))
            && (east == west || north == south || is_below(east, north))
    }

    fn node_is_below(&self, shift: u32, col: i32, row: i32, low: Altitude) -> bool {
        if shift >= TILE_SHIFT {
            return low.cell() >= self.node_top(shift - TILE_SHIFT, col, row);
        }
        self.part_is_below(shift, col, row, low)
    }

    /// [`Self::node_is_below`] for a node inside one tile.
    #[inline]
    fn part_is_below(&self, shift: u32, col: i32, row: i32, low: Altitude) -> bool {
        let up = TILE_SHIFT - shift;
        let first = Cell::new(col << shift, row << shift);
        let index = TileIndex::new(col >> up, row >> up);
        match self.surface_tile(index) {
            Some(tile) => tile.block_is_below(shift, first, low),
            None => self.blended_is_below(index, low),
        }
    }

    /// Returns a whole height that no sample under a node exceeds; `i32::MAX` if unknown.
    fn node_top(&self, level: u32, col: i32, row: i32) -> i32 {
        if !self.size.has(col, row, TILE_SHIFT + level) {
            i32::MIN
        } else if self
            .surface_tile(TileIndex::new(col << level, row << level))
            .is_some()
        {
            // A node is valid only while all its tiles are stored, so its south-west tile
            // identifies the node that the slot describes.
            self.pyramid.node(level, col, row)
        } else {
            i32::MAX
        }
    }

    // Not inlined: it has several callers.
    #[inline(never)]
    pub(super) fn update_maxima(&mut self, tile: TileIndex, top: i32) {
        self.pyramid.set(0, tile.col, tile.row, top);
        for level in 1..=MaxPyramid::<D>::HEIGHT {
            let (col, row) = (tile.col >> level, tile.row >> level);
            let highest = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(east, north)| self.node_top(level - 1, 2 * col + east, 2 * row + north))
                .into_iter()
                .fold(i32::MIN, i32::max);
            self.pyramid.set(level, col, row, highest);
        }
    }

    /// Returns the tile, if it is rendered unchanged.
    #[inline]
    pub(super) fn surface_tile(&self, index: TileIndex) -> Option<&Tile> {
        let tile = &*self.slots[wrap::<D>(index.row)][wrap::<D>(index.col)];
        // `install` accepts tiles of the field's level only.
        tile.is_surface_of(index).then_some(tile)
    }

    /// Returns true if the cell's tile has arrived, whether it still blends or not.
    pub(crate) fn has_tile(&self, cell: Cell) -> bool {
        let index = TileIndex::containing(cell);
        let tile = &*self.slots[wrap::<D>(index.row)][wrap::<D>(index.col)];
        tile.key().is_some_and(|key| key.index == index)
    }

    /// Returns true if the cell is in the field, with or without data.
    #[inline]
    pub(crate) fn has_cell(&self, cell: Cell) -> bool {
        self.size.has_cell(cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;
    use crate::terrain::testing::{Field, buffers};
    use std::vec::Vec;

    /// A field of 20 × 20 tiles whose height is a hash of the sample.
    fn rough(x: i32, y: i32) -> f32 {
        let hash = (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) as u32;
        (hash.wrapping_mul(2_654_435_761) >> 20) as f32 / 64.0
    }

    #[test]
    fn stored_patches_read_back_their_samples() {
        let mut buffers = buffers::<4>();
        let mut field = Field::<4>::empty(&mut buffers, FieldSize::new(640, 640), rough);
        field.fill_around(Cell::new(100, 70));
        for (x, y) in [(100, 70), (95, 63), (96, 64), (127, 95), (64, 32)] {
            let heights = [
                rough(x, y),
                rough(x + 1, y),
                rough(x, y + 1),
                rough(x + 1, y + 1),
            ];
            let corners = Corners { base: 0, heights };
            assert_eq!(
                field.window.ground(Cell::new(x, y)),
                CellContent::Patch(corners)
            );
        }
        assert_eq!(field.window.ground(Cell::new(-1, 0)), CellContent::NoData);
        assert_eq!(field.window.ground(Cell::new(640, 9)), CellContent::NoData);
        assert_eq!(field.window.ground(Cell::new(600, 9)), CellContent::Missing);
    }

    #[test]
    fn clear_boxes_are_clear_for_any_stored_tiles() {
        let mut buffers = buffers::<4>();
        let mut field = Field::<4>::empty(&mut buffers, FieldSize::new(640, 640), rough);
        let mut counts = [0, 0];
        const EACH: u32 = cases(1, 8);
        for step in (0..4000_i32).step_by(EACH as usize) {
            if step % 97 == 0 {
                field.fill_around(Cell::new((step * 5) % 640, (step * 11) % 640));
            }
            let a = Cell::new((step * 7) % 640, (step * 13) % 640);
            let b = a.offset(step % 41 - 20, step * 3 % 57 - 28);
            let low = Altitude::new(step % 68, 0.5);
            let span = CellBox::around(a, b);
            let clear = field.window.is_clear(span, low);
            counts[usize::from(clear)] += 1;
            if clear {
                for y in span.from.y.max(0)..=span.to.y.min(639) {
                    for x in span.from.x.max(0)..=span.to.x.min(639) {
                        assert!(rough(x, y) < low.cell() as f32 + 0.5, "{span:?} {low:?}");
                    }
                }
            }
        }
        assert!(
            counts[0] > 100 / EACH && counts[1] > cases(10, 0),
            "both answers occur: {counts:?}"
        );
    }

    #[test]
    fn three_tile_window_reports_clear_boxes_correctly() {
        let mut buffers = buffers::<3>();
        let mut field = Field::<3>::empty(&mut buffers, FieldSize::new(640, 640), rough);
        let mut counts = [0, 0];
        for step in 0..cases(4000, 500) as i32 {
            let a = Cell::new((step * 7) % 640, (step * 13) % 640);
            if step % 3 == 0 {
                let key = TileKey::containing(0, a.offset(step % 65 - 32, step % 33));
                if field.window.expects(key) && field.window.occupant(key) != Some(key) {
                    field.reinstall(key);
                }
            }
            // Also over all three tiles.
            let b = match step % 2 {
                0 => a.offset(step % 41 - 20, step * 3 % 57 - 28),
                _ => a.offset(step % 181 - 90, step * 3 % 157 - 78),
            };
            let low = Altitude::new(step % 80, 0.5);
            let span = CellBox::around(a, b);
            let clear = field.window.is_clear(span, low);
            counts[usize::from(clear)] += 1;
            if clear {
                for y in span.from.y.max(0)..=span.to.y.min(639) {
                    for x in span.from.x.max(0)..=span.to.x.min(639) {
                        assert!(rough(x, y) < low.cell() as f32 + 0.5, "{span:?} {low:?}");
                    }
                }
            }
        }
        assert!(
            counts[0] > 100 && counts[1] > 20,
            "both answers occur: {counts:?}"
        );
    }

    #[test]
    fn full_window_decides_for_large_boxes() {
        let mut buffers = buffers::<8>();
        let mut field = Field::<8>::empty(&mut buffers, FieldSize::new(256, 256), |_, _| 3.0);
        field.fill_around(Cell::new(128, 128));
        let whole = CellBox::around(Cell::new(0, 0), Cell::new(255, 255));
        // The field's own bound is higher, so the pyramid has to answer.
        assert!(field.window.is_clear(whole, Altitude::new(4, 0.0)));
        assert!(!field.window.is_clear(whole, Altitude::new(2, 0.9)));
    }

    #[test]
    fn install_returns_the_replaced_tile() {
        let mut buffers = buffers::<4>();
        let mut field = Field::<4>::empty(&mut buffers, FieldSize::new(640, 640), rough);
        field.fill_around(Cell::new(20, 20));
        let old = TileKey::containing(0, Cell::new(20, 20));
        let new = TileKey::new(0, 4, old.index.row);
        assert_eq!(field.window.occupant(new), Some(old));
        assert_eq!(field.install(new).key(), Some(old));
        assert_eq!(field.window.occupant(old), Some(new));
        let foreign = TileKey { level: 3, ..old };
        assert_eq!(field.install(foreign).key(), Some(foreign), "refused");
        assert_eq!(
            field.install(new).key(),
            None,
            "the tile is stored before and after"
        );
        assert_eq!(field.window.occupant(old), Some(new));
        let outside = TileKey::new(0, 20, old.index.row);
        assert_eq!(field.install(outside).key(), Some(outside), "refused");
        let keys: Vec<_> = [old, new].map(|k| field.window.occupant(k)).to_vec();
        assert_eq!(keys, [Some(new), Some(new)]);
    }
}
