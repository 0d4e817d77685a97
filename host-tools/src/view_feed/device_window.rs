//! The tiles that a device stores, determined from those that were sent.

use std::collections::BTreeMap;

use hapterra_core::terrain::{TileIndex, TileKey};
use hapterra_view_stream::Tiles;

/// The device's window, determined from the sent tiles: a tile replaces the one before in its slot
/// ([`hapterra_core::terrain::Window`]). A tile that was lost in transit counts as stored until it
/// is sent again.
#[derive(Debug, Default)]
pub(super) struct DeviceWindow {
    side: i32,
    /// Haptic cells along the side of a cell of the level: a haptic tile is shown as the tile of
    /// the level around it.
    parts: i32,
    slots: BTreeMap<u32, TileIndex>,
    awaited: Option<TileIndex>,
    has_changed: bool,
}

impl DeviceWindow {
    /// Creates an empty window of `side` × `side` tiles.
    pub(super) fn new(side: u8, parts: u32) -> Self {
        Self {
            parts: parts as i32,
            side: i32::from(side.max(1)),
            has_changed: true,
            ..Self::default()
        }
    }

    /// Records a sent tile of the haptic grid; returns the shown tile of the level and its slot.
    pub(super) fn sent(&mut self, key: TileKey) -> (u32, TileKey) {
        let index = self.of_level(key.index);
        let slot = self.slot(index);
        let before = self.slots.insert(slot, index);
        self.has_changed |= before != Some(index);
        (slot, TileKey { index, ..key })
    }

    /// Sets the tile that the loop lacks now.
    pub(super) fn set_missing(&mut self, tile: Option<TileIndex>) {
        let tile = tile.map(|tile| self.of_level(tile));
        self.has_changed |= self.awaited != tile;
        self.awaited = tile;
    }

    /// Changes to a placement whose haptic cells have another size.
    pub(super) fn change_placement(&mut self, parts: u32) {
        self.parts = parts as i32;
    }

    /// Returns the tile of the level around a tile of the haptic grid.
    fn of_level(&self, haptic: TileIndex) -> TileIndex {
        let [col, row] = [haptic.col, haptic.row].map(|index| index.div_euclid(self.parts.max(1)));
        TileIndex::new(col, row)
    }

    /// Empties the window.
    pub(super) fn clear(&mut self) {
        self.slots.clear();
        self.has_changed = true;
    }

    /// Returns the slot of a tile.
    fn slot(&self, index: TileIndex) -> u32 {
        let [col, row] = [index.col, index.row].map(|i| i.rem_euclid(self.side.max(1)));
        (row * self.side + col) as u32
    }

    /// Returns the tiles if they have changed since the last call.
    pub(super) fn take_change(&mut self) -> Option<Tiles> {
        std::mem::take(&mut self.has_changed).then(|| Tiles {
            held: self
                .slots
                .values()
                .map(|tile| [tile.col, tile.row])
                .collect(),
            awaited: self
                .awaited
                .map(|tile| [tile.col, tile.row])
                .into_iter()
                .collect(),
        })
    }

    /// Marks the change as pending again, because it was not sent to the viewer.
    pub(super) fn mark_unsent(&mut self) {
        self.has_changed = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tile_replaces_the_one_in_its_slot() {
        let mut held = DeviceWindow::new(4, 1);
        assert_eq!(held.take_change(), Some(Tiles::default()));
        let slots =
            [(0, 0), (4, 0), (-4, 8), (1, 0)].map(|(c, r)| held.sent(TileKey::new(0, c, r)).0);
        assert_eq!(slots, [0, 0, 0, 1]);
        held.set_missing(Some(TileIndex::new(2, 3)));
        let tiles = held.take_change().expect("it has changed");
        assert_eq!(tiles.held, [[-4, 8], [1, 0]]);
        assert_eq!(tiles.awaited, [[2, 3]]);
        held.sent(TileKey::new(0, 1, 0));
        held.set_missing(Some(TileIndex::new(2, 3)));
        assert_eq!(held.take_change(), None);
        held.clear();
        assert_eq!(held.take_change().expect("empty").held, [[0; 2]; 0]);
    }

    /// A tile under a ball is a part of a tile of the level.
    #[test]
    fn haptic_tiles_are_shown_as_the_tile_around_them() {
        let mut held = DeviceWindow::new(4, 3);
        for (col, row, slot, shown) in [(0, 0, 0, (0, 0)), (2, 5, 4, (0, 1)), (3, 3, 5, (1, 1))] {
            let key = TileKey::new(1, shown.0, shown.1);
            assert_eq!(held.sent(TileKey::new(1, col, row)), (slot, key));
        }
        held.set_missing(Some(TileIndex::new(8, 0)));
        let tiles = held.take_change().expect("it has changed");
        assert_eq!(tiles.held, [[0, 0], [0, 1], [1, 1]]);
        assert_eq!(tiles.awaited, [[2, 0]]);
    }
}
