//! Random materials of a scene: a table, and the class of each sample.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Material, MaterialTable, SurfaceParams, Texture};

use super::run::{friction, texture};
use super::symmetry::Symmetry;
use super::terrain::Terrain;
use crate::random::Random;

/// One scene in this many has materials.
const EVERY: usize = 4;

/// Layout of the classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// One class for all samples.
    One,
    /// One class in the west or south, another in the rest; often at a tile's border.
    Halves,
    /// Two classes, alternating from sample to sample.
    Checker,
    /// All classes, in stripes.
    Stripes,
    /// A random class for each sample.
    Each,
    /// Patches of some samples.
    Blobs,
}

/// All layouts.
pub const LAYOUTS: [Layout; 6] = [
    Layout::One,
    Layout::Halves,
    Layout::Checker,
    Layout::Stripes,
    Layout::Each,
    Layout::Blobs,
];

/// Materials of a scene's ground.
#[derive(Clone, Debug)]
pub struct Materials {
    /// The materials; the default is first.
    pub table: Vec<Material>,
    /// Layout of the classes.
    pub layout: Layout,
    /// The scene's own parameters: a limit, and a stiffness that is the default's or a multiple.
    pub params: SurfaceParams,
    /// Millimetres a cell: a power of two, so that lengths in cells are exact.
    pub cell_mm: f32,
    /// Samples along each side.
    size: [i32; 2],
    /// The class of each sample, by rows from the south.
    classes: Vec<u8>,
    seed: u64,
}

impl Materials {
    /// Draws the materials of a scene, if it has some: one in four has.
    pub(super) fn drawn(mixed: u64, terrain: &Terrain) -> Option<Self> {
        // From a generator of their own, so that the rest of a scene stays as it was.
        let mut random = Random::new(mixed ^ 0x3a7e_71a1);
        (random.below(EVERY) == 0).then(|| Self::random(&mut random, terrain))
    }

    fn random(random: &mut Random, terrain: &Terrain) -> Self {
        let count = match random.below(8) {
            0 => 1,
            1 | 2 => 2,
            3 | 4 => MaterialTable::MAX,
            _ => 1 + random.below(MaterialTable::MAX),
        };
        let mut table: Vec<Material> = Vec::new();
        for index in 0..count {
            let material = material(random, table.last());
            table.push(match index {
                // A default without stiffness is refused.
                0 if material.stiffness_n_per_mm == 0.0 => Material {
                    stiffness_n_per_mm: 0.5,
                    ..material
                },
                _ => material,
            });
        }
        let layout = LAYOUTS[random.below(LAYOUTS.len())];
        let scale = [1.0, 1.0, 0.5, 3.0][random.below(4)];
        let params = SurfaceParams {
            stiffness_n_per_mm: table[0].stiffness_n_per_mm * scale,
            max_force_n: [8.5, 8.5, 1.0, 1e4][random.below(4)],
            ..SurfaceParams::PREMIUM
        };
        let mut materials = Self {
            table,
            layout,
            params,
            cell_mm: [1.0, 1.0, 0.25, 4.0][random.below(4)],
            size: terrain.size.map(|patches| patches + 1),
            classes: Vec::new(),
            seed: random.bits(),
        };
        let class_of = classes(layout, count, terrain.size, random);
        materials.assign(class_of);
        materials
    }

    /// Creates materials whose classes are a function of the sample.
    #[must_use]
    pub fn from_fn(table: &[Material], size: [i32; 2], class: impl Fn(i32, i32) -> u8) -> Self {
        let mut materials = Self {
            table: table.to_vec(),
            layout: Layout::Each,
            params: SurfaceParams {
                stiffness_n_per_mm: table[0].stiffness_n_per_mm,
                ..SurfaceParams::PREMIUM
            },
            cell_mm: 1.0,
            size: size.map(|patches| patches + 1),
            classes: Vec::new(),
            seed: 1,
        };
        materials.assign(class);
        materials
    }

    fn assign(&mut self, class: impl Fn(i32, i32) -> u8) {
        let [columns, rows] = self.size;
        let samples = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        self.classes = samples.map(|(x, y)| class(x, y)).collect();
    }

    /// Returns the class of a sample: the index of its material in the table. Beyond the field it
    /// is the default's.
    #[must_use]
    pub fn class(&self, x: i32, y: i32) -> u8 {
        let [columns, rows] = self.size;
        if !(0..columns).contains(&x) || !(0..rows).contains(&y) {
            return 0;
        }
        self.classes[(y * columns + x) as usize]
    }

    /// Returns the same ground with friction drawn from the scene; some of it stays frictionless.
    #[must_use]
    pub fn roughened(mut self) -> Self {
        let mut random = Random::new(self.seed ^ 0xf71c_7104);
        for material in &mut self.table {
            material.friction = match random.below(4) {
                0 => Friction::NONE,
                _ => friction(&mut random),
            };
        }
        self
    }

