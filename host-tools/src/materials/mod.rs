//! Materials: a raster of classes over a terrain, and what each class feels like.
//!
//! The raster has a grid and a reference system of its own. Each haptic sample of the terrain takes
//! the class of the pixel in which it lies. The device gets
//! the table of the materials ([`MaterialTable`]) and an index of it for each sample, so it knows
//! nothing of the file's numbers.

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
/// Places along each side of a terrain that are looked at to tell which classes it has.
const LOOKED_AT: u32 = 24;

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

/// The materials of a scene, as a file of classes and a table say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Looks {
    /// Material where the file has no class, or one without a name.
    pub default: Material,
    /// The classes that are named, at most 15.
    #[serde(default)]
    pub class: Vec<ClassMaterial>,
}

impl Looks {
    /// The table that the device gets.
    fn table(&self) -> Option<MaterialTable> {
        let named = self.class.iter().map(|class| class.material);
        let all: Vec<_> = std::iter::once(self.default).chain(named).collect();
        MaterialTable::new(&all)
    }

    /// The index in that table of what the file has at a place; NaN where it has nothing.
    fn index(&self, value: f64) -> u8 {
        let is_it = |class: &ClassMaterial| class.class as f64 == value;
        let place = self.class.iter().position(is_it);
        place.and_then(|i| u8::try_from(i + 1).ok()).unwrap_or(0)
    }
}

/// A raster of classes over a terrain, and what they feel like.
#[derive(Debug)]
pub struct Materials {
    file: String,
    pixels: Pixels,
    looks: Looks,
    table: MaterialTable,
    fingerprint: OnceLock<u64>,
}

impl Materials {
    /// Lays the classes of a file over a terrain.
    ///
    /// # Errors
    /// [`GroundError`] if the places of the classes are unknown, or none lies on the
    /// terrain.
    pub fn over(
        terrain: (&str, &Raster),
        (file, classes): (&str, Raster),
        looks: Looks,
    ) -> Result<Self, GroundError> {
        // Recordings and messages have the name.
        let file = without_key(Path::new(file));
        let pixels = Pixels::over(terrain, (&file, classes))?;
        let table = looks
            .table()
            .ok_or(GroundError::TooMany(looks.class.len()))?;
        Ok(Self {
            file,
            pixels,
            looks,
            table,
            fingerprint: OnceLock::new(),
        })
    }

    /// The file of classes, as it was named, but for the key of a URL.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The raster of classes.
    #[must_use]
    pub const fn classes(&self) -> &Raster {
        self.pixels.raster()
    }

    /// Surfaces of the classes.
    #[must_use]
    pub const fn looks(&self) -> &Looks {
        &self.looks
    }

    /// The table that the device gets.
    #[must_use]
    pub const fn table(&self) -> &MaterialTable {
        &self.table
    }

    /// Hash of all classes, as [`crate::terrain::Terrain::fingerprint`] is of heights, and of where
    /// they lie.
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

    /// Surface parameters over the default material: that of a scene with these materials.
    #[must_use]
    pub const fn params(&self, params: &SurfaceParams) -> SurfaceParams {
        self.looks.default.params(params)
    }

    /// The index in the table of the material at a place of a grid, in the coordinates of its file,
    /// and whether it is known.
    pub fn index_at(&self, grid: &HapticGrid<'_>, ground: [f64; 2]) -> (u8, ReadStatus) {
        let on_terrain = grid.raster().georeference();
        let (value, status) = self.pixels.from(&on_terrain).value(ground, grid.wait());
        (self.looks.index(value), status)
    }

    /// The materials of a tile over a grid, whose samples are `step` of the grid's cells apart, as they
    /// are sent. Beyond the field they continue as it ends there. And whether they are complete.
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
            *index = self.looks.index(value);
        }
        (
            TileMaterials::pack(&buffer.indices, &mut buffer.bytes),
            reads.status(),
        )
    }

    /// Returns the materials of a terrain's ground, for a line to be read: those that were found at
    /// some hundred places, and how many of these have the default. Of a file at a URL nothing is
    /// fetched for it.
    #[must_use]
    pub fn told(&self, grid: &HapticGrid<'_>) -> String {
        let count = self.looks.class.len();
        let unread = format!("{count} classes in the table; the file is read where it is touched");
        if is_url(&self.file) {
            return unread;
        }
        let mut found = [0_u32; MaterialTable::MOST];
        let place =
            |i: u32, count: u32| (f64::from(i) + 0.5) / f64::from(LOOKED_AT) * f64::from(count - 1);
        for i in 0..LOOKED_AT * LOOKED_AT {
            let (column, row) = (i % LOOKED_AT, i / LOOKED_AT);
            let ground = grid.to_ground([place(column, grid.columns()), place(row, grid.rows())]);
            if let (index, ReadStatus::Complete) = self.index_at(grid, ground) {
                found[usize::from(index)] += 1;
            }
        }
        let named = self.looks.class.iter().zip(&found[1..]);
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

/// Room for one tile's materials, used again for each.
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
