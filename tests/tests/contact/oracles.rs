//! For each invariant a test passes one false observation to the oracle and checks that only this
//! invariant reports it. The correct observation beside it is reported by none.

use hapterra_core::Vec3;
use hapterra_core::contact::{ContactOutput, ContactState, Friction, WORK_PER_TICK};
use hapterra_core::force::{Pattern, Texture};
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::TileIndex;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_tests::invariants::observed_tick::{ObservedTick, Shaded};
use hapterra_tests::invariants::oracle::TickOracle;
use hapterra_tests::invariants::{Invariant, Violation};
use hapterra_tests::random::Random;
use hapterra_tests::scene::metamorphic;
use hapterra_tests::scene::run::{Execution, Scene};
use hapterra_tests::scene::symmetry;
use hapterra_tests::scene::terrain::{Kind, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};
use hapterra_tests::whole_field::point;

const SIZE: [i32; 2] = [40, 40];

/// Ground at height 2.
fn flat() -> Terrain {
    Terrain::from_fn(Kind::Flat, SIZE, |_, _| 2.0)
}

/// A ridge along x = 20, its sides falling by 1 a cell.
fn ridge() -> Terrain {
    Terrain::from_fn(Kind::Ridges, SIZE, |x, _| 2.0 - (x - 20).abs() as f32)
}

/// Walls along x = 0, 23 and y = 0, 23; 0 between them.
fn walls() -> Terrain {
    Terrain::from_fn(Kind::Walls, SIZE, |x, y| {
        if x % 23 == 0 || y % 23 == 0 {
            300.0
        } else {
            0.0
        }
    })
}

fn rendered(state: ContactState, proxy: [f64; 3], displacement: [f64; 3]) -> ContactOutput {
    ContactOutput {
        state,
        proxy: point(proxy),
        displacement: Vec3::from_array(displacement.map(|s| s as f32)),
        converged: true,
        missing_tile: None,
        work: 3,
    }
}

fn unseeded(hip: [f64; 3]) -> ObservedTick {
    ObservedTick::new(hip, rendered(ContactState::Unseeded, hip, [0.0; 3]), [0; 3])
}

fn free(hip: [f64; 3]) -> ObservedTick {
    ObservedTick::new(hip, rendered(ContactState::Free, hip, [0.0; 3]), [0; 3])
}

/// Returns a contact that renders this share of the spring.
fn faded(hip: [f64; 3], proxy: [f64; 3], fade: f64) -> ObservedTick {
    let displacement = [0, 1, 2].map(|i| fade * (proxy[i] - hip[i]));
    ObservedTick::new(
        hip,
        rendered(ContactState::Touching, proxy, displacement),
        [0; 3],
    )
}

fn touching(hip: [f64; 3], proxy: [f64; 3]) -> ObservedTick {
    faded(hip, proxy, 1.0)
}

fn releasing(hip: [f64; 3], displacement: [f64; 3]) -> ObservedTick {
    ObservedTick::new(
        hip,
        rendered(ContactState::Releasing, [10.5, 10.5, 2.0], displacement),
        [0; 3],
    )
}

/// Returns a tick with a changed output, and the forces that follow from it.
fn with(observed: ObservedTick, change: impl FnOnce(&mut ContactOutput)) -> ObservedTick {
    let mut rendered = observed.output;
    change(&mut rendered);
    ObservedTick::new(observed.hip, rendered, [0; 3])
}

/// Returns a position with a fraction that no constructor makes.
fn forged_position() -> GridPoint {
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(&([10_i32, 10, 2], [0.5_f32, 1.5, 0.0]), &mut buffer).expect("fits");
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let (_, bytes) = reader.push(frame);
    decode(bytes.expect("a frame").expect("undamaged")).expect("a position")
}

/// Returns all violations of the last of these ticks. Those before must have none.
fn reports(terrain: &Terrain, ticks: &[ObservedTick]) -> Vec<Violation> {
    reports_of(TickOracle::new(terrain), ticks)
}

fn reports_of(mut oracle: TickOracle<'_>, ticks: &[ObservedTick]) -> Vec<Violation> {
    let (last, before) = ticks.split_last().expect("there are ticks");
    for observed in before {
        assert_eq!(oracle.violations(observed), [], "before the forged one");
    }
    oracle.violations(last)
}

