//! Settings of a recording: terrain, place and scale, surface parameters, and device.
//!
//! The text is TOML. In a CSV recording each line follows `# ` before the header; in a Parquet
//! recording it is the value of [`KEY`] in the file's metadata.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Shading, SurfaceParams, Texture};
use hapterra_core::wire::hello::{DeviceHello, PROTOCOL};
use serde::{Deserialize, Serialize};

use super::marks::Mark;
use crate::materials::{ClassMaterials, Materials};
use crate::place::PlacedSurface;
use crate::terrain::{HapticCells, HapticGrid, Scale, ScaleError, Terrain};
use heightfield::ReferenceSystem;
use heightfield::printable_text::printable;

/// Key of the first line of the settings; its value is [`FORMAT`].
pub const KEY: &str = "hapterra-recording";
/// Version of the settings' format, for writing and reading.
pub const FORMAT: u32 = 1;
/// Relative difference of cell sizes on the ground below which they count as equal. Machines may
/// round the size of a degree differently, and earlier versions computed a map's scale over one
/// metre, with an error up to 1e-7: their recordings can still be replayed.
const MAX_CELL_DIFFERENCE: f64 = 1e-6;

/// The settings of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Version of this format.
    #[serde(rename = "hapterra-recording")]
    format: u32,
    /// Version of the program that wrote the recording.
    pub program: String,
    /// Version of the protocol between program and device.
    pub protocol: u16,
    /// The terrain file.
    pub terrain: TerrainFile,
    /// The rendered part, its place and scale.
    #[serde(rename = "felt")]
    pub rendered: RenderedTerrain,
    /// The surface parameters and the contact rule.
    pub force: Force,
    /// Materials of the ground, if there were several; the surface parameters are then those of the
    /// default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub materials: Option<MaterialSettings>,
    /// The device.
    pub device: Device,
    /// The later placements of the session, in order; the first one is [`Self::rendered`] and
    /// [`Self::force`].
    #[serde(rename = "view", default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<PlacementSettings>,
    /// The marks of the session, in order.
    #[serde(rename = "mark", default, skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<Mark>,
}

/// A placement that was set during a session.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacementSettings {
    /// Number of this placement in the column `view`, from 1.
    pub number: u32,
    /// Side of a haptic cell of level 0 on the ground, m, if the file states it. Also `None` in
    /// recordings of earlier versions, whose cells are those of the first placement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_m: Option<f64>,
    /// Place where a cell of the file has this size, in the file's coordinates, x and y; `None` if
    /// the cells are those of the first placement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_at: Option<[f64; 2]>,
    /// Level of detail.
    pub level: u8,
    /// Device millimetres for each haptic cell of level 0.
    pub cell_mm: f64,
    /// Device millimetres for each vertical unit of the file.
    pub height_mm_per_unit: f64,
    /// Radius of the ball at the tip, device millimetres; 0 for a point. `None` in recordings of
    /// earlier versions, whose tip is that of the first placement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_mm: Option<f64>,
    /// Height relative to true proportions, if the file states its units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exaggeration: Option<f64>,
    /// The point of the terrain at the tip in the arm's home pose, device millimetres, as known to
    /// the host: the user moves it with the clutch.
    pub home_mm: [f64; 3],
    /// Stiffness of the spring from HIP to proxy, N/mm.
    pub stiffness_n_per_mm: f32,
    /// Max force, N.
    pub max_force_n: f32,
    /// The normals for the force's direction; omitted if they are those of the patches.
    #[serde(default, skip_serializing_if = "Shading::is_none")]
    pub shading: Shading,
    /// Friction of the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Friction::is_none")]
    pub friction: Friction,
    /// Damping of motion against the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Damping::is_none")]
    pub damping: Damping,
    /// Texture of the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Texture::is_none")]
    pub texture: Texture,
}

/// The placements alone, for TOML.
#[derive(Serialize)]
struct Views<'v> {
    view: [&'v PlacementSettings; 1],
}

