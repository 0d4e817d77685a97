//! Replay: points from the host in place of the arm, amplifiers off.

use glam::Vec3;

use crate::guard::GuardOutputs;
use crate::haptics::Haptics;
use crate::tick::{Outcome, write_empty, write_output};

impl<const D: usize> Haptics<'_, D> {
    /// Runs one tick. It is repeated until the point is rendered with all of its terrain; only then
    /// is the point answered.
    pub(crate) fn tick_point(&mut self, outcome: &mut Outcome) {
        outcome.drive = GuardOutputs::default();
        outcome.answered_seq = None;
        let sample = &mut outcome.sample;
        let mut force_n = Vec3::ZERO;
        if let (Some(scene), Some(point)) = (&self.scene, self.point) {
            force_n = self.renderer.step_to_point(&self.window, scene, point.hip);
            write_output(point.hip, &self.renderer, sample);
            if self.renderer.is_done() {
                outcome.answered_seq = Some(point.seq);
                self.point = None;
            }
        } else {
            write_empty(sample);
        }
        self.write_state(force_n, sample);
    }
}
