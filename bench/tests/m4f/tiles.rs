//! The filling of a buffer with a tile, in each form of transfer, and with bytes that take as long
//! as possible.

use hapterra_core::terrain::TILE_SAMPLES;
use hapterra_core::terrain::packed::{HeightStep, MAX_PACKED, pack};
use hapterra_core::wire::message::Heights;
use hapterra_lab::path::Random;
use hapterra_lab::tick_states::terrain;
use hapterra_tests::instruction_counter::CountingBoard;

use super::contact::scene;
use super::table::{Row, Target, Tick};

const TILES: usize = 100;
const SAMPLES: usize = TILE_SAMPLES * TILE_SAMPLES;

/// Returns all rows.
pub(crate) fn rows(board: &CountingBoard) -> Vec<Row> {
    let mut random = Random(31);
    // 1/30 of a cell a metre; heights to 1/1,024 m.
    let metres = HeightStep::Cells(1.0 / 30.0);
    let parts = HeightStep::Cells(1.0 / (1024.0 * 30.0));
    let whole = packed(&[metres], || {
        (3.0 * random.between(0.0, 1.0)).floor() / 30.0
    });
    let mut random = Random(32);
    let between = packed(&[parts], || {
        (3200.0 * random.between(0.0, 1.0)).floor() / (1024.0 * 30.0)
    });
    let mut random = Random(33);
    let centimetres = HeightStep::Single {
        unit: 0.01,
        cells: 0.999_85,
    };
    let single = packed(&[centimetres], || {
        0.999_85 * f64::from((80.0 + (40.0 * random.between(0.0, 1.0)).floor() / 100.0) as f32)
    });
    let mut random = Random(34);
    let floats: Vec<Vec<u8>> = (0..TILES)
        .map(|_| {
            (0..SAMPLES)
                .flat_map(|_| (random.between(0.0, 1.0) as f32).to_le_bytes())
                .collect()
        })
        .collect();
    let mut random = Random(35);
    let hostile = (0..TILES).map(|_| hostile(&mut random)).collect::<Vec<_>>();
    let as_floats = |bytes| Heights::Samples { base: 1, bytes };
    let as_packed = |bytes| Heights::Packed { base: 1, bytes };
    vec![
        row(board, "tile, floats", &floats, as_floats, true),
        row(board, "tile, whole metres", &whole, as_packed, true),
        row(board, "tile, parts of a metre", &between, as_packed, true),
        row(board, "tile, two lines", &single, as_packed, true),
        row(board, "tile, hostile bytes", &hostile, as_packed, false),
    ]
}

/// Returns hills with an addition, packed with one of the steps.
fn packed(steps: &[HeightStep], mut rough: impl FnMut() -> f64) -> Vec<Vec<u8>> {
    let mut tile = |_| {
        let heights: [f32; SAMPLES] = std::array::from_fn(|i| {
            let slope = (i % TILE_SAMPLES + i / TILE_SAMPLES) / 4;
            (slope as f64 * unit(steps) + rough()) as f32
        });
        let mut buffer = [0; MAX_PACKED];
        let bytes = pack(&heights, 0, steps, &mut buffer).expect("packing pays");
        assert!(bytes[0] & 3 > 0, "by a line");
        bytes.to_vec()
    };
    (0..TILES).map(&mut tile).collect()
}

/// Returns the size of a slope's step, cells.
fn unit(steps: &[HeightStep]) -> f64 {
    match steps {
        [HeightStep::Cells(cells)] => *cells,
        _ => 0.0,
    }
}

/// Returns two lines, no-data in runs of one, and long numbers: each sample takes the most steps
/// possible. It has too few bytes, which is detected only at the end.
fn hostile(random: &mut Random) -> Vec<u8> {
    let mut bytes = vec![2 | 4 | 27 << 3, 0, 0, 0, 0x40];
    for _ in 0..2 {
        bytes.push(20);
        bytes.extend((0..16).map(|_| (256.0 * random.between(0.0, 1.0)) as u8));
    }
    while bytes.len() < MAX_PACKED {
        // Escapes, or one zero after the other.
        bytes.push(if random.between(0.0, 1.0) < 0.3 {
            (256.0 * random.between(0.0, 1.0)) as u8
        } else {
            0
        });
    }
    bytes
}

fn row<'b>(
    board: &CountingBoard,
    name: &str,
    tiles: &'b [Vec<u8>],
    heights: impl Fn(&'b [u8]) -> Heights<'b>,
    are_tiles: bool,
) -> Row {
    let tiles: Vec<_> = tiles.iter().map(|bytes| heights(bytes)).collect();
    let counted = board.tiles(&scene(&terrain()), &tiles);
    let ticks = (0..).zip(counted).map(|(index, tile)| {
        assert!(tile.converged == are_tiles, "{name}");
        Tick {
            instructions: tile.instructions,
            cycles: tile.cycles,
            units: 0,
            scene: None,
            index,
        }
    });
    Row::new(name, Target::default(), ticks.collect())
}