impl PlacementSettings {
    /// Creates the settings of a placement from its number and terrain.
    #[must_use]
    pub fn new(number: u32, terrain: &Terrain<'_>, placed_surface: &PlacedSurface) -> Self {
        let (grid, scale) = (terrain.grid(), terrain.scale_of_level_0());
        Self {
            number,
            cell_m: grid.side_m(),
            measured_at: grid.measured_at(),
            level: terrain.level(),
            cell_mm: scale.cell_mm(),
            height_mm_per_unit: scale.height_mm_per_unit(),
            tip_mm: Some(grid.tip_mm()),
            exaggeration: grid.exaggeration(&scale),
            home_mm: placed_surface.view.home_mm,
            stiffness_n_per_mm: placed_surface.params.stiffness_n_per_mm,
            max_force_n: placed_surface.params.max_force_n,
            shading: placed_surface.params.shading,
            texture: placed_surface.params.texture,
            friction: placed_surface.params.friction,
            damping: placed_surface.params.damping,
        }
    }

    /// Returns the placement as TOML that may follow [`Settings::to_toml`].
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&Views { view: [self] }).unwrap_or_default()
    }

    /// Returns the surface parameters.
    #[must_use]
    pub const fn params(&self) -> SurfaceParams {
        SurfaceParams {
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            max_force_n: self.max_force_n,
            friction: self.friction,
            damping: self.damping,
            shading: self.shading,
            texture: self.texture,
        }
    }

    /// Returns the scale of level 0.
    ///
    /// # Errors
    /// Numbers that are no valid scale.
    pub fn scale(&self) -> Result<Scale, ScaleError> {
        Scale::new(self.cell_mm, self.height_mm_per_unit)
    }
}

/// The terrain of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TerrainFile {
    /// The file as the user named it, or the generated terrain.
    pub file: String,
    /// Hash of all heights: [`Terrain::fingerprint`] in hexadecimal digits.
    pub fingerprint: String,
    /// Samples of the file, west to east and south to north.
    pub samples: [u32; 2],
    /// EPSG code of its horizontal reference system, as `EPSG:2056`, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
}

/// The rendered terrain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderedTerrain {
    /// Shape of the haptic cells.
    pub cells: HapticCells,
    /// Rendered samples of level 0, west to east and south to north.
    pub samples: [u32; 2],
    /// Side of a haptic cell of level 0 on the ground, m, if the file states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_m: Option<f64>,
    /// Place where a cell of the file has this size, in the file's coordinates, x and y; `None` if
    /// it is in the middle of the raster.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_at: Option<[f64; 2]>,
    /// Level of detail: every 2^level-th sample.
    pub level: u8,
    /// Device millimetres for each haptic cell of level 0.
    pub cell_mm: f64,
    /// Device millimetres for each vertical unit of the file.
    pub height_mm_per_unit: f64,
    /// Radius of the ball at the tip, device millimetres; omitted for a point. The HIP and the
    /// proxy are the ball's centre.
    #[serde(default, skip_serializing_if = "is_point")]
    pub tip_mm: f64,
    /// Height relative to true proportions, if the file states its units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exaggeration: Option<f64>,
    /// The point of the terrain at the tip in the arm's home pose, device millimetres; `None`
    /// without an arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_mm: Option<[f64; 3]>,
}

/// Contact rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// The device's: nothing passes through the surface
    Swept,
    /// As published in the paper, for comparison: in `replay`, on the host
    Paper,
}

/// Rendering of the force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// Stiffness of the spring from HIP to proxy, N/mm.
    pub stiffness_n_per_mm: f32,
    /// Max force, N.
    pub max_force_n: f32,
    /// The contact rule.
    pub rule: Rule,
    /// The normals for the force's direction; omitted if they are those of the patches.
    #[serde(default, skip_serializing_if = "Shading::is_none")]
    pub shading: Shading,
    /// Friction of the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Friction::is_none")]
    pub friction: Friction,
    /// Damping of motion against the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Damping::is_none")]
    pub damping: Damping,
    /// Texture of the surface; omitted if there is none.
    #[serde(default, skip_serializing_if = "Texture::is_none")]
    pub texture: Texture,
}

/// Returns true if a tip is a point.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands a reference")]
fn is_point(tip_mm: &f64) -> bool {
    *tip_mm == 0.0
}

