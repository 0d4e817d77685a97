//! A tile: 32 × 32 patches of terrain, and the maxima that let a sweep skip it.

use super::extent::FieldSize;
use super::index::{BLOCK_SHIFT, TILE_CELLS, TILE_SAMPLES, TileIndex, TileKey};
use super::packed::Unpacker;
use crate::grid::{Altitude, Cell, MAX_CELL};

const BLOCKS: usize = TILE_CELLS >> BLOCK_SHIFT;
const QUARTERS: usize = BLOCKS / 2;

/// Maximum difference of neighbouring samples, cells: to a hand, a wall of this height is
/// practically vertical, and the contact is exact up to it.
pub const MAX_STEP_CELLS: f32 = 1e4;

/// Reason to refuse the data of a tile. The buffer is left vacant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TileError {
    /// Not 33 × 33 little-endian `f32`.
    Length,
    /// The base lies outside ±[`MAX_CELL`].
    Base,
    /// Not the packed heights of exactly 33 × 33 samples.
    Packed,
    /// Not 33 × 33 materials of the scene's table.
    Materials,
    /// Neighbouring samples differ by more than [`MAX_STEP_CELLS`].
    Step,
}

/// Content of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// No tile.
    Nothing,
    /// A tile that is part of the fallback, or that is not rendered unchanged yet.
    Tile,
    /// A tile that is rendered unchanged.
    Surface,
}

/// One buffer of the window: 33 × 33 heights, their block maxima, and a material for each sample.
#[derive(Clone, Debug)]
pub struct Tile {
    // Key and content are adjacent: a tick reads both for each patch.
    index: TileIndex,
    level: u8,
    content: Content,
    /// True if every sample has data.
    is_whole: bool,
    base: i32,
    /// Heights above `base` in cells, `[row][column]` from the south-west;
    /// NaN where there is no surface.
    samples: [[f32; TILE_SAMPLES]; TILE_SAMPLES],
    blocks: [[f32; BLOCKS]; BLOCKS],
    quarters: [[f32; QUARTERS]; QUARTERS],
    highest: f32,
    lowest: f32,
    /// True if the tile has materials.
    has_materials: bool,
    /// For each sample, in the order of `samples`, its index in the scene's table of materials;
    /// valid only if `has_materials`.
    materials: [[u8; TILE_SAMPLES]; TILE_SAMPLES],
}

impl Tile {
    /// A buffer without a tile.
    pub const VACANT: Self = Self {
        index: TileIndex::new(0, 0),
        level: 0,
        content: Content::Nothing,
        is_whole: false,
        base: 0,
        samples: [[0.0; TILE_SAMPLES]; TILE_SAMPLES],
        blocks: [[0.0; BLOCKS]; BLOCKS],
        quarters: [[0.0; QUARTERS]; QUARTERS],
        highest: 0.0,
        lowest: 0.0,
        has_materials: false,
        materials: [[0; TILE_SAMPLES]; TILE_SAMPLES],
    };

    /// Returns the tile's key; `None` for a vacant buffer.
    #[must_use]
    pub const fn key(&self) -> Option<TileKey> {
        match self.content {
            Content::Nothing => None,
            Content::Tile | Content::Surface => Some(TileKey {
                level: self.level,
                index: self.index,
            }),
        }
    }

    /// Discards the tile; the buffer can be filled again.
    pub const fn vacate(&mut self) {
        self.content = Content::Nothing;
        self.has_materials = false;
    }

    /// Sets the material of each sample of a filled tile, as an index in the scene's table, by rows
    /// from the south.
    ///
    /// # Errors
    /// [`TileError::Materials`] unless the buffer was filled and there are exactly 33 × 33 of them,
    /// each below `count`. On an error the buffer is left vacant.
    pub fn set_materials(
        &mut self,
        count: usize,
        materials: impl IntoIterator<Item = u8>,
    ) -> Result<(), TileError> {
        self.set_materials_from(count, &mut materials.into_iter())
    }

