//! A cloud-optimised GeoTIFF, written byte by byte: tiles, and overviews after the full image. It
//! shares no code with the reader.

/// Side of a usual tile, samples.
const TILE: u32 = 256;
/// Bytes of a directory with [`TAGS`] tags.
const TAGS: u16 = 15;

/// A field of samples, rows from north to south.
struct Image {
    columns: u32,
    rows: u32,
    samples: Vec<f32>,
}

/// Returns the file of a field whose cells are 30 m, with `overviews` overviews, each of every
/// second sample of the image before.
#[must_use]
pub fn cog(columns: u32, rows: u32, overviews: u32, height: impl Fn(u32, u32) -> f32) -> Vec<u8> {
    in_tiles(TILE, [columns, rows], overviews, height)
}

/// Same as [`cog`] with tiles of this size.
#[must_use]
pub fn in_tiles(
    tile: u32,
    [columns, rows]: [u32; 2],
    overviews: u32,
    height: impl Fn(u32, u32) -> f32,
) -> Vec<u8> {
    let samples = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let full = Image {
        columns,
        rows,
        samples: samples.map(|(column, row)| height(column, row)).collect(),
    };
    let mut images = vec![full];
    for _ in 0..overviews {
        images.extend(images.last().map(halved));
    }
    written(tile, &images)
}

fn halved(image: &Image) -> Image {
    let (columns, rows) = (image.columns.div_ceil(2), image.rows.div_ceil(2));
    let at = |column: u32, row: u32| {
        // The middle of four.
        let place = |index: u32, count: u32| [index * 2, (index * 2 + 1).min(count - 1)];
        let across = place(column, image.columns);
        let down = place(row, image.rows);
        let four = down
            .into_iter()
            .flat_map(|row| across.map(|column| (column, row)));
        let sum: f32 = four
            .map(|(column, row)| image.samples[(row * image.columns + column) as usize])
            .sum();
        0.25 * sum
    };
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    Image {
        columns,
        rows,
        samples: places.map(|(column, row)| at(column, row)).collect(),
    }
}

fn written(tile: u32, images: &[Image]) -> Vec<u8> {
    let directory = 2 + 12 * u32::from(TAGS) + 4;
    let lists: Vec<u32> = images.iter().map(|image| 8 * tiles(tile, image)).collect();
    // For each image: its directory, its two lists of tiles, and its georeference.
    let place = 3 * 8 + 6 * 8 + 2 * 16;
    let header: u32 = 8 + lists
        .iter()
        .map(|list| directory + list + place)
        .sum::<u32>();
    let mut bytes = b"II*\0".to_vec();
    bytes.extend(8_u32.to_le_bytes());
    let mut first = header;
    for (index, image) in images.iter().enumerate() {
        let begins = bytes.len() as u32;
        let next = begins + directory + lists[index] + place;
        let next = if index + 1 < images.len() { next } else { 0 };
        let list = begins + directory;
        let scale = list + lists[index];
        let tile_bytes = 4 * tile * tile;
        let count = tiles(tile, image);
        bytes.extend(TAGS.to_le_bytes());
        let mut tag = |number: u16, kind: u16, count: u32, value: u32| {
            bytes.extend(number.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(count.to_le_bytes());
            bytes.extend(value.to_le_bytes());
        };
        let (short, long, double) = (3, 4, 12);
        tag(254, long, 1, u32::from(index > 0));
        tag(256, long, 1, image.columns);
        tag(257, long, 1, image.rows);
        tag(258, short, 1, 32);
        tag(259, short, 1, 1);
        tag(262, short, 1, 1);
        tag(277, short, 1, 1);
        tag(322, long, 1, tile);
        tag(323, long, 1, tile);
        // A single number is in the tag itself.
        let [offset, size] = match count {
            1 => [first, tile_bytes],
            _ => [list, list + 4 * count],
        };
        tag(324, long, count, offset);
        tag(325, long, count, size);
        tag(339, short, 1, 3);
        tag(33550, double, 3, scale);
        tag(33922, double, 6, scale + 24);
        tag(34735, short, 16, scale + 72);
        bytes.extend(next.to_le_bytes());
        for number in 0..count {
            bytes.extend((first + number * tile_bytes).to_le_bytes());
        }
        for _ in 0..count {
            bytes.extend(tile_bytes.to_le_bytes());
        }
        for number in [
            30.0_f64,
            30.0,
            0.0,
            0.0,
            0.0,
            0.0,
            500_000.0,
            4_000_000.0,
            0.0,
        ] {
            bytes.extend(number.to_le_bytes());
        }
        // Projected, samples are areas, UTM zone 11 north.
        for number in [
            1_u16, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611,
        ] {
            bytes.extend(number.to_le_bytes());
        }
        first += count * tile_bytes;
    }
    assert_eq!(bytes.len() as u32, header);
    for image in images {
        write_tiles(tile, image, &mut bytes);
    }
    bytes
}

fn tiles(tile: u32, image: &Image) -> u32 {
    image.columns.div_ceil(tile) * image.rows.div_ceil(tile)
}

fn write_tiles(tile: u32, image: &Image, bytes: &mut Vec<u8>) {
    for top in (0..image.rows).step_by(tile as usize) {
        for first_column in (0..image.columns).step_by(tile as usize) {
            for row in top..top + tile {
                for column in first_column..first_column + tile {
                    let is_in = column < image.columns && row < image.rows;
                    let index = (row * image.columns + column) as usize;
                    let sample = if is_in { image.samples[index] } else { 0.0 };
                    bytes.extend(sample.to_le_bytes());
                }
            }
        }
    }
}