    /// Returns the table as the device receives it.
    ///
    /// # Panics
    /// If it is empty or too long.
    #[must_use]
    pub fn reported(&self) -> MaterialTable {
        MaterialTable::new(&self.table).expect("as many as fit")
    }

    /// Returns true if no material has friction.
    #[must_use]
    pub fn is_frictionless(&self) -> bool {
        self.table.iter().all(|one| one.friction.is_none())
    }

    /// Returns the ground mirrored or turned.
    #[must_use]
    pub fn relative_to_(&self, symmetry: Symmetry) -> Self {
        let [columns, rows] = self.size;
        let mut turned = Self {
            size: match symmetry.transpose {
                true => [rows, columns],
                false => self.size,
            },
            ..self.clone()
        };
        turned.assign(|x, y| {
            let (x, y) = if symmetry.transpose { (y, x) } else { (x, y) };
            let x = if symmetry.mirror_x {
                columns - 1 - x
            } else {
                x
            };
            let y = if symmetry.mirror_y { rows - 1 - y } else { y };
            self.class(x, y)
        });
        turned
    }
}

/// Draws a material; sometimes with the texture of the one before.
fn material(random: &mut Random, before: Option<&Material>) -> Material {
    let own = texture(random.bits());
    let shared = before.map_or(Texture::NONE, |before| before.texture);
    Material {
        stiffness_n_per_mm: match random.below(16) {
            0 => 0.0,
            1..8 => [0.02, 0.5, 0.5, 0.6, 1.0, 5.0][random.below(6)],
            _ => 10_f64.powf(random.between(-2.0, 0.7)) as f32,
        },
        friction: Friction::NONE,
        damping_ns_per_m: [0.0, 0.0, 0.0, 1.0, 5.0, Damping::MAX_NS_PER_M][random.below(6)],
        texture: [own, own, own, shared][random.below(4)],
    }
}

/// Returns the class of each sample in a field of this many patches.
fn classes(
    layout: Layout,
    count: usize,
    size: [i32; 2],
    random: &mut Random,
) -> Box<dyn Fn(i32, i32) -> u8> {
    let mut any = || random.below(count) as u8;
    let (one, other) = (any(), any());
    let east = random.below(2) == 0;
    let along = move |x: i32, y: i32| if east { x } else { y };
    match layout {
        Layout::One => Box::new(move |_, _| one),
        Layout::Halves => {
            let patches = along(size[0], size[1]);
            let border = match random.below(2) {
                0 => patches / 64 * 32 + [0, 1][random.below(2)],
                _ => random.below(patches as usize) as i32,
            };
            Box::new(move |x, y| if along(x, y) < border { one } else { other })
        }
        Layout::Checker => Box::new(move |x, y| if (x + y) & 1 == 0 { one } else { other }),
        Layout::Stripes => {
            let width = [1, 2, 5, 16, 32][random.below(5)];
            let count = count as i32;
            Box::new(move |x, y| (along(x, y) / width % count) as u8)
        }
        Layout::Each => {
            let seed = random.bits();
            Box::new(move |x, y| random_at(seed, x, y).below(count) as u8)
        }
        Layout::Blobs => {
            let (seed, side) = (random.bits(), [3, 8, 20][random.below(3)]);
            Box::new(move |x, y| blob(seed, side, [x, y]).below(count) as u8)
        }
    }
}

/// Returns the random numbers of a sample.
fn random_at(seed: u64, x: i32, y: i32) -> Random {
    let place = u64::from(x.cast_unsigned()) << 32 | u64::from(y.cast_unsigned());
    Random::new(seed ^ place.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Returns the random numbers of a sample's blob: each square of `side` samples has a centre, and a
/// sample belongs to the nearest one.
fn blob(seed: u64, side: i32, [x, y]: [i32; 2]) -> Random {
    let (col, row) = (x.div_euclid(side), y.div_euclid(side));
    let squares = (-1..=1).flat_map(|north| (-1..=1).map(move |east| (col + east, row + north)));
    let nearest = squares.min_by(|a, b| {
        let distance = |(col, row): &(i32, i32)| {
            let mut random = random_at(seed, *col, *row);
            let mut middle = |at: i32| f64::from(side) * (f64::from(at) + random.between(0.0, 1.0));
            let (east, north) = (middle(*col), middle(*row));
            (east - f64::from(x)).hypot(north - f64::from(y))
        };
        distance(a).total_cmp(&distance(b))
    });
    let (col, row) = nearest.unwrap_or((col, row));
    random_at(!seed, col, row)
}
