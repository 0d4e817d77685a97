//! Materials on the link: the table of a scene, and the materials of a tile.

use serde::{Deserialize, Serialize};

use crate::force::MaterialTable;
use crate::scene::Scene;
use crate::terrain::{TILE_SAMPLES, Tile, TileError};

use super::tile::TileMessage;

/// Samples of a tile.
const SAMPLES: usize = TILE_SAMPLES * TILE_SAMPLES;
/// Maximum bytes of a tile's materials: two samples per byte.
pub const MAX_TILE_BYTES: usize = SAMPLES.div_ceil(2);
/// Maximum bytes of a table.
pub const MAX_TABLE_BYTES: usize = 640;

/// A scene with materials, together with their table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialScene<'a> {
    /// The scene, which contains the table's check sum ([`Scene::materials`]).
    pub scene: Scene,
    /// The table in postcard's format ([`table_bytes`]), at most [`MAX_TABLE_BYTES`].
    #[serde(borrow)]
    pub table: &'a [u8],
}

impl MaterialScene<'_> {
    /// Returns the table, if it is valid and has the scene's check sum.
    #[must_use]
    pub fn table(&self) -> Option<MaterialTable> {
        let (table, rest) = postcard::take_from_bytes::<MaterialTable>(self.table).ok()?;
        let is_right = rest.is_empty() && table.is_valid();
        (is_right && self.scene.materials == Some(table.check_sum())).then_some(table)
    }
}

/// Writes a table in the link's format; every table fits.
#[must_use]
pub fn table_bytes<'b>(table: &MaterialTable, buffer: &'b mut [u8; MAX_TABLE_BYTES]) -> &'b [u8] {
    match postcard::to_slice(table, buffer) {
        Ok(bytes) => bytes,
        Err(_) => &[],
    }
}

/// A tile of a scene with materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialTile<'a> {
    /// The tile's heights.
    #[serde(borrow)]
    pub tile: TileMessage<'a>,
    /// The tile's materials.
    #[serde(borrow)]
    pub materials: TileMaterials<'a>,
}

