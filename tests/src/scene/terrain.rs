//! Terrains from flat to extreme, as plain samples.

use hapterra_core::terrain::MAX_STEP_CELLS;

use crate::random::Random;

/// Heights beyond this, in cells, are no-data: no position can represent them.
const MAX_HEIGHT: f32 = (1 << 29) as f32;

/// Kind of a terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One height everywhere.
    Flat,
    /// A plane that slopes in both directions.
    Slope,
    /// Waves a few cells long.
    Hills,
    /// Independent samples between 0 and 2.
    Rough,
    /// Independent samples over hundreds of cells.
    Noise,
    /// 0 and 1, alternating.
    Checkerboard,
    /// Flat, with one sample in thirty as high as a neighbour may be.
    Spikes,
    /// Subnormal numbers of both signs.
    Denormals,
    /// Rough, with samples that are NaN, infinite, or out of range.
    NoData,
    /// Straight ridges of tents.
    Ridges,
    /// Cliffs between plateaus.
    Steps,
    /// A twist of 10⁻⁹ to 10⁴ in each patch.
    Twisted,
    /// A few raised rows and columns, far higher than any HIP.
    Walls,
    /// Gentle ground with a little noise, like a scan.
    Scan,
}

/// All kinds.
pub const KINDS: [Kind; 14] = [
    Kind::Flat,
    Kind::Slope,
    Kind::Hills,
    Kind::Rough,
    Kind::Noise,
    Kind::Checkerboard,
    Kind::Spikes,
    Kind::Denormals,
    Kind::NoData,
    Kind::Ridges,
    Kind::Steps,
    Kind::Twisted,
    Kind::Walls,
    Kind::Scan,
];

/// Height of a wall, cells.
pub const WALL: f64 = 300.0;
/// Distance of the raised rows and columns of [`Kind::Walls`].
pub const WALL_EVERY: i32 = 23;

/// Samples in rows from the south, as a file may have them: invalid heights are no-data.
#[derive(Clone, Debug)]
pub struct Terrain {
    /// Its kind.
    pub kind: Kind,
    /// Patches east and north.
    pub size: [i32; 2],
    posts: Vec<f32>,
}

impl Terrain {
    /// Creates a terrain of a kind.
    #[must_use]
    pub fn new(kind: Kind, size: [i32; 2], seed: u64) -> Self {
        let mut random = Random::new(seed);
        let shape = Shape {
            kind,
            seed,
            wave: [random.between(0.1, 0.9), random.between(0.1, 0.9)],
            // Powers of ten, from almost flat to as steep as a tile may be.
            amplitude: 10_f64.powf(random.between(-9.0, 3.5)),
            tilt: [random.between(-2.0, 2.0), random.between(-2.0, 2.0)],
        };
        Self::from_fn(kind, size, |x, y| shape.height(x, y))
    }

    /// Creates a terrain from a function of the sample.
    #[must_use]
    pub fn from_fn(kind: Kind, size: [i32; 2], height: impl Fn(i32, i32) -> f32) -> Self {
        let row = |y| (0..=size[0]).map(move |x| (x, y));
        let posts = (0..=size[1]).flat_map(row).map(|(x, y)| height(x, y));
        Self {
            kind,
            size,
            posts: posts.collect(),
        }
    }

    /// Returns a sample; NaN off the field.
    #[must_use]
    pub fn post(&self, x: i32, y: i32) -> f32 {
        if x < 0 || y < 0 || x > self.size[0] || y > self.size[1] {
            return f32::NAN;
        }
        self.posts[(y * (self.size[0] + 1) + x) as usize]
    }

    /// Returns the corners of a patch (south-west, south-east, north-west, north-east); `None` at
    /// no-data and off the field.
    #[must_use]
    pub fn patch(&self, [x, y]: [i32; 2]) -> Option<[f64; 4]> {
        if x < 0 || y < 0 || x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let corners = corners.map(|(east, north)| f64::from(self.post(x + east, y + north)));
        let tallest = f64::from(MAX_HEIGHT);
        corners
            .iter()
            .all(|h| h.abs() <= tallest)
            .then_some(corners)
    }

