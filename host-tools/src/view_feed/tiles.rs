//! The tiles for a viewer: those of the device's window, or those on a recording's path.

use std::collections::HashSet;

use hapterra_core::terrain::{TileIndex, TileKey};
use hapterra_view_stream::{Message, TILE_CELLS};

use super::device_window::DeviceWindow;
use super::layers;
use super::queue::Queue;
use crate::link::Event;
use crate::terrain::Terrain;

/// Max tiles that a device requests before the first sample of a placement.
const MAX_REQUESTED: usize = 1024;
/// Max tiles of a recording in full detail: further ones stay coarse.
const MAX_DETAILED: usize = 400;
/// Max tiles sent in one call, to keep it short: their heights are read again.
const MAX_TILES_PER_CALL: usize = 8;

/// Tiles, and those of them that are pending.
pub(super) struct Tiles {
    window: DeviceWindow,
    /// Tiles sent since the device accepted a placement that has no sample yet.
    requested: Option<Vec<TileKey>>,
    /// Tiles that keep their detail.
    detailed: HashSet<TileKey>,
    /// Pending tiles for the viewer, by slot.
    pending: Vec<(u32, TileKey)>,
}

impl Tiles {
    /// Creates the tiles of a device with an empty window of `side` × `side` tiles; `parts` is the
    /// number of haptic cells along the side of a cell of the level.
    pub(super) fn new(side: u8, parts: u32) -> Self {
        Self {
            window: DeviceWindow::new(side, parts),
            requested: None,
            detailed: HashSet::new(),
            pending: vec![],
        }
    }

    /// Sets the tile that the loop lacks now.
    pub(super) fn set_missing(&mut self, tile: Option<TileIndex>) {
        self.window.set_missing(tile);
    }

    /// Processes an event about the device's window.
    pub(super) fn on_event(&mut self, event: &Event<'_>) {
        match (event, &mut self.requested) {
            (Event::SceneChangeResult { accepted: true, .. }, _) => self.requested = Some(vec![]),
            // More tiles than a window holds are not sent within a few samples.
            (Event::TileSent(key), Some(requested)) if requested.len() < MAX_REQUESTED => {
                requested.push(*key);
            }
            (Event::TileSent(key), None) => self.sent(*key),
            (Event::ChangeCancelled, _) => self.requested = None,
            (Event::Opened { resumed: false, .. }, _) => self.forget(),
            _ => {}
        }
    }

    /// Changes to another placement: with the tiles of the one before, or only with those sent
    /// since the device accepted it.
    pub(super) fn change_placement(&mut self, keeps_tiles: bool, parts: u32) {
        if !keeps_tiles {
            self.forget();
        }
        self.window.change_placement(parts);
        for key in self.requested.take().unwrap_or_default() {
            self.sent(key);
        }
    }

    /// Empties the window.
    fn forget(&mut self) {
        self.window.clear();
        self.pending.clear();
    }

    fn sent(&mut self, key: TileKey) {
        let (slot, key) = self.window.sent(key);
        self.pending.retain(|(other, _)| *other != slot);
        self.pending.push((slot, key));
    }

    /// Keeps the tile at a position (cells) in full detail: for rows that are not rendered by a
    /// device with a window.
    pub(super) fn keep_detailed(&mut self, terrain: &Terrain<'_>, cells: [f64; 2]) {
        let side = f64::from(TILE_CELLS) * f64::from(terrain.level()).exp2();
        let [col, row] = cells.map(|cells| (cells / side).floor() as i32);
        let key = TileKey::new(terrain.level(), col, row);
        let haptic = |index: i32| index.saturating_mul(terrain.parts() as i32);
        let is_there = terrain.has(TileKey::new(key.level, haptic(col), haptic(row)));
        let has_room = self.detailed.len() < MAX_DETAILED;
        if has_room && is_there && self.detailed.insert(key) {
            self.pending.push((self.detailed.len() as u32, key));
        }
    }

    /// Sends some of the pending tiles.
    pub(super) fn send_pending(&mut self, terrain: &Terrain<'_>, queue: &Queue) {
        let mut reported = 0;
        for (slot, key) in std::mem::take(&mut self.pending) {
            // A tile that does not fit in the queue is tried again in the next call.
            let is_sent = reported < MAX_TILES_PER_CALL
                && queue.offer(Message::Tile(layers::tile(terrain, key.index, slot)));
            match is_sent {
                true => reported += 1,
                false => self.pending.push((slot, key)),
            }
        }
    }

    /// Sends the lists of stored and missing tiles if they have changed.
    pub(super) fn send_window(&mut self, queue: &Queue) {
        if let Some(tiles) = self.window.take_change()
            && !queue.offer(Message::Tiles(tiles))
        {
            self.window.mark_unsent();
        }
    }
}
