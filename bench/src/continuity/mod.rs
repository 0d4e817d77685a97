//! Change of the force when the HIP moves a hundredth of a cell along the ground: on smooth ground,
//! over ridges, in valleys, across the edges of patches, and while a tile arrives.
//!
//! The rendered forces are compared, with the edge fade. The HIP slides 0.1 cell below the surface;
//! its approach does not count.

mod arrival;
mod ground;
mod row;

use crate::compare::{Label, opponents, ours};
use crate::path::{Random, over, way_in};
use crate::product;
use crate::variant::{Answer, Haptics, Hip};

use ground::{GROUNDS, Ground};
use row::SIDE;
pub use row::{DEPTH, Row, STEP};

/// Straight paths over a ground.
const WAYS: usize = 24;
/// Ticks of each.
const TICKS: usize = 1000;
/// The variants.
const COMPARED: [&str; 6] = [
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
    let ways = ways(ground);
    let mut buffers = product::buffers::<SIDE>();
    let window = product::window::<SIDE>(&grid, &mut buffers);
    let mut entries = ours(&window);
    entries.extend(opponents(&grid));
    // The best of the paper's and of parry's settings, without the copy, which is not a contact.
    entries.retain(|(label, _)| COMPARED.contains(&label.name));
    let row = |(label, variant): &mut (Label, Box<dyn Haptics + '_>)| {
        let rendered: Vec<Vec<Answer>> = ways
            .iter()
            .map(|way| {
                variant.forget();
                way.hips.iter().map(|hip| variant.tick(hip)).collect()
            })
            .collect();
        let slid: Vec<&[Answer]> = rendered
            .iter()
            .zip(&ways)
            .map(|(answers, way)| &answers[way.approach - 1..])
            .collect();
        Row::of(ground.name, *label, &slid)
    };
    entries.iter_mut().map(row).collect()
}

/// A path to below the surface, and then straight on.
struct Way {
    hips: Vec<Hip>,
    approach: usize,
}

/// Returns straight paths in all directions over the middle of the field.
fn ways(ground: &Ground) -> Vec<Way> {
    let grid = ground.grid();
    let mut random = Random(17);
    let middle = [grid.columns as f64 / 2.0, grid.rows as f64 / 2.0];
    (0..WAYS)
        .map(|_| {
            let heading = random.between(0.0, std::f64::consts::TAU);
            let aside = random.between(-3.0, 3.0);
            let (north, east) = heading.sin_cos();
            let at = |tick: f64| {
                let along = STEP * (tick - TICKS as f64 / 2.0);
                let off = [east * along - north * aside, north * along + east * aside];
                [middle[0] + off[0], middle[1] + off[1]]
            };
            let mut hips = way_in(&grid, at(0.0), -DEPTH);
            let approach = hips.len();
            hips.extend((1..=TICKS).map(|tick| over(&grid, at(tick as f64), -DEPTH)));
            Way { hips, approach }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Family, SWEPT};

    fn largest(rows: &[Row], ground: &str, name: &str) -> f64 {
        let is = |row: &&Row| row.ground == ground && row.label.name == name;
        rows.iter().find(is).expect("it is measured").largest
    }

    /// No more than the change of the exact closest point, computed in f64, and the bounds of
    /// docs/explanation/contact.md.
    #[test]
    fn the_force_is_as_continuous_as_the_surface() {
        let rows = measure();
        let ours = |ground| largest(&rows, ground, SWEPT.name);
        for ground in &GROUNDS {
            let exact = largest(&rows, ground.name, "paper f64");
            let own = ours(ground.name);
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
            assert!(ours(ground) < bound, "{ground}: {}", ours(ground));
        }
    }

    #[test]
    fn triangles_have_creases_where_the_surface_has_none() {
        let rows = measure();
        for name in ["god-object", "parry within", "proxy graph"] {
            assert!(largest(&rows, "saddle", name) > 5e-3, "{name}");
        }
    }

    #[test]
    fn row_reports_largest_jump_and_missed_share() {
        let still = Answer::touching([0.0, 0.0, 0.1]);
        let jumped = Answer::touching([0.03, 0.0, 0.14]);
        let label = Label {
            name: "",
            family: Family::Ours,
            extra_bytes: 0.0,
        };
        let row = Row::of("", label, &[&[still, still, jumped], &[Answer::FREE]]);
        assert!((row.largest - 0.05).abs() < 1e-6 && row.missed == 0.25);
    }
}
