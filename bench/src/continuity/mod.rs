//! Change of the force when the HIP moves a hundredth of a cell along the ground: on smooth ground,
//! over ridges, in valleys, across the edges of patches, and while a tile arrives.
//!
//! The rendered forces are compared, with the edge fade. The HIP slides 0.1 cell below the surface;
//! its approach does not count.

mod arrival;
mod ground;
mod row;

use crate::compare::{Label, entries_of, opponents};
use crate::path::{Random, approach_hips, over};
use crate::product;
use crate::variant::{ContactResult, Haptics, Hip};

use ground::{GROUNDS, Ground};
use row::SIDE;
pub use row::{DEPTH, Row, STEP};

/// Straight paths over a ground.
const PATHS: usize = 24;
/// Ticks of each.
const TICKS: usize = 1000;
/// The variants.
const COMPARED_VARIANTS: [&str; 6] = [
    "hapterra swept",
    "paper f32",
    "paper f64",
    "god-object",
    "proxy graph",
    "parry within",
];
/// Measures every variant on every ground, and the product while a tile arrives.
#[must_use]
pub fn measure() -> Vec<Row> {
    let mut rows: Vec<Row> = GROUNDS.iter().flat_map(over_ground).collect();
    rows.extend(arrival::measure());
    rows
}

fn over_ground(ground: &Ground) -> Vec<Row> {
    let grid = ground.grid();
    let paths = paths(ground);
    let mut buffers = product::buffers::<SIDE>();
    let window = product::window::<SIDE>(&grid, &mut buffers);
    let mut entries = entries_of(&window);
    entries.extend(opponents(&grid));
    // The best of the paper's and of parry's settings, without the copy, which is not a contact.
    entries.retain(|(label, _)| COMPARED_VARIANTS.contains(&label.name));
    let row = |(label, variant): &mut (Label, Box<dyn Haptics + '_>)| {
        let rendered: Vec<Vec<ContactResult>> = paths
            .iter()
            .map(|path| {
                variant.reset();
                path.hips.iter().map(|hip| variant.tick(hip)).collect()
            })
            .collect();
        let slid: Vec<&[ContactResult]> = rendered
            .iter()
            .zip(&paths)
            .map(|(results, path)| &results[path.approach - 1..])
            .collect();
        Row::of(ground.name, *label, &slid)
    };
    entries.iter_mut().map(row).collect()
}

/// A path to below the surface, and then straight on.
struct StraightPath {
    hips: Vec<Hip>,
    approach: usize,
}

/// Returns straight paths in all directions over the middle of the field.
fn paths(ground: &Ground) -> Vec<StraightPath> {
    let grid = ground.grid();
    let mut random = Random(17);
    let middle = [grid.columns as f64 / 2.0, grid.rows as f64 / 2.0];
    (0..PATHS)
        .map(|_| {
            let heading = random.between(0.0, std::f64::consts::TAU);
            let offset = random.between(-3.0, 3.0);
            let (north, east) = heading.sin_cos();
            let at = |tick: f64| {
                let distance = STEP * (tick - TICKS as f64 / 2.0);
                let displacement = [
                    east * distance - north * offset,
                    north * distance + east * offset,
                ];
                [middle[0] + displacement[0], middle[1] + displacement[1]]
            };
            let mut hips = approach_hips(&grid, at(0.0), -DEPTH);
            let approach = hips.len();
            hips.extend((1..=TICKS).map(|tick| over(&grid, at(tick as f64), -DEPTH)));
            StraightPath { hips, approach }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{DEFAULT_VARIANT, Family};

    fn max_change(rows: &[Row], ground: &str, name: &str) -> f64 {
        let is = |row: &&Row| row.ground == ground && row.label.name == name;
        rows.iter().find(is).expect("it is measured").max_change
    }

    /// No more than the change of the exact closest point, computed in f64, and the bounds of
    /// docs/explanation/contact.md.
    #[test]
    fn force_is_as_continuous_as_the_surface() {
        let rows = measure();
        let default_change = |ground| max_change(&rows, ground, DEFAULT_VARIANT.name);
        for ground in &GROUNDS {
            let exact = max_change(&rows, ground.name, "paper f64");
            let own = default_change(ground.name);
            assert!(own < 1.01 * exact + 1e-6, "{}: {own} {exact}", ground.name);
        }
        let bounds = [
            ("saddle", 6e-5),
            ("smooth", 5e-3),
            ("patch edges", 0.02),
            ("ridge", 0.052),
            ("valley", 0.011),
            ("every tile here", 3e-3),
            ("tile 0.2 cell late", 0.15),
            ("tile 0.45 cell late", 0.05),
            ("tile 1 cell late", 0.012),
            // The motion of the surface in a tick, and of the HIP.
            ("0.2 cell late over a coarse fallback", 0.0531),
            ("0.45 cell late over a coarse fallback", 0.0531),
            ("1 cell late over a coarse fallback", 0.0531),
        ];
        for (ground, bound) in bounds {
            assert!(
                default_change(ground) < bound,
                "{ground}: {}",
                default_change(ground)
            );
        }
    }

    #[test]
    fn triangles_have_edges_where_the_surface_is_smooth() {
        let rows = measure();
        for name in ["god-object", "parry within", "proxy graph"] {
            assert!(max_change(&rows, "saddle", name) > 5e-3, "{name}");
        }
    }

    #[test]
    fn row_reports_max_change_and_missed_share() {
        let still = ContactResult::touching([0.0, 0.0, 0.1]);
        let jumped = ContactResult::touching([0.03, 0.0, 0.14]);
        let label = Label {
            name: "",
            family: Family::Ours,
            extra_bytes: 0.0,
        };
        let row = Row::of(
            "",
            label,
            &[&[still, still, jumped], &[ContactResult::FREE]],
        );
        assert!((row.max_change - 0.05).abs() < 1e-6 && row.missed == 0.25);
    }
}
