//! Content of a window where no tile of the scene's level is rendered unchanged: before it arrives,
//! and while it blends in ([`BlendAllowances`](super::BlendAllowances)).

use super::{CellContent, Corners, Window};
use crate::grid::{Altitude, Cell, GridPoint};
use crate::scalar::larger;
use crate::terrain::blend_allowances::{Allowance, BlendAllowances, within};
use crate::terrain::fallback::Fallback;
use crate::terrain::index::{TILE_CELLS, TileIndex, TileKey};
use crate::terrain::tile::Tile;

/// Rendered height at a sample, with its source: a tile or the fallback.
#[derive(Clone, Copy)]
struct BlendedHeight {
    height: f32,
    is_of_tile: bool,
}

impl<'t, const D: usize> Window<'t, D> {
    /// Stores the fallback of the next scene beside the current one, or drops it.
    pub(crate) fn expect_fallback(&mut self, fallback: Option<Fallback>, level: u8) {
        self.next.set_place(fallback);
        self.next_level = level;
    }

    /// Returns true if a tile belongs to the fallback of the next scene.
    pub(crate) fn expects_in_next(&self, key: TileKey) -> bool {
        self.next.part(Some(key), self.next_level).is_some()
    }

    /// Stores a tile of the next scene's fallback, and returns the replaced buffer, if any.
    #[must_use]
    pub(crate) fn take_for_next(&mut self, tile: &'t mut Tile) -> Option<&'t mut Tile> {
        match self.next.part(tile.key(), self.next_level) {
            Some(part) => self.next.put(part, tile),
            None => Some(tile),
        }
    }

    /// Returns true if all tiles of the next scene's fallback have arrived.
    pub(crate) fn has_next(&self) -> bool {
        self.next.loaded().is_some()
    }

    /// Returns the samples at the corners of a cell of the next scene, from its fallback; `None`
    /// before all its tiles have arrived.
    pub(crate) fn corners_of_next(&self, cell: Cell) -> Option<Corners> {
        let next = self.next.loaded()?;
        let base = next.base();
        let heights = next.corners(cell, base);
        Some(Corners { base, heights })
    }

    /// Sets the field's fallback, or none; the stored tiles are rendered unchanged. If it was
    /// expected, its tiles that have arrived are kept. The buffers of
    /// the previous fallback are kept for this one ([`Self::take_spare`]).
    pub fn set_fallback(&mut self, fallback: Option<Fallback>) {
        if self.next.is_at(fallback) {
            core::mem::swap(&mut self.fallback, &mut self.next);
            self.next.set_place(None);
        } else {
            self.fallback.set_place(fallback);
        }
        self.allowances = BlendAllowances::NONE;
        for row in 0..D {
            for col in 0..D {
                self.slots[row][col].mark_as_surface();
                let key = self.slots[row][col].key();
                if let (Some(key), true) = (key, fallback.is_some()) {
                    let top = self.slots[row][col].top();
                    self.update_maxima(key.index, top);
                }
            }
        }
    }

    /// Returns one buffer that the fallback no longer needs, if any. There may be another.
    #[must_use]
    pub fn take_spare(&mut self) -> Option<&'t mut Tile> {
        let spare = self.fallback.take_spare();
        spare.or_else(|| self.next.take_spare())
    }

