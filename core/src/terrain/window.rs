//! The window: the tiles a device holds, in a torus around the hand.

use super::ceiling::{Altitude, Box2, Pyramid, wrap};
use super::tile::{BLOCK_SHIFT, TILE_SHIFT, Tile, TileKey};

/// What lies in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// A patch.
    Patch(Corners),
    /// No surface: no data, or outside the field.
    Hole,
    /// The tile is not here yet.
    Missing,
}

/// The corners of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners {
    /// Whole height, in cells, that the corner heights count from.
    pub base: i32,
    /// South-west, south-east, north-west, north-east, cells above the base.
    pub heights: [f32; 4],
}

/// `D × D` tiles; tile `(col, row)` always lives in slot `(col mod D, row mod D)`.
///
/// The window owns its buffers as `&mut Tile`. Installing a tile swaps one
/// reference, so a tick sees the old tile or the new one and nothing is copied.
pub struct Window<'t, const D: usize> {
    slots: [[&'t mut Tile; D]; D],
    pyramid: Pyramid<D>,
    level: u8,
    size: [i32; 2],
    top: i32,
}

impl<'t, const D: usize> Window<'t, D> {
    /// A window without a field: every cell is a hole.
    #[must_use]
    pub fn new(slots: [[&'t mut Tile; D]; D]) -> Self {
        let mut window = Self {
            slots,
            pyramid: Pyramid::unknown(),
            level: 0,
            size: [0, 0],
            top: i32::MIN,
        };
        window.reset(0, [0, 0], i32::MIN);
        window
    }

    /// Forgets every tile and takes a new field: its level, its size in
    /// patches (east, north), and a whole height in cells no sample exceeds.
    pub fn reset(&mut self, level: u8, size: [i32; 2], top: i32) {
        for tile in self.slots.as_flattened_mut() {
            tile.vacate();
        }
        self.pyramid = Pyramid::unknown();
        self.level = level;
        self.size = size;
        self.top = top;
    }

    /// Puts `tile` in its slot and gives back the buffer that was there; gives
    /// back `tile` itself when it is vacant, of another level, or outside.
    #[must_use]
    pub fn install(&mut self, tile: &'t mut Tile) -> &'t mut Tile {
        let Some(key) = tile.key().filter(|key| self.expects(*key)) else {
            return tile;
        };
        let top = tile.top();
        let slot = &mut self.slots[wrap::<D>(key.row)][wrap::<D>(key.col)];
        let spent = core::mem::replace(slot, tile);
        self.renew_maxima(key, top);
        spent
    }

    /// Whether `key` names a tile of this field.
    #[must_use]
    pub fn expects(&self, key: TileKey) -> bool {
        key.level == self.level && !self.is_outside(key.col, key.row, TILE_SHIFT)
    }

    /// The field's level.
    #[must_use]
    pub const fn level(&self) -> u8 {
        self.level
    }

    /// A whole height in cells that no sample of the field exceeds.
    #[must_use]
    pub const fn top(&self) -> i32 {
        self.top
    }

    /// The tile now in the slot where `key` belongs.
    #[must_use]
    pub fn occupant(&self, key: TileKey) -> Option<TileKey> {
        self.slots[wrap::<D>(key.row)][wrap::<D>(key.col)].key()
    }

    /// What lies in `cell`.
    #[must_use]
    #[inline]
    pub fn ground(&self, cell: [i32; 2]) -> Ground {
        if !self.has_cell(cell) {
            return Ground::Hole;
        }
        let Some(tile) = self.held(cell[0] >> TILE_SHIFT, cell[1] >> TILE_SHIFT) else {
            return Ground::Missing;
        };
        let heights = tile.corners(cell[0], cell[1]);
        let [sw, se, nw, ne] = heights;
        if (sw + se + nw + ne).is_nan() {
            return Ground::Hole;
        }
        Ground::Patch(Corners {
            base: tile.base(),
            heights,
        })
    }

    /// Whether everything in the box is known to lie below `low`.
    ///
    /// `false` may also mean "cannot tell cheaply". Looks at one number for
    /// the whole field, then at four nodes at most.
    #[must_use]
    #[inline]
    pub fn is_clear(&self, span: Box2, low: Altitude) -> bool {
        low.cell() >= self.top || self.box_is_clear(span.clipped(self.size), low)
    }

    /// Whether all samples around a box of two patches a side at most are
    /// known to lie below `low`: the nine samples themselves are looked at.
    ///
    /// `false` also where the box is larger, or not all in one tile that is held.
    #[must_use]
    #[inline]
    pub fn is_clear_nearby(&self, span: Box2, low: Altitude) -> bool {
        let Box2 { from, to } = span;
        let [col, row] = from.map(|c| c >> TILE_SHIFT);
        let small = (to[0] - from[0]) | (to[1] - from[1]) <= 1;
        let in_one_tile = to.map(|c| c >> TILE_SHIFT) == [col, row];
        small
            && in_one_tile
            && self
                .held(col, row)
                .is_some_and(|tile| tile.is_below_around(from, to, low))
    }

    /// Whether everything in one block of 8 × 8 patches is known to lie below
    /// `low`.
    #[inline]
    pub(crate) fn block_is_clear(&self, [col, row]: [i32; 2], low: Altitude) -> bool {
        self.node_is_below(BLOCK_SHIFT, col, row, low) || self.is_outside(col, row, BLOCK_SHIFT)
    }

    fn box_is_clear(&self, span: Box2, low: Altitude) -> bool {
        if span.is_empty() {
            return true;
        }
        let shift = span.cover_shift(BLOCK_SHIFT);
        if shift > Pyramid::<D>::top_shift() {
            return false;
        }
        let (from, to) = (span.from.map(|c| c >> shift), span.to.map(|c| c >> shift));
        self.node_is_below(shift, from[0], from[1], low)
            && (to[0] == from[0] || self.node_is_below(shift, to[0], from[1], low))
            && (to[1] == from[1] || self.node_is_below(shift, from[0], to[1], low))
            && (to == from
                || to[0] == from[0]
                || to[1] == from[1]
                || self.node_is_below(shift, to[0], to[1], low))
    }

    fn node_is_below(&self, shift: u32, col: i32, row: i32, low: Altitude) -> bool {
        if shift >= TILE_SHIFT {
            return low.cell() >= self.node_top(shift - TILE_SHIFT, col, row);
        }
        let up = TILE_SHIFT - shift;
        self.held(col >> up, row >> up)
            .is_some_and(|tile| tile.block_is_below(shift, col << shift, row << shift, low))
    }

    /// Whole height no sample under a node exceeds; `i32::MAX` when unknown.
    fn node_top(&self, level: u32, col: i32, row: i32) -> i32 {
        if self.is_outside(col, row, TILE_SHIFT + level) {
            i32::MIN
        } else if self.held(col << level, row << level).is_some() {
            // The node is known only while all its tiles are held, so the
            // south-west one tells which node the slot speaks of.
            self.pyramid.node(level, col, row)
        } else {
            i32::MAX
        }
    }

    fn renew_maxima(&mut self, key: TileKey, top: i32) {
        self.pyramid.set(0, key.col, key.row, top);
        for level in 1..=Pyramid::<D>::height() {
            let (col, row) = (key.col >> level, key.row >> level);
            let highest = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(east, north)| self.node_top(level - 1, 2 * col + east, 2 * row + north))
                .into_iter()
                .fold(i32::MIN, i32::max);
            self.pyramid.set(level, col, row, highest);
        }
    }

    #[inline]
    fn held(&self, col: i32, row: i32) -> Option<&Tile> {
        let tile = &*self.slots[wrap::<D>(row)][wrap::<D>(col)];
        // `install` takes tiles of the field's level only.
        let is_here = |key: TileKey| key.col == col && key.row == row;
        tile.key().is_some_and(is_here).then_some(tile)
    }

    /// Whether the field has a cell there, be it a hole.
    #[inline]
    pub(crate) fn has_cell(&self, cell: [i32; 2]) -> bool {
        // One unsigned comparison an axis catches negative indices too.
        (cell[0] as u32) < self.size[0] as u32 && (cell[1] as u32) < self.size[1] as u32
    }

    fn is_outside(&self, col: i32, row: i32, shift: u32) -> bool {
        let last = self.size.map(|s| (s - 1) >> shift);
        col < 0 || row < 0 || col > last[0] || row > last[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;
    use crate::terrain::testing::Field;
    use std::vec::Vec;

    /// A field of 20 × 20 tiles whose height is a hash of the sample.
    fn rough(x: i32, y: i32) -> f32 {
        let hash = (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) as u32;
        (hash.wrapping_mul(2_654_435_761) >> 20) as f32 / 64.0
    }

    #[test]
    fn every_held_patch_reads_back_its_samples() {
        let mut field = Field::<4>::new([640, 640], rough);
        field.hold_around([100, 70]);
        for cell in [[100, 70], [95, 63], [96, 64], [127, 95], [64, 32]] {
            let [x, y] = cell;
            let heights = [
                rough(x, y),
                rough(x + 1, y),
                rough(x, y + 1),
                rough(x + 1, y + 1),
            ];
            let corners = Corners { base: 0, heights };
            assert_eq!(field.window.ground(cell), Ground::Patch(corners));
        }
        assert_eq!(field.window.ground([-1, 0]), Ground::Hole);
        assert_eq!(field.window.ground([640, 9]), Ground::Hole);
        assert_eq!(field.window.ground([600, 9]), Ground::Missing);
    }

    #[test]
    fn clear_means_clear_whatever_is_held() {
        let mut field = Field::<4>::new([640, 640], rough);
        let mut seen = [0, 0];
        const EACH: u32 = cases(1, 8);
        for step in (0..4000_i32).step_by(EACH as usize) {
            if step % 97 == 0 {
                field.hold_around([(step * 5) % 640, (step * 11) % 640]);
            }
            let a = [(step * 7) % 640, (step * 13) % 640];
            let b = [a[0] + (step % 41) - 20, a[1] + (step * 3 % 57) - 28];
            let low = Altitude::new(step % 68, 0.5);
            let span = Box2::around(a, b);
            let clear = field.window.is_clear(span, low);
            seen[usize::from(clear)] += 1;
            if clear {
                for y in span.from[1].max(0)..=span.to[1].min(639) {
                    for x in span.from[0].max(0)..=span.to[0].min(639) {
                        assert!(rough(x, y) < low.cell() as f32 + 0.5, "{span:?} {low:?}");
                    }
                }
            }
        }
        assert!(
            seen[0] > 100 / EACH && seen[1] > cases(10, 0),
            "both answers occur: {seen:?}"
        );
    }

    #[test]
    fn a_held_window_answers_for_long_boxes() {
        let mut field = Field::<8>::new([256, 256], |_, _| 3.0);
        field.hold_around([128, 128]);
        let whole = Box2::around([0, 0], [255, 255]);
        // The field's own bound is higher, so the pyramid has to answer.
        assert!(field.window.is_clear(whole, Altitude::new(4, 0.0)));
        assert!(!field.window.is_clear(whole, Altitude::new(2, 0.9)));
    }

    #[test]
    fn an_installed_tile_gives_its_predecessor_back() {
        let mut field = Field::<4>::new([640, 640], rough);
        field.hold_around([20, 20]);
        let old = TileKey::holding(0, [20, 20]);
        let new = TileKey { col: 4, ..old };
        assert_eq!(field.window.occupant(new), Some(old));
        assert_eq!(field.install(new).key(), Some(old));
        assert_eq!(field.window.occupant(old), Some(new));
        let foreign = TileKey { level: 3, ..old };
        assert_eq!(field.install(foreign).key(), Some(foreign), "refused");
        let outside = TileKey { col: 20, ..old };
        assert_eq!(field.install(outside).key(), Some(outside), "refused");
        let keys: Vec<_> = [old, new].map(|k| field.window.occupant(k)).to_vec();
        assert_eq!(keys, [Some(new), Some(new)]);
    }
}
