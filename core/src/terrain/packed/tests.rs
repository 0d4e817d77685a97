//! Packed tiles: lossless to the bit; invalid bytes are refused.
//!
//! The oracle is [`Tile::load`] with the bytes of the same heights.

use std::boxed::Box;
use std::vec::Vec;

use super::*;
use crate::grid::Cell;
use crate::terrain::{TILE_SAMPLES, Tile, TileError, TileKey};

mod reference_decoder;

const KEY: TileKey = TileKey::new(0, 2, 5);
const SAMPLES: usize = TILE_SAMPLES * TILE_SAMPLES;

/// The bits of all samples of a tile.
fn sample_bits(tile: &Tile) -> Vec<u32> {
    let sample = |i: usize| {
        let (col, row) = (i % TILE_SAMPLES, i / TILE_SAMPLES);
        // The samples of the last row and column are corners of the patches before them.
        let (u, v) = (col.min(TILE_SAMPLES - 2), row.min(TILE_SAMPLES - 2));
        tile.corners(Cell::new(u as i32, v as i32))[(col - u) + 2 * (row - v)].to_bits()
    };
    (0..SAMPLES).map(sample).collect()
}

fn loaded(heights: &[f32; SAMPLES]) -> Vec<u32> {
    let mut tile = Box::new(Tile::VACANT);
    for (at, height) in heights.iter().enumerate() {
        tile.set(at % TILE_SAMPLES, at / TILE_SAMPLES, *height);
    }
    sample_bits(&tile)
}

/// Packs heights, and checks the tile unpacked from them; `None` if packing saves nothing.
fn packed(heights: &[f32; SAMPLES], base: i32, steps: &[HeightStep]) -> Option<Vec<u8>> {
    let mut buffer = [0xAA; MAX_PACKED];
    let bytes = pack(heights, base, steps, &mut buffer)?.to_vec();
    let mut tile = Box::new(Tile::VACANT);
    let expected = loaded(heights);
    if tile.unpack(KEY, base, &bytes) != Err(TileError::Step) {
        assert_eq!((tile.key(), tile.base()), (Some(KEY), base));
    }
    assert!(sample_bits(&tile) == expected, "{} bytes", bytes.len());
    assert!(
        reference_decoder::heights(&bytes) == expected,
        "by the book"
    );
    Some(bytes)
}

/// Pseudo-random numbers, the same in every run.
struct Random(u64);

impl Random {
    fn roll(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as u32
    }

    fn below(&mut self, bound: u32) -> u32 {
        self.roll() % bound
    }
}

fn by_sample(mut height: impl FnMut(usize, usize) -> f32) -> [f32; SAMPLES] {
    core::array::from_fn(|i| height(i % TILE_SAMPLES, i / TILE_SAMPLES))
}

/// Hills in whole metres, in cells above a base.
fn hills(metres_a_cell: f64, base: i32) -> [f32; SAMPLES] {
    by_sample(|col, row| {
        let (x, y) = (col as f64, row as f64);
        let metres = 1500.0 + 40.0 * (x / 7.0).sin() * (y / 5.0).cos() + 3.0 * x;
        (metres.round() / metres_a_cell - f64::from(base)) as f32
    })
}

#[test]
fn whole_metres_use_half_a_byte_per_sample() {
    for metres in [1.0, 10.0, 29.97, 91.3] {
        let base = (1450.0 / metres) as i32;
        let steps = [HeightStep::Cells(1.0 / metres)];
        let bytes = packed(&hills(metres, base), base, &steps).unwrap();
        assert_eq!(bytes[0] & 7, 1, "one line, without no-data");
        assert!(bytes.len() < 600, "{}", bytes.len());
    }
}

#[test]
fn centimetres_in_single_precision_are_two_lines() {
    for (base, cells) in [(0, 1.0), (88, 1.0), (88, 0.999_85), (0, 0.037_8)] {
        let heights = by_sample(|col, row| {
            let file = ((9000 + 31 * col + col * row) as f32 / 100.0).max(90.5);
            (f64::from(file) * cells - f64::from(base)) as f32
        });
        let steps = [
            HeightStep::Cells(0.01 * cells),
            HeightStep::Single { unit: 0.01, cells },
        ];
        let bytes = packed(&heights, base, &steps).unwrap();
        // The file's single precision is then the tile's, so one line is enough.
        let same = base == 0 && cells == 1.0;
        assert_eq!(bytes[0] & 7, if same { 1 } else { 2 }, "{base} {cells}");
        assert!(bytes.len() < 500, "{}", bytes.len());
    }
}

