//! Log of a session's samples: each becomes a row of a recording.

use hapterra_core::scene::TickRecord;
use hapterra_core::wire::hello::DeviceHello;

use super::figures::Figures;
use super::placements::{Placements, SessionPlacement};
use super::timeline::Timeline;
use crate::replay::Record;
use crate::terrain::Terrain;

/// Time and figures of the samples rendered on a terrain.
pub struct SampleLog<'t> {
    views: Placements<'t>,
    /// Index of the latest sample's placement.
    view: usize,
    tick_hz: u32,
    timeline: Timeline,
    figures: Figures,
}

impl<'t> SampleLog<'t> {
    /// Creates an empty log for a terrain and its device.
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

    /// Adds a sample; returns its row, mm and s since the beginning.
    pub fn add(&mut self, sample: &TickRecord) -> Record {
        self.view = self.views.index_of(sample);
        let terrain = &self.views.get(self.view).terrain;
        let mut record = Record::of_tick(sample, self.tick_hz, terrain.scale());
        record.t_s = self.timeline.at(sample);
        self.figures.add(sample, &record, terrain);
        record
    }

    /// Returns all placements.
    pub const fn views(&mut self) -> &mut Placements<'t> {
        &mut self.views
    }

    /// Returns the placements alone.
    #[must_use]
    pub fn into_views(self) -> Placements<'t> {
        self.views
    }

    /// Returns the placement of the latest sample and its index, from 0.
    #[must_use]
    pub fn view(&self) -> (usize, &SessionPlacement<'t>) {
        (self.view, self.views.get(self.view))
    }

    /// Returns the number of ticks since the beginning, over all restarts of the device.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.timeline.ticks()
    }

    /// Returns the time since the beginning, over all restarts of the device, s.
    #[must_use]
    pub fn t_s(&self) -> f64 {
        self.timeline.ticks() as f64 / f64::from(self.tick_hz.max(1))
    }

    /// Returns the time of a tick since the latest restart, as time since the beginning, s.
    #[must_use]
    pub fn t_s_of(&self, tick: u32) -> f64 {
        self.timeline.t_s_of(tick)
    }

    /// Returns the present figures.
    #[must_use]
    pub fn figures(&self) -> Figures {
        self.figures
    }
}