/// Returns the invariants that the last of these ticks breaks.
fn broken_of(oracle: TickOracle<'_>, ticks: &[ObservedTick]) -> Vec<Invariant> {
    let reported = reports_of(oracle, ticks);
    reported
        .iter()
        .map(|violation| violation.invariant)
        .collect()
}

/// Checks that the oracle reports the forged tick by this invariant alone, and the correct tick by
/// none.
fn reports_only(
    invariant: Invariant,
    terrain: &Terrain,
    before: &[ObservedTick],
    honest: ObservedTick,
    forged: ObservedTick,
) {
    let all = |last| reports(terrain, &[before, &[last]].concat());
    assert_eq!(all(honest), [], "{invariant:?}, honest");
    let found: Vec<_> = all(forged).iter().map(|v| v.invariant).collect();
    assert_eq!(found, [invariant], "{forged:?}");
}

/// With friction of 0.5, and 0.8 at rest: the proxy is outside the cone, or moves inside it, on
/// flat ground and on a ridge.
#[test]
fn proxy_outside_its_friction_rule_is_detected() {
    use Invariant::{Cone, Stuck};
    let friction = Friction {
        static_mu: 0.8,
        ..Friction::coulomb(0.5)
    };
    let flat = flat();
    let found = |ticks: &[ObservedTick]| -> Vec<Invariant> {
        let oracle = TickOracle::new(&flat).with_friction(friction);
        broken_of(oracle, ticks)
    };
    let at = |x: f64, hip_x: f64| touching([hip_x, 10.5, 1.0], [x, 10.5, 2.0]);
    let first = at(10.5, 10.6);
    assert_eq!(found(&[first, at(10.5, 10.9)]), [], "inside of the cone");
    assert_eq!(
        found(&[first, at(10.5, 11.29)]),
        [],
        "up to static friction"
    );
    assert_eq!(found(&[first, at(10.5, 11.36)]), [Cone], "beyond it");
    assert_eq!(found(&[first, at(11.0, 11.5)]), [], "it slid");
    assert_eq!(found(&[first, at(11.5, 11.5)]), [Cone], "it was let go");
    assert_eq!(found(&[first, at(10.9, 11.5)]), [Cone], "held at rest");
    assert_eq!(found(&[first, at(10.51, 10.9)]), [Cone, Stuck], "it crept");
    assert_eq!(found(&[first, at(10.501, 10.601)]), [Cone, Stuck]);
    // After a rest, static friction holds it.
    let rest = [first; 25];
    let broken = at(10.7, 11.2);
    assert_eq!(found(&[first, broken]), [], "it slid until just now");
    assert_eq!(found(&[&rest[..], &[broken]].concat()), [Stuck]);
    // In the air the rest ends, even if the proxy returns to its old position.
    let over = with(free([10.5, 10.5, 2.5]), |rendered| {
        (rendered.proxy, rendered.converged) = (first.output.proxy, false);
    });
    assert_eq!(found(&[&rest[..], &[over, first, broken]].concat()), []);
    // At the ridge's edge only the HIP's side pulls.
    let ridge = ridge();
    let oracle = || TickOracle::new(&ridge).with_friction(friction);
    let edge = |x: f64| touching([x, 10.5, 1.0], [20.0, 10.5, 2.0]);
    let reported = |ticks: &[ObservedTick]| -> Vec<Invariant> { broken_of(oracle(), ticks) };
    assert_eq!(
        reported(&[edge(20.1)]),
        [Cone],
        "45° downhill, and friction for 39°"
    );
}

/// The slide of a proxy in a tick determines the viscous part of its friction.
#[test]
fn proxy_trailing_beyond_its_viscous_slide_is_detected() {
    let friction = Friction {
        viscous_s: 0.003,
        ..Friction::coulomb(0.05)
    };
    let flat = flat();
    let found = |ticks: &[ObservedTick]| -> Vec<Invariant> {
        let oracle = TickOracle::new(&flat).with_friction(friction);
        broken_of(oracle, ticks)
    };
    // From (12, 10.5), its contact onset or rest, by 2 cells; friction holds 6.
    let slid = touching([20.03, 10.5, 1.0], [14.0, 10.5, 2.0]);
    let from = |x: f64| touching([x, 10.5, 1.9], [x, 10.5, 2.0]);
    assert_eq!(found(&[from(12.0), slid]), []);
    assert_eq!(found(&[from(13.0), slid]), [Invariant::Cone]);
}

