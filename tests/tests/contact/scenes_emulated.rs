//! Scenes of the stress test (spikes, no-data, teleports, late tiles) on this processor and on the
//! emulated Cortex-M4F: the bits and the work must be identical, tick by tick.

use hapterra_core::Vec3;
use hapterra_tests::instruction_counter::{Counted, CountingBoard};
use hapterra_tests::scene::emulator_scene::EmulatorScene;

#[test]
fn scenes_are_bit_identical_on_the_emulated_processor() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let there = replayed(&board, &EmulatorScene::compared());
    let ticks: usize = there.iter().map(Vec::len).sum();
    assert!(ticks > 15_000, "{ticks}");
}

/// The whole loop on materials, point by point: forces, proxies and work.
#[test]
fn material_scenes_match_bit_for_bit_on_the_emulator() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let scenes = EmulatorScene::compared_on_materials();
    assert!(scenes.len() >= 20, "{} scenes", scenes.len());
    let there = replayed(&board, &scenes);
    let forces = there.iter().flatten();
    let forces = forces.filter(|tick| tick.vector != Vec3::ZERO).count();
    assert!(forces > 3_000, "{forces} ticks with a force");
}

/// Returns the results of the board, which must equal the host's.
fn replayed(board: &CountingBoard, scenes: &[(u64, EmulatorScene)]) -> Vec<Vec<Counted>> {
    let replays: Vec<_> = scenes.iter().map(|(_, scene)| scene.replay()).collect();
    let there = board.contact(&replays);
    for ((number, scene), there) in scenes.iter().zip(&there) {
        let kind = scene.scene.terrain.kind;
        let differs = scene.differs(there);
        assert_eq!(differs, None, "scene {number}, {kind:?}: tick");
    }
    there
}
