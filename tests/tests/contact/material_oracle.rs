//! Each test passes one false observation to the oracle of materials, which it must report; it
//! reports none of the correct ones around it, from the product's loop.

use hapterra_core::Vec3;
use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::{Material, Pattern, Shading, Texture};
use hapterra_tests::invariants::Invariant;
use hapterra_tests::invariants::material::{MaterialCounts, MaterialOracle};
use hapterra_tests::scene::loop_replay::{Replay, Replied, replay};
use hapterra_tests::scene::materials::Materials;
use hapterra_tests::scene::run::{Execution, Scene};
use hapterra_tests::scene::terrain::{Kind, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};
use hapterra_tests::whole_field::point;

const SIZE: [i32; 2] = [40, 40];
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

/// Violated invariant and point.
type Found = (Invariant, usize);

/// A path over flat ground with the second material from column 20 on: 1.5 cells deep, eastward by
/// a step in each tick, and back at the end.
struct Case {
    scene: Scene,
    materials: Materials,
    rendered: Vec<Replied>,
}

impl Case {
    fn over(table: [Material; 2], [from, step]: [f64; 2], shading: Shading) -> Self {
        let terrain = Terrain::from_fn(Kind::Flat, SIZE, |_, _| 2.0);
        let materials = Materials::from_fn(&table, SIZE, |x, _| u8::from(x >= 20));
        let steps = (0..240).chain((180..240).rev());
        let along = steps.map(|i| [from + step * f64::from(i), 10.25, 0.5]);
        let path = [[from, 10.25, 3.0]].into_iter().chain(along).collect();
        let (execution, supply) = (Execution::LockStep, Supply::Preloaded);
        let mut scene = Scene::new(terrain, path, execution, supply);
        scene.shading = shading;
        let shift = [0; 3];
        let how = Replay { shift, supply };
        let mut buffers = Buffers::default();
        let rendered = replay::<4>(&scene, &materials, &mut buffers, how, |_| Ok(()));
        Self {
            rendered: rendered.expect("settles"),
            scene,
            materials,
        }
    }

    /// Returns the oracle's result if one point is changed: the violation with its point, and the
    /// measurements.
    fn with(&self, at: usize, change: impl Fn(&mut Replied)) -> (Option<Found>, MaterialCounts) {
        let mut oracle = MaterialOracle::new(&self.scene, &self.materials, [0; 3]);
        for (point, rendered) in self.rendered.iter().enumerate() {
            let mut rendered = *rendered;
            if point == at {
                change(&mut rendered);
            }
            if let Err(violation) = oracle.check(&rendered) {
                return (Some((violation.invariant, point)), oracle.counts);
            }
        }
        (None, oracle.counts)
    }

    fn honest(&self) -> MaterialCounts {
        let (found, counts) = self.with(usize::MAX, |_| {});
        assert_eq!(found, None);
        counts
    }

    /// Returns the violation by another force, which must be reported at that point.
    fn force(&self, at: usize, change: impl Fn(Vec3) -> Vec3) -> Option<Invariant> {
        let changed =
            |rendered: &mut Replied| rendered.sample.force_n = change(rendered.sample.force_n);
        self.at_once(at, changed)
    }

    fn at_once(&self, at: usize, change: impl Fn(&mut Replied)) -> Option<Invariant> {
        let found = self.with(at, change).0;
        found.map(|(invariant, point)| {
            assert_eq!(point, at, "{invariant:?}");
            invariant
        })
    }

    /// Returns the violation by a shifted proxy with the force of a stiffness at its position.
    fn proxy(&self, at: usize, east: f64, stiffness: f64) -> Option<Invariant> {
        let moved = |rendered: &mut Replied| {
            rendered.proxy[0] += east;
            rendered.sample.proxy = point(rendered.proxy);
            let force_n =
                [0, 1, 2].map(|i| ((rendered.proxy[i] - rendered.hip[i]) * stiffness) as f32);
            rendered.sample.force_n = Vec3::from_array(force_n);
        };
        self.at_once(at, moved)
    }
}

/// Start of a path, and its step.
const SLOW: [f64; 2] = [18.51, 0.02];
/// Its first point beyond the border at 19.5; point 0 is above the ground.
const BORDER: usize = 51;

#[test]
fn wrong_force_during_a_stiffness_change_is_detected() {
    let case = Case::over([SOFT, HARD], SLOW, Shading::None);
    let counts = case.honest();
    assert_eq!((counts.compared_as_vectors, counts.open), (300, 0));
    assert!((100..110).contains(&counts.changing), "{counts:?}");
    let wrong = Some(Invariant::Material);
    // In one step, not at all, one tick early and one tick late.
    assert_eq!(case.force(BORDER, |_| Vec3::Z * 1.5), wrong);
    assert_eq!(case.force(BORDER + 40, |_| Vec3::Z * 0.6), wrong);
    assert_eq!(case.force(BORDER - 1, |f| f + Vec3::Z * 0.009), wrong);
    for at in [BORDER + 1, BORDER + 50, BORDER + 98] {
        assert_eq!(case.force(at, |f| f + Vec3::Z * 0.009), wrong, "{at}");
        assert_eq!(case.force(at, |f| f - Vec3::Z * 0.009), wrong, "{at}");
    }
    for at in [3, BORDER, 299] {
        assert_eq!(case.force(at, |f| f * 1.0001), wrong, "{at}");
        assert_eq!(case.force(at, |f| f + Vec3::X * 1e-3), wrong, "{at}");
        assert_eq!(case.force(at, |f| -f), wrong, "it pulls");
        assert_eq!(case.force(at, |f| f * 1e3), wrong, "above the limit");
    }
}

