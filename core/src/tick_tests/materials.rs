//! Materials: the force at a border of classes.

use std::vec::Vec;

use super::*;
use crate::contact::Friction;
use crate::force::{MATERIAL_CHANGE_S, Material, MaterialTable, Pattern, Shading, Texture};
use crate::terrain::TileIndex;

/// Ticks of a complete transition.
const CHANGE: u32 = (1e3 * MATERIAL_CHANGE_S) as u32;
const SOFT: Material = Material {
    stiffness_n_per_mm: 0.4,
    friction: Friction::NONE,
    damping_ns_per_m: 0.0,
    texture: Texture::NONE,
};
const HARD: Material = Material {
    stiffness_n_per_mm: 1.0,
    ..SOFT
};
const GRATING: Texture = Texture {
    pattern: Pattern::Grating,
    amplitude_mm: 0.1,
    wavelength_mm: 1.0,
    ..Texture::NONE
};

/// A level field of two tiles at height 0 in a replay; its samples from column `border` on have
/// material 1.
struct Ground<'t> {
    haptics: Haptics<'t, 2>,
    spare: Vec<&'t mut Tile>,
    border: i32,
    seq: u32,
    /// Number of ticks run.
    ticks: u32,
}

impl<'t> Ground<'t> {
    fn of(tiles: &'t mut [Tile], table: &[Material], border: i32, shading: Shading) -> Self {
        let table = MaterialTable::new(table).expect("some");
        assert!(table.is_valid());
        let mut spare: Vec<_> = tiles.iter_mut().collect();
        let mut next = || spare.pop().expect("a tile");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let mut haptics = Haptics::<2>::new(slots, TickRate::DEFAULT, None);
        let mut scene = Scene {
            size: FieldSize::new(64, 32),
            materials: Some(table.check_sum()),
            ..scene(Source::Points)
        };
        scene.params.stiffness_n_per_mm = table.materials()[0].stiffness_n_per_mm;
        scene.params.shading = shading;
        haptics.set_materials(&table);
        assert!(matches!(haptics.accept(Command::Scene(scene)), Ok(None)));
        assert!(haptics.scene.is_some(), "taken");
        let mut ground = Self {
            haptics,
            spare,
            border,
            seq: 0,
            ticks: 0,
        };
        ground.serve(0);
        ground
    }

    fn serve(&mut self, col: i32) {
        let tile = self.spare.pop().expect("a spare tile");
        let key = TileKey::new(0, col, 0);
        tile.fill_from(key, 0, FieldSize::new(64, 32), |_, _| 0.0)
            .expect("in range");
        let border = self.border;
        let samples =
            (0..TILE_SAMPLES * TILE_SAMPLES).map(|i| col * 32 + (i % TILE_SAMPLES) as i32);
        let materials = samples.map(|x| u8::from(x >= border));
        tile.set_materials(2, materials).expect("of the table");
        self.spare
            .extend(self.haptics.accept(Command::Tile(tile)).expect("taken"));
    }

    /// Returns the record at a place; a missing tile arrives `late` ticks after its request.
    fn at(&mut self, [x, y, z]: [f32; 3], late: u32) -> TickRecord {
        let seq = self.seq;
        self.seq += 1;
        let hip = GridPoint::new([0, 10, 0], Vec3::new(x, y, z));
        assert!(
            self.haptics
                .accept(Command::Hip(HipCommand { seq, hip }))
                .is_ok_and(|spare| spare.is_none())
        );
        let mut missed = 0;
        for _ in 0..200 {
            self.ticks += 1;
            let outcome = self.haptics.tick(&GuardInputs::default(), true);
            if outcome.answered_seq == Some(seq) {
                return outcome.sample;
            }
            if let Some(TileIndex { col, .. }) = outcome.sample.missing_tile {
                missed += 1;
                if missed > late {
                    self.serve(col);
                }
            }
        }
        panic!("no answer at {x} {y} {z}");
    }

    /// The forces along a path at a depth.
    fn along(&mut self, xs: impl IntoIterator<Item = f32>, depth: f32) -> Vec<Vec3> {
        xs.into_iter()
            .map(|x| self.at([x, 0.5, -depth], 0).force_n)
            .collect()
    }
}

fn tiles() -> Vec<Tile> {
    std::vec![Tile::VACANT; 7]
}

/// `count` places from a place on, in steps.
fn steps(from: f32, step: f32, count: u32) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| from + step * i as f32)
}

fn max_step(forces: &[Vec3]) -> f32 {
    let steps = forces.windows(2).map(|pair| (pair[1] - pair[0]).length());
    steps.fold(0.0, f32::max)
}