/// A height, and so the pull, is exact only to the last place of the corners it is made from.
#[test]
fn pull_within_corner_rounding_is_not_checked() {
    // Level in the middle of the patch (10, 10) for any corner heights.
    let found = |corner: f32| -> Vec<Invariant> {
        let saddle = Terrain::from_fn(Kind::Rough, SIZE, |x, y| match (x, y) {
            (10, 10) | (11, 11) => 2.0 + corner,
            (11, 10) | (10, 11) => 2.0 - corner,
            _ => 2.0,
        });
        let oracle = TickOracle::new(&saddle).with_friction(Friction::coulomb(0.5));
        let pulled = touching([10.51, 10.5, 1.99], [10.5, 10.5, 2.0]);
        broken_of(oracle, &[pulled])
    };
    assert_eq!(found(1.0), [Invariant::Cone]);
    assert_eq!(found(3e5), []);
}

/// With shading the force has the length of the unshaded one, along the smoothed normal.
#[test]
fn wrongly_shaded_force_is_detected() {
    let ridge = ridge();
    // A quarter of a cell east of the edge, under a side that falls by 1 a cell; the slope there
    // goes from 0 at the edge to 1 at the next sample, with a linear change of direction.
    let shaded = |[x, z]: [f64; 2], is_whole| {
        let displacement = Vec3::new(x as f32, 0.0, z as f32);
        let observed = touching([20.2, 10.5, 1.7], [20.25, 10.5, 1.75]);
        let shaded = Some(Shaded {
            displacement,
            is_whole,
        });
        ObservedTick { shaded, ..observed }
    };
    let found = |observed: ObservedTick| -> Vec<Invariant> {
        broken_of(TickOracle::new(&ridge), &[observed])
    };
    // Bends of 90° are turned along a fifth of an edge: this is beyond it.
    let along = [0.05, 0.05];
    assert_eq!(found(shaded(along, true)), []);
    assert_eq!(
        found(shaded([0.06, 0.037_416_57], true)),
        [Invariant::Shading],
        "turned by 13°"
    );
    assert_eq!(
        found(shaded([0.06, 0.037_416_57], false)),
        [],
        "a sample was missing"
    );
    assert_eq!(
        found(shaded([0.051, 0.051], false)),
        [Invariant::Shading],
        "longer than without"
    );
}

/// With texture the force is the untextured one plus the relief's, after the proxy was slow for
/// some time.
#[test]
fn wrongly_textured_force_is_detected() {
    let flat = flat();
    let grating = Texture {
        pattern: Pattern::Grating,
        amplitude_mm: 0.1,
        wavelength_mm: 1.0,
        ..Texture::NONE
    };
    // Half a cell deep, on a crest and where the relief rises eastward; the addition there is
    // westward, 2π/10 times the depth at which the part along the surface stops growing.
    let on = |x: f64, [along, up]: [f64; 2]| ObservedTick {
        textured: Some(Vec3::new(along as f32, 0.0, up as f32)),
        ..touching([x, 10.5, 1.5], [x, 10.5, 2.0])
    };
    let (crest, slope) = ([0.0, 0.6], [-std::f64::consts::TAU / 48.0, 0.5]);
    let reported = |honest: Option<ObservedTick>, last: ObservedTick| -> Vec<Invariant> {
        let mut oracle = TickOracle::new(&flat).with_texture(grating);
        for observed in honest
            .iter()
            .cycle()
            .take(60 * usize::from(honest.is_some()))
        {
            // The fade-in is not checked here.
            let _ = oracle.violations(observed);
        }
        let reported = oracle.violations(&last);
        reported
            .iter()
            .map(|violation| violation.invariant)
            .collect()
    };
    let plain = [0.0, 0.5];
    assert_eq!(reported(None, on(10.25, plain)), [], "it comes in");
    assert_eq!(reported(None, on(10.25, crest)), [Invariant::Texture]);
    for (x, honest) in [(10.25, crest), (10.0, slope)] {
        let rested = Some(on(x, honest));
        assert_eq!(reported(rested, on(x, honest)), []);
        for forged in [
            [0.0, 0.605],
            [0.01, 0.6],
            [-0.13, 0.505],
            plain,
            [0.0, -0.6],
        ] {
            assert_eq!(
                reported(rested, on(x, forged)),
                [Invariant::Texture],
                "{forged:?}"
            );
        }
        // Too fast: no texture at all.
        assert_eq!(reported(rested, on(x + 0.25, plain)), [], "to the bit");
        assert_eq!(
            reported(rested, on(x + 0.26, [0.0, 0.500_001])),
            [Invariant::Texture]
        );
    }
}

