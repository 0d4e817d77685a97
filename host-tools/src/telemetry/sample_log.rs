//! A session's samples as they come: each becomes a row of a recording.

use hapterra_core::scene::Sample;
use hapterra_core::wire::hello::DeviceHello;

use super::figures::Figures;
use super::timeline::Timeline;
use crate::replay::Record;
use crate::terrain::Terrain;

/// Keeps time and figures of the samples that were felt on a terrain.
pub struct SampleLog<'t> {
    terrain: &'t Terrain<'t>,
    tick_hz: u32,
    timeline: Timeline,
    figures: Figures,
}

impl<'t> SampleLog<'t> {
    /// An empty log for a terrain and the device that feels it.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, device: &DeviceHello) -> Self {
        Self {
            terrain,
            tick_hz: device.tick_hz,
            timeline: Timeline::new(device.tick_hz),
            figures: Figures::default(),
        }
    }

    /// Takes a sample; the row that it makes, mm and s since the beginning.
    pub fn take(&mut self, sample: &Sample) -> Record {
        let mut record = Record::of_tick(sample, self.tick_hz, self.terrain.scale());
        record.t_s = self.timeline.at(sample);
        self.figures.take(sample, &record, self.terrain);
        record
    }

    /// Ticks run since the beginning, over all restarts of the device.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.timeline.ticks()
    }

    /// Time since the beginning, over all restarts of the device, s.
    #[must_use]
    pub fn t_s(&self) -> f64 {
        self.timeline.ticks() as f64 / f64::from(self.tick_hz.max(1))
    }

    /// The figures so far.
    #[must_use]
    pub fn figures(&self) -> Figures {
        self.figures
    }
}