/// Materials of the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialSettings {
    /// The file of classes, as the user named it.
    pub file: String,
    /// Hash of its classes and their position.
    pub fingerprint: String,
    /// Surfaces of the classes.
    #[serde(flatten)]
    pub class_materials: ClassMaterials,
}

impl MaterialSettings {
    /// Returns the settings of a terrain with materials.
    #[must_use]
    pub fn of(materials: &Materials) -> Self {
        Self {
            file: materials.file().to_owned(),
            fingerprint: format!("{:016x}", materials.fingerprint()),
            class_materials: materials.class_materials().clone(),
        }
    }
}

/// The device, from its own description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Its board.
    pub board: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Ticks a second.
    pub tick_hz: u32,
}

/// Settings that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// Written by a later version of the program.
    #[error("its settings are of format {found}, and this program reads format {FORMAT}")]
    Later {
        /// The format of the recording.
        found: u32,
    },
    /// Not TOML, or numbers are missing.
    #[error("its settings cannot be read: {0}")]
    Unreadable(String),
}

/// A terrain that differs from that of a recording.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} is not the terrain of this recording, which is {recorded}: {difference}")]
pub struct OtherTerrain {
    /// The terrain of the recording.
    recorded: String,
    /// The terrain that the user named now.
    found: String,
    /// The difference.
    difference: String,
}

impl Settings {
    /// Creates the settings of a terrain with surface parameters and a rule; `file` names the
    /// terrain. `home_mm` is the point in the arm's home pose, if there is an arm.
    #[must_use]
    pub fn new(
        file: &str,
        terrain: &Terrain<'_>,
        (params, rule): (SurfaceParams, Rule),
        home_mm: Option<[f64; 3]>,
        device: Device,
    ) -> Self {
        let (raster, grid) = (terrain.raster(), terrain.grid());
        let scale = terrain.scale_of_level_0();
        Self {
            format: FORMAT,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            protocol: PROTOCOL,
            terrain: TerrainFile {
                file: file.to_owned(),
                fingerprint: digits(terrain),
                samples: [raster.columns(), raster.rows()],
                crs: raster
                    .reference_system()
                    .and_then(ReferenceSystem::code)
                    .map(|code| format!("EPSG:{code}")),
            },
            rendered: RenderedTerrain {
                cells: grid.cells(),
                samples: [grid.columns(), grid.rows()],
                cell_m: grid.side_m(),
                measured_at: grid.measured_at(),
                level: terrain.level(),
                cell_mm: scale.cell_mm(),
                height_mm_per_unit: scale.height_mm_per_unit(),
                tip_mm: grid.tip_mm(),
                exaggeration: grid.exaggeration(&scale),
                home_mm,
            },
            force: Force {
                stiffness_n_per_mm: params.stiffness_n_per_mm,
                max_force_n: params.max_force_n,
                rule,
                shading: params.shading,
                texture: params.texture,
                friction: params.friction,
                damping: params.damping,
            },
            materials: grid.materials().map(MaterialSettings::of),
            device,
            views: vec![],
            marks: vec![],
        }
    }

    /// Returns the settings as TOML, [`KEY`] first.
    #[must_use]
    pub fn to_toml(&self) -> String {
        // Structures of numbers and text can always be written as TOML.
        toml::to_string(self).unwrap_or_default()
    }

    /// Returns the settings without the later placements and marks: the part before the first row.
    #[must_use]
    pub fn of_beginning(&self) -> Self {
        Self {
            views: vec![],
            marks: vec![],
            ..self.clone()
        }
    }

    /// Reads settings; returns `None` if the text is anything else.
    ///
    /// # Errors
    /// [`SettingsError`] if the text begins like settings but cannot be used.
    pub fn from_toml(text: &str) -> Result<Option<Self>, SettingsError> {
        /// The format alone: other formats may differ in everything else.
        #[derive(Deserialize)]
        struct Format {
            #[serde(rename = "hapterra-recording")]
            format: u32,
        }
        if !text.trim_start().starts_with(KEY) {
            return Ok(None);
        }
        let unreadable = |error: toml::de::Error| SettingsError::Unreadable(error.to_string());
        let Format { format } = toml::from_str(text).map_err(unreadable)?;
        if format != FORMAT {
            return Err(SettingsError::Later { found: format });
        }
        toml::from_str(text).map(Some).map_err(unreadable)
    }