const ABOVE: [f64; 3] = [10.5, 10.5, 3.0];
const BELOW: [f64; 3] = [10.5, 10.5, 1.5];
const ON: [f64; 3] = [10.5, 10.5, 2.0];

/// Checks of a single answer.
#[test]
fn invalid_answer_is_detected() {
    use Invariant::{Clamp, Consistent, Finite, Work};
    let terrain = flat();
    let honest = touching(BELOW, ON);
    let forgeries: [(Invariant, ObservedTick); 13] = [
        (Finite, with(honest, |f| f.displacement.z = f32::NAN)),
        (Finite, with(honest, |f| f.displacement.x = f32::INFINITY)),
        (Finite, with(honest, |f| f.proxy = forged_position())),
        // One unit more than the limit, and the largest count, as after a wrap.
        (Work, with(honest, |f| f.work = WORK_PER_TICK + 1)),
        (Work, with(honest, |f| f.work = u32::MAX)),
        // A force without contact, in another direction than to the proxy, too strong.
        (Consistent, with(honest, |f| f.displacement.x = 0.01)),
        (Consistent, with(honest, |f| f.displacement.z = -0.5)),
        (Consistent, with(honest, |f| f.displacement.z = 0.501)),
        (
            Consistent,
            with(unseeded(BELOW), |f| f.displacement.z = 0.1),
        ),
        // Forces: too long, of another spring, in the opposite direction, NaN.
        (Clamp, forces(honest, |[_, _, z]| [0.0, 0.0, z * 1.000_01])),
        (Clamp, forces(honest, |[_, _, z]| [0.0, 0.0, -z])),
        (Clamp, forces(honest, |_| [0.0, 0.0, 8.500_01])),
        (Clamp, forces(honest, |_| [0.0, 0.0, f64::NAN])),
    ];
    for (invariant, forged) in forgeries {
        reports_only(invariant, &terrain, &[], honest, forged);
    }
    let all_spent = with(honest, |f| f.work = WORK_PER_TICK);
    assert_eq!(
        reports(&terrain, &[all_spent]),
        [],
        "all there is may be spent"
    );
    let off_hip = with(free(ABOVE), |f| f.proxy = point([10.5, 10.5, 3.001]));
    reports_only(Consistent, &terrain, &[], free(ABOVE), off_hip);
    let pressing = with(free(ABOVE), |f| f.displacement.z = 1e-3);
    reports_only(Consistent, &terrain, &[], free(ABOVE), pressing);
}

fn forces(observed: ObservedTick, change: impl Fn([f64; 3]) -> [f64; 3]) -> ObservedTick {
    ObservedTick {
        force_n: observed.force_n.map(change),
        ..observed
    }
}

#[test]
fn proxy_off_the_surface_is_detected() {
    let honest = touching(BELOW, ON);
    for off in [-1e-4, -3e-6, 3e-6, 1e-4] {
        let forged = touching(BELOW, [10.5, 10.5, 2.0 + off]);
        reports_only(Invariant::OnSurface, &flat(), &[], honest, forged);
    }
}

#[test]
fn proxy_beside_the_closest_point_is_detected() {
    // On level ground, on a slope of 1, and beside the edge where it should rest.
    let level = |off: f64| touching(BELOW, [10.5 + off, 10.5, 2.0]);
    let slope = |off: f64| touching([17.0, 10.5, -2.0], [16.5 + off, 10.5, -1.5 + off]);
    for off in [-1e-2, -3e-5, 3e-5, 1e-2] {
        reports_only(
            Invariant::LocalMinimum,
            &flat(),
            &[],
            level(0.0),
            level(off),
        );
        reports_only(
            Invariant::LocalMinimum,
            &ridge(),
            &[],
            slope(0.0),
            slope(off),
        );
    }
    let valley = Terrain::from_fn(Kind::Ridges, SIZE, |x, _| (x - 20).abs() as f32);
    let rest = |off: f64| touching([20.0, 10.5, -1.0], [20.0 + off, 10.5, off]);
    reports_only(Invariant::LocalMinimum, &valley, &[], rest(0.0), rest(1e-4));
}

