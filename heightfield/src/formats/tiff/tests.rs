//! Several images in a file, and headers that state too much.

use std::io::Cursor;

use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use super::decode;
use crate::input::FileBytes;
use crate::{Certainty, OpenOptions, Raster, RasterError};

/// One image of a file: its kind (`NewSubfileType`), size and samples.
struct Part<'a> {
    kind: u32,
    size: (u32, u32),
    samples: &'a [u8],
}

fn file(parts: &[Part<'_>]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("a file");
    for part in parts {
        let (columns, rows) = part.size;
        let mut image = encoder
            .new_image::<colortype::Gray8>(columns, rows)
            .expect("an image");
        let tags = image.encoder();
        tags.write_tag(Tag::NewSubfileType, part.kind)
            .expect("its kind");
        if part.kind & 4 != 0 {
            tags.write_tag(Tag::PhotometricInterpretation, 4_u16)
                .expect("a mask");
        }
        image.write_data(part.samples).expect("its samples");
    }
    bytes.into_inner()
}

fn of_band(band: u32) -> OpenOptions {
    OpenOptions {
        band: Some(band),
        ..OpenOptions::default()
    }
}

fn open(bytes: Vec<u8>) -> Result<Raster, RasterError> {
    Raster::checked(
        decode(
            &FileBytes::unpacked("test.tif", bytes),
            &OpenOptions::default(),
        )?,
        None,
    )
}

const FULL: Part<'_> = Part {
    kind: 0,
    size: (3, 2),
    samples: &[1, 2, 3, 4, 5, 6],
};

#[test]
fn overview_before_the_full_image_is_skipped() {
    let overview = Part {
        kind: 1,
        size: (2, 2),
        samples: &[9; 4],
    };
    let raster = open(file(&[overview, FULL])).expect("the full image");
    assert_eq!((raster.columns(), raster.rows()), (3, 2));
    assert_eq!(raster.height(0, 1), 1.0);
}

#[test]
fn mask_image_in_the_same_file_marks_no_data() {
    let mask = Part {
        kind: 4,
        size: (3, 2),
        samples: &[255, 0, 255, 255, 255, 0],
    };
    let other = Part {
        kind: 4 | 1,
        size: (2, 2),
        samples: &[0; 4],
    };
    let raster = open(file(&[FULL, other, mask])).expect("a masked image");
    assert_eq!(raster.summary().no_data, 2);
    assert!(raster.height(1, 1).is_nan() && raster.height(2, 0).is_nan());
    assert_eq!(raster.height(2, 1), 3.0);
}

/// Returns a file with one image of palette indices.
fn with_palette() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("a file");
    let mut image = encoder
        .new_image::<colortype::Gray8>(3, 2)
        .expect("an image");
    let colours = [0_u16; 3 * 256];
    let tags = image.encoder();
    tags.write_tag(Tag::PhotometricInterpretation, 3_u16)
        .expect("a palette");
    tags.write_tag(Tag::ColorMap, &colours[..])
        .expect("its colours");
    image
        .write_data(&[10, 20, 30, 80, 90, 95])
        .expect("samples");
    bytes.into_inner()
}

#[test]
fn palette_numbers_are_classes_and_no_heights() {
    assert!(matches!(
        open(with_palette()),
        Err(RasterError::NotAHeightField(what)) if what.contains("palette")
    ));
    for max_in_memory_bytes in [0, 1 << 20] {
        let options = OpenOptions {
            classes: true,
            max_in_memory_bytes,
            ..OpenOptions::default()
        };
        let input = FileBytes::unpacked("test.tif", with_palette());
        let classes = decode(&input, &options).and_then(|image| Raster::checked(image, None));
        let classes = classes.expect("an image of classes");
        let row = |row| [0, 1, 2].map(|column| classes.height(column, row));
        assert_eq!((row(1), row(0)), ([10.0, 20.0, 30.0], [80.0, 90.0, 95.0]));
    }
}

/// Returns options that leave samples in the file, whatever their size.
fn in_blocks() -> OpenOptions {
    OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    }
}

