//! Tests that terrains are bounded, reproducible to the last bit, and have the shape of their
//! names.

use clap::ValueEnum;

use super::*;

const SAMPLE_PLACES: [(u32, u32); 5] = [(0, 0), (1, 0), (37, 91), (1023, 4095), (65_536, 3)];

fn checksum(synth: &Synth) -> u32 {
    let heights = (0..4096_u32).map(|index| synth.height(index % 64 * 7, index / 64 * 5));
    let bytes: Vec<u8> = heights.flat_map(f32::to_le_bytes).collect();
    crc32fast::hash(&bytes)
}

#[test]
fn heights_stay_between_zero_and_the_amplitude() {
    for kind in Kind::value_variants() {
        let synth = Synth::new(*kind, 3, 2.0);
        let heights = (0..90_000).map(|index| synth.height(index % 300, index / 300));
        let (mut lowest, mut highest) = (f32::MAX, f32::MIN);
        for height in heights {
            (lowest, highest) = (lowest.min(height), highest.max(height));
        }
        let bound = if *kind == Kind::Plane { 18.0 } else { 2.0 };
        assert!(
            lowest >= 0.0 && highest <= bound,
            "{kind:?}: {lowest} to {highest}"
        );
        assert!(
            highest - lowest > 0.8,
            "{kind:?} is flat: {lowest} to {highest}"
        );
    }
}

#[test]
fn seed_changes_the_terrain() {
    for kind in Kind::value_variants() {
        let same = checksum(&Synth::new(*kind, 1, 5.0)) == checksum(&Synth::new(*kind, 2, 5.0));
        assert_eq!(same, *kind == Kind::Plane, "{kind:?}");
    }
}

/// Fixed values: any machine, build or later version must compute these bits.
#[test]
fn heights_are_bit_identical_on_every_machine() {
    let sums: Vec<u32> = Kind::value_variants()
        .iter()
        .map(|kind| checksum(&Synth::new(*kind, 42, 100.0)))
        .collect();
    let expected = [
        924_592_404,
        3_757_754_199,
        2_303_611_230,
        2_178_354_641,
        2_818_411_384,
        508_199_005,
    ];
    assert_eq!(sums, expected);
}

#[test]
fn plane_rises_east_and_north() {
    let plane = Synth::new(Kind::Plane, 0, 100.0);
    for (column, row) in SAMPLE_PLACES {
        let expected = 2.0 * column as f32 + row as f32;
        assert_eq!(plane.height(column, row), expected);
    }
}

#[test]
fn plane_has_its_stated_height() {
    let rise = Synth::new(Kind::Plane, 1, 1.0).rise(301, 201);
    let plane = Synth::new(Kind::Plane, 1, 100.0 / rise).raster(301, 201);
    let heights = plane.expect("raster").summary();
    assert!((heights.highest - heights.lowest - 100.0).abs() < 1e-4);
}