    /// [`Self::set_materials`] without generics: an image contains it once.
    #[inline(never)]
    fn set_materials_from(
        &mut self,
        count: usize,
        materials: &mut dyn Iterator<Item = u8>,
    ) -> Result<(), TileError> {
        let mut is_right = self.content != Content::Nothing;
        for slot in self.materials.as_flattened_mut() {
            // A missing index becomes one beyond every table.
            *slot = materials.next().unwrap_or(u8::MAX);
            is_right &= usize::from(*slot) < count;
        }
        if !is_right || materials.next().is_some() {
            self.vacate();
            return Err(TileError::Materials);
        }
        self.has_materials = true;
        Ok(())
    }

    /// Returns the material of a sample, as an index in the scene's table. `east` and `north`, 0 or
    /// 1, count from the south-west corner of a patch. `None` if the tile has no materials.
    pub(crate) fn material(&self, patch: Cell, [east, north]: [usize; 2]) -> Option<u8> {
        let [u, v] = within(patch);
        let row = self.materials.get(v + north)?;
        let material = row.get(u + east)?;
        self.has_materials.then_some(*material)
    }

    /// Returns true if this is the tile at `index`, and is rendered unchanged.
    #[inline]
    pub(super) fn is_surface_of(&self, index: TileIndex) -> bool {
        self.index == index && self.content == Content::Surface
    }

    /// Marks the tile as rendered unchanged.
    pub(super) fn mark_as_surface(&mut self) {
        if self.content == Content::Tile {
            self.content = Content::Surface;
        }
    }

    /// Fills the buffer from heights in cells above `base`, given by column and row in `0..33`. NaN
    /// is no-data; so is any height beyond ±[`MAX_CELL`].
    ///
    /// # Errors
    /// [`TileError::Base`] if `base` is out of range, [`TileError::Step`] if the tile is too steep.
    pub fn fill(
        &mut self,
        key: TileKey,
        base: i32,
        mut height: impl FnMut(usize, usize) -> f32,
    ) -> Result<(), TileError> {
        self.fill_with(key, base, &mut height)
    }

    /// [`Self::fill`] without generics: an image contains it once.
    #[inline(never)]
    fn fill_with(
        &mut self,
        key: TileKey,
        base: i32,
        height: &mut dyn FnMut(usize, usize) -> f32,
    ) -> Result<(), TileError> {
        self.vacate();
        if base.unsigned_abs() > MAX_CELL.unsigned_abs() {
            return Err(TileError::Base);
        }
        for row in 0..TILE_SAMPLES {
            for col in 0..TILE_SAMPLES {
                self.set(col, row, height(col, row));
            }
        }
        if !self.has_valid_steps() {
            return Err(TileError::Step);
        }
        self.complete(key, base);
        Ok(())
    }

    /// Returns true if no neighbouring samples differ by more than [`MAX_STEP_CELLS`].
    pub(super) fn has_valid_steps(&self) -> bool {
        // NaN (no-data) makes no step.
        let steps = |a: f32, b: f32| (a - b).abs() > MAX_STEP_CELLS;
        let in_row = |row: &[f32; TILE_SAMPLES]| {
            let next = row.iter().skip(1);
            row.iter().zip(next).any(|(a, b)| steps(*a, *b))
        };
        let between = |south: &[f32; TILE_SAMPLES], north: &[f32; TILE_SAMPLES]| {
            south.iter().zip(north).any(|(a, b)| steps(*a, *b))
        };
        let north = self.samples.iter().skip(1);
        !self.samples.iter().any(in_row)
            && !self
                .samples
                .iter()
                .zip(north)
                .any(|(south, north)| between(south, north))
    }

    /// Discards the tile, and sets every sample to no-data.
    pub(super) fn clear(&mut self) {
        self.vacate();
        self.samples = [[f32::NAN; TILE_SAMPLES]; TILE_SAMPLES];
    }

