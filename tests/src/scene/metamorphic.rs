//! Metamorphic tests: scenes run a second time so that no force may change.

use crate::scene::run::Execution;
use hapterra_core::contact::ContactState;

use super::hip_path::{GRAIN, JUMP_CELLS};
use super::run::{Player, Scene};
use super::symmetry::{self, Symmetry};
use super::terrain::Kind;
use super::tile_supply::{Buffers, SIDE, Supply};
use crate::invariants::observed_tick::{ERROR, ObservedTick};
use crate::invariants::oracle::TickOracle;
use crate::invariants::surface::distance;
use crate::invariants::{Invariant, Violation};
use crate::random::Random;

type Verdict = Result<(), Violation>;
/// Result of a comparison: true if it ran to the end.
type Compared = Result<bool, Violation>;

/// Runs a scene again without the contact's fast paths: the bits must be identical.
///
/// # Errors
/// The difference.
pub fn repeated(scene: &Scene, observed: &[ObservedTick], buffers: &mut Buffers) -> Compared {
    let scene = Scene {
        fast_paths: false,
        ..scene.clone()
    };
    let repeated = scene.render(buffers, [0; 3], scene.supply, |_| Ok(()))?;
    same_bits(Invariant::Repeatable, observed, &repeated, [0; 3]).map(|()| true)
}

/// Range of a shifted scene's HIP beyond the field, cells.
const MAX_BESIDE: f64 = 128.0;
/// Range above or below, cells: farther down than any spike is high.
const MAX_DEPTH: f64 = 4e6;

/// Runs a scene up to 10⁸ cells away: the same bits, except for textures that differ there.
///
/// Both runs are away from the origin, so that the space beyond the field is alike: not in the
/// window until requested. The shift is whole tiles, and any whole cells up and down; in real time,
/// where the work of a tick may run out, it is a multiple that keeps the blocks of tiles the same.
///
/// # Errors
/// The difference.
pub fn shifted(scene: &Scene, buffers: &mut Buffers, random: &mut Random) -> Compared {
    let whole = match scene.execution {
        Execution::RealTime => 256,
        Execution::LockStep => 32,
    };
    let distances = [1_000, 30_000, 1_000_000, 100_000_000];
    let mut pick = || distances[random.below(distances.len())] / whole * whole;
    let shift = [pick(), pick(), pick() - 50_000_000];
    // No farther beyond the field than the nearer run is from the origin: each tile there is
    // requested.
    let beside = |p: &[f64; 3]| {
        let within = |axis: usize| {
            p[axis].clamp(
                -MAX_BESIDE,
                f64::from(scene.terrain.size[axis]) + MAX_BESIDE,
            )
        };
        [within(0), within(1), p[2].clamp(-MAX_DEPTH, MAX_DEPTH)]
    };
    let scene = &scene.with(
        scene.terrain.clone(),
        scene.path.iter().map(beside).collect(),
    );
    let mut output = |shift| {
        // Grain and most gratings have another part there, so the oracle checks them as well.
        let mut oracle = TickOracle::new(&scene.terrain).with_texture(scene.texture);
        let on_demand = Supply::OnDemand { latency: 0 };
        let observed = scene.render(buffers, shift, on_demand, |observed| {
            oracle.check_texture(observed)
        })?;
        Ok(observed.into_iter().map(|observed| ObservedTick {
            textured: observed.textured.filter(|_| scene.is_textured_alike()),
            ..observed
        }))
    };
    let near = Vec::from_iter(output([256, 256, 0])?);
    let away = Vec::from_iter(output(shift)?);
    let by = [shift[0] - 256, shift[1] - 256, shift[2]];
    same_bits(Invariant::Shift, &near, &away, by).map(|()| true)
}

