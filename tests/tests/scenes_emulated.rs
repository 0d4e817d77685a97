//! Scenes of the soak (spikes, holes, teleports, tiles that come late) on this
//! processor and on the emulated Cortex-M4F: the same bits, and the same work, tick
//! by tick.

use hapterra_core::Vec3;
use hapterra_tests::counting::CountingBoard;
use hapterra_tests::scene::recorded::Recorded;
use hapterra_tests::scene::run::Surface;

const SEED: u64 = 77;

/// By number: a third of them with friction.
fn surface(number: u64) -> Surface {
    match number % 3 {
        0 => Surface::Rough,
        _ => Surface::Smooth,
    }
}

#[test]
fn scenes_give_the_same_bits_on_the_emulated_processor() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let scenes: Vec<Recorded> = (0..40)
        .map(|number| Recorded::random(SEED, number, surface(number)))
        .collect();
    let replays: Vec<_> = scenes.iter().map(Recorded::replay).collect();
    let there = board.contact(&replays);
    for (number, (scene, there)) in scenes.iter().zip(&there).enumerate() {
        let kind = scene.scene.terrain.kind;
        let differs = scene.differs(there);
        assert_eq!(differs, None, "seed {SEED}, scene {number}, {kind:?}: tick");
    }
    let ticks: usize = there.iter().map(Vec::len).sum();
    assert!(ticks > 15_000, "{ticks}");
}

/// The whole loop on materials, point by point: forces, proxies and work.
#[test]
fn scenes_on_materials_give_the_same_bits_on_the_emulated_processor() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let recorded = |number| {
        Some((
            number,
            Recorded::on_materials(SEED, number, surface(number))?,
        ))
    };
    let scenes: Vec<(u64, Recorded)> = (0..120).filter_map(recorded).collect();
    assert!(scenes.len() >= 20, "{} scenes", scenes.len());
    let replays: Vec<_> = scenes.iter().map(|(_, scene)| scene.replay()).collect();
    let there = board.contact(&replays);
    for ((number, scene), there) in scenes.iter().zip(&there) {
        let kind = scene.scene.terrain.kind;
        let differs = scene.differs(there);
        assert_eq!(differs, None, "seed {SEED}, scene {number}, {kind:?}: tick");
    }
    let forces = there.iter().flatten();
    let forces = forces.filter(|tick| tick.vector != Vec3::ZERO).count();
    assert!(forces > 3_000, "{forces} ticks with a force");
}