    /// Sets a sample of a vacant buffer.
    pub(super) fn set(&mut self, col: usize, row: usize, height: f32) {
        if let Some(sample) = self.samples.get_mut(row).and_then(|row| row.get_mut(col)) {
            let addressable = height.abs() <= MAX_CELL as f32;
            *sample = if addressable { height } else { f32::NAN };
        }
    }

    /// Completes a tile from the samples that were set.
    pub(super) fn complete(&mut self, key: TileKey, base: i32) {
        self.base = base;
        self.update_bounds();
        (self.index, self.level) = (key.index, key.level);
        self.content = Content::Tile;
    }

    /// Fills the buffer from a function of a sample's column and row in the whole field, heights in
    /// cells above `base`; beyond the field the samples are no-data.
    ///
    /// # Errors
    /// As [`Self::fill`].
    pub fn fill_from(
        &mut self,
        key: TileKey,
        base: i32,
        size: FieldSize,
        mut height: impl FnMut(i32, i32) -> f32,
    ) -> Result<(), TileError> {
        let first = key.index.first_cell();
        self.fill(key, base, |col, row| {
            let (x, y) = (first.x + col as i32, first.y + row as i32);
            match x <= size.columns && y <= size.rows {
                true => height(x, y),
                false => f32::NAN,
            }
        })
    }

    /// Fills the buffer from little-endian `f32` heights, rows from the south.
    ///
    /// # Errors
    /// [`TileError::Length`] unless there are exactly 33 × 33 of them.
    pub fn load(&mut self, key: TileKey, base: i32, bytes: &[u8]) -> Result<(), TileError> {
        self.vacate();
        let (samples, rest) = bytes.as_chunks::<4>();
        if samples.len() != TILE_SAMPLES * TILE_SAMPLES || !rest.is_empty() {
            return Err(TileError::Length);
        }
        self.fill(key, base, |col, row| {
            samples
                .get(row * TILE_SAMPLES + col)
                .map_or(f32::NAN, |le| f32::from_le_bytes(*le))
        })
    }

    /// Fills the buffer from [packed](super::packed) heights, without a second buffer.
    ///
    /// # Errors
    /// [`TileError::Packed`] unless the bytes are the packed heights of a tile, and no more.
    pub fn unpack(&mut self, key: TileKey, base: i32, bytes: &[u8]) -> Result<(), TileError> {
        self.vacate();
        let mut heights = Unpacker::new(bytes).ok_or(TileError::Packed)?;
        self.fill(key, base, |col, _| heights.next(col))?;
        if !heights.is_at_end() {
            self.vacate();
            return Err(TileError::Packed);
        }
        Ok(())
    }

    /// Returns the whole height, in cells, to which [`Self::corners`] is relative.
    #[must_use]
    pub const fn base(&self) -> i32 {
        self.base
    }

    /// Returns the heights above the base at the corners of a patch, whose column and row are taken
    /// modulo 32: south-west, south-east, north-west, north-east.
    #[must_use]
    #[inline]
    pub fn corners(&self, cell: Cell) -> [f32; 4] {
        let [u, v] = within(cell);
        let (south, north) = (&self.samples[v], &self.samples[v + 1]);
        [south[u], south[u + 1], north[u], north[u + 1]]
    }

    /// Returns true if `low` is above the corners of the patches in the columns and rows from
    /// `from` to `to` (taken modulo 32), at most two in each direction. NaN samples do not count.
    #[must_use]
    #[inline]
    pub(super) fn is_below_around(&self, from: Cell, to: Cell, low: Altitude) -> bool {
        let ([u, v], [u1, v1]) = (within(from), within(to));
        let low = low.above(self.base);
        [v, v + 1, v1 + 1].into_iter().all(|row| {
            let row = &self.samples[row];
            // False for NaN.
            let is_reached = |sample: f32| sample >= low;
            !(is_reached(row[u]) || is_reached(row[u + 1]) || is_reached(row[u1 + 1]))
        })
    }