/// Returns a full image of 64 × 48 samples, and a uniform overview.
fn with_overview(size: (u32, u32), height: u8) -> Vec<u8> {
    let samples: Vec<u8> = (0..64 * 48).map(|index| (index % 199) as u8).collect();
    let full = Part {
        kind: 0,
        size: (64, 48),
        samples: &samples,
    };
    let overview = Part {
        kind: 1,
        size,
        samples: &vec![height; (size.0 * size.1) as usize],
    };
    file(&[full, overview])
}

#[test]
fn overview_serves_coarse_levels_of_the_same_field() {
    for (size, is_used) in [((32, 24), true), ((31, 24), true), ((32, 10), false)] {
        let input = FileBytes::unpacked("test.tif", with_overview(size, 201));
        let decoded = decode(&input, &in_blocks()).expect("decoded");
        let raster = Raster::checked(decoded, None).expect("heights");
        assert_eq!(raster.height(5, 40), f64::from((7 * 64 + 5) % 199));
        let coarse = raster.surface(2, [20.0, 20.0]);
        assert_eq!(coarse == 201.0, is_used, "{size:?}: {coarse}");
        assert_eq!(raster.summary().highest == 201.0, is_used);
    }
}

#[test]
fn overviews_and_masks_beside_a_file_are_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("dem.tif");
    let samples = [7; 64 * 48];
    let part = |kind, size: (u32, u32), samples| Part {
        kind,
        size,
        samples,
    };
    std::fs::write(&path, file(&[part(0, (64, 48), &samples)])).expect("written");
    let overview = file(&[part(1, (16, 12), &[9; 16 * 12])]);
    std::fs::write(folder.path().join("dem.tif.ovr"), overview).expect("written");
    // The mask and its overview mark the first sample of each as no-data.
    let mut mask = [255; 64 * 48];
    mask[0] = 0;
    let mut coarse_mask = [255; 16 * 12];
    coarse_mask[0] = 0;
    let mask = file(&[part(4, (64, 48), &mask), part(5, (16, 12), &coarse_mask)]);
    std::fs::write(folder.path().join("dem.tif.msk"), mask).expect("written");
    let raster = Raster::open(&path, &in_blocks()).expect("opens");
    assert!(raster.samples().is_none());
    assert!(raster.height(0, 47).is_nan() && raster.height(1, 47) == 7.0);
    assert_eq!(raster.surface(1, [30.0, 30.0]), 7.0);
    assert_eq!(raster.surface(2, [30.0, 30.0]), 9.0);
    assert!(raster.surface(2, [0.0, 47.0]).is_nan());
    assert_eq!(raster.summary().no_data, 1);
}

