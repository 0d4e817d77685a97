//! Plots over time: a row for each sample.

use anyhow::Result;
use hapterra_view_stream::{Link, Sample, Scene, TickCost};
use re_sdk_types::archetypes::{Scalars, SeriesLines};
use re_sdk_types::components::Name;

use super::log::{Entry, Log};
use super::shade::Rgb;

/// Series that share an entity, and therefore a plot: entity, then names and colours.
struct Plot {
    entity: &'static str,
    series: &'static [(&'static str, Rgb)],
}

const RED: Rgb = [240, 98, 98];
const GREEN: Rgb = [120, 214, 120];
const BLUE: Rgb = [106, 160, 255];
const AMBER: Rgb = [255, 196, 80];
const VIOLET: Rgb = [206, 148, 255];
const TEAL: Rgb = [128, 222, 204];

/// Height of HIP and surface, the file's vertical unit.
pub(super) const HEIGHT: &str = "plot/height";
/// Force: east, north, up; N.
pub(super) const FORCE: &str = "plot/force";
/// Distance from HIP to proxy, mm.
pub(super) const PENETRATION: &str = "plot/penetration";
/// Energy in the spring, and energy transferred to the hand since the beginning; mJ.
pub(super) const ENERGY: &str = "plot/energy";
/// Cost of a tick, and its bound.
pub(super) const TICK: &str = "plot/tick";
/// Tiles, kilobytes a second; samples, thousands a second.
pub(super) const LINK: &str = "plot/link";

const PLOTS: [Plot; 6] = [
    Plot {
        entity: HEIGHT,
        series: &[("HIP", BLUE), ("surface", AMBER)],
    },
    Plot {
        entity: FORCE,
        series: &[("east", RED), ("north", GREEN), ("up", BLUE)],
    },
    Plot {
        entity: PENETRATION,
        series: &[("penetration", VIOLET)],
    },
    Plot {
        entity: ENERGY,
        series: &[("in the spring", TEAL), ("added to the hand", AMBER)],
    },
    Plot {
        entity: TICK,
        series: &[("tick", TEAL), ("bound", RED)],
    },
    Plot {
        entity: LINK,
        series: &[("tiles, kB/s", BLUE), ("samples, 1000/s", GREEN)],
    },
];

/// Returns the appearance of the series.
pub(super) fn style_entries(log: &Log) -> Result<Vec<Entry>> {
    let style = PLOTS.iter().map(|plot| {
        let names = plot.series.iter().map(|(name, _)| Name::from(*name));
        let lines = SeriesLines::new()
            .with_names(names)
            .with_colors(plot.series.iter().map(|(_, colour)| *colour));
        log.log_static(plot.entity, "looks", &lines)
    });
    style.collect()
}

/// Number of samples that are plotted at once.
const BATCH_SAMPLES: usize = 200;

/// Last plotted values.
pub(super) struct Plots {
    height_per_mm: f64,
    tick: Option<TickCost>,
    /// Energy transferred to the hand since the beginning, mJ.
    gained_mj: f64,
    /// Samples that are not plotted yet.
    waiting: Vec<Sample>,
    before: Option<Sample>,
    link: Option<Link>,
}

