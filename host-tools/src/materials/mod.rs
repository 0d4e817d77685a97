//! Materials: a raster of classes over a terrain, and the surface of each class.
//!
//! The raster has its own grid and reference system. Each haptic sample of the terrain gets the
//! class of the pixel in which it lies. The device receives the material table ([`MaterialTable`])
//! and an index into it for each sample, but not the class numbers of the file.

mod ground;
mod pixels;

use std::hash::Hasher as _;
use std::path::Path;
use std::sync::OnceLock;

use hapterra_core::force::{Material, MaterialTable, SurfaceParams};
use hapterra_core::terrain::{TILE_SAMPLES, TileIndex};
use hapterra_core::wire::materials::{MAX_TILE_BYTES, TileMaterials};
use serde::{Deserialize, Serialize};
use twox_hash::XxHash64;

use crate::terrain::{HapticGrid, fingerprint};
pub use ground::GroundError;
use heightfield::{Raster, ReadStatus, ReadTracker, ReferenceSystem};
use heightfield::{is_url, without_key};
use pixels::Pixels;

/// Samples of a tile.
const SAMPLES: usize = TILE_SAMPLES * TILE_SAMPLES;
/// Places along each side of a terrain that are searched for its classes.
const SEARCHED_PLACES: u32 = 24;

/// Material of a class of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassMaterial {
    /// The number of the class in the file.
    pub class: i64,
    /// The user's name for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its surface.
    pub material: Material,
}

/// The materials of a scene, from a file of classes and a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassMaterials {
    /// Material where the file has no class, or a class without an entry here.
    pub default: Material,
    /// The classes with an entry, at most 15.
    #[serde(default)]
    pub class: Vec<ClassMaterial>,
}

impl ClassMaterials {
    /// Returns the table for the device.
    fn table(&self) -> Option<MaterialTable> {
        let named = self.class.iter().map(|class| class.material);
        let all: Vec<_> = std::iter::once(self.default).chain(named).collect();
        MaterialTable::new(&all)
    }

    /// Returns the table index of a value in the file; NaN means no value.
    fn index(&self, value: f64) -> u8 {
        let is_it = |class: &ClassMaterial| class.class as f64 == value;
        let place = self.class.iter().position(is_it);
        place.and_then(|i| u8::try_from(i + 1).ok()).unwrap_or(0)
    }
}

/// A raster of classes over a terrain, and their surfaces.
#[derive(Debug)]
pub struct Materials {
    file: String,
    pixels: Pixels,
    class_materials: ClassMaterials,
    table: MaterialTable,
    fingerprint: OnceLock<u64>,
}

impl Materials {
    /// Maps the classes of a file to a terrain.
    ///
    /// # Errors
    /// [`GroundError`] if the position of the classes is unknown, or none lies on the terrain.
    pub fn over(
        terrain: (&str, &Raster),
        (file, classes): (&str, Raster),
        class_materials: ClassMaterials,
    ) -> Result<Self, GroundError> {
        // The name is written to recordings and messages, so it must not contain a key.
        let file = without_key(Path::new(file));
        let pixels = Pixels::over(terrain, (&file, classes))?;
        let table = class_materials
            .table()
            .ok_or(GroundError::TooMany(class_materials.class.len()))?;
        Ok(Self {
            file,
            pixels,
            class_materials,
            table,
            fingerprint: OnceLock::new(),
        })
    }

    /// Returns the file of classes as the user named it, without the key of a URL.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the raster of classes.
    #[must_use]
    pub const fn classes(&self) -> &Raster {
        self.pixels.raster()
    }

    /// Returns the surfaces of the classes.
    #[must_use]
    pub const fn class_materials(&self) -> &ClassMaterials {
        &self.class_materials
    }

    /// Returns the table for the device.
    #[must_use]
    pub const fn table(&self) -> &MaterialTable {
        &self.table
    }

