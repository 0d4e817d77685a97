//! Scenes of the soak (spikes, holes, teleports, tiles that come late) on this
//! processor and on the emulated Cortex-M4F: the same bits, and the same work, tick
//! by tick.

use hapterra_tests::counting::CountingBoard;
use hapterra_tests::scene::recorded::Recorded;
use hapterra_tests::scene::run::Surface;

const SEED: u64 = 77;

#[test]
fn scenes_give_the_same_bits_on_the_emulated_processor() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let scenes: Vec<Recorded> = (0..40)
        .map(|number| {
            let surface = match number % 3 {
                0 => Surface::Rough,
                _ => Surface::Smooth,
            };
            Recorded::random(SEED, number, surface)
        })
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
