//! The budget of a tick, in work units.
//!
//! Each operation first checks that the budget has its work units, and waits for the next tick if
//! not. All work is counted, with or without this check, so a missing check shows as a tick that
//! spent more than [`WORK_PER_TICK`]; the randomised stress test and the fuzz target look for such
//! ticks. `bench/instructions-m4f.csv` lists the measured instructions of a Cortex-M4F for each
//! unit.

use crate::grid::Cell;
use crate::rate::TickRate;
use crate::terrain::TileIndex;

/// Work units that a tick may spend at 1 kHz, the largest budget of any rate.
///
/// A unit takes at most 390 cycles of a NUCLEO-G474RE by the model of docs/reference/cycles.md, and
/// everything else in the costliest tick 23,000. With 300 units that is less than the 168,000
/// cycles of a millisecond; a test of the images checks this.
pub const WORK_PER_TICK: u32 = 300;
/// Work units of a tick from 2 kHz on: the number that fits into the costliest tick at 10 kHz.
const MIN_WORK_PER_TICK: u32 = 86;

/// Returns the work units that a tick may spend at a rate.
///
/// ```
/// use hapterra_core::contact::work_per_tick;
/// use hapterra_core::rate::TickRate;
///
/// let at = |hz| TickRate::new(hz).map(work_per_tick);
/// assert_eq!([at(1_000), at(2_000), at(10_000)], [Some(300), Some(86), Some(86)]);
/// ```
#[must_use]
pub const fn work_per_tick(rate: TickRate) -> u32 {
    if rate.hz() < 2_000 {
        WORK_PER_TICK
    } else {
        MIN_WORK_PER_TICK
    }
}

/// Units for following the proxy within its patch by the fast path.
pub(super) const FAST_PATH: u32 = 2;
/// Units for entering a patch: its corners, and the check whether the path to the HIP leads off.
pub(super) const PATCH_ENTRY: u32 = 6;
/// Units for the closest point of a convex patch.
pub(super) const CONVEX: u32 = 4;
/// Returns the units for the closest points of `evaluated` rulings.
#[inline]
pub(super) const fn rulings(evaluated: u32) -> u32 {
    evaluated + evaluated.div_ceil(3)
}
/// Units for the start of a search by rulings.
pub(super) const RULINGS: u32 = 8;
/// Units for the slope of the distance into one patch.
pub(super) const SLOPE: u32 = 3;
/// Units for one evaluation of the friction cone.
pub(super) const CONE_EVALUATION: u32 = 3;
/// Units for the direction and the end of a straight path with friction.
pub(super) const DIRECTION: u32 = 9;
/// Units for the check that a box is clear.
pub(super) const BOX: u32 = 4;
/// Units for the intersection of a path with the patch of a cell.
pub(super) const INTERSECTION: u32 = 8;

/// Units for entering a patch on a border, and for the slopes into its four neighbours.
pub(super) const BORDER_ENTRY: u32 = PATCH_ENTRY + 4 * SLOPE;
/// Units of the largest operation. A tick that postponed work has spent more than its budget minus
/// this.
pub const MAX_ATOMIC_WORK: u32 = BORDER_ENTRY;

/// Work of a tick, its limit, and the first missing tile.
#[derive(Debug)]
pub(super) struct Budget {
    spent: u32,
    limit: u32,
    missing: Option<TileIndex>,
}

impl Budget {
    pub(super) const fn new(limit: u32) -> Self {
        Self {
            spent: 0,
            limit,
            missing: None,
        }
    }

    /// Returns true if `units` work units are left.
    #[must_use]
    #[inline]
    pub(super) const fn has(&self, units: u32) -> bool {
        self.spent + units <= self.limit
    }

    /// Counts completed work.
    #[inline]
    pub(super) const fn spend(&mut self, units: u32) {
        self.spent += units;
    }

    /// Records that the tile of a cell is missing.
    #[cold]
    pub(super) fn record_missing(&mut self, cell: Cell) {
        self.missing.get_or_insert(TileIndex::containing(cell));
    }

    /// Returns the first tile that the tick needed and that was missing.
    pub(super) const fn missing(&self) -> Option<TileIndex> {
        self.missing
    }

    /// Returns the number of rulings for which units are left.
    pub(super) const fn remaining_rulings(&self) -> u32 {
        self.limit.saturating_sub(self.spent) / 4 * 3
    }

    /// Returns the spent units.
    pub(super) const fn spent(&self) -> u32 {
        self.spent
    }
}
