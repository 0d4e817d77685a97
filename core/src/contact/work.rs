//! How much one tick may do.

/// Units of work a tick may spend; a unit is about a hundred instructions of a
/// Cortex-M4F.
///
/// Past it the work goes on in the next tick from where it stopped. What has
/// been begun is ended: the search in a patch may go over, and so may the first
/// visit to a patch and its neighbours.
pub const WORK_PER_TICK: u32 = 90;

/// Units for coming to a patch.
pub(super) const VISIT: u32 = 8;
/// Units that most visits take: with fewer left none is begun.
const LEAST_VISIT: u32 = 24;
/// Units for an evaluation of the distance there.
pub(super) const EVALUATION: u32 = 4;
/// Units for asking whether a box is clear.
pub(super) const LOOK: u32 = 4;
/// Units for halving a way.
pub(super) const HALF: u32 = 4;
/// Units for a block that a sweep looks along.
pub(super) const BLOCK: u32 = 2;
/// Units for one whose cells are looked at.
pub(super) const ENTER: u32 = 3;
/// Units for a cell that it looks along, and for the way's height over that.
pub(super) const CELL: u32 = 2;
pub(super) const HEIGHT: u32 = 1;
/// Units for a cell that a sweep walks through.
pub(super) const STRIDE: u32 = 8;

/// What is left of a tick's work.
#[derive(Debug)]
pub(super) struct Work {
    left: u32,
    /// The visit under way is the tick's first: it is ended whatever it takes, or
    /// the next tick would begin as this one.
    must_end: bool,
}

impl Work {
    pub(super) const fn new() -> Self {
        Self {
            left: WORK_PER_TICK,
            must_end: false,
        }
    }

    /// Takes so many units; `false` when none was left.
    #[must_use]
    pub(super) fn take(&mut self, units: u32) -> bool {
        let some = self.left > 0;
        self.charge(units);
        some
    }

    /// Begins a visit to a patch; `false` when too few units are left for most.
    #[must_use]
    pub(super) fn visit(&mut self) -> bool {
        self.must_end = self.left == WORK_PER_TICK;
        let enough = self.left >= LEAST_VISIT;
        self.charge(VISIT);
        enough
    }

    /// Whether a visit may go on.
    pub(super) const fn goes_on(&self) -> bool {
        self.left > 0 || self.must_end
    }

    /// Charges for what is done already.
    pub(super) fn charge(&mut self, units: u32) {
        self.left = self.left.saturating_sub(units);
    }

    /// Units spent so far.
    pub(super) const fn spent(&self) -> u32 {
        WORK_PER_TICK - self.left
    }
}