    /// Stores a requested tile, of the field or of the fallback. Returns a buffer, if one is left
    /// over.
    ///
    /// `blended` are the cells of proxy and HIP. A tile of the field blends in if the surface at
    /// one of these cells depends on it: the cell is in this tile, or in a neighbour that is not
    /// rendered unchanged. Any other tile is rendered unchanged at once, as with [`Self::install`].
    #[must_use]
    pub fn take(&mut self, tile: &'t mut Tile, blended: [Cell; 2]) -> Option<&'t mut Tile> {
        if !self.fallback.is_set() {
            return Some(self.install(tile));
        }
        if let Some(part) = self.fallback.part(tile.key(), self.level()) {
            self.allowances.has_changed = true;
            return self.fallback.put(part, tile);
        }
        let depends = |cell: Cell, index: TileIndex| {
            let at = TileIndex::containing(cell);
            let apart = at.col.abs_diff(index.col).max(at.row.abs_diff(index.row));
            apart == 0 || (apart == 1 && self.surface_tile(at).is_none())
        };
        let blends = tile
            .key()
            .is_some_and(|key| blended.into_iter().any(|cell| depends(cell, key.index)));
        Some(self.put(tile, blends))
    }

    /// Returns true if a patch is rendered from its tile alone, without the fallback.
    #[must_use]
    #[inline]
    pub fn is_blended(&self, cell: Cell) -> bool {
        self.surface_tile(TileIndex::containing(cell)).is_some()
    }

    /// Blends arrived tiles in by at most `step` cells. Returns true if the surface may have
    /// changed since the last tick.
    pub fn blend_tiles(&mut self, step: f32) -> bool {
        let has_changed = core::mem::take(&mut self.allowances.has_changed);
        if self.allowances.count == 0 {
            return has_changed;
        }
        self.blend_each(step);
        true
    }

    #[inline(never)]
    fn blend_each(&mut self, step: f32) {
        let mut remaining = self.allowances.count;
        for slot in 0..D * D {
            let (row, col) = (slot / D, slot % D);
            let Allowance { now, end } = &mut self.allowances.slots[row][col];
            if *now == f32::INFINITY {
                continue;
            }
            *now += step;
            if *now >= *end {
                let tile = &mut self.slots[row][col];
                tile.mark_as_surface();
                let (key, top) = (tile.key(), tile.top());
                if let Some(key) = key {
                    self.allowances.begin(key.index, None);
                    self.update_maxima(key.index, top);
                }
            }
            remaining -= 1;
            if remaining == 0 {
                return;
            }
        }
    }

    /// Records a tile that has arrived in the slot of `index`. It blends in if `blends` is true
    /// and the fallback was rendered there. If the same tile was there before, its blend continues.
    pub(super) fn record_arrival(&mut self, index: TileIndex, blends: bool, was_here: bool) {
        let (row, col) = BlendAllowances::<D>::slot(index);
        self.allowances.has_changed = self.fallback.is_set();
        if was_here && self.allowances.allowed(index) < f32::INFINITY {
            return;
        }
        let end = match blends && !was_here {
            true => self.max_distance(self.slots[row][col], index),
            false => None,
        };
        self.allowances.begin(index, end);
        if end.is_none() {
            self.slots[row][col].mark_as_surface();
        }
    }

    /// Returns the maximum distance of a tile's samples from the coarse fallback, cells; `None` if
    /// no fallback is rendered there.
    fn max_distance(&self, tile: &Tile, index: TileIndex) -> Option<f32> {
        let [lowest, highest] = tile.range()?;
        let [low, high] = self.fallback.loaded()?.range_over(index, tile.base())?;
        let distance = larger(highest - low, high - lowest);
        (distance > 0.0).then_some(distance)
    }

    /// Returns the content of a cell of the field whose tile is missing or blends in.
    #[cold]
    #[inline(never)]
    pub(super) fn blended_ground(&self, cell: Cell) -> CellContent {
        let Some(under) = self.fallback.loaded() else {
            return CellContent::Missing;
        };
        let index = TileIndex::containing(cell);
        let own = self.tile_here(index);
        let base = own.map_or(under.base(), Tile::base);
        let coarse = under.corners(cell, base);
        // The heights, if no other tile shares the samples.
        let alone = match own {
            Some(tile) => {
                let (own, allowed) = (tile.corners(cell), self.allowances.allowed(index));
                let blended = |corner: usize| within(own[corner], coarse[corner], allowed);
                [blended(0), blended(1), blended(2), blended(3)]
            }
            None => coarse,
        };
        let (mut heights, mut are_of_tiles) = (alone, own.is_some());
        if !is_inside(cell) {
            are_of_tiles = self.blend_on_border(cell, (&mut heights, are_of_tiles), coarse, base);
        }
        let [sw, se, nw, ne] = heights;
        match (sw + se + nw + ne).is_nan() {
            false => CellContent::Patch(Corners { base, heights }),
            true if are_of_tiles => CellContent::NoData,
            // If the fallback has no height here, the tile may have one.
            true => CellContent::Missing,
        }
    }

    /// Replaces the heights of `alone` at those corners of a cell that are on its tile's border by
    /// the rendered ones. `alone` was computed from the cell's own tile, if it is there, and the
    /// fallback. Returns true if every corner without a height is a tile's.
    #[inline(never)]
    fn blend_on_border(
        &self,
        cell: Cell,
        alone: (&mut [f32; 4], bool),
        coarse: [f32; 4],
        base: i32,
    ) -> bool {
        let (heights, is_of_tile) = alone;
        let mut are_of_tiles = true;
        for (corner, height) in (0..).zip(heights) {
            let sample = cell.offset(corner & 1, corner >> 1);
            let blended = match is_on_border(sample.x) || is_on_border(sample.y) {
                true => self.blended(sample, coarse[corner as usize], base),
                false => BlendedHeight {
                    height: *height,
                    is_of_tile,
                },
            };
            *height = blended.height;
            are_of_tiles &= blended.is_of_tile || !blended.height.is_nan();
        }
        are_of_tiles
    }

    /// Returns the height rendered at a sample that several tiles may share, in cells above `base`.
    // Not inlined: four copies of it would be a kilobyte.
    #[inline(never)]
    fn blended(&self, sample: Cell, coarse: f32, base: i32) -> BlendedHeight {
        let mut blended = BlendedHeight {
            height: coarse,
            is_of_tile: false,
        };
        let mut max_allowed = -1.0;
        for west in 0..=i32::from(is_on_border(sample.x)) {
            for south in 0..=i32::from(is_on_border(sample.y)) {
                let index = TileIndex::containing(sample.offset(-west, -south));
                let allowed = self.allowances.allowed(index);
                if allowed <= max_allowed {
                    continue;
                }
                let Some(tile) = self.tile_here(index) else {
                    continue;
                };
                max_allowed = allowed;
                let first = index.first_cell();
                let (col, row) = (sample.x - first.x, sample.y - first.y);
                let own =
                    tile.sample(col as usize, row as usize) + tile.base().wrapping_sub(base) as f32;
                blended = BlendedHeight {
                    height: within(own, coarse, allowed),
                    is_of_tile: true,
                };
            }
        }
        blended
    }

    /// Returns the tile if it is in its slot, rendered unchanged or not.
    #[inline(never)]
    fn tile_here(&self, index: TileIndex) -> Option<&Tile> {
        let (row, col) = BlendAllowances::<D>::slot(index);
        let tile = &*self.slots[row][col];
        tile.key()
            .is_some_and(|key| key.index == index)
            .then_some(tile)
    }

    /// Returns the material of the sample nearest to a place on a patch, as an index in the scene's
    /// table; `None` if the patch's tile is missing or has no materials.
    pub(crate) fn material_near(&self, patch: Cell, place: &GridPoint) -> Option<u8> {
        let [x, y, _] = place.cell();
        let frac = place.frac();
        // The cell of a place on the far border of its patch may be the next one.
        let is_past_middle = |at: i32, frac: f32, patch: i32| {
            usize::from(at.wrapping_sub(patch) as f32 + frac >= 0.5)
        };
        let sample = [
            is_past_middle(x, frac.x, patch.x),
            is_past_middle(y, frac.y, patch.y),
        ];
        self.tile_here(TileIndex::containing(patch))?
            .material(patch, sample)
    }

    /// Returns true if the surface rendered in place of a tile lies below `low`, all over the tile.
    #[cold]
    #[inline(never)]
    pub(super) fn blended_is_below(&self, index: TileIndex, low: Altitude) -> bool {
        let Some(under) = self.fallback.loaded() else {
            return false;
        };
        // Without a height of a tile or the fallback, the surface is unknown.
        let is_known = self.tile_here(index).is_some() || under.covers(index);
        if !(is_known && under.is_below(low)) {
            return false;
        }
        // On a shared border the surface may have the neighbour's heights.
        (0..9).all(|place| {
            let near = self.tile_here(index.offset(place % 3 - 1, place / 3 - 1));
            near.is_none_or(|tile| tile.is_below(low))
        })
    }
}

/// Returns true if a column or row of samples is the border of two tiles.
const fn is_on_border(at: i32) -> bool {
    at & (TILE_CELLS as i32 - 1) == 0
}

/// Returns true if no corner of a cell is on the border of its tile.
fn is_inside(cell: Cell) -> bool {
    let on_border = |at: i32| is_on_border(at) || is_on_border(at + 1);
    !(on_border(cell.x) || on_border(cell.y))
}

#[cfg(test)]
#[path = "late_tiles_tests.rs"]
mod tests;