    /// Returns the surface parameters.
    #[must_use]
    pub const fn params(&self) -> SurfaceParams {
        SurfaceParams {
            stiffness_n_per_mm: self.force.stiffness_n_per_mm,
            max_force_n: self.force.max_force_n,
            friction: self.force.friction,
            damping: self.force.damping,
            shading: self.force.shading,
            texture: self.force.texture,
        }
    }

    /// Checks that a terrain is that of the recording; `file` names it.
    ///
    /// Its heights have to be the same and, if the same kind of cells is rendered, the cells have
    /// to be equally large on the ground.
    ///
    /// # Errors
    /// [`OtherTerrain`] describes the difference.
    pub fn check_terrain(&self, file: &str, terrain: &Terrain<'_>) -> Result<(), OtherTerrain> {
        let difference = if self.terrain.fingerprint != digits(terrain) {
            let (recorded, raster) = (self.terrain.samples, terrain.raster());
            match recorded == [raster.columns(), raster.rows()] {
                true => "its heights differ".to_owned(),
                false => format!(
                    "{} × {} samples, not {} × {}",
                    raster.columns(),
                    raster.rows(),
                    recorded[0],
                    recorded[1]
                ),
            }
        } else if let Some(difference) = self.rendered.difference(terrain.grid()) {
            difference
        } else if self.has_other_classes(terrain.grid()) {
            "the classes of its materials differ".to_owned()
        } else {
            return Ok(());
        };
        Err(OtherTerrain {
            recorded: self.terrain.file.clone(),
            found: file.to_owned(),
            difference,
        })
    }
}

impl Settings {
    /// Returns true if a terrain has other classes than those of the recording.
    fn has_other_classes(&self, grid: &HapticGrid<'_>) -> bool {
        let now = grid.materials().map(MaterialSettings::of);
        let print = |settings: &MaterialSettings| settings.fingerprint.clone();
        self.materials.is_some() && self.materials.as_ref().map(print) != now.as_ref().map(print)
    }
}

impl Device {
    /// Returns the settings of a device from its introduction.
    #[must_use]
    pub fn of(hello: &DeviceHello) -> Self {
        Self {
            board: printable(&hello.board),
            firmware: printable(&hello.version),
            tick_hz: hello.tick_hz,
        }
    }
}

impl RenderedTerrain {
    /// Returns the difference of the cells over the same heights, if the same kind is rendered.
    fn difference(&self, grid: &HapticGrid<'_>) -> Option<String> {
        if grid.cells() != self.cells {
            return None;
        }
        let same_size = match (self.cell_m, grid.side_m()) {
            (Some(recorded), Some(now)) => {
                (recorded - now).abs() <= MAX_CELL_DIFFERENCE * recorded.abs()
            }
            (recorded, now) => recorded == now,
        };
        let metres = |side: Option<f64>| side.map_or("unknown".into(), |m| format!("{m} m"));
        let same = same_size && self.samples == [grid.columns(), grid.rows()];
        (!same).then(|| {
            format!(
                "the same heights in cells of another size on the ground, {} and not {}",
                metres(grid.side_m()),
                metres(self.cell_m)
            )
        })
    }

    /// Returns device millimetres for each vertical unit at another cell size, with the recorded
    /// proportions.
    #[must_use]
    pub fn height_at_cell_mm(&self, cell_mm: f64) -> f64 {
        match cell_mm == self.cell_mm {
            true => self.height_mm_per_unit,
            false => self.height_mm_per_unit * (cell_mm / self.cell_mm),
        }
    }
}

fn digits(terrain: &Terrain<'_>) -> String {
    format!("{:016x}", terrain.fingerprint())
}

#[cfg(test)]
mod tests {
    use hapterra_core::force::Pattern;

    use super::*;
    use crate::place::Placement;
    use heightfield::Raster;

    fn raster(height: f32) -> Raster {
        Raster::from_fn(9, 7, |x, y| height + (x * y) as f32).expect("raster")
    }