    /// Returns an integer height that no sample exceeds.
    #[must_use]
    pub fn top(&self) -> i32 {
        let heights = self.posts.iter().filter(|h| h.abs() <= MAX_HEIGHT);
        let highest = heights.fold(f32::NEG_INFINITY, |a, b| a.max(*b));
        if highest == f32::NEG_INFINITY {
            0
        } else {
            highest as i32 + 1
        }
    }

    /// Returns the largest step between two neighbouring samples; infinite with no-data.
    #[must_use]
    pub fn steepest(&self) -> f32 {
        let [columns, rows] = self.size;
        let steps = (0..=rows).flat_map(|y| (0..=columns).map(move |x| (x, y)));
        let steps = steps.flat_map(|(x, y)| {
            let here = self.post(x, y);
            let east = if x < columns {
                self.post(x + 1, y)
            } else {
                here
            };
            let north = if y < rows { self.post(x, y + 1) } else { here };
            [east - here, north - here]
        });
        steps.fold(0.0, |max, step| {
            if step.is_nan() {
                f32::INFINITY
            } else {
                step.abs().max(max)
            }
        })
    }

    /// Returns the approximate height of the surface around a point, also at no-data.
    #[must_use]
    pub fn height_about(&self, x: f64, y: f64) -> f64 {
        let cell = [x.floor() as i32, y.floor() as i32];
        let Some([sw, se, nw, ne]) = self.patch(cell) else {
            return 0.0;
        };
        let (u, v) = (x - x.floor(), y - y.floor());
        let (south, north) = (sw + u * (se - sw), nw + u * (ne - nw));
        south + v * (north - south)
    }
}

struct Shape {
    kind: Kind,
    seed: u64,
    wave: [f64; 2],
    amplitude: f64,
    tilt: [f64; 2],
}

impl Shape {
    fn height(&self, x: i32, y: i32) -> f32 {
        let (fx, fy) = (f64::from(x), f64::from(y));
        let [wx, wy] = self.wave;
        let [tx, ty] = self.tilt;
        let random = self.random(x, y);
        let waves = (wx * fx).sin() * (wy * fy).cos();
        let height = match self.kind {
            Kind::Flat => 2.0,
            Kind::Slope => tx * fx + ty * fy,
            Kind::Hills => 3.0 * waves,
            Kind::Rough => 2.0 * random,
            Kind::Noise => 600.0 * random - 300.0,
            Kind::Checkerboard => f64::from((x + y) & 1),
            Kind::Spikes => f64::from(random > 0.967) * f64::from(MAX_STEP_CELLS),
            Kind::Denormals => {
                let tiny = f32::from_bits((random * 1000.0) as u32);
                return if self.random(y, x) > 0.5 { tiny } else { -tiny };
            }
            Kind::NoData => return no_data_or(random, 2.0 * self.random(y, x)),
            Kind::Ridges => 4.0 * ((0.25 * (tx * fx + ty * fy)).rem_euclid(2.0) - 1.0).abs(),
            Kind::Steps => 5.0 * (waves * 1.5).round() + f64::from(x / 11 % 3),
            Kind::Twisted => {
                let sign = if (x + y) & 1 == 0 { 1.0 } else { -1.0 };
                sign * self.amplitude * (0.5 + random)
            }
            Kind::Walls => {
                if x % WALL_EVERY == 0 || y % WALL_EVERY == 0 {
                    return WALL as f32;
                }
                waves
            }
            Kind::Scan => 3.0 * waves + tx * 0.1 * fx + 0.05 * random,
        };
        height as f32
    }

    /// Returns a number in `[0, 1)` for a sample.
    fn random(&self, x: i32, y: i32) -> f64 {
        let place = u64::from(x.cast_unsigned()) << 32 | u64::from(y.cast_unsigned());
        Random::new(self.seed ^ place.wrapping_mul(0x9e37_79b9_7f4a_7c15)).between(0.0, 1.0)
    }
}

fn no_data_or(random: f64, height: f64) -> f32 {
    match (random * 100.0) as u32 {
        0 | 1 => f32::NAN,
        2 => f32::INFINITY,
        3 => f32::NEG_INFINITY,
        4 => 1e30,
        5 => -1e10,
        _ => height as f32,
    }
}
