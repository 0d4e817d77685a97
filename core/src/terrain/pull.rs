//! Which tiles to ask the host for, and when to ask again.
//!
//! The device pulls: what it asks follows from where the loop is held up,
//! where the proxy and the hand are, and how the hand moves. A tile the hand
//! cannot reach within [`HORIZON_TICKS`] is not asked for, one that is held is
//! not asked for again. Time is counted in ticks.

use heapless::Vec;

use super::ceiling::wrap;
use super::tile::{TILE_SHIFT, TileKey};

/// How far ahead in time the hand's path is looked at.
pub const HORIZON_TICKS: i32 = 200;
/// Cells around proxy and hand that are always wanted.
pub const MARGIN_CELLS: i32 = 12;
/// A tile asked for and not received is asked for again after this many ticks.
pub const RETRY_TICKS: u32 = 250;
/// Tiles asked for and not yet received, at most.
pub const IN_FLIGHT: usize = 4;
/// Points looked at along the predicted path.
const LOOK_AHEAD: i32 = 8;

/// Where the loop needs terrain, as the last tick left it. All in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Focus {
    /// The tile (column, row) whose absence holds the proxy up.
    pub held_up_by: Option<[i32; 2]>,
    /// The cell of the proxy.
    pub proxy: [i32; 2],
    /// The cell of the haptic interface point.
    pub hip: [i32; 2],
    /// Velocity of the haptic interface point, cells a tick.
    pub velocity: [f32; 2],
}

/// The pull state machine of a `D × D` window. No I/O, no clock.
pub struct Puller<const D: usize> {
    level: u8,
    /// Last tile column and row of the field.
    last: [i32; 2],
    held: [[Option<TileKey>; D]; D],
    asked: Vec<(TileKey, u32), IN_FLIGHT>,
}

