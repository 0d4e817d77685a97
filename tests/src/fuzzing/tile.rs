//! Arbitrary bytes as a packed tile, and arbitrary heights as input of the packing.

use hapterra_core::grid::Cell;
use hapterra_core::terrain::packed::{HeightStep, MAX_PACKED, pack};
use hapterra_core::terrain::{TILE_SAMPLES, Tile, TileError, TileKey};

use super::bytes::Bytes;

const KEY: TileKey = TileKey::new(0, 1, 2);

/// Unpacks the bytes, then packs heights made from them.
///
/// # Panics
/// If refused bytes fill a tile, or a tile changes by packing.
pub fn run(data: &[u8]) {
    let mut tile = Box::new(Tile::VACANT);
    match tile.unpack(KEY, 0, data) {
        Ok(()) => assert_eq!(tile.key(), Some(KEY)),
        Err(error) => {
            assert!(
                matches!(error, TileError::Packed | TileError::Step),
                "{error:?}"
            );
            assert_eq!(tile.key(), None);
        }
    }
    packed(&mut Bytes(data), &mut tile);
}

fn packed(bytes: &mut Bytes<'_>, tile: &mut Tile) {
    let base = bytes.int() >> (2 + bytes.byte() % 30);
    let cells = f64::from(bytes.float());
    let steps = [
        HeightStep::Cells(cells),
        HeightStep::Single { unit: 0.01, cells },
        HeightStep::Cells(1.0 / 32.0),
    ];
    let (kind, odd) = (bytes.byte(), bytes.byte());
    let mut last = 0.0;
    let heights = core::array::from_fn(|i| {
        if i % usize::from(odd % 16 + 1) == 0 && !bytes.is_empty() {
            last = match kind % 4 {
                0 => bytes.float(),
                1 => (f64::from(bytes.byte()) * cells) as f32,
                2 => (f64::from(f32::from(bytes.byte()) / 100.0) * cells) as f32,
                _ => bytes.height(),
            };
        }
        last
    });
    let le: Vec<u8> = heights.iter().flat_map(|h: &f32| h.to_le_bytes()).collect();
    if tile.load(KEY, base, &le).is_err() {
        return;
    }
    let expected = bits(tile);
    let mut buffer = [0; MAX_PACKED];
    if let Some(packed) = pack(&heights, base, &steps, &mut buffer) {
        assert_eq!(tile.unpack(KEY, base, packed), Ok(()));
        assert!(bits(tile) == expected, "{kind} {odd} {cells:e} {base}");
    }
}

/// Returns all samples of a tile, some of them more than once.
fn bits(tile: &Tile) -> Vec<[u32; 4]> {
    let cells = TILE_SAMPLES as i32 - 1;
    let corners = |i: i32| tile.corners(Cell::new(i % cells, i / cells));
    let all = (0..cells * cells).map(corners);
    all.map(|corners| corners.map(f32::to_bits)).collect()
}
