//! The fallback of a scene: coarse tiles under the arm's whole reach.
//!
//! A device renders it where a tile has not arrived yet. Its samples are every 2ⁿ-th sample of the
//! scene's level, or the values of the file's overviews there. They need not be more exact, because
//! the surface blends to the tiles when these arrive.

use hapterra_core::grid::Cell;
use hapterra_core::scene::Scene;
use hapterra_core::terrain::{CoarseTile, Fallback, TILE_CELLS, TILE_SAMPLES, TileKey};
use hapterra_core::wire::message::Heights;
use heightfield::{ReadStatus, ReadTracker};

use super::tiler::range;
use super::{Terrain, TileBuffer, identity};

/// Power of two by which the near tile's samples are closer than the wide one's: it reaches a
/// quarter as far.
const NEAR_SHIFT: u8 = 2;
/// The same in a change of placement in contact: the hand touches the near tile until the others
/// have arrived.
const NEAR_SHIFT_IN_CONTACT: u8 = 4;

impl Terrain<'_> {
    /// Returns a scene of this terrain with a fallback under the arm's whole reach. `reach_mm` is
    /// the rectangle around the reach: west, south, east and north of the tip in its home pose,
    /// device millimetres ([`crate::place::Reach::sides_mm`]).
    ///
    /// The scene has no fallback if none of the terrain lies in the rectangle, or if all of it fits
    /// into four tiles, which the device stores anyway.
    #[must_use]
    pub fn with_fallback(&self, scene: Scene, reach_mm: [f64; 4]) -> Scene {
        let fallback = match self.is_small() {
            true => None,
            false => self.fallback_of(&scene, reach_mm, (scene.home.column(), NEAR_SHIFT)),
        };
        self.set_fallback(scene, fallback)
    }

    /// Returns a scene with a fallback as [`Self::with_fallback`], for a change of placement in
    /// contact: its near tile is around the touched cell, and a small terrain has a fallback, too.
    #[must_use]
    pub fn with_fallback_around(&self, scene: Scene, reach_mm: [f64; 4], touched: Cell) -> Scene {
        let fallback = self.fallback_of(&scene, reach_mm, (touched, NEAR_SHIFT_IN_CONTACT));
        self.set_fallback(scene, fallback)
    }

    /// Returns the scene with this fallback, and with the epoch of both.
    fn set_fallback(&self, mut scene: Scene, fallback: Option<Fallback>) -> Scene {
        scene.fallback = fallback;
        scene.epoch = identity::epoch(self.fingerprint(), self.grid(), self.scale(), &scene);
        scene
    }

    /// Returns true if a device stores all of the terrain.
    fn is_small(&self) -> bool {
        let size = self.size();
        size.iter().all(|cells| *cells <= 2 * TILE_CELLS as i32)
    }

    /// Returns the fallback; its near tile has this middle and is finer by this shift.
    fn fallback_of(
        &self,
        scene: &Scene,
        reach_mm: [f64; 4],
        (middle, shift): (Cell, u8),
    ) -> Option<Fallback> {
        let wide = self.wide_tile(scene, reach_mm)?;
        let near = near(&wide, middle, shift);
        let fallback = Fallback { wide, near };
        fallback.is_valid(self.level()).then_some(fallback)
    }

    /// Returns the finest tile that spans the rectangle.
    fn wide_tile(&self, scene: &Scene, reach_mm: [f64; 4]) -> Option<CoarseTile> {
        let home = self.scale().to_mm(&scene.home);
        let size = self.size();
        let along = |axis: usize| {
            let side = |mm: f64| (home[axis] + mm) / self.scale().cell_mm();
            let last = f64::from(size[axis]);
            let [from, to] = [
                side(reach_mm[axis]).floor(),
                side(reach_mm[axis + 2]).ceil(),
            ];
            // `None` also for NaN.
            (to >= 0.0 && from <= last).then(|| [from.max(0.0), to.min(last)])
        };
        let (east, north) = (along(0)?, along(1)?);
        let cells = (east[1] - east[0]).max(north[1] - north[0]);
        let spans = |shift: &u8| (TILE_CELLS as f64) * f64::from(*shift).exp2() >= cells;
        let shift = (CoarseTile::MIN_SHIFT..=CoarseTile::MAX_SHIFT).find(spans)?;
        Some(CoarseTile {
            // Whole numbers of cells inside the field.
            first: Cell::new(east[0] as i32, north[0] as i32),
            shift,
        })
    }

    /// Returns the heights of a tile that a device with this scene requests, as they are sent, and
    /// whether they are complete: a tile of the scene's level, or of its fallback. `None` if there
    /// is no such tile.
    #[must_use]
    pub fn tile_of<'b>(
        &self,
        scene: &Scene,
        key: TileKey,
        buffer: &'b mut TileBuffer,
    ) -> Option<(Heights<'b>, ReadStatus)> {
        let reads = ReadTracker::default();
        let heights = self.heights_of_scene(scene, key, buffer, &reads)?;
        Some((heights, reads.status()))
    }

    fn heights_of_scene<'b>(
        &self,
        scene: &Scene,
        key: TileKey,
        buffer: &'b mut TileBuffer,
        reads: &ReadTracker,
    ) -> Option<Heights<'b>> {
        let Some(Fallback { wide, near }) = &scene.fallback else {
            return self.heights_of(key, buffer, reads);
        };
        let coarse = |tile: &CoarseTile| key == tile.key(scene.level);
        match near.as_ref().filter(|near| coarse(near)) {
            Some(near) => {
                let sample = |col, row| self.near_sample(wide, near, [col, row], reads);
                Some(coarse_tile(buffer, sample))
            }
            None if coarse(wide) => {
                let sample = |col, row| self.coarse_sample(wide, [col, row], reads);
                Some(coarse_tile(buffer, sample))
            }
            None => self.heights_of(key, buffer, reads),
        }
    }

    /// Returns the height of a coarse tile's sample, in cells; beyond the field, that of its
    /// border.
    fn coarse_sample(&self, tile: &CoarseTile, place: [usize; 2], reads: &ReadTracker) -> f64 {
        let size = self.size();
        let sample = |first: i32, place: usize, last: i32| {
            let at = i64::from(first) + ((place as i64) << tile.shift);
            at.clamp(0, i64::from(last)) as u32
        };
        // The level at which samples are as far apart as those of the tile.
        let shift = tile.shift.saturating_sub(self.parts().ilog2() as u8);
        let level = self.level().saturating_add(shift);
        let column = sample(tile.first.x, place[0], size[0]);
        let row = sample(tile.first.y, place[1], size[1]);
        self.cells_at(level, [column, row], reads)
    }

    /// Returns a sample of the near tile. On its border it is the wide tile's height there, so that
    /// the surface continues evenly; if that has none, the near tile's own.
    fn near_sample(
        &self,
        wide: &CoarseTile,
        near: &CoarseTile,
        place: [usize; 2],
        reads: &ReadTracker,
    ) -> f64 {
        let is_on_border = place.iter().any(|at| [0, TILE_CELLS].contains(at));
        let between = is_on_border.then(|| self.between_samples(wide, near, place, reads));
        match between {
            Some(height) if !height.is_nan() => height,
            _ => self.coarse_sample(near, place, reads),
        }
    }

    /// Returns the height of the wide tile at a sample of the near one, in cells; NaN at no-data.
    fn between_samples(
        &self,
        wide: &CoarseTile,
        near: &CoarseTile,
        place: [usize; 2],
        reads: &ReadTracker,
    ) -> f64 {
        let from = |wide_first: i32, near_first: i32, place: usize| {
            let off = near_first - wide_first + place as i32 * near.spacing();
            let cell = (off / wide.spacing()).clamp(0, TILE_CELLS as i32 - 1);
            let share = f64::from(off - cell * wide.spacing()) / f64::from(wide.spacing());
            (cell as usize, share)
        };
        let (col, east) = from(wide.first.x, near.first.x, place[0]);
        let (row, north) = from(wide.first.y, near.first.y, place[1]);
        let weighed = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, up)| {
            let along = |share: f64, next: usize| if next == 1 { share } else { 1.0 - share };
            let weight = along(east, right) * along(north, up);
            // A corner without weight does not count, even if it has no data.
            match weight > 0.0 {
                true => weight * self.coarse_sample(wide, [col + right, row + up], reads),
                false => 0.0,
            }
        });
        weighed.iter().sum()
    }
}

