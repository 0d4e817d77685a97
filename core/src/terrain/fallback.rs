//! The fallback: a coarse copy of the terrain in the arm's reach, rendered where a tile is missing.
//!
//! It has a wide tile under the whole reach and a near one with finer samples around the home pose,
//! where the hand is most of the time, or around the place of a change in contact. Where both exist, the near one is rendered. The host sets
//! the samples on its border to the heights of the wide one, where that has any, so there is no
//! step between them.

use serde::{Deserialize, Serialize};

use super::coarse_tile::CoarseTile;
use super::index::{TileIndex, TileKey};
use super::tile::Tile;
use crate::grid::{Altitude, Cell};
use crate::scalar::{larger, smaller};

/// Position of the tiles of a coarse fallback.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fallback {
    /// Tile under the whole reach of the arm.
    pub wide: CoarseTile,
    /// Finer tile around the home pose or the touched place, if any.
    pub near: Option<CoarseTile>,
}

/// Maximum number of tiles of a fallback.
pub(super) const PARTS: usize = 2;

impl Fallback {
    /// Returns true if the fallback is valid in a scene of this level.
    #[must_use]
    pub fn is_valid(&self, level: u8) -> bool {
        // Otherwise two tiles would have one key.
        let is_finer = |near: CoarseTile| near.shift < self.wide.shift;
        let mut parts = self.parts().into_iter().flatten();
        self.near.is_none_or(is_finer) && parts.all(|part| part.is_valid(level))
    }

    const fn parts(&self) -> [Option<CoarseTile>; PARTS] {
        [Some(self.wide), self.near]
    }

    /// Returns the keys of its tiles on the link, in a scene of this level.
    #[must_use]
    pub fn keys(&self, level: u8) -> [Option<TileKey>; PARTS] {
        self.parts().map(|part| part.map(|part| part.key(level)))
    }
}

/// The fallback of a window: its place, and its tiles that have arrived. The one in use, or the one
/// of the next scene.
pub(super) struct FallbackSlots<'t> {
    /// Place of the fallback, if the scene has one.
    place: Option<Fallback>,
    /// The tiles that have arrived, or their vacant buffers.
    tiles: [Option<&'t mut Tile>; PARTS],
}

impl<'t> FallbackSlots<'t> {
    pub(super) const EMPTY: Self = Self {
        place: None,
        tiles: [const { None }; PARTS],
    };

    /// Sets another place. The buffers of the previous tiles are kept for the new ones.
    pub(super) fn set_place(&mut self, place: Option<Fallback>) {
        self.place = place;
        for tile in self.tiles.iter_mut().flatten() {
            tile.vacate();
        }
    }

    /// Returns true if it is at this place.
    pub(super) fn is_at(&self, place: Option<Fallback>) -> bool {
        self.place.is_some() && self.place == place
    }

    pub(super) const fn is_set(&self) -> bool {
        self.place.is_some()
    }

    /// Returns a buffer that the fallback no longer needs, if any.
    pub(super) fn take_spare(&mut self) -> Option<&'t mut Tile> {
        let parts = self.place.map_or([None; PARTS], |place| place.parts());
        let mut slots = parts.iter().zip(&mut self.tiles);
        slots.find_map(|(part, tile)| match part {
            Some(_) => None,
            None => tile.take(),
        })
    }

    /// Returns the index in `tiles` of the tile with this key, in a scene of this level.
    pub(super) fn part(&self, key: Option<TileKey>, level: u8) -> Option<usize> {
        let keys = self.place?.keys(level);
        key.and_then(|_| keys.into_iter().position(|part| part == key))
    }

    /// Stores a tile, and returns the replaced buffer.
    pub(super) fn put(&mut self, part: usize, tile: &'t mut Tile) -> Option<&'t mut Tile> {
        let Some(slot) = self.tiles.get_mut(part) else {
            return Some(tile);
        };
        let spent = slot.replace(tile)?;
        spent.vacate();
        Some(spent)
    }

    /// Returns the fallback once all its tiles have arrived. One tile alone is not rendered: the
    /// surface would jump when the other arrives.
    pub(super) fn loaded(&self) -> Option<LoadedFallback<'_>> {
        let place = self.place?;
        let [wide, near] = &self.tiles;
        let near = match place.near {
            Some(part) => Some((part, arrived_tile(near)?)),
            None => None,
        };
        Some(LoadedFallback {
            wide: (place.wide, arrived_tile(wide)?),
            near,
        })
    }
}