/// The material of each sample of a tile, as an index into the scene's table, in rows from the
/// south.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TileMaterials<'a> {
    /// All samples have this material.
    One(u8),
    /// Pairs of bytes: a material, and the number of consecutive samples that have it, minus one.
    Runs(#[serde(borrow)] &'a [u8]),
    /// Two samples per byte, the first in the lower half: [`MAX_TILE_BYTES`] bytes; the last half
    /// byte is zero.
    Each(#[serde(borrow)] &'a [u8]),
}

impl<'a> TileMaterials<'a> {
    /// Packs the materials of a tile's samples, each below 16, in the shortest form.
    #[must_use]
    pub fn pack(materials: &[u8; SAMPLES], buffer: &'a mut [u8; MAX_TILE_BYTES]) -> Self {
        if materials.iter().all(|material| *material == materials[0]) {
            return Self::One(materials[0]);
        }
        match runs(materials, buffer) {
            Some(length) => Self::Runs(buffer.get(..length).unwrap_or(&[])),
            None => {
                let pairs = materials.chunks(2);
                for (byte, pair) in buffer.iter_mut().zip(pairs) {
                    let half = |i: usize| pair.get(i).map_or(0, |material| material & 15);
                    *byte = half(0) | half(1) << 4;
                }
                Self::Each(buffer.as_slice())
            }
        }
    }

    /// Sets the materials of a filled tile, from a table of `count`.
    ///
    /// # Errors
    /// Returns [`TileError::Materials`] unless there are 33 × 33 samples, all in the table. The
    /// buffer is then vacant.
    pub fn fill(&self, tile: &mut Tile, count: usize) -> Result<(), TileError> {
        match *self {
            Self::One(material) => {
                tile.set_materials(count, core::iter::repeat_n(material, SAMPLES))
            }
            Self::Runs(bytes) => {
                let (runs, rest) = bytes.as_chunks::<2>();
                let samples = runs
                    .iter()
                    .flat_map(|[material, more]| {
                        core::iter::repeat_n(*material, usize::from(*more) + 1)
                    })
                    // An incomplete run is a material that no table has.
                    .chain(rest.iter().map(|_| u8::MAX));
                tile.set_materials(count, samples)
            }
            Self::Each(bytes) => {
                let halves = bytes.iter().flat_map(|byte| [byte & 15, byte >> 4]);
                let is_ended = bytes.last().is_some_and(|last| last >> 4 == 0);
                match bytes.len() == MAX_TILE_BYTES && is_ended {
                    true => tile.set_materials(count, halves.take(SAMPLES)),
                    false => tile.set_materials(count, core::iter::empty()),
                }
            }
        }
    }
}

/// Writes runs; returns their number of bytes, if it is less than with two samples per byte.
fn runs(materials: &[u8; SAMPLES], buffer: &mut [u8; MAX_TILE_BYTES]) -> Option<usize> {
    let mut length = 0;
    let alike = materials.chunk_by(|one, next| one == next);
    // A byte counts up to 256 samples.
    for run in alike.flat_map(|run| run.chunks(256)) {
        let pair = buffer.get_mut(length..length + 2)?;
        let more = u8::try_from(run.len() - 1).ok()?;
        pair.copy_from_slice(&[*run.first()?, more]);
        length += 2;
    }
    Some(length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::{Material, SurfaceParams};
    use crate::grid::Cell;
    use crate::terrain::TileKey;
    use std::boxed::Box;
    use std::vec::Vec;

    const KEY: TileKey = TileKey::new(0, 0, 0);

    fn filled() -> Box<Tile> {
        let mut tile = Box::new(Tile::VACANT);
        tile.fill(KEY, 0, |_, _| 0.0).unwrap();
        tile
    }

    fn materials(of: impl Fn(usize, usize) -> u8) -> [u8; SAMPLES] {
        core::array::from_fn(|i| of(i % TILE_SAMPLES, i / TILE_SAMPLES))
    }

    /// Returns the content of a filled tile.
    fn read(tile: &Tile) -> Vec<u8> {
        let at = |i: usize| {
            let (col, row) = (i % TILE_SAMPLES, i / TILE_SAMPLES);
            let (x, y) = (col.min(31), row.min(31));
            tile.material(Cell::new(x as i32, y as i32), [col - x, row - y])
        };
        (0..SAMPLES).map(|i| at(i).expect("set")).collect()
    }

    #[test]
    fn packed_materials_round_trip_in_shortest_form() {
        let noise = |col: usize, row: usize| ((col * 7919 + row * 104_729) % 61 % 16) as u8;
        let mut buffer = [0xAA; MAX_TILE_BYTES];
        let border = |col: usize, row: usize| u8::from(col + row / 3 > 20) * 9;
        for (all, max) in [
            (materials(|_, _| 15), 1),
            (materials(|_, row| u8::from(row > 16)), 12),
            (materials(border), 2 * 2 * TILE_SAMPLES),
            (materials(noise), MAX_TILE_BYTES),
        ] {
            let packed = TileMaterials::pack(&all, &mut buffer);
            let length = match packed {
                TileMaterials::One(_) => 1,
                TileMaterials::Runs(bytes) | TileMaterials::Each(bytes) => bytes.len(),
            };
            assert!(length <= max, "{length} of {max}");
            let mut tile = filled();
            assert_eq!(packed.fill(&mut tile, 16), Ok(()));
            assert_eq!(read(&tile), all);
            // The table must have all of them.
            let largest = usize::from(*all.iter().max().expect("some"));
            assert_eq!(
                packed.fill(&mut filled(), largest),
                Err(TileError::Materials)
            );
        }
    }

    #[test]
    fn invalid_material_bytes_are_refused_and_leave_tile_vacant() {
        let whole = [[3, 255]; 4].as_flattened().to_vec();
        let with = |more: &[u8]| [&whole[..], more].concat();
        let runs = [
            with(&[3, 63]),
            with(&[3, 65]),
            with(&[3, 64, 0]),
            with(&[16, 64]),
        ];
        for bytes in &runs {
            let mut tile = filled();
            let filled = TileMaterials::Runs(bytes).fill(&mut tile, 16);
            assert_eq!(filled, Err(TileError::Materials), "{bytes:?}");
            assert_eq!(tile.key(), None);
        }
        let right = with(&[3, 64]);
        assert_eq!(TileMaterials::Runs(&right).fill(&mut filled(), 16), Ok(()));
        let each = [0x11; MAX_TILE_BYTES + 1];
        for length in [0, MAX_TILE_BYTES - 1, MAX_TILE_BYTES, MAX_TILE_BYTES + 1] {
            let mut tile = filled();
            let filled = TileMaterials::Each(&each[..length]).fill(&mut tile, 16);
            assert_eq!(filled, Err(TileError::Materials), "{length}");
            assert_eq!(tile.key(), None);
        }
        assert!(TileMaterials::One(2).fill(&mut filled(), 2).is_err());
    }

    #[test]
    fn largest_table_fits_and_must_match_its_scene() {
        let mut material = Material::of(&SurfaceParams::PREMIUM);
        material.texture.seed = u32::MAX;
        let table = MaterialTable::new(&[material; MaterialTable::MAX]).expect("fits");
        let mut buffer = [0; MAX_TABLE_BYTES];
        let bytes = table_bytes(&table, &mut buffer).to_vec();
        assert!(bytes.len() > 600, "{}", bytes.len());
        let scene = |materials| Scene {
            epoch: 1,
            level: 0,
            size: crate::terrain::FieldSize::new(3, 3),
            top: 1,
            fallback: None,
            cell_mm: 1.0,
            home: crate::grid::GridPoint::default(),
            params: SurfaceParams::PREMIUM,
            source: crate::scene::Source::Points,
            hold_clock: false,
            materials,
        };
        let with = |sum, table: &[u8]| {
            MaterialScene {
                scene: scene(sum),
                table,
            }
            .table()
        };
        let sum = Some(table.check_sum());
        assert_eq!(with(sum, &bytes), Some(table));
        assert_eq!(with(None, &bytes), None);
        assert_eq!(with(Some(7), &bytes), None);
        assert_eq!(with(sum, &[&bytes[..], &[0]].concat()), None);
        assert_eq!(with(sum, &bytes[..bytes.len() - 1]), None);
        assert_eq!(with(sum, &[]), None);
    }
}
