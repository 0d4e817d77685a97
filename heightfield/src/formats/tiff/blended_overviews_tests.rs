//! Files with one overview, half of them no-data.

use std::path::Path;

use super::super::tiffs::{DATA, Values, floats_in_a_strip, tiff};
use crate::{OpenOptions, Raster};

const SIDE: u32 = 64;
const NO_DATA: f64 = -9999.0;

/// Opens a file whose western 33 columns are no-data, and whose overview has `rim` where half of a
/// sample is no-data.
fn opened(folder: &Path, rim: f32) -> Raster {
    let row = |side: u32, value: &dyn Fn(u32) -> f32| -> Vec<u8> {
        let samples = (0..side * side).map(|index| value(index % side));
        samples.flat_map(f32::to_le_bytes).collect()
    };
    let hole = NO_DATA as f32;
    let full = row(SIDE, &|column| if column < 33 { hole } else { 1000.0 });
    let coarse = row(SIDE / 2, &|column| match column {
        0..16 => hole,
        16 => rim,
        _ => 1000.0,
    });
    let mut overview = vec![(254, Values::Longs(vec![1]))];
    overview.extend(floats_in_a_strip([SIDE / 2; 2], DATA + full.len() as u32));
    let images = [floats_in_a_strip([SIDE; 2], DATA), overview];
    let path = folder.join("x.tif");
    std::fs::write(&path, tiff(&[full, coarse].concat(), &images)).expect("written");
    let options = OpenOptions {
        no_data: Some(NO_DATA),
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    Raster::open(path, &options).expect("a terrain")
}

#[test]
fn overviews_mixed_with_no_data_are_not_used() {
    let folder = tempfile::tempdir().expect("a folder");
    for rim in [-4499.5, 250.0] {
        let raster = opened(folder.path(), rim);
        assert_eq!(raster.file_layout().overviews, [[SIDE / 2; 2]]);
        let summary = raster.summary();
        assert_eq!((summary.lowest, summary.highest), (1000.0, 1000.0));
        assert_eq!(raster.surface(1, [33.0, 10.0]), 1000.0);
        let remarks = raster.remarks().join(" ");
        assert!(
            remarks.contains(&rim.to_string()) && remarks.contains("gdaladdo"),
            "{remarks}"
        );
    }
}

#[test]
fn overviews_of_heights_alone_are_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let raster = opened(folder.path(), 1000.5);
    assert_eq!(raster.remarks(), [""; 0]);
    assert_eq!(raster.summary().highest, 1000.5);
}