#[test]
fn strip_beyond_file_end_is_no_data_when_read_in_blocks() {
    let samples: Vec<u8> = vec![5; 3000 * 900];
    let parts = [Part {
        kind: 0,
        size: (3000, 900),
        samples: &samples,
    }];
    let mut bytes = file(&parts);
    // The writer puts the samples first and the directory last: change one strip's offset.
    let raster = |bytes: Vec<u8>| {
        let input = FileBytes::unpacked("test.tif", bytes);
        Raster::checked(decode(&input, &in_blocks()).expect("decoded"), None).expect("heights")
    };
    assert_eq!(raster(bytes.clone()).height(10, 899), 5.0);
    let directory = u32::from_le_bytes(bytes[4..8].try_into().expect("4 bytes")) as usize;
    let entries = u16::from_le_bytes(bytes[directory..][..2].try_into().expect("2 bytes"));
    let offsets = (0..usize::from(entries))
        .map(|index| directory + 2 + 12 * index)
        .find(|&at| bytes[at..at + 2] == 273_u16.to_le_bytes())
        .expect("strips");
    let list = u32::from_le_bytes(bytes[offsets + 8..][..4].try_into().expect("4")) as usize;
    bytes[list..list + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let raster = raster(bytes);
    assert!(raster.height(10, 899).is_nan(), "the first strip");
    assert_eq!(raster.height(10, 0), 5.0);
}

/// Overwrites the count and value of a tag in the first directory.
fn with_tag(mut bytes: Vec<u8>, tag: u16, count: u32, value: u32) -> Vec<u8> {
    let directory = u32::from_le_bytes(bytes[4..8].try_into().expect("4 bytes")) as usize;
    let entries = u16::from_le_bytes(bytes[directory..][..2].try_into().expect("2 bytes"));
    let entry = (0..usize::from(entries))
        .map(|index| directory + 2 + 12 * index)
        .find(|&at| bytes[at..at + 2] == tag.to_le_bytes())
        .expect("the tag is there");
    bytes[entry + 4..entry + 8].copy_from_slice(&count.to_le_bytes());
    bytes[entry + 8..entry + 12].copy_from_slice(&value.to_le_bytes());
    bytes
}

#[test]
fn size_larger_than_the_file_is_refused_before_allocation() {
    let wide = with_tag(file(&[FULL]), 256, 1, 4_000_000_000);
    let fault = open(wide).expect_err("refused");
    assert!(matches!(fault, RasterError::AbsurdSize(_)), "{fault}");
    let long = with_tag(file(&[FULL]), 273, 3_000_000_000, 8);
    let fault = open(long).expect_err("refused");
    assert!(matches!(fault, RasterError::AbsurdSize(_)), "{fault}");
    let outside = with_tag(file(&[FULL]), 273, 1, 1_000_000);
    let fault = open(outside).expect_err("refused");
    assert!(matches!(fault, RasterError::Truncated(_)), "{fault}");
}

/// Returns a little-endian file of one strip from tags with type, count and bytes.
fn by_hand(tags: &[(u16, u16, u32, Vec<u8>)], samples: &[u8]) -> Vec<u8> {
    let mut bytes = b"II*\0".to_vec();
    bytes.extend((8 + samples.len() as u32).to_le_bytes());
    bytes.extend(samples);
    bytes.extend((tags.len() as u16).to_le_bytes());
    let mut out_of_line: Vec<u8> = Vec::new();
    let after = bytes.len() + 12 * tags.len() + 4;
    for (tag, kind, count, value) in tags {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        if value.len() > 4 {
            bytes.extend(((after + out_of_line.len()) as u32).to_le_bytes());
            out_of_line.extend(value);
        } else {
            bytes.extend(value.iter().chain(&[0; 4]).take(4));
        }
    }
    bytes.extend([0; 4]);
    bytes.extend(out_of_line);
    bytes
}

fn shorts(tag: u16, values: &[u16]) -> (u16, u16, u32, Vec<u8>) {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes());
    (tag, 3, values.len() as u32, bytes.collect())
}

fn doubles(tag: u16, values: &[f64]) -> (u16, u16, u32, Vec<u8>) {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes());
    (tag, 12, values.len() as u32, bytes.collect())
}

/// Returns the tags of an uncompressed strip of bytes.
fn grey(size: [u16; 2], bands: u16) -> Vec<(u16, u16, u32, Vec<u8>)> {
    vec![
        shorts(256, &[size[0]]),
        shorts(257, &[size[1]]),
        shorts(258, &vec![8; bands.into()]),
        shorts(259, &[1]),
        shorts(262, &[1]),
        shorts(273, &[8]),
        shorts(277, &[bands]),
        shorts(278, &[size[1]]),
        shorts(279, &[size[0] * size[1] * bands]),
    ]
}

#[test]
fn transparent_alpha_samples_are_no_data() {
    let samples = [1, 255, 2, 0, 3, 7, 4, 255];
    for (kind, no_data_count) in [(1, 1), (2, 1), (0, 0)] {
        let mut tags = grey([2, 2], 2);
        tags.push(shorts(338, &[kind]));
        let raster = open(by_hand(&tags, &samples)).expect("a band and its alpha");
        assert_eq!(
            raster.summary().no_data,
            no_data_count,
            "extra samples of kind {kind}"
        );
        assert_eq!(raster.height(1, 1).is_nan(), no_data_count == 1);
        assert_eq!(raster.height(0, 0), 3.0);
    }
}

