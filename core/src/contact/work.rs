//! How much one tick may do.

/// Units of work a tick may spend; a unit is two to three hundred instructions of
/// a Cortex-M4F.
///
/// Past it the work goes on in the next tick from where it stopped. What has
/// been begun is ended: the search in a patch may go over, and so may the first
/// visit to a patch and its neighbours.
pub const WORK_PER_TICK: u32 = 27;

/// Units for coming to a patch; the evaluations there are a unit each.
pub(super) const VISIT: u32 = 2;
/// Units for asking whether a box is clear.
pub(super) const LOOK: u32 = 2;
/// Units for a cell that a sweep walks through.
pub(super) const STRIDE: u32 = 2;

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

    /// Begins a visit to a patch; `false` when no unit was left.
    #[must_use]
    pub(super) fn visit(&mut self) -> bool {
        self.must_end = self.left == WORK_PER_TICK;
        self.take(VISIT)
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
