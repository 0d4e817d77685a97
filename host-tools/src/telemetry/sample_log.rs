//! A session's samples as they come: each becomes a row of a recording.

use hapterra_core::scene::TickRecord;
use hapterra_core::wire::hello::DeviceHello;

use super::figures::Figures;
use super::placements::{Placements, SessionPlacement};
use super::timeline::Timeline;
use crate::replay::Record;
use crate::terrain::Terrain;

/// Keeps time and figures of the samples that were rendered on a terrain.
pub struct SampleLog<'t> {
    views: Placements<'t>,
    /// The view of the latest sample.
    view: usize,
    tick_hz: u32,
    timeline: Timeline,
    figures: Figures,
}

impl<'t> SampleLog<'t> {
    /// An empty log for a terrain and the device that feels it.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, device: &DeviceHello) -> Self {
        Self {
            views: Placements::new(terrain.clone()),
            view: 0,
            tick_hz: device.tick_hz,
            timeline: Timeline::new(device.tick_hz),
            figures: Figures::default(),
        }
    }

    /// Takes a sample; the row that it makes, mm and s since the beginning.
    pub fn take(&mut self, sample: &TickRecord) -> Record {
        self.view = self.views.index_of(sample);
        let terrain = &self.views.get(self.view).terrain;
        let mut record = Record::of_tick(sample, self.tick_hz, terrain.scale());
        record.t_s = self.timeline.at(sample);
        self.figures.take(sample, &record, terrain);
        record
    }

    /// All placements.
    pub const fn views(&mut self) -> &mut Placements<'t> {
        &mut self.views
    }

    /// The views alone.
    #[must_use]
    pub fn into_views(self) -> Placements<'t> {
        self.views
    }

    /// The view of the latest sample, counted from 0, with its terrain.
    #[must_use]
    pub fn view(&self) -> (usize, &SessionPlacement<'t>) {
        (self.view, self.views.get(self.view))
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

    /// Time of a tick of the device as it runs now, since the beginning, s.
    #[must_use]
    pub fn t_s_of(&self, tick: u32) -> f64 {
        self.timeline.t_s_of(tick)
    }

    /// Present figures.
    #[must_use]
    pub fn figures(&self) -> Figures {
        self.figures
    }
}