#[test]
fn pulling_contact_is_detected() {
    let above = |off: f64| touching([10.5, 10.5, 2.0 - off], ON);
    let slope = |off: f64| touching([16.5 + off, 10.5, -1.5 - off], [16.5, 10.5, -1.5]);
    for off in [1e-4, 0.1, 3.0] {
        for (terrain, observed) in [
            (flat(), &above as &dyn Fn(f64) -> ObservedTick),
            (ridge(), &slope),
        ] {
            reports_only(
                Invariant::HipBelow,
                &terrain,
                &[],
                observed(off),
                observed(-off),
            );
        }
    }
    // Correct contacts are not reported: a valley, the border of the data.
    let valley = Terrain::from_fn(Kind::Ridges, SIZE, |x, _| (x - 20).abs() as f32);
    let at_border = |z: f64| touching([40.25, 10.5, z], [40.0, 10.5, 2.0]);
    for (terrain, honest) in [
        (valley, touching([20.0, 10.5, -1.0], [20.0, 10.5, 0.0])),
        (flat(), at_border(1.5)),
    ] {
        assert_eq!(reports(&terrain, &[honest]), [], "{honest:?}");
    }
}

/// North of the proxy is no-data, and beyond its corner the HIP is above the ground: the line to
/// the HIP first leads over no-data, while the proxy is before the corner.
#[test]
fn friction_at_no_data_edge_excuses_a_hip_above_ground() {
    let hole = Terrain::from_fn(Kind::NoData, SIZE, |x, y| match (x, y) {
        (19, 21) => f32::NAN,
        _ => 0.0_f32.max((20 - x) as f32),
    });
    let found = |x: f64| -> Vec<Invariant> {
        let oracle = TickOracle::new(&hole).with_friction(Friction::coulomb(2.0));
        let observed = touching([22.0, 20.1, 0.1], [x, 20.0, 0.0_f64.max(20.0 - x)]);
        broken_of(oracle, &[observed])
    };
    for before in [1e-2, 1e-5, 5e-7] {
        assert_eq!(found(20.0 - before), [], "{before}");
    }
    for beyond in [1e-5, 1e-2] {
        assert_eq!(found(20.0 + beyond), [Invariant::HipBelow], "{beyond}");
    }
}

/// Rounding of a patch's corners is allowed where they contribute, but not at the foot of one.
#[test]
fn spike_at_one_corner_allows_no_error_at_the_others() {
    let spike = Terrain::from_fn(Kind::Spikes, SIZE, |x, y| {
        if (x, y) == (11, 11) { 1e6 } else { 2.0 }
    });
    let at = |off: f64| touching([10.5, 10.0, 1.0], [10.5 + off, 10.0, 2.0]);
    for off in [-1e-2, -3e-5, 3e-5, 1e-2] {
        reports_only(Invariant::LocalMinimum, &spike, &[], at(0.0), at(off));
    }
}

/// A HIP in the ridge, and the closest points of its two sides.
const IN_RIDGE: [f64; 3] = [19.875, 10.5, 1.0];
const NEAR_SIDE: [f64; 3] = [19.4375, 10.5, 1.4375];
const FAR_SIDE: [f64; 3] = [20.4375, 10.5, 1.5625];

#[test]
fn proxy_crossing_a_ridge_to_a_farther_point_is_reported() {
    let honest = touching(IN_RIDGE, NEAR_SIDE);
    let forged = touching(IN_RIDGE, FAR_SIDE);
    let before = touching([19.75, 10.5, 1.0], [19.375, 10.5, 1.375]);
    reports_only(Invariant::Descent, &ridge(), &[before], honest, forged);
}

#[test]
fn contact_beyond_the_first_crossing_is_detected() {
    let honest = touching(IN_RIDGE, NEAR_SIDE);
    let forged = touching(IN_RIDGE, FAR_SIDE);
    let before = free([18.875, 10.5, 1.5]);
    reports_only(
        Invariant::FirstCrossing,
        &ridge(),
        &[before],
        honest,
        forged,
    );
}

#[test]
fn contact_without_a_crossing_is_detected() {
    let before = free(ABOVE);
    let near = [10.625, 10.5, 2.5];
    // Still moving, or the oracle would report it for pulling.
    let forged = with(touching(near, [10.625, 10.5, 2.0]), |f| f.converged = false);
    reports_only(Invariant::Freedom, &flat(), &[before], free(near), forged);
}

