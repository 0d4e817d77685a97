//! Time since the beginning of a session, over all restarts of its device.

use hapterra_core::scene::TickRecord;

/// Times of samples from their tick numbers, which restart with the device.
#[derive(Clone, Copy, Debug)]
pub struct Timeline {
    tick_hz: f64,
    before: u64,
    latest: u32,
}

impl Timeline {
    /// Creates a timeline for a device with `tick_hz` ticks a second.
    #[must_use]
    pub fn new(tick_hz: u32) -> Self {
        Self {
            tick_hz: f64::from(tick_hz.max(1)),
            before: 0,
            latest: 0,
        }
    }

    /// Returns the number of ticks since the beginning, over all restarts.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.before + u64::from(self.latest)
    }

    /// Returns the time of a sample, s.
    pub fn at(&mut self, sample: &TickRecord) -> f64 {
        if sample.tick < self.latest {
            self.before += u64::from(self.latest);
        }
        self.latest = sample.tick;
        self.t_s_of(sample.tick)
    }

    /// Returns the time of a tick since the latest restart, as time since the beginning, s.
    #[must_use]
    pub fn t_s_of(&self, tick: u32) -> f64 {
        (self.before + u64::from(tick)) as f64 / self.tick_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_continues_after_a_device_restart() {
        let mut time = Timeline::new(1000);
        let tick = |tick| TickRecord {
            tick,
            ..TickRecord::default()
        };
        let at: Vec<f64> = [1, 500, 1, 2].map(|t| time.at(&tick(t))).to_vec();
        assert_eq!(at, [0.001, 0.5, 0.501, 0.502]);
        assert_eq!(time.ticks(), 502);
    }
}
