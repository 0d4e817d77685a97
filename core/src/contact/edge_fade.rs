//! Fade of the force at the edge of the surface.
//!
//! In contact, the proxy stops at the edge of no-data, at the border of the data, and before a
//! missing tile. The force then fades with the distance of the *HIP* from the nearest patch, to
//! zero at [`REACH`], where the contact ends. The HIP slides off an edge as off a table, without a
//! kick and without a pull from underneath.
//!
//! The edge fade is a factor on the force: from 1 (full force) to 0 (no force).

use super::budget::Budget;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{CellContent, TILE_CELLS, Window};

/// Distance of the HIP from the nearest patch, in cells, at which no force is rendered.
pub const REACH: f32 = 0.5;
/// Maximum change of the edge fade in a second, in either direction: from 1 to 0 in 32 ms.
pub const RATE_PER_S: f32 = 31.25;
/// Maximum change of the edge fade in a tick at 1 kHz.
pub const RATE: f32 = RATE_PER_S / 1_000.0;
/// Distance between HIP and proxy, in cells along an axis, from which the cell under the HIP no
/// longer matters: the full force is then rendered.
///
/// One less than a tile's side: the cells that are read, including a neighbour of the HIP's patch,
/// never share a slot of the window with the tile under the proxy.
pub const FULL_FORCE_DISTANCE: u32 = TILE_CELLS as u32 - 1;

/// Returns true if the cell under the HIP is too far from the proxy's to matter.
#[inline]
fn is_far(proxy: Cell, hip: Cell) -> bool {
    proxy.x.abs_diff(hip.x).max(proxy.y.abs_diff(hip.y)) >= FULL_FORCE_DISTANCE
}

/// Target of the edge fade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Target {
    /// 1 over a patch, less beside one, 0 farther than [`REACH`] from any: continuous in the HIP
    /// within [`FULL_FORCE_DISTANCE`] of the proxy's cell, and 1 beyond. Missing tiles count as
    /// no-data.
    pub(super) fade: f32,
    /// True if the HIP is over a patch, so that nothing fades while it stays over its cell.
    pub(super) over_patch: bool,
}

impl Target {
    const ALL: Self = Self {
        fade: 1.0,
        over_patch: true,
    };
}

/// Returns the target for a HIP whose proxy is on the patch in a cell.
pub(super) fn target<const D: usize>(
    window: &Window<'_, D>,
    hip: &GridPoint,
    proxy: Cell,
    budget: &mut Budget,
) -> Target {
    // Usually the HIP is over the patch that the proxy is on.
    if proxy == hip.column() {
        return Target::ALL;
    }
    if is_far(proxy, hip.column()) {
        return Target {
            over_patch: false,
            ..Target::ALL
        };
    }
    beside_patches(window, hip, budget)
}

fn beside_patches<const D: usize>(
    window: &Window<'_, D>,
    hip: &GridPoint,
    budget: &mut Budget,
) -> Target {
    let mut is_patch = |cell| match window.ground(cell) {
        CellContent::Patch(_) => true,
        CellContent::NoData => false,
        CellContent::Missing => {
            budget.record_missing(cell);
            false
        }
    };
    let Cell { x, y } = hip.column();
    if is_patch(Cell::new(x, y)) {
        return Target::ALL;
    }
    let (p, q) = (hip.frac().x, hip.frac().y);
    let mut nearest = REACH * REACH;
    for north in -1..=1 {
        for east in -1..=1 {
            if is_patch(Cell::new(x + east, y + north)) {
                let (du, dv) = (gap(p, east), gap(q, north));
                nearest = nearest.min(du * du + dv * dv);
            }
        }
    }
    Target {
        fade: 1.0 - libm::sqrtf(nearest) / REACH,
        over_patch: false,
    }
}

/// Returns the distance along one axis from a place in a cell to a neighbouring cell.
fn gap(place: f32, toward: i32) -> f32 {
    match toward {
        1 => 1.0 - place,
        -1 => place,
        _ => 0.0,
    }
}