    /// Returns a hash of all classes and their position, as
    /// [`crate::terrain::Terrain::fingerprint`] does for heights.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        *self.fingerprint.get_or_init(|| {
            let (classes, mut hasher) = (self.classes(), XxHash64::with_seed(0));
            hasher.write(&fingerprint(classes).to_le_bytes());
            let on = classes.georeference();
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            let places = corners.map(|corner| on.transform().to_ground(corner));
            for number in places.as_flattened() {
                hasher.write(&number.to_le_bytes());
            }
            let system = on.reference().map_or("", ReferenceSystem::name);
            hasher.write(system.as_bytes());
            hasher.finish()
        })
    }

    /// Returns the surface parameters of a scene with these materials: the given ones over the
    /// default material.
    #[must_use]
    pub const fn params(&self, params: &SurfaceParams) -> SurfaceParams {
        self.class_materials.default.params(params)
    }

    /// Returns the table index of the material at a point of a grid, in the coordinates of the
    /// grid's file, and whether it is known.
    pub fn index_at(&self, grid: &HapticGrid<'_>, ground: [f64; 2]) -> (u8, ReadStatus) {
        let on_terrain = grid.raster().georeference();
        let (value, status) = self.pixels.from(&on_terrain).value(ground, grid.wait());
        (self.class_materials.index(value), status)
    }

    /// Returns the materials of a tile over a grid, with samples `step` grid cells apart, as they
    /// are sent, and whether they are complete. Beyond the raster, its border is continued.
    pub(crate) fn tile<'b>(
        &self,
        (grid, last, step): (&HapticGrid<'_>, [i32; 2], f64),
        index: TileIndex,
        buffer: &'b mut MaterialBuffer,
    ) -> (TileMaterials<'b>, ReadStatus) {
        let reads = ReadTracker::default();
        let (first, terrain) = (index.first_cell(), grid.raster());
        let place = |first: i32, i: usize, last: i32| {
            let sample = first.saturating_add(i as i32).clamp(0, last);
            f64::from(sample) * step
        };
        let on_terrain = terrain.georeference();
        let from_terrain = self.pixels.from(&on_terrain);
        for (i, index) in buffer.indices.iter_mut().enumerate() {
            let column = place(first.x, i % TILE_SAMPLES, last[0]);
            let row = place(first.y, i / TILE_SAMPLES, last[1]);
            let ground = grid.to_ground([column, row]);
            let value = reads.record(from_terrain.value(ground, grid.wait()));
            *index = self.class_materials.index(value);
        }
        (
            TileMaterials::pack(&buffer.indices, &mut buffer.bytes),
            reads.status(),
        )
    }

    /// Describes the materials of a terrain in one line: those found at some hundred places, and
    /// the share of the default. Nothing is fetched if the file is at a URL.
    #[must_use]
    pub fn describe(&self, grid: &HapticGrid<'_>) -> String {
        let count = self.class_materials.class.len();
        let unread = format!("{count} classes in the table; the file is read where it is touched");
        if is_url(&self.file) {
            return unread;
        }
        let mut found = [0_u32; MaterialTable::MAX];
        let place = |i: u32, count: u32| {
            (f64::from(i) + 0.5) / f64::from(SEARCHED_PLACES) * f64::from(count - 1)
        };
        for i in 0..SEARCHED_PLACES * SEARCHED_PLACES {
            let (column, row) = (i % SEARCHED_PLACES, i / SEARCHED_PLACES);
            let ground = grid.to_ground([place(column, grid.columns()), place(row, grid.rows())]);
            if let (index, ReadStatus::Complete) = self.index_at(grid, ground) {
                found[usize::from(index)] += 1;
            }
        }
        let named = self.class_materials.class.iter().zip(&found[1..]);
        let mut named: Vec<_> = named.filter(|(_, count)| **count > 0).collect();
        named.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        let names = named.iter().map(|(class, _)| match &class.name {
            Some(name) => name.clone(),
            None => format!("class {}", class.class),
        });
        let names = names.collect::<Vec<_>>().join(", ");
        let places: u32 = found.iter().sum();
        if places == 0 {
            return unread;
        }
        let percent = 100.0 * f64::from(found[0]) / f64::from(places);
        match (names.is_empty(), found[0]) {
            (true, _) => {
                format!("the default: no class of the table was found at {places} places looked at")
            }
            (false, 0) => names,
            (false, _) => format!("{names}; the default on {percent:.0} %"),
        }
    }
}

/// Buffer for one tile's materials, reused for each tile.
pub struct MaterialBuffer {
    indices: Box<[u8; SAMPLES]>,
    bytes: Box<[u8; MAX_TILE_BYTES]>,
}

impl Default for MaterialBuffer {
    fn default() -> Self {
        Self {
            indices: Box::new([0; SAMPLES]),
            bytes: Box::new([0; MAX_TILE_BYTES]),
        }
    }
}

#[cfg(test)]
mod tests;
