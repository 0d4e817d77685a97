//! The underlay of a scene: the coarse image under all that the arm reaches, and its one tile.
//!
//! A device feels it where a tile has not come yet. Its samples are those of the terrain at
//! every so many-th sample of the scene's level, or what the file's overviews have there; they
//! need not be more exact, because the surface moves on to the tiles when these come.

use hapterra_core::grid::Cell;
use hapterra_core::scene::Scene;
use hapterra_core::terrain::{POSTS, TILE_CELLS, TileKey, Underlay};
use hapterra_core::wire::message::Heights;

use super::tiler::range;
use super::{Terrain, TileBuffer, identity};

impl Terrain<'_> {
    /// A scene of this terrain with an underlay under all that an arm reaches. `reach_mm` is the
    /// rectangle around that: west, south, east and north of the tip in its home pose, hand
    /// millimetres ([`crate::place::Reach::sides_mm`]).
    ///
    /// The scene stays as it is where none of the terrain lies in there, or all of it fits into four
    /// tiles, which the device holds anyway.
    #[must_use]
    pub fn underlaid(&self, scene: Scene, reach_mm: [f64; 4]) -> Scene {
        let mut scene = Scene {
            underlay: self.under(&scene, reach_mm),
            ..scene
        };
        scene.epoch = identity::epoch(self.fingerprint(), self.grid(), self.scale(), &scene);
        scene
    }

    fn under(&self, scene: &Scene, reach_mm: [f64; 4]) -> Option<Underlay> {
        let home = self.scale().to_mm(&scene.home);
        let size = self.size();
        if size.iter().all(|cells| *cells <= 2 * TILE_CELLS as i32) {
            return None;
        }
        let along = |axis: usize| {
            let side = |mm: f64| (home[axis] + mm) / self.scale().cell_mm();
            let last = f64::from(size[axis]);
            let [from, to] = [
                side(reach_mm[axis]).floor(),
                side(reach_mm[axis + 2]).ceil(),
            ];
            // Also where a number is none.
            (to >= 0.0 && from <= last).then(|| [from.max(0.0), to.min(last)])
        };
        let (east, north) = (along(0)?, along(1)?);
        let cells = (east[1] - east[0]).max(north[1] - north[0]);
        let spans = |shift: &u8| (TILE_CELLS as f64) * f64::from(*shift).exp2() >= cells;
        let shift = (Underlay::LEAST_SHIFT..=Underlay::MOST_SHIFT).find(spans)?;
        let underlay = Underlay {
            // Whole numbers of cells inside of the field.
            first: Cell::new(east[0] as i32, north[0] as i32),
            shift,
        };
        underlay.is_valid(self.level()).then_some(underlay)
    }

    /// The heights of a tile that a device with this scene asks for, as they go on the link: of the
    /// scene's level, or of its underlay. `None` if there is no such tile.
    #[must_use]
    pub fn tile_of<'b>(
        &self,
        scene: &Scene,
        key: TileKey,
        buffer: &'b mut TileBuffer,
    ) -> Option<Heights<'b>> {
        match &scene.underlay {
            Some(underlay) if key == underlay.key(scene.level) => {
                Some(self.underlay_tile(underlay, buffer))
            }
            _ => self.tile(key, buffer),
        }
    }

    /// The samples of an underlay. Beyond the field it goes on as it ends there.
    fn underlay_tile<'b>(&self, underlay: &Underlay, buffer: &'b mut TileBuffer) -> Heights<'b> {
        let last = self.size();
        let sample = |first: i32, place: usize, last: i32| {
            let at = i64::from(first) + ((place as i64) << underlay.shift);
            at.clamp(0, i64::from(last)) as u32
        };
        let level = self.level().saturating_add(underlay.shift);
        for (index, height) in buffer.heights.iter_mut().enumerate() {
            let column = sample(underlay.first.x, index % POSTS, last[0]);
            let row = sample(underlay.first.y, index / POSTS, last[1]);
            *height = self.cells_at(level, column, row);
        }
        match range(buffer.heights.as_slice()) {
            None => Heights::Hole,
            // Nothing is known of what its samples are multiples of.
            Some((low, high, _)) => buffer.above(low, high, &[]),
        }
    }
}