#[test]
fn stiffness_is_continuous_across_border_midway_between_samples() {
    for step in [0.001, 0.02, -0.02] {
        let mut tiles = tiles();
        let table = match step > 0.0 {
            true => [SOFT, HARD],
            false => [HARD, SOFT],
        };
        let mut ground = Ground::of(&mut tiles, &table, 20, Shading::None);
        let (begin, border) = (19.5 - 50.5 * step, 19.5);
        ground.at([begin, 0.5, 1.0], 0);
        let depth = 5.0;
        // Down at the start of the path, over the border and on.
        let forces = ground.along(steps(begin, step, 200), depth);
        let (first, last) = match step > 0.0 {
            true => (SOFT, HARD),
            false => (SOFT, HARD),
        };
        let (from, to) = (first.stiffness_n_per_mm, last.stiffness_n_per_mm);
        // A path westward starts east of the border.
        assert_eq!(forces[49].z, from * depth, "{step}: before {border}");
        assert!(forces[51].z > from * depth, "{step}: {}", forces[51]);
        assert_eq!(forces[51 + CHANGE as usize].z, to * depth, "{step}");
        let max = (to - from) * depth / CHANGE as f32;
        let largest = max_step(&forces);
        assert!(largest < 1.001 * max, "{step}: {largest} N, {max} at most");
    }
}

#[test]
fn material_is_rendered_at_once_after_the_air() {
    let mut tiles = tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, HARD], 20, Shading::None);
    ground.at([5.0, 0.5, 1.0], 0);
    assert_eq!(ground.at([5.0, 0.5, -1.0], 0).force_n, Vec3::Z * 0.4);
    ground.at([25.0, 0.5, 1.0], 0);
    assert_eq!(ground.at([25.0, 0.5, -1.0], 0).force_n, Vec3::Z);
    ground.at([5.0, 0.5, 1.0], 0);
    assert_eq!(ground.at([5.0, 0.5, -1.0], 0).force_n, Vec3::Z * 0.4);
}

#[test]
fn friction_blends_evenly_and_stuck_proxy_keeps_its_material() {
    let rough = Material {
        friction: Friction::coulomb(0.8),
        ..SOFT
    };
    let mut tiles = tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, rough], 20, Shading::None);
    ground.at([18.0, 0.5, 1.0], 0);
    let depth = 2.0;
    let forces = ground.along(steps(18.0, 0.02, 400), depth);
    assert!(forces[70].truncate().length() < 1e-5, "{}", forces[70]);
    let (held, pressed) = (-forces[399].x, forces[399].z);
    assert!((held / pressed - 0.8).abs() < 1e-3, "{held} {pressed}");
    // The maximum is the change of friction in a tick plus a hand's motion of 0.02 in a tick.
    let max = 0.4 * (depth * 0.8 / CHANGE as f32 + 0.02);
    let largest = max_step(&forces[1..]);
    assert!(largest < 1.01 * max, "{largest} N, {max} at most");

    // The proxy sticks east of the border while the HIP moves over it: the proxy's material counts.
    let mut tiles = self::tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, rough], 20, Shading::None);
    ground.at([20.2, 0.5, 1.0], 0);
    ground.along(core::iter::repeat_n(20.2, 200), depth);
    let stuck = ground.at([20.2, 0.5, -depth], 0).proxy;
    for x in [20.0, 19.6, 19.2, 18.8] {
        for _ in 0..50 {
            let rendered = ground.at([x, 0.5, -depth], 0);
            assert_eq!(rendered.proxy, stuck, "{x}");
            assert_eq!(rendered.force_n.z, 0.4 * depth);
        }
    }
}

#[test]
fn texture_fades_out_before_the_next_fades_in() {
    let textured = |texture| Material { texture, ..SOFT };
    let waves = |wavelength_mm| Texture {
        wavelength_mm,
        ..GRATING
    };
    for table in [
        [textured(waves(1.0)), textured(waves(1.7))],
        [SOFT, textured(waves(1.0))],
        [textured(waves(1.0)), SOFT],
        [
            textured(waves(1.0)),
            textured(Texture {
                pattern: Pattern::Grain,
                ..GRATING
            }),
        ],
    ] {
        let mut tiles = tiles();
        let mut ground = Ground::of(&mut tiles, &table, 20, Shading::None);
        ground.at([10.0, 0.5, 1.0], 0);
        let forces = ground.along(steps(10.0, 0.02, 900), 1.0);
        let swing = |from: usize, to: usize| {
            let off = forces[from..to].iter().map(|force| (force.z - 0.4).abs());
            off.fold(0.0, f32::max)
        };
        // The 476th tick crosses the border; 50 ms later neither texture is rendered.
        let (before, between, after) = (swing(100, 470), swing(524, 527), swing(700, 900));
        // A surface without texture has nothing to fade out.
        let goes_out = !table[0].texture.is_none();
        assert!(!goes_out || between < 4e-3, "{table:?}: {between}");
        for (material, rendered) in table.iter().zip([before, after]) {
            let expected = if material.texture.is_none() {
                0.0
            } else {
                0.04
            };
            let min = if expected > 0.0 { 0.2 } else { 0.0 };
            assert!(
                rendered >= min * expected && rendered < 1.01 * expected + 1e-6,
                "{rendered}"
            );
        }
        // No more than the wave itself: 2π A / λ times the stiffness and the path.
        let max = 0.4 * 0.02 * core::f32::consts::TAU * 0.1 * 2.0 + 0.04 / 25.0;
        let largest = max_step(&forces[100..]);
        assert!(largest < max, "{table:?}: {largest} of {max}");
        assert!(forces.iter().all(|force| force.z >= 0.0), "it pulls");
    }
}

