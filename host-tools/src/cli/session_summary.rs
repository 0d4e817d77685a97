//! Summary of `demo` and `run` at the end of a session.

use std::path::Path;

use hapterra_core::wire::hello::DeviceHello;

use super::failure::{Failure, OrHint};
use super::options::placing;
use crate::link::{EMULATED, INSTRUCTIONS_PER_COUNT, LinkStats};
use crate::picture::{GroundFacts, SessionPicture, Surface};
use crate::place::{Placement, coordinates_in_words};
use crate::replay::Record;
use crate::telemetry::Figures;
use crate::terrain::Terrain;
use heightfield::printable_text::printable;

/// Figures of a session and its link.
#[derive(Clone, Debug)]
pub(super) struct SessionSummary {
    /// Number of ticks since the scene was received.
    pub(super) ticks: u64,
    pub(super) device: DeviceHello,
    pub(super) figures: Figures,
    pub(super) stats: LinkStats,
}

impl SessionSummary {
    /// Returns the table, one figure a line.
    pub(super) fn text(&self) -> String {
        let (figures, stats, ticks) = (&self.figures, &self.stats, self.ticks);
        let (force, depth, off) = (
            figures.force_n,
            figures.penetration_mm,
            figures.height_error_mm,
        );
        let (mean_cost, worst_cost, unit) = self.cost();
        let mut text = format!(
            "ticks          {ticks} run, {} late\n\
             tiles          {} fetched ({} bytes), {} of them again\n\
             telemetry      {} samples, {} lost on the link, {} dropped by the device\n\
             contact        {} of {} ticks\n\
             force          mean {:.3} N, max {:.3} N in contact\n\
             penetration    mean {:.3} mm, max {:.3} mm\n\
             proxy height   mean error {:.3e} mm, max {:.3e} mm against the bilinear surface in f64\n\
             tick cost      mean {mean_cost:.0}, worst {worst_cost:.0} {unit}\n",
            figures.late,
            stats.tiles,
            stats.tile_bytes,
            stats.repeated,
            stats.samples,
            stats.lost,
            stats.dropped,
            force.count(),
            figures.samples,
            force.mean(),
            force.max(),
            depth.mean(),
            depth.max(),
            off.mean(),
            off.max(),
        );
        let (bad, sessions) = (stats.bad_frames, stats.sessions);
        if bad > 0 || sessions > 1 {
            text += &format!("link           {bad} frames not understood, {sessions} sessions\n");
        }
        let reported = [
            (
                stats.uncertain,
                "sessions with an unknown end: more may be lost",
            ),
            (stats.foreign_frames, "frames of other sessions, ignored"),
            (stats.no_tiles, "requests for tiles that do not exist"),
            (stats.unanswered, "requests and queries without an answer"),
        ];
        for (count, what) in reported.iter().filter(|(count, _)| *count > 0) {
            text += &format!("link           {count} {what}\n");
        }
        text
    }

    /// Returns the mean and maximum cost of a tick, and their unit.
    fn cost(&self) -> (f64, f64, &'static str) {
        let (a_count, unit) = match self.device.board.as_str() {
            EMULATED => (INSTRUCTIONS_PER_COUNT, "instructions of the Cortex-M4F"),
            _ => {
                let hz = f64::from(self.device.clock_hz.max(1));
                (1e9 / hz, "ns of the device's clock")
            }
        };
        let cost = self.figures.cost;
        (a_count * cost.mean(), a_count * cost.max(), unit)
    }

    /// Returns the figures beside the picture.
    fn facts(&self) -> Vec<(String, String)> {
        let (mean_cost, _, unit) = self.cost();
        let unit = unit.split(' ').next().unwrap_or_default();
        let force = self.figures.force_n.mean();
        let facts = [
            ("mean force", format!("{force:.2} N")),
            ("ticks late", self.figures.late.to_string()),
            ("tiles fetched", self.stats.tiles.to_string()),
            ("tick cost", format!("{mean_cost:.0} {unit}")),
        ];
        facts.map(|(name, value)| (name.to_owned(), value)).to_vec()
    }

