//! How much one tick may do.

/// Units of work a tick may spend: a patch visited, a box asked about, or
/// three evaluations in a patch are one unit each.
///
/// Past it the work goes on in the next tick from where it stopped.
pub const WORK_PER_TICK: u32 = 64;

/// What is left of a tick's work.
#[derive(Debug)]
pub(super) struct Work {
    left: u32,
}

impl Work {
    pub(super) const fn new() -> Self {
        Self {
            left: WORK_PER_TICK,
        }
    }

    /// Takes one unit; `false` when none is left.
    #[must_use]
    pub(super) fn take(&mut self) -> bool {
        let enough = self.left > 0;
        self.left = self.left.saturating_sub(1);
        enough
    }

    /// Charges for the evaluations of one search in a patch.
    pub(super) fn charge(&mut self, evaluations: u32) {
        self.left = self.left.saturating_sub(evaluations / 3);
    }

    /// Units spent so far.
    pub(super) const fn spent(&self) -> u32 {
        WORK_PER_TICK - self.left
    }
}