/// A mask in `NAME.tif.msk`, as GDAL writes it.
#[test]
fn msk_sidecar_file_marks_no_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("terrain.tif");
    std::fs::write(&path, file(&[FULL])).expect("written");
    let mask = Part {
        kind: 4,
        samples: &[255, 0, 255, 255, 255, 0],
        ..FULL
    };
    std::fs::write(folder.path().join("terrain.tif.msk"), file(&[mask])).expect("written");
    let raster = Raster::open(&path, &crate::OpenOptions::default()).expect("opens");
    assert_eq!(raster.summary().no_data, 2);
    assert!(raster.height(1, 1).is_nan() && raster.height(2, 0).is_nan());
}

/// Opens a projected grid of 10 units with these GeoKeys besides model type and raster type.
fn projected(keys: &[(u16, u16)], origin: [f64; 2]) -> Raster {
    let is_point = keys.iter().any(|(key, _)| *key == 1025);
    let mut directory = vec![1, 1, 0, 1 + keys.len() as u16, 1024, 0, 1, 1];
    if !is_point {
        directory[3] += 1;
        directory.extend([1025, 0, 1, 1]);
    }
    for (key, value) in keys {
        directory.extend([*key, 0, 1, *value]);
    }
    let mut tags = grey([3, 2], 1);
    tags.push(doubles(33550, &[10.0, 10.0, 0.0]));
    tags.push(doubles(33922, &[0.0, 0.0, 0.0, origin[0], origin[1], 0.0]));
    tags.push(shorts(34735, &directory));
    open(by_hand(&tags, &[1, 2, 3, 4, 5, 6])).expect("a grid")
}

#[test]
fn units_follow_from_the_codes_of_the_reference_systems() {
    let (projected_system, vertical_system) = (3072, 4096);
    // NAD83 / UTM 11N with NAVD88 heights in feet.
    let feet_up = projected(
        &[(projected_system, 26911), (vertical_system, 8228)],
        [386_000.0, 3_790_000.0],
    );
    assert_eq!(feet_up.stated_metres_per_vertical_unit(), Some(0.3048));
    let (east, _) = feet_up.cell().expect("a cell").ground_metres();
    assert!((east - 10.0024).abs() < 1e-3, "{east}: UTM's scale there");
    let system = feet_up.reference_system().expect("known");
    assert_eq!(system.code(), Some(26911));
    assert_eq!(system.name(), "NAD83 / UTM zone 11N");
    assert_eq!(feet_up.vertical_unit_from(), Certainty::FromCode);
    let datum = feet_up.vertical_datum().expect("stated");
    assert_eq!(
        (datum.code, datum.name.as_str()),
        (Some(8228), "NAVD88 height (ft)")
    );
    // California zone 5, whose own unit is the US survey foot.
    let feet = projected(&[(projected_system, 2229)], [6_490_000.0, 1_870_000.0]);
    let (east, _) = feet.cell().expect("a cell").ground_metres();
    assert!((east - 3.0481).abs() < 1e-3, "{east}");
    // At 60° N, pseudo-Mercator lengths are half as large on the ground as on the map.
    let mercator = projected(&[(projected_system, 3857)], [0.0, 8_399_737.9]);
    let (east, north) = mercator.cell().expect("a cell").ground_metres();
    assert!((east - 5.0126).abs() < 1e-3 && (north - 5.0042).abs() < 1e-3);
    // A depth system.
    let depth = projected(
        &[(projected_system, 26911), (vertical_system, 6357)],
        [386_000.0, 3_790_000.0],
    );
    assert_eq!(depth.summary().lowest, -6.0);
}

#[test]
fn coordinates_of_points_are_those_of_the_samples_centres() {
    let sides = |raster: &Raster| {
        let bounds = raster.bounds().expect("placed");
        [bounds.west, bounds.south, bounds.east, bounds.north]
    };
    let areas = projected(&[(3072, 26911)], [500.0, 400.0]);
    assert_eq!(sides(&areas), [500.0, 380.0, 530.0, 400.0]);
    let points = projected(&[(1025, 2), (3072, 26911)], [500.0, 400.0]);
    assert_eq!(sides(&points), [495.0, 385.0, 525.0, 405.0]);
}