    /// Draws the picture of the session to a file.
    pub(super) fn draw(
        &self,
        path: &Path,
        (terrain, view): (&Terrain<'_>, &Placement),
        title: &str,
        records: &[Record],
    ) -> Result<(), Failure> {
        let height_mm =
            |east: f64, north: f64, apart: f64| terrain.picture_height_mm(east, north, apart);
        let file = terrain.raster().georeference();
        let cell_mm = view.scale.cell_mm();
        let place_of = |east: f64, north: f64| {
            let ground = terrain
                .grid()
                .to_ground([east, north].map(|mm| mm / cell_mm));
            coordinates_in_words(&file, ground)
        };
        let lines = placing::picture_lines(view, &file);
        let picture = SessionPicture {
            title,
            subtitles: [
                &in_words(terrain),
                &format!("rendered by {}", kind_of_device(&self.device)),
            ],
            surface: Surface {
                height_mm: &height_mm,
                size_mm: terrain.size_mm(),
                cell_mm: terrain.scale().cell_mm(),
            },
            records,
            facts: &self.facts(),
            ground: Some(GroundFacts {
                metres_per_mm: view.ground_m_per_mm(),
                place_of: &place_of,
                lines: &lines,
            }),
        };
        picture.save(path).or_hint("name another folder with --out")
    }
}

/// Describes the ball at the tip and the level of the terrain; returns `None` for a point.
pub(super) fn tip(terrain: &Terrain<'_>) -> Option<String> {
    let (mm, level) = (terrain.grid().tip_mm(), terrain.level());
    let cell_size = placing::short(terrain.scale().cell_mm());
    (mm > 0.0).then(|| {
        format!(
            "rendered with a ball of {mm} mm over level {level}, on haptic cells of {cell_size} mm"
        )
    })
}

/// Describes a terrain and its scale.
pub(super) fn in_words(terrain: &Terrain<'_>) -> String {
    let (raster, grid, scale) = (terrain.raster(), terrain.grid(), terrain.scale());
    let proportions = match grid.exaggeration(&terrain.scale_of_level_0()) {
        Some(1.0) => "heights true to scale".to_owned(),
        Some(times) => format!("heights × {}", (times * 1e6).round() / 1e6),
        None => format!("{} mm a vertical unit", scale.height_mm_per_unit()),
    };
    let (columns, rows) = (raster.columns(), raster.rows());
    let of_level = terrain.scale_of_level_0().at_level(terrain.level());
    let cell_mm = placing::short(of_level.cell_mm());
    let cell_size = match grid.side_m() {
        Some(side) if grid.is_resampled() => format!(
            " rendered as {} × {} squares of {side:.3} m,",
            grid.columns() - 1,
            grid.rows() - 1
        ),
        Some(side) if grid.is_distorted() => {
            format!(
                " its stored cells rendered as squares of {side:.3} m, not in their true shape,"
            )
        }
        _ => String::new(),
    };
    let tip = tip(terrain)
        .map(|tip| format!(", {tip}"))
        .unwrap_or_default();
    format!("{columns} × {rows} samples,{cell_size} {cell_mm} mm a cell, {proportions}{tip}")
}

/// Describes a device.
pub(super) fn device(hello: &DeviceHello) -> String {
    match hello.serial.is_none() {
        true => kind_of_device(hello),
        false => format!("{}, serial number {}", kind_of_device(hello), hello.serial),
    }
}

/// Describes a kind of device, without its serial number.
fn kind_of_device(hello: &DeviceHello) -> String {
    let [board, version] = [&hello.board, &hello.version].map(|text| printable(text));
    let (w, hz) = (hello.window, hello.tick_hz);
    format!("{board} {version}, window of {w} × {w} tiles, {hz} ticks a second")
}

/// Describes the materials of the ground, if there are several.
pub(super) fn materials(terrain: &Terrain<'_>) -> Option<String> {
    let grid = terrain.grid();
    let materials = grid.materials()?;
    Some(format!("materials      {}", materials.describe(grid)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{HapticCells, HapticGrid};
    use heightfield::Raster;

    /// A cell of level 3 is eight cells of the file wide, and its height is scaled equally.
    #[test]
    fn level_keeps_proportions() {
        let raster = Raster::from_fn(65, 65, |column, row| (column + row) as f32);
        let raster = raster.expect("a field");
        for level in [0, 3] {
            let grid = HapticGrid::new(&raster, HapticCells::Stored);
            let scale = grid.true_scale(1.0).expect("a scale");
            let words = in_words(&Terrain::over(grid, scale, level).expect("a terrain"));
            assert!(
                words.contains("heights true to scale"),
                "level {level}: {words}"
            );
        }
    }
}
