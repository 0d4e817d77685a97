//! Ticks of the soak: any terrain, any hand.

use hapterra_core::contact::Rule;
use hapterra_tests::counting::CountingBoard;
use hapterra_tests::wild::walks;

use super::table::{Row, Target};

/// Walks, of some 550 ticks each.
const WALKS: usize = 40;

/// One row over all of them for the product's rule, one for the paper's.
pub(crate) fn rows(board: &CountingBoard) -> Vec<Row> {
    let (mut swept, mut paper) = (vec![], vec![]);
    for (number, walk) in walks(2026, WALKS).enumerate() {
        let post = |x: i32, y: i32| walk.post(x, y);
        let ticks = board.contact(&walk.message, 0, &post, &walk.events);
        let counts = ticks.iter().map(|tick| tick.instructions);
        let worst = ticks
            .iter()
            .enumerate()
            .max_by_key(|(_, tick)| tick.instructions);
        if let Some((tick, worst)) = worst.filter(|(_, tick)| tick.instructions > 10_000) {
            println!(
                "walk {number}, {:?}, {:?}: tick {tick} takes {} instructions, {} units of work",
                walk.terrain.kind, walk.message.rule, worst.instructions, worst.work
            );
        }
        match walk.message.rule {
            Rule::Swept => swept.extend(counts),
            Rule::Paper => paper.extend(counts),
        }
    }
    let target = Target {
        max: Some(10_000),
        ..Target::default()
    };
    vec![
        Row::new("soak", target, swept),
        Row::new("soak, paper's rule", Target::default(), paper),
    ]
}
