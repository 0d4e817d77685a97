//! The replay of a scene on materials under its oracle, and in metamorphic tests in which no force
//! may change.

use super::hip_path::JUMP_CELLS;
use super::loop_replay::{Replay, Replied, replay};
use super::materials::Materials;
use super::run::{Scene, is_alike};
use super::symmetry;
use super::terrain::Kind;
use super::tile_supply::{Buffers, SIDE, Supply};
use crate::invariants::material::MaterialOracle;
use crate::invariants::oracle::Measured;
use crate::invariants::{Invariant, Violation};
use crate::random::Random;

/// Range of the HIP of a shifted scene beyond the field, and above or below it, cells.
const MAX_BESIDE: f64 = 128.0;
const MAX_DEPTH: f64 = 4e6;

/// Replays a scene on its materials under the oracle, and adds to its measurements.
///
/// # Errors
/// The first violation.
pub fn run(
    scene: &Scene,
    materials: &Materials,
    buffers: &mut Buffers,
    measured: &mut Measured,
) -> Result<(), Violation> {
    let mut random = Random::new(scene.seed ^ 0x57ab_1e55);
    let side = match scene.supply {
        Supply::Preloaded => SIDE,
        Supply::OnDemand { .. } => [2, 3, 4, SIDE][random.below(4)],
    };
    let mut oracle = MaterialOracle::new(scene, materials, [0; 3]);
    let usual = Replay {
        shift: [0; 3],
        supply: scene.supply,
    };
    let replied = replay_in(side, scene, materials, buffers, usual, |replied| {
        oracle.check(replied)
    })
    .map_err(|violation| Violation {
        detail: format!(
            "window of {side}², {:?}: {}",
            scene.supply, violation.detail
        ),
        ..violation
    })?;
    measured.on_materials = oracle.counts;
    let twin = random.below(6);
    match twin {
        0 if fits(&replied) => windowed(scene, materials, &replied, buffers, &mut random)?,
        1 => shifted(scene, materials, buffers, &mut random)?,
        // Mirrored walls are not where the check of walls expects them.
        2 if scene.terrain.kind != Kind::Walls => turned(scene, materials, buffers, &mut random)?,
        _ => return Ok(()),
    }
    measured.metamorphic_on_materials[twin] = 1;
    Ok(())
}

/// Runs [`replay`] in a window of `side` × `side` tiles.
fn replay_in(
    side: usize,
    scene: &Scene,
    materials: &Materials,
    buffers: &mut Buffers,
    how: Replay,
    check: impl FnMut(&Replied) -> Result<(), Violation>,
) -> Result<Vec<Replied>, Violation> {
    match side {
        2 => replay::<2>(scene, materials, buffers, how, check),
        3 => replay::<3>(scene, materials, buffers, how, check),
        4 => replay::<4>(scene, materials, buffers, how, check),
        6 => replay::<6>(scene, materials, buffers, how, check),
        _ => replay::<SIDE>(scene, materials, buffers, how, check),
    }
}

/// Returns true if each path from the proxy to the HIP fits into a window of 6 × 6 tiles, and no
/// point lacked terrain, as one does that needs more tiles than its window has.
fn fits(replied: &[Replied]) -> bool {
    let is_near = |ticks: &[Replied]| {
        let distance = |axis: usize| (ticks[1].hip[axis] - ticks[0].proxy[axis]).abs();
        distance(0).max(distance(1)) <= 4.0 * JUMP_CELLS
    };
    let is_whole = |replied: &Replied| replied.sample.missing_tile.is_none();
    replied.iter().all(is_whole) && replied.windows(2).all(is_near)
}

/// Replays in another window, whose tiles arrive at other times: the bits must be identical.
fn windowed(
    scene: &Scene,
    materials: &Materials,
    replied: &[Replied],
    buffers: &mut Buffers,
    random: &mut Random,
) -> Result<(), Violation> {
    let side = [6, SIDE][random.below(2)];
    let latency = [0, 1, 5][random.below(3)];
    let how = Replay {
        shift: [0; 3],
        supply: Supply::OnDemand { latency },
    };
    let other = replay_in(side, scene, materials, buffers, how, |_| Ok(()))?;
    same_bits(Invariant::Window, replied, &other, [0; 3], true)
}

