//! Little-endian TIFFs written tag by tag, so that they can contain anything.

/// The values of a tag.
#[derive(Clone, Debug)]
pub enum Values {
    /// 16-bit integers.
    Shorts(Vec<u16>),
    /// 32-bit integers.
    Longs(Vec<u32>),
    /// 64-bit floats.
    Doubles(Vec<f64>),
}

/// Tags of an image in ascending order.
pub type Directory = Vec<(u16, Values)>;

/// Offset of the data in a file.
pub const DATA: u32 = 8;

/// Returns a file with this data and these images.
pub fn tiff(data: &[u8], images: &[Directory]) -> Vec<u8> {
    let mut bytes = b"II*\0".to_vec();
    bytes.extend((DATA + data.len() as u32).to_le_bytes());
    bytes.extend(data);
    for (number, image) in images.iter().enumerate() {
        let mut beyond = bytes.len() + 2 + 12 * image.len() + 4;
        let mut out_of_line = Vec::new();
        bytes.extend((image.len() as u16).to_le_bytes());
        for (tag, values) in image {
            let (kind, count, value) = stored(values);
            bytes.extend([tag.to_le_bytes(), u16::to_le_bytes(kind)].concat());
            bytes.extend((count as u32).to_le_bytes());
            if value.len() <= 4 {
                bytes.extend(value.iter().chain(&[0; 4]).take(4));
            } else {
                bytes.extend((beyond as u32).to_le_bytes());
                beyond += value.len();
                out_of_line.extend(value);
            }
        }
        let next = if number + 1 < images.len() { beyond } else { 0 };
        bytes.extend((next as u32).to_le_bytes());
        bytes.extend(out_of_line);
    }
    bytes
}

fn stored(values: &Values) -> (u16, usize, Vec<u8>) {
    match values {
        Values::Shorts(all) => {
            let bytes = all.iter().flat_map(|value| value.to_le_bytes());
            (3, all.len(), bytes.collect())
        }
        Values::Longs(all) => {
            let bytes = all.iter().flat_map(|value| value.to_le_bytes());
            (4, all.len(), bytes.collect())
        }
        Values::Doubles(all) => {
            let bytes = all.iter().flat_map(|value| value.to_le_bytes());
            (12, all.len(), bytes.collect())
        }
    }
}

/// Returns an image of single floats in one uncompressed strip, which begins at `place`.
pub fn floats_in_a_strip([columns, rows]: [u32; 2], place: u32) -> Directory {
    let one = |tag: u16, value: u32| (tag, Values::Longs(vec![value]));
    vec![
        one(256, columns),
        one(257, rows),
        one(258, 32),
        one(259, 1),
        one(262, 1),
        one(273, place),
        one(277, 1),
        one(278, rows),
        one(279, columns * rows * 4),
        one(339, 3),
    ]
}

/// Returns the tags that place an image in a UTM zone, its first sample's outer corner at `corner`.
pub fn placed(corner: [f64; 2], cell: f64, zone: u16) -> Directory {
    let keys = vec![1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, zone];
    vec![
        (33550, Values::Doubles(vec![cell, cell, 0.0])),
        (
            33922,
            Values::Doubles(vec![0.0, 0.0, 0.0, corner[0], corner[1], 0.0]),
        ),
        (34735, Values::Shorts(keys)),
    ]
}
