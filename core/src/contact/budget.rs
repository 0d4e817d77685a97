//! The budget of a tick, in work units.
//!
//! Every piece of work asks whether the budget has its units, and is put off to
//! the next tick where it has not; what is done is counted, asked for or not. So a
//! piece that did not ask shows as a tick that spent more than [`WORK_PER_TICK`]:
//! the soak's invariant and the fuzz target look for it. How many instructions of a
//! Cortex-M4F a unit stands for is measured; the table is
//! `bench/instructions-m4f.csv`.

use crate::grid::Cell;
use crate::rate::TickRate;
use crate::terrain::TileIndex;

/// Units of work a tick may spend at 1 kHz, and at any rate at most.
///
/// A unit takes at most 390 cycles of a NUCLEO-G474RE by the model of docs/reference/cycles.md, and all else
/// of the costliest tick 23,000. With 300 units that is less than the 168,000 cycles of a
/// millisecond, which a test of the images holds it to.
pub const WORK_PER_TICK: u32 = 300;
/// Units of work that a tick may spend from 2 kHz on: what the costliest have time for at 10 kHz.
const LEAST_WORK_PER_TICK: u32 = 86;

/// Units of work that a tick may spend at a rate.
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
        LEAST_WORK_PER_TICK
    }
}

/// Units for following the proxy within its patch by the shortcut.
pub(super) const FAST_PATH: u32 = 2;
/// Units for arriving at a patch: its corners, and whether the way leads off.
pub(super) const ARRIVAL: u32 = 6;
/// Units for the closest point of a convex patch.
pub(super) const CONVEX: u32 = 4;
/// Units for the closest point of so many rulings.
#[inline]
pub(super) const fn rulings(looked: u32) -> u32 {
    looked + looked.div_ceil(3)
}
/// Units for beginning a search by rulings.
pub(super) const RULINGS: u32 = 8;
/// Units for the slope of the distance into one patch.
pub(super) const SLOPE: u32 = 3;
/// Units for a look at the cone of friction.
pub(super) const LOOK: u32 = 3;
/// Units for the direction and the end of a straight way with friction.
pub(super) const DIRECTION: u32 = 9;
/// Units for asking whether a box is clear.
pub(super) const BOX: u32 = 4;
/// Units for a cell whose patch is intersected with a path.
pub(super) const INTERSECTION: u32 = 8;

/// Units for arriving at a patch on a border, and asking its four neighbours.
pub(super) const ON_BORDER: u32 = ARRIVAL + 4 * SLOPE;
/// Units of the largest piece of work. A tick that put work off has spent more than its budget
/// less this.
pub const MAX_PIECE: u32 = ON_BORDER;

/// Work of a tick, its bound, and the missing terrain.
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

    /// Returns true if so many units are left.
    #[must_use]
    #[inline]
    pub(super) const fn has(&self, units: u32) -> bool {
        self.spent + units <= self.limit
    }

    /// Counts work that is done.
    #[inline]
    pub(super) const fn spend(&mut self, units: u32) {
        self.spent += units;
    }

    /// Notes that the tile of a cell is not here.
    #[cold]
    pub(super) fn lacks(&mut self, cell: Cell) {
        self.missing.get_or_insert(TileIndex::holding(cell));
    }

    /// The first tile that was looked for and is not here.
    pub(super) const fn missing(&self) -> Option<TileIndex> {
        self.missing
    }

    /// Rulings for which units are left.
    pub(super) const fn left_for_rulings(&self) -> u32 {
        self.limit.saturating_sub(self.spent) / 4 * 3
    }

    /// Spent units.
    pub(super) const fn spent(&self) -> u32 {
        self.spent
    }
}
