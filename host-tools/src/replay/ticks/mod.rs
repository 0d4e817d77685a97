//! A trajectory at the ticks of a device, by the rule of `hapterra_touch::ticks`.

mod counts;
#[cfg(test)]
mod tests;

use hapterra_touch::ticks;
pub use hapterra_touch::ticks::{Pace, Tick};

use super::trajectory::{Trajectory, TrajectoryError};

/// A trajectory that is read tick by tick.
pub struct Ticks {
    ticks: ticks::Ticks<Trajectory>,
    tick_hz: u32,
}

impl Ticks {
    /// The ticks of a device with `tick_hz` ticks a second, 1 at least.
    #[must_use]
    pub fn new(trajectory: Trajectory, pace: Pace, tick_hz: u32) -> Self {
        let ticks = ticks::Ticks::new(trajectory, pace, tick_hz);
        Self { ticks, tick_hz }
    }

    /// The trajectory.
    pub const fn trajectory(&mut self) -> &mut Trajectory {
        self.ticks.rows()
    }

    /// Returns what the rows were for the ticks, for the line that counts them; none where they
    /// were a tick each by their own times.
    #[must_use]
    pub fn pace(&self) -> Option<String> {
        counts::pace(self.ticks.counts(), self.tick_hz)
    }

    /// Returns what is odd about the times, a sentence each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        counts::remarks(self.ticks.counts())
    }

    /// The next tick; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] names line and column of what is wrong with a row or its time.
    pub fn next_tick(&mut self) -> Result<Option<Tick>, TrajectoryError> {
        let tick = self.ticks.next().transpose();
        tick.map_err(|error| match error {
            ticks::TickError::Row(error) => error,
            ticks::TickError::Time { fault, .. } => self.trajectory().mistimed(fault),
        })
    }
}
