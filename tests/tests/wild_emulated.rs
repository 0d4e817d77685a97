//! Wild walks (spikes, holes, teleports, tiles that come late) on this processor
//! and on the emulated Cortex-M4F: the same bits, and the same work, tick by tick.

use hapterra_tests::counting::{Counted, CountingBoard};
use hapterra_tests::wild::walks;

fn bits(tick: &Counted) -> (u32, bool, u32, [u32; 3], [i32; 3], [u32; 3]) {
    (
        tick.state,
        tick.settled,
        tick.work,
        tick.vector.to_array().map(f32::to_bits),
        tick.proxy.cell(),
        tick.proxy.frac().to_array().map(f32::to_bits),
    )
}

#[test]
fn wild_walks_give_the_same_bits_on_the_emulated_processor() {
    let Some(board) = CountingBoard::found() else {
        return;
    };
    let mut ticks = 0;
    for (number, walk) in walks(77, 40).enumerate() {
        let post = |x: i32, y: i32| walk.post(x, y);
        let there = board.contact(&walk.message, 0, &post, &walk.events);
        let here = walk.felt_here();
        assert_eq!(here.len(), there.len());
        for (tick, (here, there)) in here.iter().zip(&there).enumerate() {
            let kind = walk.terrain.kind;
            assert_eq!(
                bits(here),
                bits(there),
                "walk {number} on {kind:?}, tick {tick}"
            );
        }
        ticks += here.len();
    }
    assert!(ticks > 15_000, "{ticks}");
}