/// Returns the edge fade, moved toward its target by at most `max_change`, which is positive.
pub(super) fn approach(fade: f32, target: f32, max_change: f32) -> f32 {
    // Not `f32::min`, which is a call where the processor has no instruction for it.
    let change = target - fade;
    if change > max_change {
        fade + max_change
    } else if change < -max_change {
        fade - max_change
    } else {
        fade + change
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;
    use crate::contact::{Contact, ContactSettings, ContactState};
    use crate::rate::TickRate;
    use crate::terrain::testing::{Field, buffers};
    use crate::terrain::{FieldSize, Tile, TileIndex};
    use glam::Vec3;

    fn hole_at_10_10(tiles: &mut [Tile]) -> Field<'_, 2> {
        Field::filled(tiles, FieldSize::new(40, 40), |x, y| {
            if (10..=11).contains(&x) && (10..=11).contains(&y) {
                f32::NAN
            } else {
                0.0
            }
        })
    }

    fn beside(field: &Field<'_, 2>, hip: GridPoint) -> Target {
        beside_patches(&field.window, &hip, &mut Budget::new(0))
    }

    fn at(x: f32, y: f32) -> GridPoint {
        GridPoint::new([0; 3], Vec3::new(x, y, -1.0))
    }

    #[test]
    fn fade_is_full_over_a_patch_and_zero_far_away() {
        let mut tiles = buffers::<2>();
        let field = hole_at_10_10(&mut tiles);
        assert_eq!(beside(&field, at(8.99, 10.5)).fade, 1.0);
        assert_eq!(beside(&field, at(10.5, 10.5)).fade, 0.0);
        assert_eq!(beside(&field, at(-3.0, 5.0)).fade, 0.0);
    }

    #[test]
    fn missing_tile_is_reported() {
        let mut tiles = buffers::<2>();
        let field = Field::<2>::empty(&mut tiles, FieldSize::new(100, 100), |_, _| 0.0);
        let mut budget = Budget::new(0);
        let there = beside_patches(&field.window, &at(40.5, 5.5), &mut budget);
        let missing = budget.missing();
        assert_eq!((there.fade, missing), (0.0, Some(TileIndex::new(1, 0))));
    }

    #[test]
    fn force_stays_full_over_patches_near_the_proxy() {
        let mut tiles = buffers::<2>();
        let field = hole_at_10_10(&mut tiles);
        let over_patch = |hip: GridPoint, proxy| {
            let target = target(&field.window, &hip, proxy, &mut Budget::new(0));
            (target.over_patch, target.fade)
        };
        let proxy = Cell::new(8, 10);
        assert_eq!(over_patch(at(8.5, 10.5), proxy), (true, 1.0), "its own");
        assert_eq!(over_patch(at(8.5, 9.5), proxy), (true, 1.0), "another");
        assert_eq!(over_patch(at(39.0, 9.5), proxy), (false, 1.0), "a far one");
        // Exactly on the border of no-data the full force is rendered, but not beyond.
        assert_eq!(over_patch(at(9.0, 10.5), proxy), (false, 1.0), "a border");
    }

    #[test]
    fn edge_fade_is_continuous_across_every_border() {
        let mut tiles = buffers::<2>();
        let field = hole_at_10_10(&mut tiles);
        let mut last = beside(&field, at(7.0, 9.2)).fade;
        let steps = cases(6000, 300);
        let step = 6.0 / steps as f32;
        for i in 1..=steps {
            let now = beside(&field, at(7.0 + i as f32 * step, 9.2)).fade;
            assert!((now - last).abs() < 3.0 * step, "at {i}");
            last = now;
        }
        assert!((beside(&field, at(40.25, 5.0)).fade - 0.5).abs() < 1e-6);
    }

    /// Milliseconds until the force ends for a HIP that moved over no-data, and the maximum change
    /// of the edge fade in a tick.
    fn faded_after(khz: u32) -> (f32, f32) {
        let mut tiles = buffers::<2>();
        let field = hole_at_10_10(&mut tiles);
        let rate = TickRate::new(1_000 * khz).expect("in range");
        let mut contact = Contact::new(ContactSettings::AT_1_KHZ.at_rate(rate));
        let mut step = |hip: GridPoint| {
            let output = *contact.step(&field.window, &hip);
            (output.state, contact.edge_fade())
        };
        let above = GridPoint::new([0; 3], Vec3::new(8.5, 10.5, 1.0));
        assert_eq!(step(above).0, ContactState::Free);
        assert_eq!(step(at(8.5, 10.5)).0, ContactState::Touching);
        let (mut last, mut max_change, mut ticks) = (1.0, 0.0f32, 0);
        while let (ContactState::Touching, fade) = step(at(10.5, 10.5)) {
            max_change = max_change.max(last - fade);
            last = fade;
            ticks += 1;
        }
        (ticks as f32 / khz as f32, max_change)
    }

    #[test]
    fn edge_fade_time_is_independent_of_the_tick_rate() {
        for khz in [1, 2, 5, 10] {
            let (ms, max_change) = faded_after(khz);
            assert!((30.9..=32.1).contains(&ms), "{khz} kHz: {ms} ms");
            assert!(
                max_change <= 1.001 * RATE / khz as f32,
                "{khz} kHz: {max_change}"
            );
        }
    }
}
