//! The tiles that a viewer receives: those of the device's window, or those that a
//! recording's path goes over.

use std::collections::HashSet;

use hapterra_core::terrain::{TileIndex, TileKey};
use hapterra_view_stream::{Message, TILE_CELLS};

use super::held_tiles::HeldTiles;
use super::layers;
use super::queue::Queue;
use crate::link::Event;
use crate::terrain::Terrain;

/// Tiles that a device asks for before the first sample of a view, at most.
const MAX_COMING: usize = 1024;
/// Tiles of a recording in full detail: beyond so many, others stay coarse.
const MAX_DETAILED: usize = 400;
/// Tiles that are sent at once, so that a look stays short: heights are read again for
/// them.
const AT_A_TIME: usize = 8;

/// Tiles, and which of them are pending.
pub(super) struct Tiles {
    held: HeldTiles,
    /// The device took a view of which no sample has come yet; tiles that were sent since.
    coming: Option<Vec<TileKey>>,
    /// Tiles that are shown for good.
    detailed: HashSet<TileKey>,
    /// Pending tiles for the viewer, by slot.
    untold: Vec<(u32, TileKey)>,
}

impl Tiles {
    /// Of a device with an empty window of `side` × `side` tiles, with so many haptic cells a cell
    /// of the level.
    pub(super) fn new(side: u8, parts: u32) -> Self {
        Self {
            held: HeldTiles::new(side, parts),
            coming: None,
            detailed: HashSet::new(),
            untold: vec![],
        }
    }

    /// Sets the tile that the loop lacks now.
    pub(super) fn lacks(&mut self, tile: Option<TileIndex>) {
        self.held.lacks(tile);
    }

    /// Takes what a session tells of the device's window.
    pub(super) fn on_event(&mut self, event: &Event<'_>) {
        match (event, &mut self.coming) {
            (Event::Viewed { taken: true, .. }, _) => self.coming = Some(vec![]),
            // More than a window holds are not sent within some samples.
            (Event::TileSent(key), Some(coming)) if coming.len() < MAX_COMING => coming.push(*key),
            (Event::TileSent(key), None) => self.sent(*key),
            (Event::Opened { resumed: false, .. }, _) => self.forget(),
            _ => {}
        }
    }

    /// Another view is in force: with the tiles of the one before, or with none but those
    /// that were sent since the device took it.
    pub(super) fn go_over(&mut self, keeps_tiles: bool, parts: u32) {
        if !keeps_tiles {
            self.forget();
        }
        self.held.go_over(parts);
        for key in self.coming.take().unwrap_or_default() {
            self.sent(key);
        }
    }

    /// The device begins with an empty window.
    fn forget(&mut self) {
        self.held.clear();
        self.untold.clear();
    }

    fn sent(&mut self, key: TileKey) {
        let (slot, key) = self.held.sent(key);
        self.untold.retain(|(other, _)| *other != slot);
        self.untold.push((slot, key));
    }

    /// Shows the tile at a place (cells) in full detail, for good: under rows that are not
    /// rendered by a device with a window.
    pub(super) fn detail(&mut self, terrain: &Terrain<'_>, cells: [f64; 2]) {
        let side = f64::from(TILE_CELLS) * f64::from(terrain.level()).exp2();
        let [col, row] = cells.map(|cells| (cells / side).floor() as i32);
        let key = TileKey::new(terrain.level(), col, row);
        let haptic = |index: i32| index.saturating_mul(terrain.parts() as i32);
        let is_there = terrain.has(TileKey::new(key.level, haptic(col), haptic(row)));
        let has_room = self.detailed.len() < MAX_DETAILED;
        if has_room && is_there && self.detailed.insert(key) {
            self.untold.push((self.detailed.len() as u32, key));
        }
    }

    /// Tells some of the tiles that there are to tell.
    pub(super) fn tell(&mut self, terrain: &Terrain<'_>, queue: &Queue) {
        let mut told = 0;
        for (slot, key) in std::mem::take(&mut self.untold) {
            // What there is no room for is tried again at the next look.
            let is_told = told < AT_A_TIME
                && queue.offer(Message::Tile(layers::tile(terrain, key.index, slot)));
            match is_told {
                true => told += 1,
                false => self.untold.push((slot, key)),
            }
        }
    }

    /// Tells which tiles the device holds and lacks, where that has changed.
    pub(super) fn tell_window(&mut self, queue: &Queue) {
        if let Some(tiles) = self.held.take_change()
            && !queue.offer(Message::Tiles(tiles))
        {
            self.held.not_told();
        }
    }
}
