//! Hypsometric tint under lights from the north-west, as on maps.

/// Red, green and blue.
pub(super) type Rgb = [u8; 3];

/// Colours from low to high, each with its share of the heights.
const TINTS: [(f32, [f32; 3]); 7] = [
    (0.0, [66.0, 122.0, 88.0]),
    (0.2, [110.0, 152.0, 96.0]),
    (0.4, [172.0, 180.0, 118.0]),
    (0.6, [212.0, 190.0, 140.0]),
    (0.78, [186.0, 146.0, 112.0]),
    (0.92, [206.0, 190.0, 178.0]),
    (1.0, [250.0, 248.0, 246.0]),
];
/// Directions towards the lights (east, north, up) and their strengths.
const LIGHTS: [([f32; 3], f32); 3] = [
    ([-0.5, 0.5, 0.707], 0.65),
    ([-0.77, -0.2, 0.6], 0.2),
    ([0.3, 0.74, 0.6], 0.15),
];
/// Colours of the shade, and of full light.
const DARK: [f32; 3] = [20.0, 28.0, 48.0];
const LIGHT: [f32; 3] = [255.0, 252.0, 244.0];
/// Slopes are exaggerated until this share of them is below 45°, within limits.
const BELOW_45_SHARE: f64 = 0.88;
const EXAGGERATION: (f64, f64) = (0.3, 30.0);
/// Colour of no-data.
pub(super) const NO_DATA: Rgb = [60, 64, 72];

/// Colours of heights: the same for all layers of a terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shade {
    low: f32,
    span: f32,
    exaggeration: f32,
}

/// Heights row by row from the south, NaN for no-data.
pub(super) struct Heights<'h> {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Distance between samples, in the unit of the heights.
    pub(super) step: f64,
    pub(super) up: &'h [f32],
}

impl Heights<'_> {
    /// Returns a height; `None` for no-data and outside.
    pub(super) fn at(&self, column: usize, row: usize) -> Option<f32> {
        let inside = column < self.columns && row < self.rows;
        let index = row.checked_mul(self.columns)?.checked_add(column)?;
        let height = self.up.get(index).copied().filter(|_| inside);
        height.filter(|height| height.is_finite())
    }

    /// Returns the slope towards the east and the north, from the available neighbours.
    fn slope(&self, column: usize, row: usize) -> [f32; 2] {
        let here = self.at(column, row);
        let step = self.step as f32;
        let rise = |low: Option<f32>, high: Option<f32>| match (low, here, high) {
            (Some(low), _, Some(high)) => (high - low) / (2.0 * step),
            (Some(low), Some(here), None) => (here - low) / step,
            (None, Some(here), Some(high)) => (high - here) / step,
            _ => 0.0,
        };
        let before = |index: usize| index.checked_sub(1);
        [
            rise(
                before(column).and_then(|west| self.at(west, row)),
                self.at(column + 1, row),
            ),
            rise(
                before(row).and_then(|south| self.at(column, south)),
                self.at(column, row + 1),
            ),
        ]
    }
}

impl Shade {
    /// Fits the colours to heights: nearly all of them are between the first and the last tint, so
    /// that one spike does not reduce the rest to one colour.
    pub(super) fn of(heights: &Heights<'_>) -> Self {
        let known_heights = || heights.up.iter().copied().filter(|h| h.is_finite());
        let mut sorted: Vec<f32> = known_heights()
            .step_by(1 + heights.up.len() / 200_000)
            .collect();
        sorted.sort_by(f32::total_cmp);
        let (low, high) = (quantile(&sorted, 0.002), quantile(&sorted, 0.998));
        let (low, high) = (low.unwrap_or(0.0), high.unwrap_or(1.0));
        let places = (0..heights.rows).step_by(3).flat_map(|row| {
            (0..heights.columns)
                .step_by(3)
                .map(move |column| (column, row))
        });
        let steepness = places.map(|(column, row)| {
            let [east, north] = heights.slope(column, row);
            east.hypot(north)
        });
        let mut steep: Vec<f32> = steepness.filter(|slope| *slope > 0.0).collect();
        steep.sort_by(f32::total_cmp);
        let slope = quantile(&steep, BELOW_45_SHARE).unwrap_or(1.0);
        let (min, max) = EXAGGERATION;
        Self {
            low,
            span: (high - low).max(1e-6),
            exaggeration: (1.0 / f64::from(slope)).clamp(min, max) as f32,
        }
    }

    /// Returns the colour of a sample.
    pub(super) fn colour(&self, heights: &Heights<'_>, column: usize, row: usize) -> Rgb {
        let Some(height) = heights.at(column, row) else {
            return NO_DATA;
        };
        let slope = heights.slope(column, row).map(|s| s * self.exaggeration);
        let tint = tint((height - self.low) / self.span);
        lit(tint, slope).map(|value| value.round().clamp(0.0, 255.0) as u8)
    }
}

fn quantile(sorted: &[f32], share: f64) -> Option<f32> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((last as f64 * share) as usize).copied()
}

fn tint(share: f32) -> [f32; 3] {
    let share = share.clamp(0.0, 1.0);
    let pairs = TINTS.iter().zip(TINTS.iter().skip(1));
    let between = pairs.clone().find(|(_, (above, _))| share <= *above);
    match between {
        Some(((below, from), (above, to))) => mix(*from, *to, (share - below) / (above - below)),
        None => LIGHT,
    }
}

/// Returns a tint under the lights; a level surface has the tint itself.
fn lit(tint: [f32; 3], [east, north]: [f32; 2]) -> [f32; 3] {
    let length = (east * east + north * north + 1.0).sqrt();
    let (mut light, mut level) = (0.0, 0.0);
    for ([x, y, z], strength) in LIGHTS {
        light += strength * ((z - x * east - y * north) / length).max(0.0);
        level += strength * z;
    }
    let shade = light / level;
    match shade < 1.0 {
        true => mix(DARK, tint, 0.15 + 0.85 * shade),
        false => mix(tint, LIGHT, ((shade - 1.0) * 1.1).min(0.7)),
    }
}

fn mix(from: [f32; 3], to: [f32; 3], share: f32) -> [f32; 3] {
    let pairs = from.iter().zip(to);
    let mut mixed = [0.0; 3];
    for (value, (a, b)) in mixed.iter_mut().zip(pairs) {
        *value = a + (b - a) * share;
    }
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cone() -> Vec<f32> {
        let height = |x: i32, y: i32| 100.0 - f32::hypot((x - 20) as f32, (y - 20) as f32);
        (0..41)
            .flat_map(|y| (0..41).map(move |x| height(x, y)))
            .collect()
    }

    fn of(up: &[f32]) -> Heights<'_> {
        Heights {
            columns: 41,
            rows: 41,
            step: 1.0,
            up,
        }
    }

    #[test]
    fn north_west_slope_is_brighter_than_south_east() {
        let mm = cone();
        let heights = of(&mm);
        let shade = Shade::of(&heights);
        let bright = |x: usize, y: usize| -> u32 {
            let colour = shade.colour(&heights, x, y);
            colour.iter().map(|value| u32::from(*value)).sum()
        };
        assert!(bright(12, 28) > bright(28, 12) + 100);
    }

    #[test]
    fn no_data_and_extreme_heights_have_a_colour() {
        for value in [f32::NAN, f32::INFINITY, 0.0, 1e30, -1e30] {
            let mm = vec![value; 41 * 41];
            let heights = of(&mm);
            let shade = Shade::of(&heights);
            let colour = shade.colour(&heights, 0, 0);
            assert_eq!(colour == NO_DATA, !value.is_finite(), "{value}");
        }
    }
}
