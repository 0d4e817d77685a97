//! A scale at which a terrain feels good, for when the user states none.

use crate::terrain::{BadScale, FeltGrid, Scale};

/// What the hand ranges over without moving the elbow, east and north, mm.
const HAND_MM: [f64; 2] = [140.0, 70.0];
/// A smaller terrain is made this long, mm.
const LENGTH_MM: f64 = 150.0;
/// Smallest and largest cell that is suggested, mm.
const CELL_MM: (f64, f64) = (1.0, 5.0);
/// Relief under the hand that is left as it is, mm.
const GOOD_MM: (f64, f64) = (8.0, 50.0);
/// Relief under the hand that is aimed at otherwise, mm.
const AIM_MM: f64 = 25.0;
/// Nine slopes of ten stay below this after an exaggeration: 45°.
const STEEP: f64 = 1.0;
/// Places looked at in each direction, and samples in each.
const PLACES: u32 = 9;
const SAMPLES: u32 = 24;

/// A scale, and how it came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuggestedScale {
    /// The suggested scale.
    pub scale: Scale,
    /// How much higher the terrain is than at its true proportions.
    pub exaggeration: f64,
}

/// A scale for a terrain: the cell as stated, else 1 mm, more for a terrain
/// smaller than a hand's reach; heights at their true proportions (1 mm a unit
/// where the file does not know them) where that is neither flat nor a tower
/// under the hand, else exaggerated by a round number, but not so much that the
/// usual slopes become walls.
///
/// # Errors
/// A stated cell that no terrain can be scaled with.
pub fn suggest_scale(
    grid: &FeltGrid<'_>,
    cell_mm: Option<f64>,
) -> Result<SuggestedScale, BadScale> {
    let longest = grid.columns().max(grid.rows()) - 1;
    let fitting = (LENGTH_MM / f64::from(longest)).clamp(CELL_MM.0, CELL_MM.1);
    let cell_mm = cell_mm.unwrap_or((fitting * 2.0).round() / 2.0);
    let plain = Scale::true_to(grid, cell_mm)?;
    let relief_mm = usual_relief(grid, cell_mm) * plain.height_mm_per_unit();
    let good = (GOOD_MM.0..=GOOD_MM.1).contains(&relief_mm) || relief_mm <= 0.0;
    let exaggeration = match good {
        true => 1.0,
        false => {
            let bearable = STEEP / plain.height_cells(great_slope(grid));
            // Slopes that are steep by themselves are the terrain's own.
            round(f64::min(AIM_MM / relief_mm, bearable.max(1.0)))
        }
    };
    let height = plain.height_mm_per_unit() * exaggeration;
    Ok(SuggestedScale {
        scale: Scale::new(cell_mm, height)?,
        exaggeration,
    })
}

/// The cells of a square grid of `count` × `count`.
fn square(count: u32) -> impl Iterator<Item = [u32; 2]> {
    (0..count * count).map(move |i| [i % count, i / count])
}

/// The `i`-th of `count` whole numbers spread evenly from 0 to `room`.
fn spread(i: u32, count: u32, room: u32) -> u32 {
    (u64::from(room) * u64::from(i) / u64::from(count - 1)) as u32
}

/// The value that `tenths` tenths of the values are below; zero of nothing.
fn quantile(mut values: Vec<f64>, tenths: usize) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = values.len() * tenths / 10;
    values.get(index).copied().unwrap_or(0.0)
}

/// The median relief, in vertical units, of places as large as a hand's reach
/// that have any.
fn usual_relief(grid: &FeltGrid<'_>, cell_mm: f64) -> f64 {
    let last = [grid.columns() - 1, grid.rows() - 1];
    let size = [0, 1].map(|axis| {
        let cells = (HAND_MM[axis] / cell_mm).ceil();
        cells.min(f64::from(last[axis])).max(1.0) as u32
    });
    let corner =
        |place: [u32; 2]| [0, 1].map(|axis| spread(place[axis], PLACES, last[axis] - size[axis]));
    let reliefs = square(PLACES).filter_map(|place| relief(grid, corner(place), size));
    quantile(reliefs.collect(), 5)
}

/// Relief of a place, if most of it is known and it is not flat.
fn relief(grid: &FeltGrid<'_>, corner: [u32; 2], size: [u32; 2]) -> Option<f64> {
    let known: Vec<f64> = square(SAMPLES)
        .map(|at| [0, 1].map(|axis| corner[axis] + spread(at[axis], SAMPLES, size[axis])))
        .map(|[x, y]| grid.height(x, y))
        .filter(|height| !height.is_nan())
        .collect();
    let low = known.iter().copied().fold(f64::MAX, f64::min);
    let high = known.iter().copied().fold(f64::MIN, f64::max);
    (2 * known.len() > (SAMPLES * SAMPLES) as usize && high > low).then_some(high - low)
}

/// The slope, in vertical units a cell, that one in ten of those that are not
/// flat exceeds.
fn great_slope(grid: &FeltGrid<'_>) -> f64 {
    const ALONG: u32 = 200;
    let slopes = square(ALONG).map(|[i, j]| {
        let x = spread(i, ALONG, grid.columns() - 2);
        let y = spread(j, ALONG, grid.rows() - 2);
        (grid.height(x + 1, y) - grid.height(x, y)).abs()
    });
    quantile(slopes.filter(|slope| *slope > 0.0).collect(), 9)
}

/// The largest of 1, 2, 5, 10, … (and 0.5, 0.2, …) not above `x`.
fn round(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let digit = match x / power {
        lead if lead >= 5.0 => 5.0,
        lead if lead >= 2.0 => 2.0,
        _ => 1.0,
    };
    digit * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;
    use crate::terrain::FeltCells;

    fn grid(raster: &Raster) -> FeltGrid<'_> {
        FeltGrid::new(raster, FeltCells::Square)
    }

    #[test]
    fn round_numbers() {
        let cases = [
            (1.0, 1.0),
            (1.99, 1.0),
            (2.5, 2.0),
            (49.0, 20.0),
            (0.6, 0.5),
        ];
        for (x, expected) in cases {
            assert!((round(x) - expected).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn a_terrain_of_any_relief_comes_out_neither_flat_nor_a_tower() {
        for height in [1e-3f32, 1.0, 30.0, 1e4] {
            let raster = Raster::from_fn(400, 300, |x, y| {
                height * ((x as f32 * 0.05).sin() + (y as f32 * 0.07).cos())
            });
            let raster = raster.expect("raster");
            let suggestion = suggest_scale(&grid(&raster), None).expect("valid");
            let relief = usual_relief(&grid(&raster), 1.0) * suggestion.scale.height_mm_per_unit();
            assert!((8.0..=50.0).contains(&relief), "{height}: {relief} mm");
            assert_eq!(suggestion.scale.cell_mm(), 1.0);
        }
    }

    #[test]
    fn small_and_flat_and_mostly_unknown_terrains_have_a_scale() {
        let flat = Raster::from_fn(2, 2, |_, _| 3.0).expect("raster");
        let suggestion = suggest_scale(&grid(&flat), None).expect("valid");
        assert_eq!(
            (suggestion.scale.cell_mm(), suggestion.exaggeration),
            (5.0, 1.0)
        );
        let holes = Raster::from_fn(50, 50, |x, y| if x + y > 8 { f32::NAN } else { x as f32 });
        let holes = holes.expect("raster");
        assert!(suggest_scale(&grid(&holes), Some(2.0)).is_ok());
    }
}