/// Replays in two places, whole tiles apart: the bits must be identical, except for forces of
/// textures that differ there. The oracle checks both.
fn shifted(
    scene: &Scene,
    materials: &Materials,
    buffers: &mut Buffers,
    random: &mut Random,
) -> Result<(), Violation> {
    let distances = [1_024, 30_016, 1_000_000, 99_999_968];
    let mut pick = || distances[random.below(distances.len())] / 32 * 32;
    let away = [pick(), pick(), pick() - 50_000_000];
    let beside = |p: &[f64; 3]| {
        let within = |axis: usize| {
            p[axis].clamp(
                -MAX_BESIDE,
                f64::from(scene.terrain.size[axis]) + MAX_BESIDE,
            )
        };
        [within(0), within(1), p[2].clamp(-MAX_DEPTH, MAX_DEPTH)]
    };
    let path = scene.path.iter().map(beside).collect();
    let scene = &scene.with(scene.terrain.clone(), path);
    let mut at = |shift| {
        let supply = Supply::OnDemand { latency: 0 };
        let mut oracle = MaterialOracle::new(scene, materials, shift);
        let how = Replay { shift, supply };
        replay_in(4, scene, materials, buffers, how, |replied| {
            oracle.check(replied)
        })
    };
    // Both are away from the origin, so that the space beyond the field is alike.
    let near = [256, 256, 0];
    let (here, there) = (at(near)?, at(away)?);
    let alike = |one: &hapterra_core::force::Material| is_alike(&one.texture, materials.cell_mm);
    let forces = materials.table.iter().all(alike);
    let by = [0, 1, 2].map(|i| away[i] - near[i]);
    same_bits(Invariant::Shift, &here, &there, by, forces)
}

/// Replays mirrored or turned ground and classes under the oracle. The bits differ, since a point
/// half way between two samples then has the other one's class.
fn turned(
    scene: &Scene,
    materials: &Materials,
    buffers: &mut Buffers,
    random: &mut Random,
) -> Result<(), Violation> {
    let symmetries = symmetry::all();
    let symmetry = symmetries[random.below(symmetries.len())];
    let path = scene.path.iter();
    let path = path.map(|p| symmetry.point(&scene.terrain, *p)).collect();
    let twin = scene.with(symmetry.terrain(&scene.terrain), path);
    let materials = &materials.relative_to_(symmetry);
    let mut oracle = MaterialOracle::new(&twin, materials, [0; 3]);
    let how = Replay {
        shift: [0; 3],
        supply: Supply::OnDemand { latency: 0 },
    };
    replay_in(4, &twin, materials, buffers, how, |replied| {
        oracle.check(replied)
    })
    .map(drop)
}

/// Compares two replays, the second shifted by `shift` cells; `forces` includes the forces.
fn same_bits(
    invariant: Invariant,
    one: &[Replied],
    other: &[Replied],
    shift: [i32; 3],
    forces: bool,
) -> Result<(), Violation> {
    let bits = |replied: &Replied, shift: [i32; 3]| {
        let (proxy, force) = (replied.sample.proxy, replied.sample.force_n);
        let cell = proxy.cell();
        (
            replied.sample.state,
            [0, 1, 2].map(|i| cell[i] - shift[i]),
            proxy.frac().to_array().map(f32::to_bits),
            forces.then(|| force.to_array().map(f32::to_bits)),
        )
    };
    let pairs = one.iter().zip(other);
    let differs = |(a, b): (&Replied, &Replied)| bits(a, [0; 3]) != bits(b, shift);
    match pairs.clone().position(differs) {
        None => Ok(()),
        Some(tick) => Err(Violation {
            invariant,
            tick,
            detail: format!(
                "on materials, {shift:?}: {:?} but {:?}",
                one[tick], other[tick]
            ),
        }),
    }
}
