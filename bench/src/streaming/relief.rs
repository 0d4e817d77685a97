//! The relief of the synthetic terrains: a square of mountains that repeats, in compressed blocks.
//!
//! A terrain of 10¹⁰ samples has 40 GB. The hand moves inside one square of [`PERIOD`] samples, so
//! a synthetic terrain repeats that square, and its file stores each block of it once: the file's
//! index has the same offset in many places. The program reads, stores and sends it like any other.
//! Between two squares there is a cliff, which no path of the HIP crosses.

use std::collections::BTreeMap;
use std::io::{self, Write as _};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use hapterra::synth::{Kind, Synth};

/// Side of the square that repeats, samples.
pub(super) const PERIOD: u32 = 3072;
/// Side of a block of a file, samples, as in the output of `gdal_translate -of COG`.
pub(super) const BLOCK: u32 = 512;
/// Side of a cell on the ground, metres.
pub(super) const CELL_M: f64 = 10.0;
/// Resolution of heights, metres.
const STEP_M: f64 = 0.01;

/// Content of a block: the number of halvings of the field, and the block's first column and row in
/// the square.
pub(super) type Place = (u32, [u32; 2]);

/// The square, and its blocks as files store them.
pub(super) struct Relief {
    /// The square itself, and then each of its overviews.
    images: Vec<Image>,
    packed: BTreeMap<Place, Vec<u8>>,
}

/// Heights in metres, rows from north to south.
struct Image {
    side: u32,
    heights: Vec<f32>,
}

impl Relief {
    /// Creates mountains with heights in whole centimetres.
    pub(super) fn new() -> Self {
        let cells = Kind::Fractal.default_amplitude_cells();
        let synth = Synth::new(Kind::Fractal, 17, cells * CELL_M);
        let places = (0..PERIOD).flat_map(|row| (0..PERIOD).map(move |column| (column, row)));
        let whole = |height: f32| ((f64::from(height) / STEP_M).round() * STEP_M) as f32;
        let heights = places.map(|(column, row)| whole(synth.height(column, row)));
        let full = Image {
            side: PERIOD,
            heights: heights.collect(),
        };
        Self {
            images: vec![full],
            packed: BTreeMap::new(),
        }
    }

    /// Returns the block's content, by its column and row in an image after these halvings.
    pub(super) fn place(halvings: u32, block: [u32; 2]) -> Place {
        let side = PERIOD >> halvings;
        (halvings, block.map(|index| index * BLOCK % side))
    }

    /// Returns the bytes of a block.
    ///
    /// # Errors
    /// None from a vector in memory.
    pub(super) fn packed(&mut self, place: Place) -> io::Result<&[u8]> {
        if !self.packed.contains_key(&place) {
            let bytes = self.pack(place)?;
            self.packed.insert(place, bytes);
        }
        Ok(&self.packed[&place])
    }

    fn pack(&mut self, (halvings, [left, top]): Place) -> io::Result<Vec<u8>> {
        while self.images.len() <= halvings as usize {
            self.images.extend(self.images.last().map(Image::halved));
        }
        let image = &self.images[halvings as usize];
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        let mut line = Vec::with_capacity(4 * BLOCK as usize);
        for row in top..top + BLOCK {
            line.clear();
            for column in left..left + BLOCK {
                line.extend(image.height(column, row).to_le_bytes());
            }
            encoder.write_all(&line)?;
        }
        encoder.finish()
    }
}

impl Image {
    fn height(&self, column: u32, row: u32) -> f32 {
        let [column, row] = [column, row].map(|index| (index % self.side) as usize);
        self.heights[row * self.side as usize + column]
    }

    /// Returns the means of four samples each.
    fn halved(&self) -> Self {
        let side = self.side / 2;
        let mean = |column: u32, row: u32| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let four = four.map(|(east, south)| self.height(2 * column + east, 2 * row + south));
            0.25 * four.iter().sum::<f32>()
        };
        let places = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
        Self {
            side,
            heights: places.map(|(column, row)| mean(column, row)).collect(),
        }
    }
}
