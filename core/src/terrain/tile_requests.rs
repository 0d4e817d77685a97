//! Requests to the host for tiles, and their repetition.
//!
//! The requests follow from the missing tile, from the positions of the proxy and the haptic
//! interface point (HIP), and from the motion of the HIP. A tile that the HIP cannot reach within
//! [`HORIZON_TICKS`] is not requested, and a stored one is not requested again. Over a fallback
//! that time begins when an answer can arrive, so tiles that the HIP will have left by then are not
//! requested either. Time is counted in ticks of one millisecond at every rate of the loop.

use heapless::Vec;

use super::extent::FieldSize;
use super::fallback::{Fallback, PARTS};
use super::index::{TileIndex, TileKey, wrap};
use crate::grid::Cell;

/// Horizon of the HIP's extrapolated path, ticks.
pub const HORIZON_TICKS: i32 = 200;
/// Margin around proxy and HIP in which tiles are always requested, cells.
pub const MARGIN_CELLS: i32 = 12;
/// Ticks after which an unanswered request is repeated.
pub const RETRY_TICKS: u32 = 250;
/// Maximum number of unanswered requests.
pub const IN_FLIGHT: usize = 4;
/// Weight of the latest answer in the mean answer time.
const ANSWER_SHARE: f32 = 0.125;
/// Number of steps along the predicted path at which tiles are requested.
const PATH_STEPS: i32 = 8;

/// Position and motion after the last tick, for which the loop needs terrain, in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RequestHint {
    /// The tile without which the tick could not be completed.
    pub missing_tile: Option<TileIndex>,
    /// The cell of the proxy.
    pub proxy: Cell,
    /// The cell of the haptic interface point.
    pub hip: Cell,
    /// Velocity of the haptic interface point, cells a tick.
    pub velocity: [f32; 2],
}

impl RequestHint {
    /// Returns the tile around which others are requested: the missing one, otherwise the proxy's.
    fn centre(&self) -> TileIndex {
        self.missing_tile
            .unwrap_or(TileIndex::containing(self.proxy))
    }
}

/// Selection of the next tile to request for a `D × D` window. No I/O, no clock.
///
/// ```
/// use hapterra_core::grid::Cell;
/// use hapterra_core::terrain::{FieldSize, RequestHint, TileKey, TileRequester};
///
/// let mut requester = TileRequester::<4>::new();
/// requester.reset(0, FieldSize::new(10_000, 10_000));
/// // HIP and proxy are in the middle of a tile and move east, 0.1 cell a tick.
/// let cell = Cell::new(80, 48);
/// let hint = RequestHint { proxy: cell, hip: cell, velocity: [0.1, 0.0], ..RequestHint::default() };
/// assert_eq!(requester.next_request(0, &hint), Some(TileKey::new(0, 2, 1)));
/// assert_eq!(requester.next_request(0, &hint), Some(TileKey::new(0, 3, 1)));
/// assert_eq!(requester.next_request(0, &hint), None);
/// requester.received(TileKey::new(0, 2, 1));
/// assert_eq!(requester.in_flight(), 1);
/// ```
pub struct TileRequester<const D: usize> {
    level: u8,
    size: FieldSize,
    stored: [[Option<TileKey>; D]; D],
    /// The fallback's tiles, with true for each that is stored; they are requested before all
    /// others.
    fallback: [Option<(TileKey, bool)>; PARTS],
    pending: Vec<(TileKey, u32), IN_FLIGHT>,
    /// Tick of the last search for a request, and mean answer time in ticks.
    now: u32,
    answer_ticks: f32,
}