#[test]
fn equidistant_materials_are_accepted_until_force_decides() {
    // Up to the line half way between two samples.
    let case = Case::over([SOFT, HARD], [18.5, 1.0 / 64.0], Shading::None);
    let on_line = 66;
    assert_eq!(case.rendered[on_line - 1].proxy[0], 19.5);
    case.honest();
    // There the old class would be valid, but then the next point is the first of the change.
    let before = |rendered: &mut Replied| rendered.sample.force_n = Vec3::Z * 0.6;
    let (found, _) = case.with(on_line - 1, before);
    assert_eq!(found, Some((Invariant::Material, on_line)));
    let wrong = Some(Invariant::Material);
    assert_eq!(case.force(on_line - 1, |_| Vec3::Z * 0.61), wrong);
    assert_eq!(case.force(on_line - 2, |_| Vec3::Z * 0.609), wrong);
}

#[test]
fn friction_of_the_place_after_is_found() {
    let rough = Material {
        friction: Friction::coulomb(0.5),
        ..SOFT
    };
    let case = Case::over([SOFT, rough], SLOW, Shading::None);
    let counts = case.honest();
    assert!(counts.sliding > 150 && counts.open == 0, "{counts:?}");
    // At 1.5 cells depth, each tick of the change holds 0.0075 cells more.
    let proxy = |at, east| case.proxy(BORDER + at, east, 0.4);
    let early = proxy(0, -0.0075);
    assert_eq!(early, Some(Invariant::LocalMinimum), "nothing is held yet");
    assert_eq!(proxy(10, 0.0), None);
    assert_eq!(proxy(10, -0.0075), Some(Invariant::Cone), "one tick early");
    assert_eq!(proxy(10, 0.0075), Some(Invariant::Cone), "one tick late");
    // On its return it is held, and does not move.
    let [stuck, before] = [280, 279].map(|at| case.rendered[at].sample.proxy);
    assert_eq!(stuck, before);
    assert_eq!(case.proxy(280, 1e-4, 0.4), Some(Invariant::Cone));
}

#[test]
fn two_simultaneous_textures_are_detected() {
    let textured = |wavelength_mm| Material {
        texture: Texture {
            wavelength_mm,
            ..GRATING
        },
        ..SOFT
    };
    let case = Case::over([textured(1.0), textured(1.7)], SLOW, Shading::None);
    case.honest();
    let wrong = Some(Invariant::Material);
    // In the middle of the change neither texture has any force.
    assert_eq!(case.force(BORDER + 50, |f| f + Vec3::Z * 0.004), wrong);
    for at in [BORDER + 10, BORDER + 90, 280] {
        assert_eq!(case.force(at, |f| f + Vec3::Z * 4e-3), wrong, "{at}");
        assert_eq!(case.force(at, |f| f + Vec3::X * 8e-3), wrong, "{at}");
    }
}

#[test]
fn another_damping_is_found() {
    let damped = Material {
        damping_ns_per_m: 10.0,
        ..SOFT
    };
    let rough = Material {
        friction: Friction::coulomb(0.3),
        ..damped
    };
    // 20 mm/s along the force make 0.2 N, and less with friction.
    let case = Case::over([SOFT, rough], SLOW, Shading::None);
    case.honest();
    let wrong = Some(Invariant::Material);
    assert_eq!(case.force(280, |f| f * 1.01), wrong);
    assert_eq!(case.force(280, |f| f / f.length() * 0.4 * 1.566), wrong);
}

#[test]
fn shaded_force_is_checked_by_magnitude() {
    let case = Case::over([SOFT, HARD], SLOW, Shading::Smooth);
    let counts = case.honest();
    assert_eq!(
        (counts.compared_as_vectors, counts.compared_by_size),
        (0, 300)
    );
    let wrong = Some(Invariant::Material);
    assert_eq!(case.force(BORDER + 50, |f| f * 1.001), wrong);
    assert_eq!(case.force(BORDER + 50, |f| f * 0.999), wrong);
    let turned = |f: Vec3| Vec3::X * f.length();
    assert_eq!(case.force(BORDER + 50, turned), wrong, "by 90°");
}

#[test]
fn force_without_contact_is_detected() {
    let case = Case::over([SOFT, HARD], SLOW, Shading::None);
    let found = case.at_once(0, |rendered| {
        assert_eq!(rendered.sample.state, ContactState::Free);
        rendered.sample.force_n = Vec3::Z * 1e-3;
    });
    assert_eq!(found, Some(Invariant::Material));
}