#[test]
fn damping_follows_the_material() {
    let damped = Material {
        damping_ns_per_m: 10.0,
        ..SOFT
    };
    let mut tiles = tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, damped], 20, Shading::None);
    for (x, ns_per_m) in [(5.0, 0.0), (25.0, 10.0), (5.0, 0.0)] {
        ground.at([x, 0.5, 1.0], 0);
        ground.at([x, 0.5, -3.0], 0);
        // A cell of a millimetre in a tick of a millisecond, and a tenth of it.
        let rendered = ground.at([x, 0.5, -3.1], 0).force_n.z;
        let expected = 0.4 * 3.1 + 1e-3 * ns_per_m * 100.0;
        assert!(
            (rendered - expected).abs() < 1e-3,
            "{x}: {rendered}, not {expected}"
        );
    }
}

/// Returns the forces of points over the border of a tile and one of classes, with late tiles.
fn rendered(late: u32, border: i32, shading: Shading) -> (Vec<TickRecord>, u32) {
    let rough = Material {
        friction: Friction::coulomb(0.5),
        texture: GRATING,
        damping_ns_per_m: 3.0,
        ..HARD
    };
    let mut tiles = tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, rough], border, shading);
    ground.at([29.0, 0.5, 1.0], 0);
    let path = steps(29.0, 0.02, 300);
    let rendered = path.map(|x| {
        let mut sample = ground.at([x, 0.5, -1.5], late);
        // The tick number and the cost of a sample are not part of the force.
        (sample.tick, sample.work, sample.missing_tile) = (0, 0, None);
        sample
    });
    (rendered.collect(), ground.ticks)
}

#[test]
fn repeated_tick_gives_the_same_record() {
    for border in [31, 32, 33] {
        for shading in [Shading::None, Shading::Smooth] {
            let (early, ticks) = rendered(0, border, shading);
            let (late, more) = rendered(30, border, shading);
            assert!(more >= ticks + 30, "{ticks} {more}");
            assert_eq!(early, late, "{border}");
        }
    }
}

/// A replay with a table over a field, whose tiles arrive on request.
fn replayed<'t, const D: usize>(
    tiles: &'t mut [Tile],
    table: &[Material],
    height: fn(i32, i32) -> f32,
    material: fn(TileKey, [i32; 2]) -> Option<u8>,
) -> Device<'t, D> {
    let mut device = Device::<D>::new(tiles, Source::Points, height);
    let table = MaterialTable::new(table).expect("some");
    let mut scene = Scene {
        materials: Some(table.check_sum()),
        ..scene(Source::Points)
    };
    scene.params.stiffness_n_per_mm = table.materials()[0].stiffness_n_per_mm;
    scene.params.shading = Shading::Smooth;
    device.haptics.set_materials(&table);
    device.send(Command::Scene(scene));
    device.requester.reset(0, scene.size);
    device.material = material;
    device
}

#[test]
fn tile_without_materials_keeps_previous_material() {
    let mut tiles = buffers::<4>();
    let east_alone = |key: TileKey, _| (key.index.col >= 10).then_some(1);
    let mut device = replayed::<4>(&mut tiles, &[SOFT, HARD], |_, _| 0.0, east_alone);
    let mut seq = 0;
    let mut at = |x: f32, z: f32| {
        seq += 1;
        let hip = GridPoint::new([300, 300, 0], Vec3::new(x, 0.5, z));
        device.step(seq, hip).force_n.z
    };
    at(5.0, 1.0);
    assert_eq!(at(5.0, -1.0), 0.4, "the default");
    at(25.0, 1.0);
    assert_eq!(at(25.0, -1.0), 1.0);
    for x in 0..200 {
        assert_eq!(at(25.0 - 0.1 * x as f32, -1.0), 1.0, "{x}");
    }
    at(5.0, 1.0);
    assert_eq!(at(5.0, -1.0), 1.0, "out of the air, too");
}

