//! Count of departures from the surface for one HIP: rounding could repeat them without end.

use crate::contact::closest_point::{DepartureRule, position_on};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::GridPoint;
use crate::terrain::Window;

/// Maximum number of departures that bring the proxy no nearer to the HIP. After that it must not
/// leave the surface: rounding only moves it back and forth.
const MAX_FRUITLESS_DEPARTURES: u32 = 32;

/// The departures from the surface since the HIP last had the proxy on it; `None` if there were
/// none.
pub(super) type Departures = Option<Departed>;

#[derive(Clone, Copy, Debug)]
pub(super) struct Departed {
    /// The place nearest to the HIP from which the proxy left.
    nearest: GridPoint,
    /// Departures since then from places that were no nearer.
    fruitless: u32,
}

/// Counts a departure, and compares it with the nearest one before.
pub(super) fn count_departure(departures: &mut Departures, from: GridPoint, view: &HipView) {
    let Some(before) = departures else {
        *departures = Some(Departed {
            nearest: from,
            fruitless: 0,
        });
        return;
    };
    if view.is_nearer(&from, &before.nearest) {
        (before.nearest, before.fruitless) = (from, 0);
    } else {
        before.fruitless += 1;
    }
}

/// Returns the places where a proxy that has hit the surface may leave it again.
pub(super) fn departure_rule<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    hit: SurfacePoint,
    departures: &Departures,
) -> DepartureRule {
    let is_nearer = |before: &GridPoint| {
        position_on(window, &hit).is_some_and(|position| view.is_nearer(&position, before))
    };
    match departures {
        Some(before) if before.fruitless >= MAX_FRUITLESS_DEPARTURES => {
            DepartureRule::Forbidden(hit)
        }
        Some(before) if !is_nearer(&before.nearest) => DepartureRule::ExceptAt(hit),
        _ => DepartureRule::Anywhere,
    }
}