#[test]
fn zero_height_over_base_zero_is_packed_exactly() {
    let heights = by_sample(|col, row| (col.min(row) as f64 / 29.99) as f32);
    for steps in [
        &[HeightStep::Cells(1.0 / 29.99)],
        &[HeightStep::Cells(1.0 / (8.0 * 29.99))],
    ] {
        assert_eq!(packed(&heights, 0, steps).unwrap()[0] & 3, 1);
    }
}

#[test]
fn negative_zero_is_preserved() {
    let mut heights = by_sample(|col, row| col.min(row) as f32);
    heights[40] = -0.0;
    packed(&heights, 0, &[HeightStep::Cells(1.0)]).unwrap();
    heights[40] = 0.0;
    packed(&heights, 0, &[HeightStep::Cells(1.0)]).unwrap();
}

#[test]
fn floats_without_a_step_are_packed_losslessly() {
    let heights = by_sample(|col, row| ((col as f32 / 9.0).sin() + row as f32 / 7.0) * 3.7);
    for steps in [
        &[][..],
        &[HeightStep::Cells(0.1)],
        &[HeightStep::Cells(f64::NAN)],
    ] {
        let bytes = packed(&heights, 0, steps).unwrap();
        assert_eq!(bytes[0] & 7, 0);
    }
}

#[test]
fn packing_keeps_no_data_samples_in_place() {
    let base = 50;
    let hills = hills(30.0, base);
    let mut random = Random(3);
    let steps = [HeightStep::Cells(1.0 / 30.0)];
    let holes: [&mut dyn FnMut(usize, usize) -> bool; 6] = [
        &mut |col, row| (col, row) != (17, 4),
        &mut |col, row| (col, row) == (0, 0),
        &mut |col, row| (col, row) == (32, 32),
        &mut |col, _| col > 20,
        &mut |_, row| row < 9,
        &mut |_, _| random.below(3) == 0,
    ];
    for is_no_data in holes {
        let heights = by_sample(|col, row| match is_no_data(col, row) {
            true => f32::NAN,
            false => hills[row * TILE_SAMPLES + col],
        });
        let bytes = packed(&heights, base, &steps).unwrap();
        assert_eq!(bytes[0] & NO_DATA, NO_DATA);
        assert!(bytes.len() < 1200, "{}", bytes.len());
    }
    let mut buffer = [0; MAX_PACKED];
    assert_eq!(pack(&[f32::NAN; SAMPLES], 0, &steps, &mut buffer), None);
}

#[test]
fn unusual_floats_are_packed_losslessly() {
    let odd = [
        0.0,
        -0.0,
        1e-45,
        -1e-45,
        f32::MIN_POSITIVE,
        1.0,
        536_870_912.0,
        -536_870_912.0,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        -f32::NAN,
        f32::MAX,
    ];
    let mut random = Random(5);
    let steps = [
        HeightStep::Cells(1e-45),
        HeightStep::Cells(0.0),
        HeightStep::Cells(-2.0),
        HeightStep::Single {
            unit: 0.1,
            cells: 1e30,
        },
        HeightStep::Single {
            unit: 1e-300,
            cells: 1e300,
        },
        HeightStep::Cells(1.0),
    ];
    let mut packs = 0;
    for round in 0..300 {
        let common = odd[round % odd.len()];
        let rare = 1 + random.below(60);
        let heights = by_sample(|_, _| match random.below(rare) {
            0 => odd[random.below(odd.len() as u32) as usize],
            _ => common,
        });
        packs += u32::from(packed(&heights, round as i32 - 150, &steps).is_some());
    }
    assert!(packs > 100, "{packs}");
}

