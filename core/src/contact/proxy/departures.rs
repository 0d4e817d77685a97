//! Count of departures from the surface for one HIP: by rounding there could be no end of them.

use crate::contact::closest_point::{Leave, position_on};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::GridPoint;
use crate::terrain::Window;

/// After so many departures without getting nearer to the HIP the proxy may leave the
/// surface no more: it only moves to and fro by rounding.
const DEPARTURES: u32 = 32;

/// The departures from the surface since the HIP last found the proxy on it, if there was
/// one.
pub(super) type Departures = Option<Departed>;

#[derive(Clone, Copy, Debug)]
pub(super) struct Departed {
    /// The place nearest to the HIP from which the proxy has left.
    nearest: GridPoint,
    /// Departures since from where it was no nearer.
    in_vain: u32,
}

/// Counts a departure, and how it compares with the nearest one before.
pub(super) fn count_departure(departures: &mut Departures, from: GridPoint, view: &HipView) {
    let Some(before) = departures else {
        *departures = Some(Departed {
            nearest: from,
            in_vain: 0,
        });
        return;
    };
    if view.is_nearer(&from, &before.nearest) {
        (before.nearest, before.in_vain) = (from, 0);
    } else {
        before.in_vain += 1;
    }
}

/// Returns the place where a proxy that has hit the surface may leave it again.
pub(super) fn may_leave<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    hit: SurfacePoint,
    departures: &Departures,
) -> Leave {
    let is_nearer = |before: &GridPoint| {
        position_on(window, &hit).is_some_and(|position| view.is_nearer(&position, before))
    };
    match departures {
        Some(before) if before.in_vain >= DEPARTURES => Leave::NoMore(hit),
        Some(before) if !is_nearer(&before.nearest) => Leave::ButAt(hit),
        _ => Leave::Anywhere,
    }
}