#[test]
fn small_windows_render_the_same_bits_as_a_large_one() {
    fn rendered<const D: usize>() -> Vec<(GridPoint, Vec3)> {
        let rough = Material {
            friction: Friction::coulomb(0.4),
            texture: GRATING,
            ..HARD
        };
        let damped = Material {
            damping_ns_per_m: 5.0,
            texture: Texture {
                pattern: Pattern::Grain,
                ..GRATING
            },
            ..SOFT
        };
        let mut tiles = buffers::<D>();
        let patches = |_: TileKey, [x, y]: [i32; 2]| Some(((x / 6 + y / 4) % 4) as u8);
        let table = [SOFT, rough, damped, HARD];
        let mut device = replayed::<D>(&mut tiles, &table, hills, patches);
        let mut path = (0..cases(3_000, 40)).map(|i| {
            let (t, down) = (f64::from(i), i % 500 > 3);
            let x = 300.0 + 40.0 * libm::sin(t * 0.011) + 20.0 * libm::sin(t * 0.0017);
            let y = 310.0 + 35.0 * libm::cos(t * 0.007);
            let ground = f64::from(hills(x as i32, y as i32));
            let z = ground + if down { -0.7 } else { 6.0 };
            let place = |c: f64| (c.floor() as i32, (c - c.floor()) as f32);
            let ((x, u), (y, v), (z, w)) = (place(x), place(y), place(z));
            let sample = device.step(i, GridPoint::new([x, y, z], Vec3::new(u, v, w)));
            (sample.proxy, sample.force_n)
        });
        path.by_ref().collect()
    }
    let large = rendered::<8>();
    assert!(
        large
            .iter()
            .filter(|(_, force)| *force != Vec3::ZERO)
            .count()
            > cases(2_000, 10) as usize
    );
    assert_eq!(rendered::<2>(), large);
    assert_eq!(rendered::<3>(), large);
    assert_eq!(rendered::<4>(), large);
}

#[test]
fn scene_without_its_material_table_is_refused() {
    let mut tiles = tiles();
    let mut ground = Ground::of(&mut tiles, &[SOFT, HARD], 20, Shading::None);
    let before = ground.haptics.scene;
    let other = MaterialTable::new(&[HARD, SOFT]).expect("some");
    let scene = Scene {
        epoch: 9,
        materials: Some(other.check_sum()),
        ..before.expect("taken")
    };
    assert_eq!(
        ground.haptics.accept(Command::Scene(scene)).err(),
        Some(RefusedScene)
    );
    assert_eq!(ground.haptics.scene, None);
    ground.haptics.set_materials(&other);
    assert!(matches!(
        ground.haptics.accept(Command::Scene(scene)),
        Ok(None)
    ));
    assert_eq!(ground.haptics.scene, Some(scene));
    // An invalid table is ignored, even with the right check sum.
    for broken in [
        Material {
            stiffness_n_per_mm: f32::NAN,
            ..SOFT
        },
        Material {
            stiffness_n_per_mm: 0.0,
            ..SOFT
        },
        Material {
            friction: Friction::coulomb(-1.0),
            ..SOFT
        },
    ] {
        let broken = MaterialTable::new(&[broken]).expect("one");
        assert!(!broken.is_valid());
        ground.haptics.set_materials(&broken);
        let scene = Scene {
            materials: Some(broken.check_sum()),
            ..scene
        };
        assert_eq!(
            ground.haptics.accept(Command::Scene(scene)).err(),
            Some(RefusedScene)
        );
        assert_eq!(ground.haptics.scene, None);
    }
    assert!(MaterialTable::new(&[]).is_none() && MaterialTable::new(&[SOFT; 17]).is_none());
}

#[test]
fn material_table_check_sum_depends_on_every_field() {
    let plain = Material {
        friction: Friction {
            static_mu: 0.5,
            dynamic_mu: 0.4,
            viscous_s: 0.01,
        },
        texture: GRATING,
        ..SOFT
    };
    let changes: [fn(&mut Material); 10] = [
        |m| m.stiffness_n_per_mm += 0.1,
        |m| m.friction.static_mu += 0.1,
        |m| m.friction.dynamic_mu += 0.1,
        |m| m.friction.viscous_s += 0.1,
        |m| m.damping_ns_per_m += 0.1,
        |m| m.texture.pattern = Pattern::Grain,
        |m| m.texture.amplitude_mm += 0.01,
        |m| m.texture.wavelength_mm += 0.1,
        |m| m.texture.direction_deg += 0.1,
        |m| m.texture.seed += 1,
    ];
    let sum = |materials: &[Material]| MaterialTable::new(materials).expect("some").check_sum();
    let mut sums = std::vec![sum(&[plain]), sum(&[plain; 2])];
    for change in changes {
        let mut other = plain;
        change(&mut other);
        sums.push(sum(&[other]));
    }
    sums.sort_unstable();
    sums.dedup();
    assert_eq!(sums.len(), 12);
}
