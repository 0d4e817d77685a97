//! The hand: proxy, HIP, the last tick's ray, force and the trace of the last seconds.

use std::collections::VecDeque;

use anyhow::Result;
use hapterra_view_stream::Sample;
use re_sdk_types::archetypes::{Arrows3D, LineStrips3D, Points3D};
use re_sdk_types::components::Radius;

use super::ground::Ground;
use super::log::{Entry, Log};
use super::shade::Rgb;

/// Updates of the hand in a second.
const RATE_HZ: f64 = 60.0;
/// Updates of the trace in a second.
const TRACES_HZ: f64 = 10.0;
/// Length of the trace, s, and its points in a second.
const TRACE_S: f64 = 4.0;
const TRACE_HZ: f64 = 30.0;
/// Length of the arrow for a newton, device mm.
const ARROW_MM_PER_N: f64 = 14.0;
/// Height of the trace over the surface, device mm.
const FLOAT_MM: f64 = 0.15;
/// Colours.
const PROXY: Rgb = [255, 120, 20];
pub(super) const HIP: Rgb = [80, 150, 255];
const RAY: Rgb = [255, 60, 200];
const FORCE: Rgb = [255, 230, 60];
const TRACE: Rgb = [255, 170, 90];

/// Last state of the hand.
#[derive(Default)]
pub(super) struct Hand {
    /// Times of the next update of hand and trace, s.
    due_s: f64,
    trace_due_s: f64,
    point_due_s: f64,
    before: Option<Sample>,
    trace: VecDeque<(f64, [f32; 3])>,
}

/// Returns the appearance of the parts of the hand.
pub(super) fn style_entries(log: &Log, ground: &Ground) -> Result<Vec<Entry>> {
    let points = |entity: &str, colour: Rgb, width: f32| {
        let style = Points3D::update_fields()
            .with_colors([colour])
            .with_radii([Radius::new_ui_points(width)]);
        log.log_static(entity, "looks", &style)
    };
    let lines = |entity: &str, colour: Rgb, width: f32| {
        let style = LineStrips3D::update_fields()
            .with_colors([colour])
            .with_radii([Radius::new_ui_points(width)]);
        log.log_static(entity, "looks", &style)
    };
    let proxy = match ground.ball > 0.0 {
        // Its radius is sent with its positions, because it depends on the placement.
        true => {
            let style = Points3D::update_fields().with_colors([PROXY]);
            log.log_static("hand/proxy", "looks", &style)?
        }
        false => points("hand/proxy", PROXY, 8.0)?,
    };
    let arrow = Arrows3D::update_fields()
        .with_colors([FORCE])
        .with_radii([Radius::new_scene_units((0.7 * ground.per_mm) as f32)]);
    // The surface hides a HIP below it, but not its name.
    let name = Points3D::update_fields()
        .with_labels(["HIP"])
        .with_show_labels(true);
    Ok(vec![
        proxy,
        points("hand/hip", HIP, 7.0)?,
        log.log_static("hand/hip", "name", &name)?,
        lines("hand/ray", RAY, 2.0)?,
        lines("hand/trace", TRACE, 1.5)?,
        log.log_static("hand/force", "looks", &arrow)?,
    ])
}

/// Rows of one batch.
#[derive(Default)]
struct Rows {
    times_s: Vec<f64>,
    proxies: Vec<[f32; 3]>,
    /// Radii of the ball at the tip, if it is no point.
    radii: Vec<Radius>,
    hips: Vec<[f32; 3]>,
    rays: Vec<[[f32; 3]; 2]>,
    forces: Vec<[f32; 3]>,
}

impl Hand {
    /// Changes to another placement: the hand's position in the terrain jumps.
    pub(super) fn start_new_line(&mut self) {
        self.before = None;
        self.trace.clear();
    }

