//! Prefetch of the tiles that the HIP's extrapolated path needs.

use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::TILE_CELLS;

use crate::terrain::Terrain;

/// Time ahead of the HIP, seconds: longer than the response time of a distant server.
const LOOKAHEAD_S: f64 = 0.5;
/// Time between two positions, seconds: positions of adjacent ticks yield no useful speed.
const MIN_INTERVAL_S: f64 = 0.05;
/// Max distance from the HIP's tile, tiles. For a faster HIP nothing is prefetched: the tiles would
/// arrive after it has passed them.
const MAX_TILES: i32 = 8;

/// Prefetch of the tiles ahead of the HIP.
#[derive(Debug, Default)]
pub(super) struct Prefetch {
    /// A tick, and the HIP's position in it.
    previous: Option<(u32, GridPoint)>,
    /// First and last prefetched tile, east and north.
    prefetched: Option<[[i32; 2]; 2]>,
}

impl Prefetch {
    /// Resets the prefetch, for another scene or another device.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Prefetches tiles for the HIP's position in a tick, at `tick_hz` ticks a second.
    pub(super) fn follow(
        &mut self,
        terrain: &Terrain<'_>,
        tick: u32,
        hip: &GridPoint,
        tick_hz: f64,
    ) {
        let Some((then, previous)) = self.previous else {
            self.previous = Some((tick, *hip));
            return;
        };
        let since = f64::from(tick.wrapping_sub(then)) / tick_hz;
        if since < MIN_INTERVAL_S {
            return;
        }
        self.previous = Some((tick, *hip));
        let Some(tiles) = tiles(&previous, hip, LOOKAHEAD_S / since) else {
            return;
        };
        if self.prefetched.replace(tiles) != Some(tiles) {
            let cells = |tile: i32| tile.saturating_mul(TILE_CELLS as i32);
            let [from, to] = tiles;
            let to = to.map(|tile| cells(tile.saturating_add(1)));
            terrain.prefetch(from.map(cells), to);
        }
    }
}

/// Prefetches the tiles around a HIP's next position.
pub(super) fn prefetch_around(terrain: &Terrain<'_>, hip: &GridPoint) {
    let [east, north, _] = hip.cell();
    let tile = TILE_CELLS as i32;
    let (from, to) = (
        [east, north].map(|cell| cell.saturating_sub(tile)),
        [east, north].map(|cell| cell.saturating_add(tile)),
    );
    terrain.prefetch(from, to);
}

/// Returns the first and last tile, east and north, between the HIP and its extrapolated position;
/// `times` is the extrapolation time over the time since `previous`. `None` if the HIP is too fast.
fn tiles(previous: &GridPoint, is: &GridPoint, times: f64) -> Option<[[i32; 2]; 2]> {
    let along = |axis: usize| {
        let at = |point: &GridPoint| f64::from(point.cell()[axis]) + f64::from(point.frac()[axis]);
        let (from, moved) = (at(is), at(is) - at(previous));
        let tile = |cells: f64| (cells / f64::from(TILE_CELLS as u32)).floor() as i32;
        let (from, to) = (tile(from), tile(from + moved * times));
        let is_near = to.saturating_sub(from).saturating_abs() <= MAX_TILES;
        is_near.then_some([from.min(to), from.max(to)])
    };
    let (east, north) = (along(0)?, along(1)?);
    Some([[east[0], north[0]], [east[1], north[1]]])
}

#[cfg(test)]
mod tests {
    use hapterra_core::Vec3;

    use super::*;

    fn at(east: i32, north: i32) -> GridPoint {
        GridPoint::new([east, north, 0], Vec3::new(0.5, 0.5, 0.5))
    }

    #[test]
    fn prefetch_covers_tiles_from_hip_to_extrapolated_position() {
        assert_eq!(
            tiles(&at(40, 40), &at(40, 40), 10.0),
            Some([[1, 1], [1, 1]])
        );
        // One cell in a twentieth of a second is ten cells in half a second.
        assert_eq!(
            tiles(&at(56, 40), &at(57, 40), 10.0),
            Some([[1, 1], [2, 1]])
        );
        assert_eq!(
            tiles(&at(41, 70), &at(40, 66), 10.0),
            Some([[0, 0], [1, 2]])
        );
        assert_eq!(tiles(&at(0, 0), &at(0, 30), 10.0), None, "it is too fast");
        assert_eq!(tiles(&at(i32::MIN, 0), &at(i32::MAX, 0), 1e9), None);
    }
}
