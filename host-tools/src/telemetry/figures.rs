//! Figures of a session: means and maxima.

use hapterra_core::contact::ContactState;
use hapterra_core::guard::Fault;
use hapterra_core::scene::TickRecord;

use crate::replay::Record;
use crate::terrain::Terrain;

/// Mean and maximum of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    sum: f64,
    count: u64,
    max: f64,
}

impl Mean {
    /// Adds a value, which must not be negative.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
        self.max = self.max.max(value);
    }

    /// Returns the mean; zero without values.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    /// Returns the largest value; zero without values.
    #[must_use]
    pub const fn max(&self) -> f64 {
        self.max
    }

    /// Returns the number of values.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.count
    }
}

/// Figures of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Number of samples.
    pub samples: u64,
    /// Ticks that began or ended too late, by the device's count.
    pub late: u32,
    /// Force in contact, N.
    pub force_n: Mean,
    /// Distance from HIP to proxy in contact, mm.
    pub penetration_mm: Mean,
    /// Distance of the proxy's height from the bilinear surface in `f64`, mm.
    pub height_error_mm: Mean,
    /// Cost of a tick, in counts of the device's clock.
    pub cost: Mean,
    /// The fault in the latest sample, if one was latched.
    pub fault: Option<Fault>,
}

impl Figures {
    /// Adds a sample and its record.
    pub fn add(&mut self, sample: &TickRecord, record: &Record, terrain: &Terrain<'_>) {
        self.samples += 1;
        self.late = self.late.max(sample.late);
        self.fault = sample.fault;
        if sample.tick > 1 {
            self.cost.add(f64::from(sample.cost)); // the cost of the tick before
        }
        if sample.state != ContactState::Touching {
            return;
        }
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.force_n.add(length(record.force_n));
        let [x, y, z] = record.proxy_mm;
        let depth = std::array::from_fn(|i| record.proxy_mm[i] - record.hip_mm[i]);
        self.penetration_mm.add(length(depth));
        if let Some(height) = terrain.height_mm(x, y) {
            self.height_error_mm.add((z - height).abs());
        }
    }
}