impl<const D: usize> Default for TileRequester<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> TileRequester<D> {
    /// Creates a requester that requests nothing until a field is set.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            level: 0,
            size: FieldSize::new(0, 0),
            stored: [[None; D]; D],
            fallback: [None; PARTS],
            pending: Vec::new(),
            now: 0,
            answer_ticks: 0.0,
        }
    }

    /// Sets a new field of `size` patches, none of whose tiles is stored.
    pub fn reset(&mut self, level: u8, size: FieldSize) {
        *self = Self::new();
        self.level = level;
        self.size = size;
    }

    /// Sets the field's fallback, which is not stored yet, or none. Equally coarse fallbacks have
    /// the same keys, so earlier requests must be discarded ([`Self::clear_pending`]).
    pub fn set_fallback(&mut self, fallback: Option<Fallback>) {
        let keys = fallback.map_or([None; PARTS], |fallback| fallback.keys(self.level));
        self.fallback = keys.map(|key| key.map(|key| (key, false)));
    }

    /// Discards the open requests, for instance after the link was lost; stored tiles stay.
    pub fn clear_pending(&mut self) {
        self.pending.clear();
    }

    /// Makes the open requests `ticks` older, for a loop that runs no ticks while it waits for
    /// answers.
    pub fn age(&mut self, ticks: u32) {
        for (_, at) in &mut self.pending {
            *at = at.wrapping_sub(ticks);
        }
    }

    /// Returns the number of unanswered requests.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.pending.len()
    }

    /// Returns true if this tile was requested; any other answer is dropped.
    #[must_use]
    pub fn is_pending(&self, key: TileKey) -> bool {
        self.pending.iter().any(|(pending, _)| *pending == key)
    }

    /// Records that the tile was handed to the window.
    pub fn received(&mut self, key: TileKey) {
        if let Some((_, at)) = self.pending.iter().find(|(pending, _)| *pending == key) {
            let ticks = self.now.wrapping_sub(*at).min(RETRY_TICKS) as f32;
            self.answer_ticks += (ticks - self.answer_ticks) * ANSWER_SHARE;
        }
        self.pending.retain(|(pending, _)| *pending != key);
        match self.fallback_flag_mut(key) {
            Some(is_stored) => *is_stored = true,
            None => *self.slot(key) = Some(key),
        }
    }

    /// Records that the window has not kept the tile.
    pub fn lost(&mut self, key: TileKey) {
        match self.fallback_flag_mut(key) {
            Some(is_stored) => *is_stored = false,
            None => drop(self.slot(key).take_if(|stored| *stored == key)),
        }
    }

    /// Returns the flag of a fallback's tile: true if the tile is stored.
    fn fallback_flag_mut(&mut self, key: TileKey) -> Option<&mut bool> {
        let mut parts = self.fallback.iter_mut().flatten();
        parts.find_map(|(part, is_stored)| (*part == key).then_some(is_stored))
    }

    fn slot(&mut self, key: TileKey) -> &mut Option<TileKey> {
        &mut self.stored[wrap::<D>(key.index.row)][wrap::<D>(key.index.col)]
    }

    /// Returns the next tile to request at tick `now`, most urgent first; `None` if no tile is
    /// needed or enough requests are open. Call until `None`.
    pub fn next_request(&mut self, now: u32, hint: &RequestHint) -> Option<TileKey> {
        if let Some(key) = self.next_of_fallback(now, hint) {
            return Some(key);
        }
        if self.pending.is_full() {
            return None;
        }
        let key = self.most_urgent(hint)?;
        self.pending.push((key, now)).ok()?;
        Some(key)
    }

    /// As [`Self::next_request`], without new requests for tiles of the field itself: for a device
    /// that renders another placement until the fallback has arrived.
    pub fn next_of_fallback(&mut self, now: u32, hint: &RequestHint) -> Option<TileKey> {
        if let Some(key) = self.next_repeat(now, hint) {
            return Some(key);
        }
        if self.pending.is_full() {
            return None;
        }
        let mut fallback = self.fallback.iter().flatten();
        let is_needed = |(key, is_stored): &&(TileKey, bool)| !is_stored && !self.is_pending(*key);
        let (key, _) = *fallback.find(is_needed)?;
        self.pending.push((key, now)).ok()?;
        Some(key)
    }

    /// Returns the next tile whose request is overdue and is repeated: for a device without room
    /// for more tiles.
    #[inline(never)]
    pub fn next_repeat(&mut self, now: u32, hint: &RequestHint) -> Option<TileKey> {
        self.now = now;
        let is_overdue = |at: &u32| now.wrapping_sub(*at) >= RETRY_TICKS;
        let (level, centre) = (self.level, hint.centre());
        let is_near = |key: &TileKey| key.level != level || Self::is_in_reach(centre, key.index);
        // The proxy has moved on: an answer now would replace a nearer tile.
        self.pending
            .retain(|(key, at)| !is_overdue(at) || is_near(key));
        let (key, at) = self.pending.iter_mut().find(|(_, at)| is_overdue(at))?;
        *at = now;
        Some(*key)
    }

    /// Returns the most urgent tile: the missing one, then those around the proxy, around the HIP
    /// and along its path.
    ///
    /// Only tiles nearer to the centre than half the torus are candidates, so that none can replace
    /// a nearer tile.
    fn most_urgent(&self, hint: &RequestHint) -> Option<TileKey> {
        let centre = hint.centre();
        // Over a fallback no tick needs a tile that the HIP leaves before it arrives.
        let first = if self.fallback[0].is_some() {
            self.answer_ticks
        } else {
            0.0
        };
        // The casts saturate, so any velocity results in a valid cell.
        let after = |from: Cell, ticks: f32| {
            let [east, north] = hint.velocity.map(|v| (v * ticks) as i32);
            from.offset(east, north)
        };
        let ahead = (0..=PATH_STEPS).map(|step| {
            let ticks = (step * HORIZON_TICKS / PATH_STEPS) as f32;
            after(hint.hip, first + ticks)
        });
        let mut places = core::iter::once(after(hint.proxy, first)).chain(ahead);
        let missing = hint.missing_tile;
        missing
            .and_then(|tile| self.candidate(tile, centre))
            .or_else(|| places.find_map(|cell| self.around(cell, centre)))
    }

    /// Returns a tile to request among those within the margin of a cell, the cell's own first.
    fn around(&self, cell: Cell, centre: TileIndex) -> Option<TileKey> {
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
        near.iter().find_map(|(dx, dy)| {
            self.candidate(TileIndex::containing(cell.offset(*dx, *dy)), centre)
        })
    }

    /// Returns the tile's key, unless it is outside, too far, stored or requested already.
    fn candidate(&self, index: TileIndex, centre: TileIndex) -> Option<TileKey> {
        let level = self.level;
        let key = TileKey { level, index };
        let is_stored = self.stored[wrap::<D>(index.row)][wrap::<D>(index.col)] == Some(key);
        let is_needed = !is_stored && !self.is_pending(key) && Self::is_in_reach(centre, index);
        (is_needed && self.size.has_tile(index)).then_some(key)
    }

    /// Returns true if a tile is nearer to the centre than half the torus: each of these tiles has
    /// its own slot.
    fn is_in_reach(centre: TileIndex, TileIndex { col, row }: TileIndex) -> bool {
        let reach = (D as i32 - 1) / 2;
        col.abs_diff(centre.col).max(row.abs_diff(centre.row)) <= reach.unsigned_abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::CoarseTile;
    use std::vec::Vec;

    fn drain(requester: &mut TileRequester<4>, now: u32, hint: &RequestHint) -> Vec<(i32, i32)> {
        core::iter::from_fn(|| requester.next_request(now, hint))
            .map(|k| (k.index.col, k.index.row))
            .collect()
    }

    fn fallback(near: Option<u8>) -> Fallback {
        let of = |shift| CoarseTile {
            first: Cell::new(0, 0),
            shift,
        };
        Fallback {
            wide: of(4),
            near: near.map(of),
        }
    }

    fn requester() -> TileRequester<4> {
        let mut requester = TileRequester::new();
        requester.reset(0, FieldSize::new(640, 640));
        requester
    }

    fn at(x: i32, y: i32) -> RequestHint {
        RequestHint {
            proxy: Cell::new(x, y),
            hip: Cell::new(x, y),
            ..RequestHint::default()
        }
    }

    #[test]
    fn still_hand_requests_only_tiles_within_the_margin() {
        let mut requester = requester();
        assert_eq!(drain(&mut requester, 0, &at(48, 48)), [(1, 1)]);
        requester.received(TileKey::new(0, 1, 1));
        assert_eq!(drain(&mut requester, 1, &at(48, 48)), []);
        assert_eq!(drain(&mut requester, 2, &at(60, 48)), [(2, 1)]);
    }

    #[test]
    fn fallback_tiles_are_requested_first_and_once() {
        let mut requester = requester();
        let fallback = fallback(Some(2));
        requester.set_fallback(Some(fallback));
        let near = fallback.near.expect("near").key(0);
        let key = fallback.wide.key(0);
        assert_eq!(requester.next_request(0, &at(48, 48)), Some(key));
        assert_eq!(requester.next_request(0, &at(48, 48)), Some(near));
        requester.received(near);
        assert_eq!(drain(&mut requester, 0, &at(48, 48)), [(1, 1)]);
        // The fallback is never too far away to be requested again.
        assert_eq!(drain(&mut requester, RETRY_TICKS, &at(400, 48)).len(), 2);
        assert!(requester.is_pending(key));
        requester.received(key);
        assert_eq!(
            drain(&mut requester, 3 * RETRY_TICKS, &at(400, 48)),
            [(12, 1)]
        );
        assert!(!requester.is_pending(key));
        requester.received(TileKey::new(0, 12, 1));
        requester.lost(key);
        assert_eq!(
            requester.next_request(3 * RETRY_TICKS, &at(400, 48)),
            Some(key)
        );
        requester.received(key);
        // Another fallback with the same keys is requested again.
        requester.set_fallback(Some(fallback));
        assert_eq!(requester.next_request(0, &at(400, 48)), Some(key));
        assert_eq!(requester.next_request(0, &at(400, 48)), Some(near));
        requester.set_fallback(None);
        requester.clear_pending();
        assert_eq!(drain(&mut requester, 0, &at(400, 48)), []);
    }

    #[test]
    fn tiles_left_behind_are_not_requested_over_a_fallback() {
        for has_fallback in [false, true] {
            let mut requester = requester();
            if has_fallback {
                requester.set_fallback(Some(fallback(None)));
                requester.received(fallback(None).wide.key(0));
            }
            // Answers arrive after 60 ticks.
            for (tick, col) in (0..40_u32).map(|n| (n * 61, n as i32 % 8)) {
                let here = at(col * 32 + 16, 48);
                for (col, row) in drain(&mut requester, tick, &here) {
                    drain(&mut requester, tick + 60, &here);
                    requester.received(TileKey::new(0, col, row));
                }
            }
            // One cell a tick: in 60 ticks the HIP has moved two tiles on.
            let hint = RequestHint {
                velocity: [1.0, 0.0],
                ..at(16 * 32 + 16, 48)
            };
            let first = drain(&mut requester, 4000, &hint);
            assert_eq!(first.contains(&(16, 1)), !has_fallback, "{first:?}");
            // A HIP at rest is still there when the tile arrives.
            let first = drain(&mut requester, 4000, &at(16 * 32 + 16, 48));
            assert_eq!(first.contains(&(16, 1)), has_fallback, "{first:?}");
        }
    }

    #[test]
    fn tile_that_blocks_the_proxy_is_requested_first() {
        let mut requester = requester();
        let hint = RequestHint {
            missing_tile: Some(TileIndex::new(9, 9)),
            ..at(48, 48)
        };
        assert_eq!(drain(&mut requester, 0, &hint)[0], (9, 9));
    }

    #[test]
    fn moving_hand_requests_tiles_ahead() {
        let mut requester = requester();
        let hint = RequestHint {
            velocity: [0.3, 0.0],
            ..at(48, 48)
        };
        assert_eq!(drain(&mut requester, 0, &hint), [(1, 1), (2, 1)]);
    }

    #[test]
    fn windows_of_three_and_four_tiles_have_the_same_reach() {
        fn requested<const D: usize>() -> Vec<TileKey> {
            let mut requester = TileRequester::<D>::new();
            requester.reset(0, FieldSize::new(640, 640));
            let mut requested = Vec::new();
            for (x, y) in [(33, 33), (62, 62), (62, 33), (33, 62), (300, 300), (33, 33)] {
                while let Some(key) = requester.next_request(0, &at(x, y)) {
                    requester.received(key);
                    requested.push(key);
                }
            }
            requested
        }
        let (three, four) = (requested::<3>(), requested::<4>());
        let around: Vec<_> = three.iter().take(9).collect();
        assert!(four.iter().take(9).eq(around), "{three:?}");
        // The distant tile has replaced one of them, which is requested again.
        assert_eq!(three.get(10), Some(&TileKey::new(0, 0, 0)));
        assert_eq!(four.get(10), Some(&TileKey::new(0, 1, 1)));
        assert_eq!((three.len(), four.len()), (11, 11));
    }

    #[test]
    fn request_is_repeated_only_after_the_timeout() {
        let mut requester = requester();
        assert_eq!(drain(&mut requester, 7, &at(48, 48)), [(1, 1)]);
        assert_eq!(drain(&mut requester, 6 + RETRY_TICKS, &at(48, 48)), []);
        assert_eq!(
            drain(&mut requester, 7 + RETRY_TICKS, &at(48, 48)),
            [(1, 1)]
        );
    }

    #[test]
    fn tile_out_of_reach_is_not_requested_again() {
        let mut requester = requester();
        assert_eq!(drain(&mut requester, 0, &at(48, 48)), [(1, 1)]);
        let far = drain(&mut requester, RETRY_TICKS, &at(400, 48));
        assert_eq!(far, [(12, 1)]);
        assert!(!requester.is_pending(TileKey::new(0, 1, 1)));
        let back = drain(&mut requester, RETRY_TICKS + 1, &at(48, 48));
        assert_eq!(back, [(1, 1)]);
    }

    #[test]
    fn aged_request_is_repeated_sooner() {
        let mut requester = requester();
        assert_eq!(drain(&mut requester, 7, &at(48, 48)), [(1, 1)]);
        requester.age(RETRY_TICKS / 2);
        assert_eq!(drain(&mut requester, 7, &at(48, 48)), []);
        requester.age(RETRY_TICKS / 2);
        assert_eq!(drain(&mut requester, 7, &at(48, 48)), [(1, 1)]);
        assert_eq!(drain(&mut requester, 7, &at(48, 48)), []);
    }

    #[test]
    fn requests_stay_inside_the_field_and_within_the_limit() {
        let mut requester = requester();
        let hint = RequestHint {
            velocity: [-f32::MAX, f32::NAN],
            ..at(0, 0)
        };
        let requested = drain(&mut requester, 0, &hint);
        assert_eq!(requested, [(0, 0)]);
        let corner = at(31, 31);
        assert!(drain(&mut requester, 0, &corner).len() <= IN_FLIGHT);
    }
}