    /// Draws the hand 60 times a second of the samples' time.
    pub(super) fn take(
        &mut self,
        log: &Log,
        ground: &Ground,
        samples: &[Sample],
    ) -> Result<Vec<Entry>> {
        let mut rows = Rows::default();
        let mut traces = Vec::new();
        for sample in samples {
            self.leave_trace(ground, sample);
            if sample.t_s >= self.due_s {
                self.due_s = sample.t_s + 1.0 / RATE_HZ;
                rows.push(ground, sample, self.before.as_ref());
            }
            if sample.t_s >= self.trace_due_s && self.trace.len() > 1 {
                self.trace_due_s = sample.t_s + 1.0 / TRACES_HZ;
                let line: Vec<_> = self.trace.iter().map(|(_, place)| *place).collect();
                traces.push((sample.t_s, line));
            }
            self.before = Some(*sample);
        }
        let mut entries = Vec::new();
        if !rows.times_s.is_empty() {
            entries.extend(rows.entries(log)?);
        }
        if !traces.is_empty() {
            let (times, lines): (Vec<f64>, Vec<_>) = traces.into_iter().unzip();
            let strips = LineStrips3D::update_fields().with_strips(lines);
            let columns = strips.columns_of_unit_batches()?;
            entries.push(log.log_timed("hand/trace", &times, columns)?);
        }
        Ok(entries)
    }

    fn leave_trace(&mut self, ground: &Ground, sample: &Sample) {
        if sample.t_s < self.point_due_s {
            return;
        }
        self.point_due_s = sample.t_s + 1.0 / TRACE_HZ;
        let [x, y, z] = sample.proxy_mm;
        self.trace
            .push_back((sample.t_s, ground.at([x, y, z + FLOAT_MM])));
        while self
            .trace
            .front()
            .is_some_and(|(at, _)| at + TRACE_S < sample.t_s)
        {
            self.trace.pop_front();
        }
    }
}

impl Rows {
    fn push(&mut self, ground: &Ground, sample: &Sample, before: Option<&Sample>) {
        let (proxy, hip) = (ground.at(sample.proxy_mm), ground.at(sample.hip_mm));
        self.times_s.push(sample.t_s);
        self.proxies.push(proxy);
        if ground.ball > 0.0 {
            let radius = Radius::new_scene_units(ground.ball as f32);
            self.radii.push(radius);
        }
        self.hips.push(hip);
        // The loop searches for the surface between the proxy of the previous tick and the HIP.
        let from = before.map_or(hip, |before| ground.at(before.proxy_mm));
        self.rays.push([from, hip]);
        let length = (ARROW_MM_PER_N * ground.per_mm) as f32;
        self.forces
            .push(sample.force_n.map(|newtons| newtons * length));
    }

    fn entries(self, log: &Log) -> Result<[Entry; 4]> {
        let times = &self.times_s;
        let points = |entity: &str, places: &[[f32; 3]], radii: Vec<Radius>| {
            let points = Points3D::update_fields().with_positions(places.to_vec());
            let points = match radii.is_empty() {
                true => points,
                false => points.with_radii(radii),
            };
            log.log_timed(entity, times, points.columns_of_unit_batches()?)
        };
        let rays =
            LineStrips3D::update_fields().with_strips(self.rays.iter().map(|ray| ray.to_vec()));
        let arrows = Arrows3D::update_fields()
            .with_origins(self.proxies.clone())
            .with_vectors(self.forces);
        Ok([
            points("hand/proxy", &self.proxies, self.radii)?,
            points("hand/hip", &self.hips, vec![])?,
            log.log_timed("hand/ray", times, rays.columns_of_unit_batches()?)?,
            log.log_timed("hand/force", times, arrows.columns_of_unit_batches()?)?,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::super::ground::tests::scene;
    use super::*;

    /// On the ground the ball is as large as in the hand, in each placement.
    #[test]
    fn ball_is_drawn_in_its_size_and_point_as_a_dot() {
        let sample = Sample {
            t_s: 0.0,
            hip_mm: [40.0, 30.0, 0.0],
            proxy_mm: [40.0, 30.0, 0.0],
            force_n: [0.0; 3],
            ground_mm: 0.0,
            contact: false,
            cost: None,
        };
        let drawn = |tip_mm: f64, ground_m_per_mm: f64| {
            let scene = hapterra_view_stream::Scene {
                tip_mm,
                ground_m_per_mm: Some(ground_m_per_mm),
                ..scene()
            };
            let mut rows = Rows::default();
            rows.push(&Ground::new(&scene), &sample, None);
            rows.radii
        };
        assert_eq!(drawn(2.0, 60.0), [Radius::new_scene_units(120.0)]);
        assert_eq!(drawn(2.0, 30.0), [Radius::new_scene_units(60.0)]);
        assert_eq!(drawn(0.0, 60.0), []);
    }
}