#[test]
fn random_bits_are_packed_losslessly_or_not_at_all() {
    let mut random = Random(7);
    let mut packs = 0;
    for bits in 1..=32 {
        for _ in 0..6 {
            let from = random.roll();
            let heights =
                by_sample(|_, _| f32::from_bits(from.wrapping_add(random.roll() >> (32 - bits))));
            packs += u32::from(packed(&heights, -7, &[]).is_some());
        }
    }
    assert!((90..180).contains(&packs), "{packs}");
}

/// Examples of packed tiles of every kind.
fn examples() -> Vec<Vec<u8>> {
    let mut hollow = hills(30.0, 50);
    for i in (0..SAMPLES).filter(|i| i % 37 < 9) {
        hollow[i] = f32::NAN;
    }
    let step = [HeightStep::Cells(1.0 / 30.0)];
    let rough = by_sample(|col, row| (col * row % 11) as f32 * 0.37);
    let single = by_sample(|col, row| (6000 + col * 3 + row) as f32 / 100.0);
    let steps = [HeightStep::Single {
        unit: 0.01,
        cells: 1.0,
    }];
    // The last code has 19 bits, and the reader loads 25: it must not need the bytes after it.
    let last = by_sample(|col, row| match (col, row) {
        (32, 32) => 9.0,
        (0, _) => 4.0,
        _ => 0.0,
    });
    std::vec![
        packed(&last, 0, &[HeightStep::Cells(1.0)]).unwrap(),
        packed(&hills(30.0, 50), 50, &step).unwrap(),
        packed(&hollow, 50, &step).unwrap(),
        packed(&rough, 0, &[]).unwrap(),
        packed(&single, 0, &steps).unwrap(),
    ]
}

#[test]
fn truncated_or_overlong_bytes_are_refused() {
    for whole in examples() {
        let mut tile = Box::new(Tile::VACANT);
        for length in 0..whole.len() {
            tile.fill(KEY, 0, |_, _| 0.0).unwrap();
            let refused = tile.unpack(KEY, 0, &whole[..length]);
            assert_eq!(refused, Err(TileError::Packed), "{length}");
            assert_eq!(tile.key(), None);
        }
        for more in [&[0][..], &[1], &[0x80], &[0; 9], &[1; 9]] {
            let longer = [&whole[..], more].concat();
            assert_eq!(tile.unpack(KEY, 0, &longer), Err(TileError::Packed));
            assert_eq!(tile.key(), None);
        }
        assert_eq!(tile.unpack(KEY, i32::MIN, &whole), Err(TileError::Base));
        assert_eq!(tile.key(), None);
        assert_eq!(tile.unpack(KEY, 0, &whole), Ok(()));
    }
}

#[test]
fn damaged_tile_is_refused_or_decoded_as_by_the_reference() {
    let (mut accepted, mut refused) = (0, 0);
    for whole in examples() {
        let mut tile = Box::new(Tile::VACANT);
        for place in 0..whole.len() {
            for change in [1, 0x10, 0x80, 0xFF] {
                let mut bytes = whole.clone();
                bytes[place] ^= change;
                match tile.unpack(KEY, 0, &bytes) {
                    Ok(()) => {
                        accepted += 1;
                        assert!(
                            sample_bits(&tile) == reference_decoder::heights(&bytes),
                            "{place}"
                        );
                    }
                    Err(error) => {
                        refused += 1;
                        assert!(
                            matches!(error, TileError::Packed | TileError::Step),
                            "{error:?}"
                        );
                        assert_eq!(tile.key(), None);
                    }
                }
            }
        }
    }
    assert!(accepted > 1000 && refused > 1000, "{accepted} {refused}");
}

#[test]
fn random_bytes_are_unpacked_or_refused() {
    let mut random = Random(11);
    let mut tile = Box::new(Tile::VACANT);
    for _ in 0..3000 {
        let length = random.below(5000);
        // Long runs of zeros and of ones are included.
        let calm = random.below(4);
        let mut bytes: Vec<u8> = (0..length)
            .map(|_| match random.below(1 + 8 * calm) {
                0 => random.roll() as u8,
                _ => [0, 0xFF][calm as usize % 2],
            })
            .collect();
        if let Some(kind) = bytes.first_mut() {
            *kind = *kind & 0x7C | random.below(3) as u8;
        }
        let accepted = tile.unpack(KEY, 0, &bytes).is_ok();
        assert_eq!(tile.key().is_some(), accepted);
    }
}
