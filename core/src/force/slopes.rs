//! The slopes of the surface, and slopes that change gradually from patch to patch (after
//! Morgenbesser and Srinivasan 1996).
//!
//! The eastward slope of a patch interpolates between its two edges that lead east, so it is
//! continuous northward and jumps from one edge of a row to the next. Each row of edges is
//! therefore smoothed along itself. At a sample its direction is the mean of the two edges that
//! meet there; away from the sample it approaches that of the edge. A gentle bend uses the whole
//! edge for this, a sharp bend, which is intended, a fifth of it. Columns and the northward slope
//! are smoothed in the same way.

use crate::contact::surface::HipView;
use crate::contact::surface::patch::mix;
use crate::grid::GridPoint;
use crate::scalar::one_over_root;
use crate::terrain::{CellContent, Corners, TileIndex, Window};

/// Cosine of the maximum bend at which the direction changes along a whole edge: 45°.
const GENTLE: f32 = core::f32::consts::FRAC_1_SQRT_2;
/// Cosine of the minimum bend at which the direction changes along [`NARROW`] of an edge: 75°.
const SHARP: f32 = 0.258_819_04;
/// Part of an edge along which the direction changes at a sharp bend.
const NARROW: f32 = 0.2;

/// Slopes eastward and northward: ∂z/∂x and ∂z/∂y.
pub(crate) type Slopes = [f32; 2];

/// Slopes of the surface at one of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SlopesAt {
    /// Minimum and maximum slope eastward of the patches that meet there.
    pub(crate) east: [f32; 2],
    /// Minimum and maximum slope northward of the patches that meet there.
    pub(crate) north: [f32; 2],
    /// Slopes that change gradually from patch to patch.
    pub(crate) smoothed: Slopes,
    /// A missing tile that contains a sample beside the patch. The surface then counts as ending
    /// before it.
    pub(crate) missing: Option<TileIndex>,
}

impl SlopesAt {
    /// Returns the slopes at a point of the surface, from the samples of a patch and of its four
    /// neighbours; `None` if there is no patch.
    pub(crate) fn point<const D: usize>(window: &Window<'_, D>, at: &GridPoint) -> Option<Self> {
        let view = HipView::new(*at);
        let (cell, CellContent::Patch(own)) = view.ground(window) else {
            return None;
        };
        let (u, v) = view.in_patch(cell);
        let mut missing = None;
        let mut beside = |east, north| {
            let there = cell.offset(east, north);
            window.corners(there).unwrap_or_else(|| {
                missing = Some(TileIndex::containing(there));
                Corners::NONE
            })
        };
        let south = beside(0, -1).above(own.base);
        let north = beside(0, 1).above(own.base);
        let west = beside(-1, 0).above(own.base);
        let east = beside(1, 0).above(own.base);
        let [sw, se, nw, ne] = own.heights;
        let rows = [
            Edges::between([west[0], sw, se, east[1]]),
            Edges::between([west[2], nw, ne, east[3]]),
        ];
        let columns = [
            Edges::between([south[0], sw, nw, north[2]]),
            Edges::between([south[1], se, ne, north[3]]),
        ];
        Some(Self {
            east: slope_range(&rows, u, v),
            north: slope_range(&columns, v, u),
            smoothed: [smoothed(&rows, u, v), smoothed(&columns, v, u)],
            missing,
        })
    }
}

/// The slopes of three consecutive edges of a row or column; NaN if an edge is missing.
struct Edges {
    before: f32,
    own: f32,
    after: f32,
}

impl Edges {
    fn between([first, from, to, last]: [f32; 4]) -> Self {
        Self {
            before: from - first,
            own: to - from,
            after: last - to,
        }
    }

    /// Returns the smoothed slope at a place of the middle edge, from 0 to 1.
    fn smoothed(&self, place: f32) -> f32 {
        let own = direction(self.own);
        let at_start = direction_change(own, self.before, place);
        let at_end = direction_change(own, self.after, 1.0 - place);
        (own[1] + at_start[1] + at_end[1]) / (own[0] + at_start[0] + at_end[0])
    }
}

/// Returns the change of an edge's direction at a distance `place` from the sample where it meets
/// an edge of the slope `beside`.
fn direction_change(own: [f32; 2], beside: f32, place: f32) -> [f32; 2] {
    if beside.is_nan() {
        return [0.0; 2];
    }
    let other = direction(beside);
    let bend = own[0] * other[0] + own[1] * other[1];
    let reach = NARROW + (1.0 - NARROW) / (GENTLE - SHARP) * (bend - SHARP);
    let share = 0.5 * (1.0 - place / reach.clamp(NARROW, 1.0));
    if share > 0.0 {
        [share * (other[0] - own[0]), share * (other[1] - own[1])]
    } else {
        [0.0; 2]
    }
}

/// Returns the direction of a slope: along the ground and up, of length 1.
fn direction(slope: f32) -> [f32; 2] {
    let along = one_over_root(1.0 + slope * slope);
    [along, slope * along]
}

/// Returns the smoothed slope across a patch between two rows or columns of edges.
fn smoothed([first, second]: &[Edges; 2], along: f32, across: f32) -> f32 {
    mix(first.smoothed(along), second.smoothed(along), across)
}

/// Returns the minimum and maximum slope at a place of a patch; on the border between edges, those
/// of both edges.
fn slope_range([first, second]: &[Edges; 2], along: f32, across: f32) -> [f32; 2] {
    let own = mix(first.own, second.own, across);
    if along != 0.0 {
        return [own; 2];
    }
    let before = match across {
        0.0 => first.before,
        1.0 => second.before,
        _ => mix(first.before, second.before, across),
    };
    // NaN if there is no patch; then only its own slope remains.
    [own.min(before), own.max(before)]
}