#[test]
fn chosen_band_of_a_colour_image_is_a_height() {
    let mut tags = grey([2, 2], 3);
    tags[4] = shorts(262, &[2]);
    let bytes = by_hand(&tags, &[1, 20, 3, 4, 50, 6, 7, 80, 9, 10, 110, 12]);
    let fault = open(bytes.clone()).expect_err("colours");
    assert!(
        matches!(fault, RasterError::ColourBands { bands: 3, .. }),
        "{fault}"
    );
    let input = FileBytes::unpacked("test.tif", bytes);
    let green =
        Raster::checked(decode(&input, &of_band(2)).expect("a band"), None).expect("heights");
    assert_eq!((green.height(0, 1), green.height(1, 0)), (20.0, 110.0));
    assert!(
        green.format().ends_with("band 2 of 3"),
        "{}",
        green.format()
    );
    let fault = decode(&input, &of_band(4)).expect_err("three bands");
    assert!(fault.to_string().contains("bands 1 to 3"), "{fault}");
}

/// Returns the tags of a grey square in tiles, with their offsets and sizes.
fn in_tiles(side: u32, tile: u32, [offsets, sizes]: [&[u32]; 2]) -> Vec<(u16, u16, u32, Vec<u8>)> {
    let long = |tag: u16, values: &[u32]| {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes());
        (tag, 4, values.len() as u32, bytes.collect::<Vec<u8>>())
    };
    let mut tags = grey([16, 16], 1);
    tags[0] = long(256, &[side]);
    tags[1] = long(257, &[side]);
    tags.retain(|tag| ![273, 278, 279].contains(&tag.0));
    tags.push(long(322, &[tile]));
    tags.push(long(323, &[tile]));
    tags.push(long(324, offsets));
    tags.push(long(325, sizes));
    tags
}

/// One stored tile in six thousand, without compression, is a valid file.
#[test]
fn sparse_file_on_disk_has_its_whole_size() {
    let (side, tile) = (20_000_u32, 256_u32);
    let count = side.div_ceil(tile).pow(2) as usize;
    let at_the_last = |value: u32| {
        let mut values = vec![0; count];
        values[count - 1] = value;
        values
    };
    let places = [at_the_last(8), at_the_last(tile * tile)];
    let tags = in_tiles(side, tile, places.each_ref().map(Vec::as_slice));
    let bytes = by_hand(&tags, &vec![7; (tile * tile) as usize]);
    let raster = open(bytes).expect("nothing is wrong with it");
    assert_eq!(raster.height(side - 1, 0), 7.0);
    assert!(raster.height(0, 0).is_nan());
}

/// A sparse file is too large, but not damaged.
#[test]
fn sparse_file_beyond_memory_is_oversized_not_damaged() {
    // 200,000 × 200,000 in four deflated tiles, the last of which is stored.
    let mut tags = in_tiles(200_000, 100_000, [&[0, 0, 0, 8], &[0, 0, 0, 64]]);
    tags[3] = shorts(259, &[8]);
    let fault = open(by_hand(&tags, &[1; 64])).expect_err("too large");
    assert!(
        matches!(fault, RasterError::TooLarge { gigabytes: 40, .. }),
        "{fault}"
    );
}

#[test]
fn world_file_places_a_file_without_own_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plain.tif");
    std::fs::write(&path, file(&[FULL])).expect("written");
    let open = || Raster::open(&path, &crate::OpenOptions::default());
    assert!(open().expect("opens").bounds().is_none());
    std::fs::write(folder.path().join("plain.TFW"), "30\n0\n0\n-30\n515\n985\n").expect("written");
    let wkt = r#"PROJCS["WGS 84 / UTM zone 11N",AUTHORITY["EPSG","32611"]]"#;
    std::fs::write(folder.path().join("plain.prj"), wkt).expect("written");
    let raster = open().expect("opens");
    let bounds = raster.bounds().expect("placed");
    assert_eq!(
        [bounds.west, bounds.north, bounds.east],
        [500.0, 1000.0, 590.0]
    );
    assert_eq!(
        raster.reference_system().and_then(|system| system.code()),
        Some(32611)
    );
    std::fs::write(folder.path().join("plain.TFW"), "30\n0\n0\n").expect("written");
    let reported = open().expect_err("a damaged neighbour").to_string();
    assert!(
        reported.contains("plain.TFW") && reported.contains("six numbers"),
        "{reported}"
    );
}