/// Runs a scene in a window of 7 × 7 tiles that waits for them, and with the whole field stored:
/// the bits must be identical if waiting leaves no trace.
///
/// # Errors
/// The difference.
pub fn windowed(
    scene: &Scene,
    observed: &[ObservedTick],
    buffers: &mut Buffers,
    random: &mut Random,
) -> Compared {
    let fits = scene.terrain.size.iter().all(|patches| *patches <= 256);
    // The path from the proxy to the HIP fits into the small window.
    let is_near = |ticks: &[ObservedTick]| {
        let distance = |axis: usize| (ticks[1].hip[axis] - ticks[0].proxy[axis]).abs();
        distance(0).max(distance(1)) <= 5.0 * JUMP_CELLS
    };
    if scene.execution != Execution::LockStep || !fits || !observed.windows(2).all(is_near) {
        return Ok(false);
    }
    let latency = [0, 1, 5][random.below(3)];
    let on_demand = Supply::OnDemand { latency };
    let small = scene.render_in::<7>(buffers, [0; 3], on_demand, |_| Ok(()))?;
    same_bits(Invariant::Window, observed, &small, [0; 3])?;
    if scene.supply != Supply::Preloaded {
        let whole = scene.render(buffers, [0; 3], Supply::Preloaded, |_| Ok(()))?;
        same_bits(Invariant::Window, observed, &whole, [0; 3])?;
    }
    Ok(true)
}

/// Compares two runs, the second shifted by `shift` cells.
///
/// # Errors
/// `invariant`, if a bit of the results differs.
pub fn same_bits(
    invariant: Invariant,
    observed: &[ObservedTick],
    other: &[ObservedTick],
    shift: [i32; 3],
) -> Verdict {
    for (tick, (a, b)) in observed.iter().zip(other).enumerate() {
        let bits = |observed: &ObservedTick, shift: [i32; 3]| {
            let (cell, frac) = (observed.output.proxy.cell(), observed.output.proxy.frac());
            (
                observed.output.state,
                observed.output.displacement.to_array().map(f32::to_bits),
                observed
                    .shaded
                    .map(|shaded| shaded.displacement.to_array().map(f32::to_bits)),
                observed
                    .textured
                    .map(|textured| textured.to_array().map(f32::to_bits)),
                [0, 1, 2].map(|i| cell[i] - shift[i]),
                frac.to_array().map(f32::to_bits),
            )
        };
        if bits(a, [0; 3]) != bits(b, shift) {
            let detail = format!("{shift:?}: {a:?} but {b:?}");
            return Err(Violation {
                invariant,
                tick,
                detail,
            });
        }
    }
    Ok(())
}

/// Steps between neighbouring samples up to which mirrored scenes are compared,
/// cells. On steeper ground rounding decides at nearly every vertex.
const STEEP: f32 = 10.0;

/// Ratio of the motions of proxy and HIP from which the proxy counts as elsewhere.
const JUMP: f64 = 1e3;

/// Runs a scene mirrored or turned: the results must agree to within rounding.
///
/// The core counts from the south-west corner of a patch, so rounding differs. If two paths are
/// equally good, the two runs may differ; they are not compared until both are free again. If
/// rounding decides in one of them, the comparison ends.
///
/// # Errors
/// A difference that rounding does not explain.
pub fn turned(scene: &Scene, buffers: &mut Buffers, random: &mut Random) -> Compared {
    // On a border of the data a HIP belongs to the patch in the north-east, mirrored or not; and
    // the work left of a tick may differ.
    let settles = scene.execution == Execution::LockStep && scene.supply == Supply::Preloaded;
    let plain = scene.terrain.steepest() <= STEEP && scene.terrain.kind != Kind::NoData;
    if !settles || !plain {
        return Ok(false);
    }
    let inside = |p: &[f64; 3]| {
        let within = |axis: usize| p[axis].clamp(0.5, f64::from(scene.terrain.size[axis]) - 0.5);
        [within(0), within(1), p[2]]
    };
    let path: Vec<_> = scene.path.iter().map(inside).collect();
    let scene = &scene.with(scene.terrain.clone(), path);
    let observed = scene.render(buffers, [0; 3], Supply::Preloaded, |_| Ok(()))?;
    let symmetries = symmetry::all();
    let symmetry = symmetries[random.below(symmetries.len())];
    let twin = transformed(scene, symmetry);
    let mut oracle = TickOracle::of(&twin);
    let other = twin.render(buffers, [0; 3], Supply::Preloaded, |observed| {
        oracle.check(observed)
    })?;
    same_forces(scene, symmetry, &observed, &other, buffers)
}