impl<const D: usize> Default for Puller<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> Puller<D> {
    /// A puller that wants nothing until a field is known.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            level: 0,
            last: [-1, -1],
            held: [[None; D]; D],
            asked: Vec::new(),
        }
    }

    /// Takes a new field of `size` patches; nothing of it is held.
    pub fn reset(&mut self, level: u8, size: [i32; 2]) {
        *self = Self::new();
        self.level = level;
        self.last = size.map(|s| (s - 1) >> TILE_SHIFT);
    }

    /// Forgets what was asked, as after the link was lost; held tiles stay.
    pub fn forget_asked(&mut self) {
        self.asked.clear();
    }

    /// Tiles asked for and not yet received.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.asked.len()
    }

    /// Whether this tile was asked for; an answer nobody asked for is dropped.
    #[must_use]
    pub fn awaits(&self, key: TileKey) -> bool {
        self.asked.iter().any(|(asked, _)| *asked == key)
    }

    /// The tile was handed to the window.
    pub fn received(&mut self, key: TileKey) {
        self.asked.retain(|(asked, _)| *asked != key);
        self.held[wrap::<D>(key.row)][wrap::<D>(key.col)] = Some(key);
    }

    /// The window did not keep the tile after all.
    pub fn lost(&mut self, key: TileKey) {
        let slot = &mut self.held[wrap::<D>(key.row)][wrap::<D>(key.col)];
        if *slot == Some(key) {
            *slot = None;
        }
    }

    /// The next tile to ask for at tick `now`, most urgent first; `None` when
    /// nothing is wanted or enough is under way. Call until `None`.
    pub fn next_request(&mut self, now: u32, focus: &Focus) -> Option<TileKey> {
        if let Some(overdue) = self.overdue(now) {
            return Some(overdue);
        }
        if self.asked.is_full() {
            return None;
        }
        let key = self.most_urgent(focus)?;
        self.asked.push((key, now)).ok()?;
        Some(key)
    }

    fn overdue(&mut self, now: u32) -> Option<TileKey> {
        let (key, asked_at) = self
            .asked
            .iter_mut()
            .find(|(_, at)| now.wrapping_sub(*at) >= RETRY_TICKS)?;
        *asked_at = now;
        Some(*key)
    }

    /// Held-up tile, tiles around the proxy, around the hand, along its path.
    ///
    /// Only tiles nearer to the centre than half the torus are candidates, so
    /// that none can push out a tile that is nearer.
    fn most_urgent(&self, focus: &Focus) -> Option<TileKey> {
        let proxy = TileKey::holding(self.level, focus.proxy);
        let centre = focus.held_up_by.map_or([proxy.col, proxy.row], |tile| tile);
        let blocked = focus.held_up_by.map(|tile| self.candidate(tile, centre));
        if let Some(Some(key)) = blocked {
            return Some(key);
        }
        if let Some(key) = self.around(focus.proxy, centre) {
            return Some(key);
        }
        (0..=LOOK_AHEAD).find_map(|step| {
            let ticks = (step * HORIZON_TICKS / LOOK_AHEAD) as f32;
            let ahead = |axis: usize| {
                // The cast saturates, so any velocity gives some cell.
                focus.hip[axis].saturating_add((focus.velocity[axis] * ticks) as i32)
            };
            self.around([ahead(0), ahead(1)], centre)
        })
    }

    /// A wanted tile among those within the margin of a cell, its own first.
    fn around(&self, cell: [i32; 2], centre: [i32; 2]) -> Option<TileKey> {
        let tile = |dx: i32, dy: i32| {
            [
                cell[0].saturating_add(dx) >> TILE_SHIFT,
                cell[1].saturating_add(dy) >> TILE_SHIFT,
            ]
        };
        let m = MARGIN_CELLS;
        let near = [
            (0, 0),
            (-m, 0),
            (m, 0),
            (0, -m),
            (0, m),
            (-m, -m),
            (m, -m),
            (-m, m),
            (m, m),
        ];
        near.iter()
            .find_map(|(dx, dy)| self.candidate(tile(*dx, *dy), centre))
    }

    /// The tile as a request, unless outside, too far, held or asked for.
    fn candidate(&self, tile: [i32; 2], centre: [i32; 2]) -> Option<TileKey> {
        let [col, row] = tile;
        let reach = (D as i32 / 2 - 1).max(0);
        let key = TileKey {
            level: self.level,
            col,
            row,
        };
        let inside = (0..=self.last[0]).contains(&col) && (0..=self.last[1]).contains(&row);
        let far = col.abs_diff(centre[0]).max(row.abs_diff(centre[1])) > reach.unsigned_abs();
        let held = self.held[wrap::<D>(row)][wrap::<D>(col)] == Some(key);
        (inside && !far && !held && !self.awaits(key)).then_some(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn drain(puller: &mut Puller<4>, now: u32, focus: &Focus) -> Vec<(i32, i32)> {
        core::iter::from_fn(|| puller.next_request(now, focus))
            .map(|k| (k.col, k.row))
            .collect()
    }

    fn puller() -> Puller<4> {
        let mut puller = Puller::new();
        puller.reset(0, [640, 640]);
        puller
    }

    fn at(x: i32, y: i32) -> Focus {
        Focus {
            proxy: [x, y],
            hip: [x, y],
            ..Focus::default()
        }
    }

    #[test]
    fn a_still_hand_wants_only_what_is_within_the_margin() {
        let mut puller = puller();
        assert_eq!(drain(&mut puller, 0, &at(48, 48)), [(1, 1)]);
        puller.received(TileKey {
            level: 0,
            col: 1,
            row: 1,
        });
        assert_eq!(drain(&mut puller, 1, &at(48, 48)), []);
        assert_eq!(drain(&mut puller, 2, &at(60, 48)), [(2, 1)]);
    }

    #[test]
    fn what_holds_the_proxy_up_comes_first() {
        let mut puller = puller();
        let focus = Focus {
            held_up_by: Some([9, 9]),
            ..at(48, 48)
        };
        assert_eq!(drain(&mut puller, 0, &focus)[0], (9, 9));
    }

    #[test]
    fn a_moving_hand_wants_what_lies_ahead() {
        let mut puller = puller();
        let focus = Focus {
            velocity: [0.3, 0.0],
            ..at(48, 48)
        };
        assert_eq!(drain(&mut puller, 0, &focus), [(1, 1), (2, 1)]);
    }

    #[test]
    fn asks_again_after_the_time_out_and_not_before() {
        let mut puller = puller();
        assert_eq!(drain(&mut puller, 7, &at(48, 48)), [(1, 1)]);
        assert_eq!(drain(&mut puller, 6 + RETRY_TICKS, &at(48, 48)), []);
        assert_eq!(drain(&mut puller, 7 + RETRY_TICKS, &at(48, 48)), [(1, 1)]);
    }

    #[test]
    fn never_asks_outside_the_field_nor_for_more_than_the_limit() {
        let mut puller = puller();
        let focus = Focus {
            velocity: [-f32::MAX, f32::NAN],
            ..at(0, 0)
        };
        let asked = drain(&mut puller, 0, &focus);
        assert_eq!(asked, [(0, 0)]);
        let corner = at(31, 31);
        assert!(drain(&mut puller, 0, &corner).len() <= IN_FLIGHT);
    }
}
