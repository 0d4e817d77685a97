//! Counts of a run's ticks by the ground under the hand.

use hapterra_core::contact::ContactState;
use hapterra_core::guard::Limits;
use hapterra_core::scene::TickRecord;

/// Counts of ticks. Every tick that the device reports is counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TickCounts {
    /// Ticks of the hand's motion; in all of them the HIP is below the surface.
    pub(super) ticks: u32,
    /// Ticks whose terrain was not on the device yet, nor any coarser one.
    pub(super) missing: u32,
    /// Ticks over a fallback, or over a tile that blends from it.
    pub(super) coarse: u32,
    /// Ticks without a contact, though nothing was missing.
    pub(super) free: u32,
}

impl TickCounts {
    /// Counts a tick.
    pub(super) fn add(&mut self, sample: &TickRecord) {
        self.ticks += 1;
        let is_missing = lacks_terrain(sample);
        self.missing += u32::from(is_missing);
        let is_coarse = sample.limits.contains(Limits::TERRAIN_COARSE);
        self.coarse += u32::from(!is_missing && is_coarse);
        self.free += u32::from(!is_missing && sample.state == ContactState::Free);
    }
}

/// Returns true if terrain near the HIP was not on the device: no-data in the rendered surface.
pub(super) fn lacks_terrain(sample: &TickRecord) -> bool {
    sample.limits.contains(Limits::TERRAIN_MISSING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tick_counts_as_missing_touching_coarse_or_free() {
        let sample = |limits, state| TickRecord {
            limits,
            state,
            ..TickRecord::default()
        };
        let mut counts = TickCounts::default();
        let fading = Limits::EDGE_FADING;
        counts.add(&sample(Limits::empty(), ContactState::Touching));
        counts.add(&sample(fading, ContactState::Touching));
        counts.add(&sample(Limits::TERRAIN_COARSE, ContactState::Touching));
        counts.add(&sample(
            fading | Limits::TERRAIN_MISSING,
            ContactState::Touching,
        ));
        counts.add(&sample(Limits::TERRAIN_MISSING, ContactState::Free));
        counts.add(&sample(Limits::empty(), ContactState::Free));
        let expected = TickCounts {
            ticks: 6,
            missing: 2,
            coarse: 1,
            free: 1,
        };
        assert_eq!(counts, expected);
    }
}
