//! A scale at which a terrain feels good without anybody having said one.

use crate::raster::Raster;
use crate::terrain::{BadScale, Scale};

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
pub struct Suggestion {
    /// The scale.
    pub scale: Scale,
    /// How much higher the terrain is than at its true proportions.
    pub exaggeration: f64,
}

/// A scale for a raster: the cell as stated, else 1 mm, more for a terrain
/// smaller than a hand's reach; heights at their true proportions (1 mm a unit
/// where the file does not know them) where that is neither flat nor a tower
/// under the hand, else exaggerated by a round number, but not so much that the
/// usual slopes become walls.
///
/// # Errors
/// A stated cell that no terrain can be scaled with.
pub fn suggest(raster: &Raster, cell_mm: Option<f64>) -> Result<Suggestion, BadScale> {
    let longest = raster.columns().max(raster.rows()) - 1;
    let fitting = (LENGTH_MM / f64::from(longest)).clamp(CELL_MM.0, CELL_MM.1);
    let cell_mm = cell_mm.unwrap_or((fitting * 2.0).round() / 2.0);
    let plain = Scale::true_to(raster, cell_mm)?;
    let relief_mm = usual_relief(raster, cell_mm) * plain.height_mm_per_unit();
    let good = (GOOD_MM.0..=GOOD_MM.1).contains(&relief_mm) || relief_mm <= 0.0;
    let wanted = if good { 1.0 } else { AIM_MM / relief_mm };
    let bearable = STEEP / plain.height_cells(great_slope(raster));
    // Slopes that are steep by themselves are the terrain's own.
    let exaggeration = if good {
        1.0
    } else {
        round(wanted.min(bearable.max(1.0)))
    };
    let height = plain.height_mm_per_unit() * exaggeration;
    Ok(Suggestion {
        scale: Scale::new(cell_mm, height)?,
        exaggeration,
    })
}

/// The median relief, in vertical units, of places as large as a hand's reach
/// that have any.
fn usual_relief(raster: &Raster, cell_mm: f64) -> f64 {
    let extent = |axis: usize, samples: u32| {
        let cells = (HAND_MM[axis] / cell_mm).ceil().min(f64::from(samples - 1));
        cells.max(1.0) as u32
    };
    let (width, height) = (extent(0, raster.columns()), extent(1, raster.rows()));
    let spread =
        |i: u32, room: u32| (u64::from(room) * u64::from(i) / u64::from(PLACES - 1)) as u32;
    let mut reliefs = Vec::new();
    for i in 0..PLACES * PLACES {
        let west = spread(i % PLACES, raster.columns() - 1 - width);
        let south = spread(i / PLACES, raster.rows() - 1 - height);
        reliefs.extend(relief(raster, [west, south], [width, height]));
    }
    reliefs.sort_by(f64::total_cmp);
    reliefs.get(reliefs.len() / 2).copied().unwrap_or(0.0)
}

/// Relief of a place, if most of it is known and it is not flat.
fn relief(raster: &Raster, corner: [u32; 2], size: [u32; 2]) -> Option<f64> {
    let at = |axis: usize, i: u32| {
        corner[axis] + (u64::from(size[axis]) * u64::from(i) / u64::from(SAMPLES - 1)) as u32
    };
    let heights = (0..SAMPLES * SAMPLES)
        .map(|i| raster.height(at(0, i % SAMPLES), at(1, i / SAMPLES)))
        .filter(|height| !height.is_nan());
    let (mut known, mut low, mut high) = (0, f64::MAX, f64::MIN);
    for height in heights {
        known += 1;
        (low, high) = (low.min(height), high.max(height));
    }
    (2 * known > SAMPLES * SAMPLES && high > low).then_some(high - low)
}

/// The slope, in vertical units a cell, that one in ten of those that are not
/// flat exceeds.
fn great_slope(raster: &Raster) -> f64 {
    const ALONG: u32 = 200;
    let at = |i: u32, samples: u32| {
        (u64::from(samples - 2) * u64::from(i) / u64::from(ALONG - 1)) as u32
    };
    let mut slopes: Vec<f64> = (0..ALONG * ALONG)
        .map(|i| {
            let (x, y) = (
                at(i % ALONG, raster.columns()),
                at(i / ALONG, raster.rows()),
            );
            (raster.height(x + 1, y) - raster.height(x, y)).abs()
        })
        .filter(|slope| *slope > 0.0)
        .collect();
    slopes.sort_by(f64::total_cmp);
    slopes.get(slopes.len() * 9 / 10).copied().unwrap_or(0.0)
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
            let suggestion = suggest(&raster, None).expect("valid");
            let relief = usual_relief(&raster, 1.0) * suggestion.scale.height_mm_per_unit();
            assert!((8.0..=50.0).contains(&relief), "{height}: {relief} mm");
            assert_eq!(suggestion.scale.cell_mm(), 1.0);
        }
    }

    #[test]
    fn small_and_flat_and_mostly_unknown_terrains_have_a_scale() {
        let flat = Raster::from_fn(2, 2, |_, _| 3.0).expect("raster");
        let suggestion = suggest(&flat, None).expect("valid");
        assert_eq!(
            (suggestion.scale.cell_mm(), suggestion.exaggeration),
            (5.0, 1.0)
        );
        let holes = Raster::from_fn(50, 50, |x, y| if x + y > 8 { f32::NAN } else { x as f32 });
        assert!(suggest(&holes.expect("raster"), Some(2.0)).is_ok());
    }
}
