//! The proxy's way over gentle ground: from patch to patch, where the squared
//! distance is convex in each.
//!
//! A convex distance has one minimum in a patch, and a point of the border from
//! which downhill leads out of the patch is that minimum. So the way that
//! [`super::descent`] would search is known: to the edge, across it, and on; or
//! to rest on the edge where downhill leads back from the other side, too; and
//! over a corner, where the patches beside it lead on into the same one.
//! Wherever that is not certain the general search decides.

use glam::Vec3;

use super::descent::leaves;
use super::exit::{Exit, LEVEL, beyond, on_edge, over_border};
use super::gentle::Gentle;
use super::spot::{Hand, Spot, is_inside, tile_of};
use super::track::Track;
use crate::terrain::{Ground, Window};

/// Patches entered at most in one tick.
pub(super) const HOPS: u32 = 4;

/// Where a way over gentle ground ends.
pub(super) struct Rest {
    /// From the hand to the proxy, cells.
    pub(super) stretch: Vec3,
    /// Patches entered.
    pub(super) hops: u32,
}

/// Moves a proxy that rests on a track to where it rests now; `None`, and the
/// track as it was, where it takes the general search to tell.
///
/// # Errors
/// The tile (column, row) on its way that is not here.
#[inline]
pub(super) fn glide<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    track: &mut Track,
) -> Result<Option<Rest>, [i32; 2]> {
    // The patch entered last, most often none or one, and where.
    let (mut entered, mut from) = (None, track.spot);
    for hops in 0..HOPS {
        let gentle = entered.as_ref().unwrap_or(&track.gentle);
        let (spot, stretch) = match within(window, hand, gentle, &from, entered.is_some()) {
            None => return Ok(None),
            Some(Within::Inside(spot, stretch)) => (spot, stretch),
            Some(Within::OnBorder(exit)) => match onward(window, hand, &exit)? {
                Onward::Into(there, beyond) => {
                    (entered, from) = (Some(beyond), there.at);
                    continue;
                }
                Onward::Rests => (exit.at, hand.stretch(&exit.at, exit.z)),
                Onward::Unclear => return Ok(None),
            },
        };
        if !track.is_under(window, hand.column(), spot.cell)? {
            return Ok(None);
        }
        track.rests_at(spot, entered);
        return Ok(Some(Rest { stretch, hops }));
    }
    Ok(None)
}

/// Where a patch's own minimum of the distance is.
enum Within {
    /// Here, this far from the hand.
    Inside(Spot, Vec3),
    /// On the border; beyond it downhill goes on as far as this patch can tell.
    OnBorder(Exit),
}

/// The minimum of a patch, where the distance is sure to be convex and the way to
/// the hand leads into the ground: from a spot of it, at which it was `entered` or
/// rested.
#[inline(never)]
fn within<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    gentle: &Gentle,
    from: &Spot,
    entered: bool,
) -> Option<Within> {
    let patch = gentle.seen_by(hand);
    let (p, q) = hand.in_patch(from.cell);
    let above = patch.polynomial(p, q);
    let stays = if from.faces((p, q)) {
        from.stays(&patch, (p, q), above)
    } else {
        // The patches back there have their minima on the borders of this one.
        entered || !leaves(window, hand, from, &patch)
    };
    if !stays {
        return None;
    }
    let (mut to, mut is_exact) = gentle.guess(&patch, (p, q), above, from);
    loop {
        let (u, v) = (p + to.x, q + to.y);
        if !(is_inside(u) && is_inside(v)) {
            let exit = over_border(gentle, &patch, (p, q), from.cell, beyond((u, v)));
            if is_exact || exit.is_some() {
                return exit.map(Within::OnBorder);
            }
        } else if is_exact {
            let convex = gentle.is_convex(to.z) || gentle.is_convex_between(from, to.z, (u, v));
            let at = Spot {
                cell: from.cell,
                u,
                v,
            };
            return (to.z >= 0.0 && convex).then_some(Within::Inside(at, to));
        }
        (to, is_exact) = (gentle.by_newton(&patch, (p, q), (to.x, to.y))?, true);
    }
}

/// Where downhill goes from a patch's minimum on its border.
enum Onward {
    /// By this way into that patch.
    Into(Exit, Gentle),
    /// Not at all: it leads back from the other side, too.
    Rests,
    Unclear,
}

/// How downhill goes on from there.
#[inline(always)]
fn onward<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    exit: &Exit,
) -> Result<Onward, [i32; 2]> {
    let there = if exit.is_corner() {
        best_way(window, hand, exit)?
    } else {
        Some(exit.across())
    };
    let Some(there) = there else {
        return Ok(Onward::Unclear);
    };
    let Some(beyond) = enter(window, there.at.cell)? else {
        return Ok(Onward::Unclear);
    };
    // Over a corner it is known to fall.
    if there.is_corner() {
        return Ok(Onward::Into(there, beyond));
    }
    let slope = there.slope(&beyond.patch, hand.in_patch(there.at.cell));
    Ok(match () {
        () if slope < -LEVEL => Onward::Into(there, beyond),
        () if slope > LEVEL && !exit.is_corner() => Onward::Rests,
        () => Onward::Unclear,
    })
}

/// A patch, if it is one to glide over.
#[inline(always)]
fn enter<const D: usize>(
    window: &Window<'_, D>,
    cell: [i32; 2],
) -> Result<Option<Gentle>, [i32; 2]> {
    match window.ground(cell) {
        Ground::Patch(corners) => Ok(Gentle::new(&corners)),
        Ground::Hole => Ok(None),
        Ground::Missing => Err(tile_of(cell)),
    }
}

/// The way on from a corner from which downhill leads out over both edges: over
/// the corner, if the patches beside it have nothing nearer to offer than their
/// edges to the patch there; into one of them, if the other rises.
#[inline(never)]
fn best_way<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    corner: &Exit,
) -> Result<Option<Exit>, [i32; 2]> {
    let mut best = corner.across();
    let [east, north] = corner.edges();
    for (aside, onward) in [(east, north), (north, east)] {
        let cell = corner.at.neighbour(aside);
        let Some(gentle) = enter(window, cell)? else {
            return Ok(None);
        };
        let (patch, place) = (gentle.seen_by(hand), hand.in_patch(cell));
        let exit = on_edge(&gentle, &patch, place, cell, onward);
        if exit.is_some_and(|exit| !exit.is_corner()) {
            continue;
        }
        let rises = corner.over(aside).slope(&patch, place) > LEVEL;
        if !(rises && gentle.is_convex(corner.z) && best.is_corner()) {
            return Ok(None);
        }
        best = corner.over(onward);
    }
    Ok(Some(best))
}

#[cfg(test)]
#[path = "glide_tests.rs"]
mod tests;