/// Returns the scene, mirrored or turned.
fn transformed(scene: &Scene, symmetry: Symmetry) -> Scene {
    let turned = |p: &[f64; 3]| symmetry.point(&scene.terrain, *p);
    let path = scene.path.iter().map(turned).collect();
    scene.with(symmetry.terrain(&scene.terrain), path)
}

/// Compares the forces with those of the mirrored or turned scene.
///
/// # Errors
/// A difference that rounding does not explain.
pub fn same_forces(
    scene: &Scene,
    symmetry: Symmetry,
    observed: &[ObservedTick],
    other: &[ObservedTick],
    buffers: &mut Buffers,
) -> Compared {
    let turned = |p| symmetry.point(&scene.terrain, p);
    let mut parted = false;
    for (tick, (a, b)) in observed.iter().zip(other).enumerate() {
        // Until both proxies are at the HIP again.
        parted &= a.output.state != ContactState::Free || b.output.state != ContactState::Free;
        if parted {
            continue;
        }
        let agree = |proxy, a: &ObservedTick, b: &ObservedTick| agree(scene, proxy, a, b);
        if agree(turned(a.proxy), a, b) {
            parted = !is_near(turned(a.proxy), a, b);
            if !parted && !is_shaded_likewise(scene, symmetry, a, b) {
                let detail = format!("{symmetry:?}: shaded {a:?} but {b:?}");
                return Err(Violation {
                    invariant: Invariant::Symmetry,
                    tick,
                    detail,
                });
            }
            continue;
        }
        let decides = |there: &ObservedTick, hair| {
            has_moved_apart(there, a, hair) || agree(turned(there.proxy), there, b)
        };
        if is_undecided(scene, tick, decides, buffers)
            || is_transformed_undecided(scene, symmetry, tick, buffers)
        {
            return Ok(false);
        }
        let detail = format!("{symmetry:?}: {a:?} but {b:?}");
        return Err(Violation {
            invariant: Invariant::Symmetry,
            tick,
            detail,
        });
    }
    Ok(true)
}

/// Tolerance of the direction of a shaded force, rad: more than its turn by rounding of the
/// position, on ground steep enough for mirrored scenes.
const TURNED: f32 = 0.01;
/// Distance of a HIP, cells, from which its force is not compared.
const MIN_MOTION_RATIO: f32 = 1e4;

fn is_shaded_likewise(
    scene: &Scene,
    symmetry: Symmetry,
    a: &ObservedTick,
    b: &ObservedTick,
) -> bool {
    let (Some(one), Some(other)) = (a.shaded, b.shaded) else {
        return true;
    };
    // At this distance all points near the proxy are equally near, and each has its own normal.
    let length = a.output.displacement.length();
    let is_reported = (0.1..MIN_MOTION_RATIO).contains(&length);
    if !is_reported || !scene.friction.is_none() || a.output.state != b.output.state {
        return true;
    }
    let tip = one.displacement.as_dvec3().to_array();
    let ends = [[0.0; 3], tip].map(|end| symmetry.point(&scene.terrain, end));
    let [x, y, z] = [0, 1, 2].map(|i| (ends[1][i] - ends[0][i]) as f32);
    let expected = hapterra_core::Vec3::new(x, y, z);
    let along = expected.dot(other.displacement);
    let across = expected.cross(other.displacement).length();
    across <= TURNED * along
}

/// Tolerance of the pull on a proxy that slid, as a fraction of friction: if rounding decides
/// whether it slides on, the two runs differ by as much.
const SLACK: f64 = 0.03;