impl Plots {
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            height_per_mm: scene.height_per_mm,
            tick: scene.tick.clone(),
            gained_mj: 0.0,
            waiting: Vec::new(),
            before: None,
            link: None,
        }
    }

    /// Changes to another placement, and plots the waiting samples of the previous one.
    ///
    /// # Errors
    /// As [`Self::finish`].
    pub(super) fn change(&mut self, log: &Log, scene: &Scene) -> Result<Vec<Entry>> {
        let remaining = self.finish(log)?;
        self.height_per_mm = scene.height_per_mm;
        // The hand's jump over the terrain was not under a force.
        self.before = None;
        Ok(remaining)
    }

    /// Plots every sample, several at a time: one entry costs a page as much as a hundred samples.
    pub(super) fn take(&mut self, log: &Log, samples: &[Sample]) -> Result<Vec<Entry>> {
        self.waiting.extend(samples);
        match self.waiting.len() < BATCH_SAMPLES {
            true => Ok(Vec::new()),
            false => self.finish(log),
        }
    }

    /// Plots the waiting samples.
    pub(super) fn finish(&mut self, log: &Log) -> Result<Vec<Entry>> {
        let samples = std::mem::take(&mut self.waiting);
        if samples.is_empty() {
            return Ok(Vec::new());
        }
        let energies: Vec<_> = samples.iter().map(|sample| self.energy(sample)).collect();
        let times: Vec<f64> = samples.iter().map(|sample| sample.t_s).collect();
        let per_mm = self.height_per_mm;
        let rows = |entity: &str, values: Vec<Vec<f64>>| series(log, entity, &times, &values);
        let heights = |s: &Sample| vec![s.hip_mm[2] * per_mm, s.ground_mm * per_mm];
        let forces = |s: &Sample| s.force_n.map(f64::from).to_vec();
        let mut entries = vec![
            rows(HEIGHT, samples.iter().map(heights).collect())?,
            rows(FORCE, samples.iter().map(forces).collect())?,
            rows(
                PENETRATION,
                samples.iter().map(|s| vec![penetration(s)]).collect(),
            )?,
            rows(ENERGY, energies)?,
        ];
        if let Some(tick) = &self.tick {
            let cost = |cost: u32| vec![f64::from(cost) * tick.per_count, tick.bound];
            let costs = samples.iter().filter_map(|s| Some((s.t_s, cost(s.cost?))));
            let (times, costs): (Vec<f64>, Vec<_>) = costs.unzip();
            if !times.is_empty() {
                entries.push(series(log, TICK, &times, &costs)?);
            }
        }
        Ok(entries)
    }

    /// Plots the rates since the last count.
    pub(super) fn link(&mut self, log: &Log, link: &Link) -> Result<Vec<Entry>> {
        let before = self.link.replace(*link);
        let Some(before) = before.filter(|before| link.t_s > before.t_s) else {
            return Ok(Vec::new());
        };
        let seconds = (link.t_s - before.t_s).max(1e-3);
        let rate = |now: u64, before: u64| now.saturating_sub(before) as f64 / seconds / 1000.0;
        let row = vec![
            rate(link.tile_bytes, before.tile_bytes),
            rate(link.samples, before.samples),
        ];
        Ok(vec![series(log, LINK, &[link.t_s], &[row])?])
    }

    /// Returns the energy in the spring and the energy transferred to the hand, mJ, which is N·mm.
    fn energy(&mut self, sample: &Sample) -> Vec<f64> {
        let force = sample.force_n.map(f64::from);
        let stored_mj = 0.5 * length(force) * penetration(sample);
        if let Some(before) = self.before.replace(*sample) {
            let pairs = sample.hip_mm.iter().zip(before.hip_mm);
            let moved = pairs.map(|(now, before)| now - before);
            self.gained_mj += force.iter().zip(moved).map(|(f, d)| f * d).sum::<f64>();
        }
        vec![stored_mj, self.gained_mj]
    }
}

/// Returns the distance from HIP to proxy, mm.
fn penetration(sample: &Sample) -> f64 {
    let mut depth = sample.proxy_mm;
    for (depth, hip) in depth.iter_mut().zip(sample.hip_mm) {
        *depth -= hip;
    }
    length(depth)
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns rows of equally many values.
fn series(log: &Log, entity: &str, times_s: &[f64], rows: &[Vec<f64>]) -> Result<Entry> {
    let lengths: Vec<usize> = rows.iter().map(Vec::len).collect();
    let scalars = Scalars::new(rows.iter().flatten().copied());
    log.log_timed(entity, times_s, scalars.columns(lengths)?)
}
