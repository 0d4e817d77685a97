//! A synthetic terrain as a cloud-optimised GeoTIFF: deflated blocks, overviews, the index first.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::Path;

use super::relief::{BLOCK, CELL_M, Place, Relief};

/// Tags of a directory.
const TAGS: u16 = 15;
/// Bytes of a directory without its lists of blocks.
const DIRECTORY: u32 = 2 + 12 * TAGS as u32 + 4;
/// Bytes before the first directory: the header and the georeference.
const HEAD: u32 = 8 + 9 * 8 + 20 * 2;

/// Position and length of each block in the file.
type Stored = BTreeMap<Place, [u32; 2]>;

/// An image of the file.
struct Image {
    side: u32,
    /// Content of each block, row after row.
    blocks: Vec<Place>,
}

/// Writes a square terrain of `side` × `side` samples: single floats, metres, with overviews down
/// to one block. Returns the bytes of the file.
///
/// The order is that of GDAL's COG driver: all directories, then all lists of blocks, then the
/// blocks, those of the smallest overview first.
///
/// # Errors
/// If the file cannot be written.
pub(super) fn write(path: &Path, side: u32, relief: &mut Relief) -> io::Result<u64> {
    let images = images(side);
    let mut list = HEAD + DIRECTORY * images.len() as u32;
    let mut lists = vec![];
    for image in &images {
        lists.push(list);
        list += 8 * image.blocks.len() as u32;
    }
    // Position and length of each distinct block.
    let (mut stored, mut order, mut end) = (Stored::new(), vec![], list);
    for place in images.iter().rev().flat_map(|image| &image.blocks) {
        if !stored.contains_key(place) {
            let length = relief.packed(*place)?.len() as u32;
            stored.insert(*place, [end, length]);
            order.push(*place);
            end += length;
        }
    }
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&head())?;
    for (number, (image, list)) in images.iter().zip(&lists).enumerate() {
        let next = match number + 1 < images.len() {
            true => HEAD + DIRECTORY * (number as u32 + 1),
            false => 0,
        };
        file.write_all(&directory(image, *list, number > 0, &stored, next))?;
    }
    for image in &images {
        for which in [0, 1] {
            for place in &image.blocks {
                file.write_all(&stored[place][which].to_le_bytes())?;
            }
        }
    }
    for place in order {
        file.write_all(relief.packed(place)?)?;
    }
    file.into_inner()?.sync_all()?;
    Ok(end.into())
}

/// Returns an upper bound of a terrain's file size, for any compression of its blocks.
pub(super) fn max_bytes(side: u32) -> u64 {
    let images = images(side);
    let blocks: Vec<&Place> = images.iter().flat_map(|image| &image.blocks).collect();
    let index = blocks.len() * 8 + images.len() * DIRECTORY as usize;
    let distinct = BTreeSet::from_iter(blocks).len();
    // Deflate adds less than a hundredth to data that cannot be compressed.
    let block = 4 * u64::from(BLOCK) * u64::from(BLOCK);
    u64::from(HEAD) + index as u64 + distinct as u64 * (block + block / 100)
}

fn images(side: u32) -> Vec<Image> {
    let mut images = vec![];
    for halvings in 0.. {
        let side = side.div_ceil(1 << halvings);
        let count = side.div_ceil(BLOCK);
        let blocks = (0..count).flat_map(|row| (0..count).map(move |column| [column, row]));
        images.push(Image {
            side,
            blocks: blocks.map(|at| Relief::place(halvings, at)).collect(),
        });
        if count == 1 {
            break;
        }
    }
    images
}

/// A projected map in metres without further parameters, with areas as pixels: a georeferenced file
/// needs no world file, and its cells have one size everywhere.
const GEO_KEYS: [u16; 20] = [
    1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32767, 3076, 0, 1, 9001,
];

/// Returns the header before the directories, with the georeference that they share.
fn head() -> Vec<u8> {
    let mut bytes = b"II*\0".to_vec();
    bytes.extend(HEAD.to_le_bytes());
    // Size of a cell; column and row of a corner, and its position.
    let place = [
        CELL_M,
        CELL_M,
        0.0,
        0.0,
        0.0,
        0.0,
        500_000.0,
        4_000_000.0,
        0.0,
    ];
    bytes.extend(place.iter().flat_map(|number| number.to_le_bytes()));
    bytes.extend(GEO_KEYS.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

/// Writes a directory whose two lists of blocks are at `list`.
fn directory(image: &Image, list: u32, is_overview: bool, stored: &Stored, next: u32) -> Vec<u8> {
    let (short, long) = (3_u16, 4_u16);
    let count = image.blocks.len() as u32;
    // A single number is in the tag itself.
    let [offsets, lengths] = match image.blocks.as_slice() {
        [only] => stored[only],
        _ => [list, list + 4 * count],
    };
    let mut bytes = TAGS.to_le_bytes().to_vec();
    let mut tag = |number: u16, kind: u16, count: u32, value: u32| {
        bytes.extend(number.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    };
    tag(254, long, 1, u32::from(is_overview));
    tag(256, long, 1, image.side);
    tag(257, long, 1, image.side);
    tag(258, short, 1, 32);
    // Deflate.
    tag(259, short, 1, 8);
    tag(262, short, 1, 1);
    tag(277, short, 1, 1);
    tag(322, long, 1, BLOCK);
    tag(323, long, 1, BLOCK);
    tag(324, long, count, offsets);
    tag(325, long, count, lengths);
    // Floats.
    tag(339, short, 1, 3);
    let double = 12;
    // Cells of an overview are larger; its georeference is not used.
    tag(33550, double, 3, 8);
    tag(33922, double, 6, 32);
    tag(34735, short, GEO_KEYS.len() as u32, 80);
    bytes.extend(next.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streaming::relief::PERIOD;
    use hapterra::terrain::{HapticCells, HapticGrid};
    use heightfield::{OpenOptions, Raster, Wait};

    #[test]
    fn written_cog_repeats_one_square_of_relief_everywhere() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("made.tif");
        let (mut relief, side) = (Relief::new(), 7200);
        let bytes = write(&path, side, &mut relief).expect("written");
        assert_eq!(std::fs::metadata(&path).expect("there").len(), bytes);
        assert!(bytes <= max_bytes(side), "{bytes}");
        let options = OpenOptions {
            max_in_memory_bytes: 0,
            ..OpenOptions::default()
        };
        let raster = Raster::open(&path, &options).expect("opens");
        assert_eq!([raster.columns(), raster.rows()], [side; 2]);
        let grid = HapticGrid::new(&raster, HapticCells::default());
        assert_eq!(grid.cells_per_vertical_unit(), Some(1.0 / CELL_M));
        assert!(raster.bounds().is_some(), "it is georeferenced");
        let synth = hapterra::synth::Synth::new(hapterra::synth::Kind::Fractal, 17, 600.0);
        for (column, row) in [(0, 0), (3071, 511), (3072, 512), (6500, 7199), (4000, 100)] {
            let height = raster.height(column, side - 1 - row);
            let expected = f64::from(synth.height(column % PERIOD, row % PERIOD));
            assert!((height - expected).abs() < 0.006, "{column} {row}");
        }
        // An overview, without no-data.
        for (column, row) in [(1, 1), (55, 55), (110, 3)] {
            let mut heights = [f64::NAN];
            assert!(
                raster
                    .read_row(6, row, column, &mut heights, Wait::UntilRead)
                    .is_complete()
            );
            assert!((0.0..600.0).contains(&heights[0]), "{heights:?}");
        }
    }
}