    /// Returns the sample in a column and row of `0..33`, cells above the base; NaN beyond.
    #[must_use]
    pub(super) fn sample(&self, col: usize, row: usize) -> f32 {
        let sample = self.samples.get(row).and_then(|row| row.get(col));
        sample.copied().unwrap_or(f32::NAN)
    }

    /// Returns true if every sample has data.
    #[must_use]
    pub(super) const fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Returns the lowest and highest sample, cells above the base; `None` if all are no-data.
    #[must_use]
    pub(super) fn range(&self) -> Option<[f32; 2]> {
        (self.lowest <= self.highest).then_some([self.lowest, self.highest])
    }

    /// Returns a whole height, in cells, above every sample of the tile; `i32::MIN` if all are
    /// no-data.
    #[must_use]
    pub(super) fn top(&self) -> i32 {
        if self.highest == f32::NEG_INFINITY {
            return i32::MIN; // no data
        }
        // Above every sample, also if the height is whole: the comparison with it may then be `>=`.
        self.base
            .saturating_add(self.highest as i32)
            .saturating_add(1)
    }

    /// Returns true if `low` is above every sample of the 8- or 16-cell block that contains a cell.
    #[inline]
    pub(super) fn block_is_below(&self, shift: u32, cell: Cell, low: Altitude) -> bool {
        let [u, v] = within(cell);
        let top = if shift == BLOCK_SHIFT {
            self.blocks[v >> BLOCK_SHIFT][u >> BLOCK_SHIFT]
        } else {
            self.quarters[v >> (BLOCK_SHIFT + 1)][u >> (BLOCK_SHIFT + 1)]
        };
        low.above(self.base) > top
    }

    /// Returns true if `low` is above every sample.
    pub(super) fn is_below(&self, low: Altitude) -> bool {
        low.above(self.base) > self.highest
    }

    fn update_bounds(&mut self) {
        let Self {
            samples, blocks, ..
        } = self;
        for (row, blocks) in blocks.iter_mut().enumerate() {
            for (col, block) in blocks.iter_mut().enumerate() {
                *block = highest_of(
                    samples,
                    col << BLOCK_SHIFT,
                    row << BLOCK_SHIFT,
                    (1 << BLOCK_SHIFT) + 1,
                );
            }
        }
        for (row, quarters) in self.quarters.iter_mut().enumerate() {
            for (col, quarter) in quarters.iter_mut().enumerate() {
                *quarter = highest_of(&self.blocks, 2 * col, 2 * row, 2);
            }
        }
        self.highest = highest_of(&self.quarters, 0, 0, QUARTERS);
        (self.lowest, self.is_whole) = lowest_of(self.samples.as_flattened());
    }
}

/// A cell's column and row within its tile.
#[inline]
fn within(cell: Cell) -> [usize; 2] {
    [cell.x, cell.y].map(|c| c as usize % TILE_CELLS)
}

/// Returns the lowest of the numbers, and true if none is NaN; NaN does not count.
#[inline(never)]
fn lowest_of(numbers: &[f32]) -> (f32, bool) {
    let mut lowest = (f32::INFINITY, true);
    for number in numbers {
        if *number < lowest.0 {
            lowest.0 = *number;
        }
        lowest.1 &= !number.is_nan();
    }
    lowest
}