/// Returns true if two results are equal to within rounding, or equally near to the HIP, or, with
/// friction, both possible ends of a slide.
fn agree(scene: &Scene, proxy: [f64; 3], a: &ObservedTick, b: &ObservedTick) -> bool {
    let (da, db) = (distance(a.proxy, a.hip), distance(b.proxy, b.hip));
    let tie = (da - db).abs() <= 1e-5 * da.max(1.0);
    // A HIP in the surface may be touching or free: both without force.
    let at_hip = |observed: &ObservedTick| {
        let may = matches!(
            observed.output.state,
            ContactState::Free | ContactState::Touching
        );
        may && observed.output.displacement.length() <= ERROR as f32
    };
    let same = a.output.state == b.output.state || (at_hip(a) && at_hip(b));
    let slack = match scene.friction.is_none() {
        true => 0.0,
        false => SLACK * f64::from(1.0 + scene.friction.static_mu) * da.max(db),
    };
    let slid = distance(proxy, b.proxy) <= slack;
    same && a.output.converged == b.output.converged && (is_near(proxy, a, b) || tie || slid)
}

fn is_near(proxy: [f64; 3], a: &ObservedTick, b: &ObservedTick) -> bool {
    distance(proxy, b.proxy) <= 1e-4 * distance(a.proxy, a.hip).max(1.0)
}

/// Returns true if a proxy moves much farther than the tiny motion `hair` of its HIP, cells.
fn has_moved_apart(there: &ObservedTick, here: &ObservedTick, hair: f64) -> bool {
    distance(there.proxy, here.proxy) > JUMP * hair * distance(here.proxy, here.hip).max(1.0)
}

/// Returns true if a tiny motion of the HIP changes the result of the mirrored or turned run as
/// well.
fn is_transformed_undecided(
    scene: &Scene,
    symmetry: Symmetry,
    tick: usize,
    buffers: &mut Buffers,
) -> bool {
    let twin = transformed(scene, symmetry);
    let own = rendered_at(&twin, tick, |_| [0.0; 3], buffers);
    own.is_some_and(|own| {
        let decides = |there: &ObservedTick, hair| has_moved_apart(there, &own, hair);
        is_undecided(&twin, tick, decides, buffers)
    })
}

/// Returns true if a tiny motion of the HIP on the whole path or in this tick alone changes the
/// result as well.
fn is_undecided(
    scene: &Scene,
    tick: usize,
    decides: impl Fn(&ObservedTick, f64) -> bool,
    buffers: &mut Buffers,
) -> bool {
    const OFFSETS: [f64; 3] = [1.0, 16.0, 256.0];
    let starts = [0, tick]
        .into_iter()
        .flat_map(|first| OFFSETS.map(|hair| (first, GRAIN * hair)));
    for (first, hair) in starts {
        for corner in 0..8 {
            let off = [0, 1, 2].map(|bit| if corner >> bit & 1 == 0 { hair } else { -hair });
            let moved = |now| if now < first { [0.0; 3] } else { off };
            if rendered_at(scene, tick, moved, buffers).is_some_and(|output| decides(&output, hair))
            {
                return true;
            }
        }
    }
    false
}

/// Returns the result of a tick of a path in which each position is shifted by `moved`.
fn rendered_at(
    scene: &Scene,
    tick: usize,
    moved: impl Fn(usize) -> [f64; 3],
    buffers: &mut Buffers,
) -> Option<ObservedTick> {
    let mut player = Player::<SIDE>::new(scene, buffers, [0; 3], scene.supply);
    let mut output = None;
    for (now, hip) in scene.path[..=tick].iter().enumerate() {
        let by = moved(now);
        let hip = [0, 1, 2].map(|i| hip[i] + by[i]);
        output = player
            .step(hip)
            .map(|output| ObservedTick::new(hip, output, [0; 3]));
    }
    output
}
