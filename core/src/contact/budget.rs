//! How much one tick may do, counted in units of work.
//!
//! Every piece of work asks whether the budget has its units, and is put off to
//! the next tick where it has not; what is done is counted, asked for or not. So a
//! piece that did not ask shows as a tick that spent more than [`WORK_PER_TICK`]:
//! the soak's invariant and the fuzz target look for it. How many instructions of a
//! Cortex-M4F a unit stands for is measured; the table is
//! `bench/instructions-m4f.csv`.

/// Units of work a tick may spend.
pub const WORK_PER_TICK: u32 = 86;

/// Units for following the proxy within its patch by the shortcut.
pub(super) const SHORTCUT: u32 = 2;
/// Units for arriving at a patch: its corners, and whether the way leads off.
pub(super) const ARRIVAL: u32 = 6;
/// Units for the closest point of a convex patch.
pub(super) const CONVEX: u32 = 4;
/// Units for the closest point of one ruling.
pub(super) const RULING: u32 = 4;
/// Units for the slope of the distance into one patch.
pub(super) const SLOPE: u32 = 3;
/// Units for asking whether a box is clear.
pub(super) const BOX: u32 = 4;
/// Units for halving a path.
pub(super) const HALF: u32 = 4;
/// Units for a block that a path is looked along over.
pub(super) const BLOCK: u32 = 2;
/// Units for a block whose cells are looked at.
pub(super) const BLOCK_CELLS: u32 = 3;
/// Units for a cell that a path is looked along over.
pub(super) const CELL: u32 = 2;
/// Units for the cells beside one of a hole.
pub(super) const BESIDE: u32 = 1;
/// Units for the height of a path over a cell.
pub(super) const GAP: u32 = 1;
/// Units for a cell whose patch is intersected with a path.
pub(super) const INTERSECTION: u32 = 8;

/// Units of the largest piece of work: arriving at a patch on a border, and asking its four
/// neighbours; the cone of friction asks as much. A tick that put work off has spent more
/// than [`WORK_PER_TICK`] less this.
pub const LARGEST_PIECE: u32 = ARRIVAL + 4 * SLOPE;

/// What a tick has spent, and what it may.
#[derive(Debug)]
pub(super) struct Budget {
    spent: u32,
    limit: u32,
}

impl Budget {
    pub(super) const fn new(limit: u32) -> Self {
        Self { spent: 0, limit }
    }

    /// Whether so many units are left.
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

    /// Units spent so far.
    pub(super) const fn spent(&self) -> u32 {
        self.spent
    }
}
