//! The choice of the height's channel, for all kinds of pictures.

use super::decode;
use crate::input::FileBytes;
use crate::{PngChannel, Raster, RasterError};

/// Returns a 2 × 2 picture from its samples, row by row from the north.
fn picture(color: ::png::ColorType, depth: ::png::BitDepth, bytes: &[u8]) -> FileBytes {
    let mut file = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut file, 2, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(bytes).expect("the samples");
    writer.finish().expect("the end");
    FileBytes::unpacked("test.png", file)
}

fn open(input: &FileBytes, channel: Option<PngChannel>) -> Result<[f64; 4], RasterError> {
    let raster = Raster::checked(decode(input, channel)?, None)?;
    Ok([(0, 1), (1, 1), (0, 0), (1, 0)].map(|(column, row)| raster.height(column, row)))
}

#[test]
fn alpha_of_a_colour_picture_is_the_height() {
    use ::png::{BitDepth, ColorType};
    let bytes = [9, 9, 9, 1, 9, 9, 9, 2, 9, 9, 9, 0, 7, 8, 9, 255];
    let depth_in_alpha = picture(ColorType::Rgba, BitDepth::Eight, &bytes);
    let found = open(&depth_in_alpha, None).expect("heights");
    assert_eq!(found, [1.0, 2.0, 0.0, 255.0], "alpha 0 is a height");
    let blue = open(&depth_in_alpha, Some(PngChannel::Blue)).expect("heights");
    assert_eq!(blue, [9.0; 4]);

    let wide: Vec<u8> = [1_u16, 500, 65_535, 0]
        .iter()
        .flat_map(|alpha| [[0, 1], [0, 2], [0, 3], alpha.to_be_bytes()])
        .flatten()
        .collect();
    let found = open(&picture(ColorType::Rgba, BitDepth::Sixteen, &wide), None);
    assert_eq!(found.expect("heights"), [1.0, 500.0, 65_535.0, 0.0]);
}

#[test]
fn opaque_colour_picture_is_not_a_height_field() {
    use ::png::{BitDepth, ColorType};
    let opaque = picture(ColorType::Rgba, BitDepth::Eight, &[255; 16]);
    assert!(matches!(
        open(&opaque, None),
        Err(RasterError::AmbiguousChannels(_))
    ));
    // Unless the user chooses it.
    assert_eq!(
        open(&opaque, Some(PngChannel::Alpha)).expect("heights"),
        [255.0; 4]
    );
    let colours = picture(ColorType::Rgb, BitDepth::Eight, &[3; 12]);
    assert!(matches!(
        open(&colours, None),
        Err(RasterError::AmbiguousChannels(_))
    ));
    assert_eq!(
        open(&colours, Some(PngChannel::Red)).expect("heights"),
        [3.0; 4]
    );
}

#[test]
fn grey_pixel_with_zero_alpha_is_no_data() {
    use ::png::{BitDepth, ColorType};
    let bytes = [0, 10, 0, 1, 0, 20, 0, 0, 0, 30, 255, 255, 0, 0, 1, 0];
    let grey = picture(ColorType::GrayscaleAlpha, BitDepth::Sixteen, &bytes);
    let found = open(&grey, None).expect("heights");
    assert_eq!([found[0], found[2], found[3]], [10.0, 30.0, 0.0]);
    assert!(found[1].is_nan());
}

#[test]
fn grey_value_in_trns_chunk_is_no_data() {
    let mut file = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut file, 2, 2);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Sixteen);
    encoder.set_trns(vec![0x01, 0x02]);
    let mut writer = encoder.write_header().expect("a header");
    let samples = [0, 5, 1, 2, 0, 6, 0, 7];
    writer.write_image_data(&samples).expect("the samples");
    writer.finish().expect("the end");
    let [a, b, c, d] = open(&FileBytes::unpacked("test.png", file), None).expect("heights");
    assert!(b.is_nan(), "0x0102 is no data");
    assert_eq!([a, c, d], [5.0, 6.0, 7.0]);
}
