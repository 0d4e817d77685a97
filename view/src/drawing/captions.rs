//! The text beside the picture: position, scale, and coordinates of the hand.

use std::fmt::Write as _;

use anyhow::Result;
use hapterra_view_stream::{Link, Sample, Scene};
use re_sdk_types::archetypes::TextDocument;
use re_sdk_types::components::MediaType;

use super::log::{Entry, Log};

/// Updates of the text in a second.
const RATE_HZ: f64 = 4.0;
/// The entity's path.
pub(super) const WORDS: &str = "words";

/// The constant part of the text, and the time of the next update.
pub(super) struct Words {
    facts: String,
    due_s: f64,
    link: Option<Link>,
}

impl Words {
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            facts: facts(scene),
            due_s: f64::NEG_INFINITY,
            link: None,
        }
    }

    /// Changes to another placement.
    pub(super) fn change(&mut self, scene: &Scene) {
        // In a recording they are sent once.
        if !scene.facts.is_empty() {
            self.facts = facts(scene);
        }
        self.due_s = f64::NEG_INFINITY;
    }

    pub(super) fn link(&mut self, link: &Link) {
        self.link = Some(*link);
    }

    /// Writes the text. In a live session only the latest text is kept; in a recording each has its
    /// time.
    pub(super) fn take(
        &mut self,
        log: &Log,
        scene: &Scene,
        samples: &[Sample],
    ) -> Result<Option<Entry>> {
        let due = samples.iter().rev().find(|sample| sample.t_s >= self.due_s);
        let Some(sample) = due else {
            return Ok(None);
        };
        self.due_s = sample.t_s + 1.0 / RATE_HZ;
        let words =
            TextDocument::new(self.text(scene, sample)).with_media_type(MediaType::markdown());
        match scene.is_live {
            true => log.log_static(WORDS, "", &words).map(Some),
            false => {
                let columns = words.columns_of_unit_batches()?;
                log.log_timed(WORDS, &[sample.t_s], columns).map(Some)
            }
        }
    }

    fn text(&self, scene: &Scene, sample: &Sample) -> String {
        let unit = &scene.height_unit;
        let [x, y, z] = sample.hip_mm;
        let height = |mm: f64| mm * scene.height_per_mm;
        // In Markdown, the first row of a table is its header.
        let mut text = format!("| {} | |\n|---|---|\n", plain(&scene.title));
        if let Some(place) = coordinates(scene, x, y) {
            let _ = writeln!(text, "| HIP at | {place} |");
        }
        let surface = match sample.ground_mm.is_finite() {
            true => format!("{:.1} {unit}", height(sample.ground_mm)),
            false => "no data".into(),
        };
        let _ = writeln!(
            text,
            "| HIP, surface | {:.1} {unit}, {surface} |",
            height(z)
        );
        let [fx, fy, fz] = sample.force_n;
        let force = (fx * fx + fy * fy + fz * fz).sqrt();
        let touching = if sample.contact { "touching" } else { "free" };
        let _ = writeln!(text, "| force | {force:.2} N, {touching} |");
        if let Some(link) = &self.link {
            let _ = writeln!(
                text,
                "| tiles, lost, late | {}, {}, {} |",
                link.tiles, link.lost, link.late
            );
            if link.dropped > 0 {
                let _ = writeln!(text, "| not shown | {} messages |", link.dropped);
            }
        }
        text.push_str(self.facts.trim_start());
        text
    }
}

fn facts(scene: &Scene) -> String {
    let mut facts = String::from("\n");
    for (name, value) in &scene.facts {
        let _ = writeln!(facts, "| {} | {} |", plain(name), plain(value));
    }
    facts
}

/// Returns the file's coordinates of a position, mm; `None` if the file states none.
pub(super) fn coordinates(scene: &Scene, x: f64, y: f64) -> Option<String> {
    let coordinates = scene.coordinates.as_ref()?;
    let at = |axis: usize| {
        let [origin, east, north] = [&coordinates.origin, &coordinates.east, &coordinates.north];
        Some(origin.get(axis)? + x * east.get(axis)? + y * north.get(axis)?)
    };
    let decimals = usize::from(coordinates.decimals.min(9));
    Some(format!("{:.decimals$}, {:.decimals$}", at(0)?, at(1)?))
}

/// Removes the characters that end a cell of a table.
fn plain(text: &str) -> String {
    text.replace(['|', '\n', '\r', '<', '>', '*', '`'], " ")
}