/// Returns the highest of the numbers in a square; NaN does not count.
fn highest_of<const N: usize>(of: &[[f32; N]; N], col: usize, row: usize, side: usize) -> f32 {
    let rows = of.iter().skip(row).take(side);
    rows.flat_map(|numbers| numbers.iter().skip(col).take(side))
        .fold(f32::NEG_INFINITY, |high, number| high.max(*number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::boxed::Box;

    const KEY: TileKey = TileKey::new(0, 3, -2);

    fn filled(height: impl FnMut(usize, usize) -> f32) -> Box<Tile> {
        let mut tile = Box::new(Tile::VACANT);
        tile.fill(KEY, 100, height).unwrap();
        tile
    }

    #[test]
    fn corners_are_the_four_samples_around_a_patch() {
        let tile = filled(|col, row| (col * 100 + row) as f32);
        assert_eq!(
            tile.corners(Cell::new(31, 0)),
            [3100.0, 3200.0, 3101.0, 3201.0]
        );
        assert_eq!(
            tile.corners(Cell::new(-1, 32)),
            tile.corners(Cell::new(31, 0))
        );
    }

    #[test]
    fn block_maxima_bound_heights_and_ignore_no_data() {
        let tile = filled(|col, row| match (col, row) {
            (8, 8) => 5.5, // belongs to four blocks
            (20, 20) => f32::NAN,
            _ => 1.0,
        });
        for (u, v) in [(0, 0), (8, 0), (0, 8), (8, 8)] {
            assert!(!tile.block_is_below(3, Cell::new(u, v), Altitude::new(105, 0.5)));
            assert!(tile.block_is_below(3, Cell::new(u, v), Altitude::new(105, 0.75)));
        }
        assert!(tile.block_is_below(3, Cell::new(16, 16), Altitude::new(101, 0.25)));
        assert!(!tile.block_is_below(4, Cell::new(0, 0), Altitude::new(105, 0.0)));
        assert_eq!(tile.top(), 106);
    }

    #[test]
    fn failed_load_leaves_the_tile_vacant() {
        let mut tile = filled(|_, _| 0.0);
        assert_eq!(tile.load(KEY, 0, &[0; 7]), Err(TileError::Length));
        assert_eq!(tile.key(), None);
        let bytes = [0u8; 4 * TILE_SAMPLES * TILE_SAMPLES];
        assert_eq!(tile.load(KEY, i32::MAX, &bytes), Err(TileError::Base));
        assert_eq!(tile.load(KEY, 0, &bytes), Ok(()));
        assert_eq!(tile.key(), Some(KEY));
    }

    #[test]
    fn materials_must_be_in_the_table_and_match_the_samples() {
        const ALL: usize = TILE_SAMPLES * TILE_SAMPLES;
        let mut tile = filled(|_, _| 0.0);
        let kinds = |count: usize| (0..count).map(|i| (i % 5) as u8);
        assert_eq!(tile.material(Cell::new(0, 0), [0, 0]), None, "it has none");
        assert_eq!(tile.set_materials(5, kinds(ALL)), Ok(()));
        let at = |col: usize, row: usize| ((row * TILE_SAMPLES + col) % 5) as u8;
        assert_eq!(tile.material(Cell::new(31, 2), [1, 1]), Some(at(32, 3)));
        assert_eq!(tile.material(Cell::new(-1, 34), [0, 0]), Some(at(31, 2)));
        for (count, of) in [(4, ALL), (5, ALL - 1), (5, ALL + 1), (0, ALL)] {
            let mut tile = filled(|_, _| 0.0);
            assert_eq!(
                tile.set_materials(count, kinds(of)),
                Err(TileError::Materials)
            );
            assert_eq!(tile.key(), None);
        }
        // Filling the buffer again discards its materials.
        tile.fill(KEY, 0, |_, _| 1.0).unwrap();
        assert_eq!(tile.material(Cell::new(0, 0), [0, 0]), None);
        tile.vacate();
        assert_eq!(tile.set_materials(5, kinds(ALL)), Err(TileError::Materials));
    }

    #[test]
    fn heights_beyond_the_addressable_range_are_no_data() {
        let tile = filled(|col, _| if col == 0 { f32::INFINITY } else { 1e30 });
        assert!(tile.corners(Cell::new(0, 0)).iter().all(|h| h.is_nan()));
        assert_eq!(tile.top(), i32::MIN);
    }
}