#[test]
fn free_hip_below_the_surface_is_detected() {
    for depth in [1.0 / 65536.0, 0.5, 100.0] {
        let below = [10.5, 10.5, 2.0 - depth];
        let honest = touching(below, ON);
        for before in [&[][..], &[free(ABOVE)]] {
            let forged = free(below);
            // A fall from so far has fewer exact digits.
            if depth < 10.0 || before.is_empty() {
                reports_only(Invariant::AboveSurface, &flat(), before, honest, forged);
            }
        }
    }
}

#[test]
fn contact_of_an_unseeded_proxy_is_detected() {
    let (before, forged) = (unseeded(BELOW), touching(BELOW, ON));
    reports_only(
        Invariant::SeenAbove,
        &flat(),
        &[before],
        unseeded(BELOW),
        forged,
    );
}

/// For any motion of the HIP, but not while a tile is missing.
#[test]
fn proxy_without_progress_is_detected() {
    let flies = |tick: usize, height: f64| {
        let hip = [15.5 + 0.1 * tick as f64, 10.5, 1.5];
        with(free(hip), |f| {
            f.converged = false;
            f.proxy = point([10.5, 10.5, height]);
        })
    };
    let stands: Vec<_> = (0..5).map(|tick| flies(tick, 3.0)).collect();
    reports_only(
        Invariant::Advances,
        &flat(),
        &stands,
        flies(5, 2.9),
        flies(5, 3.0),
    );
    let waits = |tick| {
        with(flies(tick, 3.0), |f| {
            f.missing_tile = Some(TileIndex::new(0, 0));
        })
    };
    let waits: Vec<_> = (0..50).map(waits).collect();
    assert_eq!(reports(&flat(), &waits), []);
}

#[test]
fn passage_through_a_wall_is_detected() {
    let before = free([20.5, 10.5, 3.0]);
    let honest = free([21.5, 10.5, 3.0]);
    let forged = free([25.5, 10.5, 3.0]);
    reports_only(Invariant::Wall, &walls(), &[before], honest, forged);
    // Also for a proxy that stays on the ground.
    let before = touching([20.5, 10.5, -0.5], [20.5, 10.5, 0.0]);
    let honest = touching([21.5, 10.5, -0.5], [21.5, 10.5, 0.0]);
    let forged = touching([25.5, 10.5, -0.5], [25.5, 10.5, 0.0]);
    reports_only(Invariant::Wall, &walls(), &[before], honest, forged);
}

#[test]
fn abrupt_force_onset_or_release_is_reported() {
    let before = touching(BELOW, ON);
    let fades = |fade| faded(BELOW, ON, fade);
    let terrain = &flat();
    let reports_only = |before: &[ObservedTick], honest, forged| {
        reports_only(Invariant::Fade, terrain, before, honest, forged);
    };
    reports_only(&[before], fades(0.97), fades(0.95));
    reports_only(&[fades(0.5)], fades(0.53), fades(0.55));
    // Released at once.
    reports_only(&[before], fades(1.0), unseeded(BELOW));
    // A release that is too fast, returns, or turns.
    let go = |part: f64| releasing(BELOW, [0.0, 0.0, 0.5 * part]);
    reports_only(&[before], go(0.97), go(0.9));
    reports_only(&[before, go(0.97)], go(0.95), go(0.99));
    let turned = releasing(BELOW, [0.01, 0.0, 0.475]);
    reports_only(&[before, go(0.97)], go(0.95), turned);
    reports_only(&[before, go(0.97), go(0.95)], go(0.92), unseeded(BELOW));
}

/// Plays a scene of a few HIPs. Returns the scene and its ticks.
fn run_scene(supply: Supply) -> (Scene, Vec<ObservedTick>, Buffers) {
    // Down into a side of the ridge, along it, and up again.
    let path = [3.0, 0.0, 0.25, 3.0].map(|z| [18.5 + 0.5 * z, 10.5, z]);
    let scene = Scene::new(ridge(), path.to_vec(), Execution::LockStep, supply);
    let mut buffers = Buffers::default();
    let observed = scene
        .render(&mut buffers, [0; 3], supply, |_| Ok(()))
        .expect("it settles");
    (scene, observed, buffers)
}

