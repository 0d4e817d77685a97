//! Several images in a file, and headers that promise too much.

use std::io::Cursor;

use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use super::decode;
use crate::raster::input::FileBytes;
use crate::raster::{BadRaster, Raster};

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

fn open(bytes: Vec<u8>) -> Result<Raster, BadRaster> {
    Raster::checked(decode(&FileBytes::unpacked("test.tif", bytes))?, None)
}

const FULL: Part<'_> = Part {
    kind: 0,
    size: (3, 2),
    samples: &[1, 2, 3, 4, 5, 6],
};

#[test]
fn an_overview_before_the_full_image_is_passed_over() {
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
fn the_mask_beside_an_image_makes_holes() {
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
    assert_eq!(raster.summary().holes, 2);
    assert!(raster.height(1, 1).is_nan() && raster.height(2, 0).is_nan());
    assert_eq!(raster.height(2, 1), 3.0);
}

/// Overwrites the number of the first directory's entry for a tag.
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
fn a_size_that_the_file_cannot_hold_is_refused_before_room_is_made() {
    let wide = with_tag(file(&[FULL]), 256, 1, 4_000_000_000);
    let fault = open(wide).expect_err("refused");
    assert!(matches!(fault, BadRaster::AbsurdSize(_)), "{fault}");
    let long = with_tag(file(&[FULL]), 273, 3_000_000_000, 8);
    let fault = open(long).expect_err("refused");
    assert!(matches!(fault, BadRaster::AbsurdSize(_)), "{fault}");
    let outside = with_tag(file(&[FULL]), 273, 1, 1_000_000);
    let fault = open(outside).expect_err("refused");
    assert!(matches!(fault, BadRaster::Truncated(_)), "{fault}");
}
