//! What `demo` and `run` say about a session at its end.

use std::path::Path;

use hapterra_core::wire::message::DeviceHello;
use indicatif::{ProgressBar, ProgressStyle};

use super::Failure;
use crate::link::{INSTRUCTIONS_PER_COUNT, Tally};
use crate::live::Figures;
use crate::picture::{Field, Sample, Session, save_session};
use crate::replay::Record;
use crate::terrain::Terrain;

/// The board whose clock counts instructions.
const EMULATED: &str = "mps2-an386";

/// Figures of a session and of its link.
#[derive(Clone, Debug)]
pub(super) struct Report {
    /// Ticks run since the scene was taken.
    pub(super) ticks: u64,
    pub(super) device: DeviceHello,
    pub(super) figures: Figures,
    pub(super) tally: Tally,
}

impl Report {
    /// Prints the table.
    pub(super) fn print(&self) {
        for (name, value) in self.lines() {
            println!("{name:<14} {value}");
        }
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let Self { figures, tally, .. } = self;
        let (mean_cost, worst_cost, unit) = self.cost();
        let mut lines = vec![
            (
                "ticks",
                format!("{} run, {} late", self.ticks, figures.late),
            ),
            (
                "tiles",
                format!(
                    "{} fetched ({} bytes), {} of them again",
                    tally.tiles, tally.tile_bytes, tally.again
                ),
            ),
            (
                "telemetry",
                format!(
                    "{} samples, {} lost on the link, {} dropped by the device",
                    tally.samples, tally.lost, tally.dropped
                ),
            ),
            (
                "contact",
                format!("{} of {} ticks", figures.force_n.count(), figures.samples),
            ),
            (
                "force",
                format!(
                    "mean {:.3} N, max {:.3} N in contact",
                    figures.force_n.mean(),
                    figures.force_n.max()
                ),
            ),
            (
                "penetration",
                format!(
                    "mean {:.3} mm, max {:.3} mm",
                    figures.penetration_mm.mean(),
                    figures.penetration_mm.max()
                ),
            ),
            (
                "proxy height",
                format!(
                    "mean error {:.3e} mm, max {:.3e} mm against the bilinear surface in f64",
                    figures.height_error_mm.mean(),
                    figures.height_error_mm.max()
                ),
            ),
            (
                "tick cost",
                format!("mean {mean_cost:.0}, worst {worst_cost:.0} {unit}"),
            ),
        ];
        if tally.bad_frames > 0 || tally.sessions > 1 {
            let lines_of_link = format!(
                "{} frames not understood, {} sessions",
                tally.bad_frames, tally.sessions
            );
            lines.push(("link", lines_of_link));
        }
        lines
    }

    /// Mean and worst cost of a tick, and what they are counted in.
    fn cost(&self) -> (f64, f64, &'static str) {
        let (mean, worst) = (self.figures.cost.mean(), self.figures.cost.max());
        if self.device.board.as_str() == EMULATED {
            let n = INSTRUCTIONS_PER_COUNT;
            return (n * mean, n * worst, "instructions of the Cortex-M4F");
        }
        let ns = 1e9 / f64::from(self.device.clock_hz.max(1));
        (ns * mean, ns * worst, "ns of the device's clock")
    }

    /// The figures that go beside the picture.
    fn facts(&self) -> Vec<(String, String)> {
        let (mean_cost, _, unit) = self.cost();
        let unit = unit.split(' ').next().unwrap_or_default();
        let fact = |name: &str, value: String| (name.to_owned(), value);
        vec![
            fact(
                "mean force",
                format!("{:.2} N", self.figures.force_n.mean()),
            ),
            fact("ticks late", self.figures.late.to_string()),
            fact("tiles fetched", self.tally.tiles.to_string()),
            fact("tick cost", format!("{mean_cost:.0} {unit}")),
        ]
    }
}

/// How a terrain lies in the hand, in words.
pub(super) fn how(terrain: &Terrain<'_>) -> String {
    let (raster, scale) = (terrain.raster(), terrain.scale());
    let proportions = match raster.cells_per_vertical_unit() {
        Some(true_cells) => match scale.height_cells(1.0) / true_cells {
            times if (times - 1.0).abs() < 1e-9 => "heights true to scale".to_owned(),
            times => format!("heights × {}", (times * 1e6).round() / 1e6),
        },
        None => format!("{} mm a vertical unit", scale.height_mm_per_unit()),
    };
    format!(
        "{} × {} samples, {} mm a cell, {proportions}",
        raster.columns(),
        raster.rows(),
        scale.cell_mm()
    )
}

/// A device in words.
pub(super) fn device(hello: &DeviceHello) -> String {
    format!(
        "{} {}, window of {w} × {w} tiles, {} ticks a second",
        hello.board,
        hello.version,
        hello.tick_hz,
        w = hello.window
    )
}

/// A bar over the ticks of a session.
pub(super) fn progress(ticks: u64) -> ProgressBar {
    let template = "feeling {bar:30} {human_pos} of {human_len} ticks, {elapsed}";
    // The template is constant; the default style is no worse a fallback.
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(ticks).with_style(style)
}

/// Draws the picture of a session.
///
/// # Errors
/// When it cannot be written.
pub(super) fn draw(
    path: &Path,
    terrain: &Terrain<'_>,
    (name, how): (&str, &str),
    records: &[Record],
    report: &Report,
) -> Result<(), Failure> {
    let height_mm = |east: f64, north: f64| terrain.height_mm(east, north);
    let samples: Vec<Sample> = records
        .iter()
        .map(|record| Sample {
            t_s: record.t_s,
            hip_mm: record.hip_mm,
            proxy_mm: record.proxy_mm,
            force_n: record.force_n,
            contact: record.contact,
        })
        .collect();
    let subtitle = format!("{how}; felt by {}", device(&report.device));
    let session = Session {
        title: name,
        subtitle: &subtitle,
        field: Field {
            height_mm: &height_mm,
            size_mm: terrain.size_mm(),
            cell_mm: terrain.scale().cell_mm(),
        },
        samples: &samples,
        facts: &report.facts(),
    };
    save_session(path, &session)
        .map_err(|error| Failure::new(error).hint("name another folder with --out"))
}