/// Returns copies of the ticks, each with one bit changed.
fn other_bits(observed: &[ObservedTick]) -> Vec<Vec<ObservedTick>> {
    let changes: [fn(&mut ContactOutput); 4] = [
        |f| f.displacement.z = f32::from_bits(f.displacement.z.to_bits() ^ 1),
        |f| f.proxy = f.proxy.midpoint(&point([0.0, 0.0, 0.0])),
        |f| f.state = ContactState::Unseeded,
        |f| f.displacement.x = -0.0,
    ];
    changes
        .map(|change| {
            let mut forged = observed.to_vec();
            forged[1] = with(forged[1], change);
            forged
        })
        .into_iter()
        .chain(std::iter::once({
            let mut forged = observed.to_vec();
            let textured = forged[1].textured.as_mut().expect("textured");
            textured.z = f32::from_bits(textured.z.to_bits() ^ 1);
            forged
        }))
        .collect()
}

fn assert_violates<T: std::fmt::Debug>(invariant: Invariant, verdict: Result<T, Violation>) {
    assert_eq!(verdict.expect_err("forged").invariant, invariant);
}

#[test]
fn other_bits_are_found() {
    let (scene, observed, mut buffers) = run_scene(Supply::Preloaded);
    assert_eq!(
        metamorphic::repeated(&scene, &observed, &mut buffers),
        Ok(true)
    );
    for forged in other_bits(&observed) {
        let verdict = metamorphic::repeated(&scene, &forged, &mut buffers);
        assert_violates(Invariant::Repeatable, verdict);
    }
    let (scene, observed, mut buffers) = run_scene(Supply::OnDemand { latency: 2 });
    assert_eq!(
        metamorphic::windowed(&scene, &observed, &mut buffers, &mut Random::new(1)),
        Ok(true)
    );
    for forged in other_bits(&observed) {
        let verdict = metamorphic::windowed(&scene, &forged, &mut buffers, &mut Random::new(1));
        assert_violates(Invariant::Window, verdict);
    }
}

#[test]
fn different_bits_far_away_are_detected() {
    let shift = [3200, 6400, -1_000_000];
    let (scene, observed, mut buffers) = run_scene(Supply::Preloaded);
    let on_demand = Supply::OnDemand { latency: 0 };
    let away = scene.render(&mut buffers, shift, on_demand, |_| Ok(()));
    let away = away.expect("it settles");
    let compare =
        |away: &[ObservedTick], by| metamorphic::same_bits(Invariant::Shift, &observed, away, by);
    assert_eq!(compare(&away, shift), Ok(()));
    for forged in other_bits(&away) {
        assert_violates(Invariant::Shift, compare(&forged, shift));
    }
    assert_violates(Invariant::Shift, compare(&away, [3201, 6400, -1_000_000]));
}

#[test]
fn result_differing_under_a_symmetry_is_reported() {
    let (scene, observed, mut buffers) = run_scene(Supply::Preloaded);
    for symmetry in symmetry::all() {
        let turned = |p| symmetry.point(&scene.terrain, p);
        let path = scene.path.iter().map(|p| turned(*p)).collect();
        let twin = scene.with(symmetry.terrain(&scene.terrain), path);
        let other = twin
            .render(&mut buffers, [0; 3], Supply::Preloaded, |_| Ok(()))
            .expect("it settles");
        let mut compare = |other: &[ObservedTick]| {
            metamorphic::same_forces(&scene, symmetry, &observed, other, &mut buffers)
        };
        assert_eq!(compare(&other), Ok(true), "{symmetry:?}");
        let mut elsewhere = other.clone();
        elsewhere[1] = touching(other[1].hip, {
            let [x, y, z] = other[1].proxy;
            [x, y, z + 1e-3]
        });
        assert_violates(Invariant::Symmetry, compare(&elsewhere));
        // Held by rounding while the other is free.
        let mut held = other.clone();
        held[0] = touching(other[0].hip, {
            let [x, y, z] = other[0].hip;
            [x, y, z - 1e-5]
        });
        assert_violates(Invariant::Symmetry, compare(&held));
        let mut let_go = other;
        let_go[2] = free(let_go[2].hip);
        assert_violates(Invariant::Symmetry, compare(&let_go));
    }
}

#[test]
fn unanswered_hip_is_detected() {
    let path = vec![ABOVE, BELOW];
    let never = Supply::OnDemand { latency: 1 << 30 };
    let scene = Scene::new(flat(), path, Execution::LockStep, never);
    assert_violates(Invariant::Settles, scene.run(&mut Buffers::default()));
}