/// Returns the tile in a buffer, if any.
fn arrived_tile<'w>(buffer: &'w Option<&mut Tile>) -> Option<&'w Tile> {
    buffer.as_deref().filter(|tile| tile.key().is_some())
}

/// A fallback whose tiles have all arrived.
pub(super) struct LoadedFallback<'w> {
    wide: (CoarseTile, &'w Tile),
    near: Option<(CoarseTile, &'w Tile)>,
}

impl LoadedFallback<'_> {
    /// Returns the base height of the wide tile, whole cells.
    pub(super) fn base(&self) -> i32 {
        self.wide.1.base()
    }

    /// Returns the height at a sample of the scene's level, in cells above `base`; NaN beyond the
    /// fallback, and where a corner that counts has no data.
    #[inline(never)]
    fn height(&self, sample: Cell, base: i32) -> f32 {
        let of = |(place, tile): &(CoarseTile, &Tile)| {
            let height = place.height(tile, sample)?;
            Some(height + tile.base().wrapping_sub(base) as f32)
        };
        let near = self.near.as_ref().and_then(of);
        near.or_else(|| of(&self.wide)).unwrap_or(f32::NAN)
    }

    /// Returns the heights at the corners of a cell, in the order of [`Tile::corners`].
    pub(super) fn corners(&self, cell: Cell, base: i32) -> [f32; 4] {
        let [covers_near, touches_near] = match &self.near {
            Some((near, _)) => near.coverage(cell),
            None => [false; 2],
        };
        let under = match &self.near {
            Some(near) if covers_near => Some(near),
            _ if !touches_near && self.wide.0.coverage(cell)[0] => Some(&self.wide),
            _ => None,
        };
        if let Some((place, tile)) = under
            && let Some(heights) = place.corners(tile, cell)
        {
            let up = tile.base().wrapping_sub(base) as f32;
            return heights.map(|height| height + up);
        }
        self.corners_by_samples(cell, base)
    }

    /// Returns the heights at the corners of a cell on a border or beside no-data.
    #[cold]
    #[inline(never)]
    fn corners_by_samples(&self, cell: Cell, base: i32) -> [f32; 4] {
        let mut heights = [f32::NAN; 4];
        for (corner, height) in (0..).zip(&mut heights) {
            *height = self.height(cell.offset(corner & 1, corner >> 1), base);
        }
        heights
    }

    /// Returns the lowest and highest height over a tile of the scene's level, in cells above
    /// `base`; `None` if there is none.
    pub(super) fn range_over(&self, index: TileIndex, base: i32) -> Option<[f32; 2]> {
        let of = |(place, tile): &(CoarseTile, &Tile)| {
            let up = tile.base().wrapping_sub(base) as f32;
            let range = place.range_over(tile, index)?;
            Some(range.map(|height| height + up))
        };
        let wide = of(&self.wide);
        let Some(near) = self.near.as_ref().and_then(of) else {
            return wide;
        };
        let [low, high] = wide.unwrap_or(near);
        Some([smaller(low, near[0]), larger(high, near[1])])
    }

    /// Returns true if all heights are below `low`.
    pub(super) fn is_below(&self, low: Altitude) -> bool {
        self.tiles().all(|tile| tile.is_below(low))
    }

    /// Returns true if the fallback has a height everywhere over a tile of the scene's level.
    pub(super) fn covers(&self, index: TileIndex) -> bool {
        self.wide.0.covers(index) && self.tiles().all(Tile::is_whole)
    }

    fn tiles(&self) -> impl Iterator<Item = &Tile> {
        core::iter::once(self.wide.1).chain(self.near.map(|(_, tile)| tile))
    }
}
