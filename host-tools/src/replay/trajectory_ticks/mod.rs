//! A trajectory in the ticks of a device, by the rule of `hapterra_touch::ticks`.

mod remarks;
#[cfg(test)]
mod tests;

pub use hapterra_touch::ticks::{Pace, Tick};
use hapterra_touch::ticks::{TickError, Ticks};

use super::trajectory::{Trajectory, TrajectoryError};

/// A trajectory, read tick by tick.
pub struct TrajectoryTicks {
    ticks: Ticks<Trajectory>,
    tick_hz: u32,
}

impl TrajectoryTicks {
    /// Creates the ticks of a device with `tick_hz` ticks a second, at least 1.
    #[must_use]
    pub fn new(trajectory: Trajectory, pace: Pace, tick_hz: u32) -> Self {
        let ticks = Ticks::new(trajectory, pace, tick_hz);
        Self { ticks, tick_hz }
    }

    /// Returns the trajectory.
    pub const fn trajectory(&mut self) -> &mut Trajectory {
        self.ticks.rows()
    }

    /// Describes the relation of rows to ticks in one line; `None` if each row was a tick by its
    /// own time.
    #[must_use]
    pub fn pace(&self) -> Option<String> {
        remarks::pace(self.ticks.counts(), self.tick_hz)
    }

    /// Returns remarks on unusual times, one sentence each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        remarks::remarks(self.ticks.counts())
    }

    /// Returns the next tick; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] reports line, column and fault of a row or its time.
    pub fn next_tick(&mut self) -> Result<Option<Tick>, TrajectoryError> {
        let tick = self.ticks.next().transpose();
        tick.map_err(|error| match error {
            TickError::Row(error) => error,
            TickError::Time { fault, .. } => self.trajectory().mistimed(fault),
        })
    }
}