/// Returns the finer tile within a wide one, centred on a cell as far as possible; `None` if it
/// would not be finer. Its samples include the borders of the wide one's cells.
fn near(wide: &CoarseTile, middle: Cell, finer: u8) -> Option<CoarseTile> {
    let shift = wide.shift.saturating_sub(finer);
    let near = CoarseTile {
        shift: shift.max(CoarseTile::MIN_SHIFT),
        ..*wide
    };
    let side = |tile: &CoarseTile| (TILE_CELLS as i32) << tile.shift;
    let from = |middle: i32, first: i32| {
        let off = middle.saturating_sub(first).saturating_sub(side(&near) / 2);
        let off = off.clamp(0, side(wide) - side(&near));
        first + off / near.spacing() * near.spacing()
    };
    let first = Cell::new(from(middle.x, wide.first.x), from(middle.y, wide.first.y));
    (near.shift < wide.shift).then_some(CoarseTile { first, ..near })
}

/// Returns the heights of a coarse tile, from a function of its samples.
fn coarse_tile(buffer: &mut TileBuffer, sample: impl Fn(usize, usize) -> f64) -> Heights<'_> {
    for (index, height) in buffer.heights.iter_mut().enumerate() {
        *height = sample(index % TILE_SAMPLES, index / TILE_SAMPLES);
    }
    match range(buffer.heights.as_slice()) {
        None => Heights::NoData,
        // The samples have no known unit.
        Some((low, high, _)) => buffer.above(low, high, &[]),
    }
}

#[cfg(test)]
#[path = "fallback_tests.rs"]
mod tests;
