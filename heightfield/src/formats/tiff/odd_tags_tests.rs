//! Files whose tags cause a remark or an error, or need an option.

use super::tiffs::{DATA, Directory, Values, floats_in_a_strip, placed, tiff};
use crate::{Encoding, Error, OpenOptions, Raster};

const SIZE: [u32; 2] = [4, 3];

fn opened(data: &[u8], mut tags: Directory, options: &OpenOptions) -> Result<Raster, Error> {
    tags.sort_by_key(|(tag, _)| *tag);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.tif");
    std::fs::write(&path, tiff(data, &[tags])).expect("written");
    Raster::open(path, options)
}

/// Opens the heights 0 to 11, with more tags.
fn with_tags(more: Directory) -> Result<Raster, Error> {
    let data: Vec<u8> = (0..12).flat_map(|at| (at as f32).to_le_bytes()).collect();
    let mut tags = floats_in_a_strip(SIZE, DATA);
    tags.retain(|(tag, _)| more.iter().all(|(other, _)| other != tag));
    tags.extend(more);
    opened(&data, tags, &OpenOptions::default())
}

#[test]
fn whole_numbers_with_a_predictor_of_floats_are_refused() {
    let tag = |tag, value| (tag, Values::Longs(vec![value]));
    assert!(with_tags(vec![tag(317, 1)]).is_ok());
    for sample_format in [1, 2] {
        let tags = vec![tag(317, 3), tag(339, sample_format)];
        let fault = with_tags(tags).expect_err("refused").to_string();
        assert!(fault.contains("predictor is 3"), "{fault}");
    }
}

#[test]
fn tie_points_without_a_grid_and_orientation_get_a_remark() {
    let ties = |count: usize| vec![(33922, Values::Doubles(vec![1.0; 6 * count]))];
    for count in [1, 4] {
        let raster = with_tags(ties(count)).expect("a terrain");
        let remarks = raster.remarks().join(" ");
        assert!(
            remarks.contains(&format!("places of {count} samples")),
            "{remarks}"
        );
    }
    let whole = with_tags(placed([0.0, 0.0], 30.0, 32632)).expect("a terrain");
    assert_eq!(whole.remarks(), [""; 0]);
    let turned = vec![(274, Values::Shorts(vec![4]))];
    let remarks = with_tags(turned).expect("a terrain").remarks().join(" ");
    assert!(remarks.contains("the first row at the bottom"), "{remarks}");
}

#[test]
fn colours_encode_heights_in_memory_and_in_the_file() {
    let height = |at: u32| -7.5 + f64::from(at) * 100.3;
    let codes = (0..12).map(|at| ((height(at) + 10_000.0) * 10.0).round() as u32);
    let data: Vec<u8> = codes
        .flat_map(|code| code.to_be_bytes()[1..].to_vec())
        .collect();
    let long = |tag, value| (tag, Values::Longs(vec![value]));
    let tags = vec![
        long(256, SIZE[0]),
        long(257, SIZE[1]),
        (258, Values::Shorts(vec![8; 3])),
        long(259, 1),
        long(262, 2),
        long(273, DATA),
        long(277, 3),
        long(278, SIZE[1]),
        long(279, data.len() as u32),
    ];
    for max_in_memory_bytes in [0, 1 << 20] {
        let options = OpenOptions {
            encoding: Some(Encoding::TerrainRgb),
            max_in_memory_bytes,
            ..OpenOptions::default()
        };
        let raster = opened(&data, tags.clone(), &options).expect("a terrain");
        for at in 0..12 {
            let found = raster.height(at % SIZE[0], SIZE[1] - 1 - at / SIZE[0]);
            assert!((found - height(at)).abs() < 0.06, "{at}: {found}");
        }
        let with_band = OpenOptions {
            band: Some(2),
            ..options
        };
        assert!(opened(&data, tags.clone(), &with_band).is_err());
    }
    let plain = opened(&data, tags, &OpenOptions::default()).expect_err("refused");
    assert!(plain.to_string().contains("colour image"), "{plain}");
}