    fn terrain(raster: &Raster) -> Terrain<'_> {
        Terrain::new(raster, Scale::new(2.0, 0.1).expect("valid"), 1).expect("terrain")
    }

    fn settings(terrain: &Terrain<'_>) -> Settings {
        let params = (SurfaceParams::PREMIUM, Rule::Paper);
        let device = Device {
            board: "native".into(),
            firmware: "0.1.0".into(),
            tick_hz: 1000,
        };
        Settings::new(
            "a \"b\"\nc.tif",
            terrain,
            params,
            Some([1.5, -2.0, 0.1]),
            device,
        )
    }

    #[test]
    fn settings_round_trip_through_toml() {
        let raster = raster(0.0);
        let settings = settings(&terrain(&raster));
        let text = settings.to_toml();
        assert!(text.starts_with("hapterra-recording = 1\n"), "{text}");
        assert_eq!(Settings::from_toml(&text).expect("read"), Some(settings));
        assert!(text.contains("rule = \"paper\"") && text.contains("level = 1"));
        assert!(text.contains("cell_mm = 2.0"), "of level 0: {text}");
    }

    #[test]
    fn surface_parameters_round_trip_through_toml() {
        let params = SurfaceParams {
            stiffness_n_per_mm: 0.75,
            max_force_n: 6.0,
            friction: Friction::coulomb(0.3),
            damping: Damping {
                ns_per_m: 1.0,
                ..Damping::NONE
            },
            shading: Shading::Smooth,
            texture: Texture {
                pattern: Pattern::Grain,
                amplitude_mm: 0.1,
                wavelength_mm: 1.5,
                direction_deg: 0.0,
                seed: 3,
            },
        };
        let raster = raster(0.0);
        let terrain = terrain(&raster);
        let mut settings = settings(&terrain);
        settings = Settings::new(
            "t.tif",
            &terrain,
            (params, Rule::Swept),
            None,
            settings.device,
        );
        assert_eq!(settings.params(), params);
        let (grid, scale) = (terrain.grid(), terrain.scale_of_level_0());
        let view = Placement {
            home_mm: [1.0; 3],
            home_ground: [0.0; 2],
            scale,
            level: 1,
            side_m: grid.side_m(),
            exaggeration: None,
            extent_mm: [0.0; 4],
            heights_mm: [0.0; 2],
            reach_mm: [0.0; 4],
        };
        let view = PlacementSettings::new(1, &terrain, &PlacedSurface { view, params });
        assert_eq!(view.params(), params);
        settings.views = vec![view];
        let text = settings.to_toml();
        assert_eq!(Settings::from_toml(&text).expect("read"), Some(settings));
    }

    #[test]
    fn broken_or_later_settings_are_errors_but_comments_not() {
        assert_eq!(Settings::from_toml(" a remark\n").expect("none"), None);
        let later = Settings::from_toml("hapterra-recording = 2\nall = \"else\"");
        assert!(matches!(later, Err(SettingsError::Later { found: 2 })));
        for broken in ["hapterra-recording = 1", "hapterra-recording 1"] {
            let read = Settings::from_toml(broken);
            assert!(
                matches!(read, Err(SettingsError::Unreadable(_))),
                "{broken}"
            );
        }
    }

    #[test]
    fn terrain_with_other_heights_or_cells_is_refused() {
        let (one, other) = (raster(0.0), raster(0.5));
        let settings = settings(&terrain(&one));
        assert_eq!(settings.check_terrain("same", &terrain(&one)), Ok(()));
        let wrong = settings.check_terrain("x.tif", &terrain(&other));
        let wrong = wrong.expect_err("other heights").to_string();
        assert!(
            wrong.contains("x.tif") && wrong.contains("c.tif"),
            "{wrong}"
        );
        let mut cell = one.cell().expect("metres");
        (cell.east, cell.north) = (2.0, 2.0);
        let wider = one.clone().with_cell(cell);
        let wrong = settings.check_terrain("x.tif", &terrain(&wider));
        let wrong = wrong.expect_err("other cells").to_string();
        assert!(wrong.contains("2 m and not 1 m"), "{wrong}");
    }
}
