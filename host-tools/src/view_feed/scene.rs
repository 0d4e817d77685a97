//! The scene of a terrain, for a viewer.

use hapterra_core::wire::hello::DeviceHello;
use hapterra_view_stream::{Coordinates, Hello, Layer, Message, Scene, TickCost, VERSION};

use super::layers;
use crate::link::{EMULATED, INSTRUCTIONS_PER_COUNT};
use crate::terrain::Terrain;
use heightfield::System;

/// The contents of a viewer.
pub struct Picture<'p, 't> {
    /// The rendered terrain.
    pub terrain: &'p Terrain<'t>,
    /// The user's name for it.
    pub title: &'p str,
    /// Place and scale: short names and values.
    pub facts: Vec<(String, String)>,
    /// The point under the tip in the arm's home pose, mm; the middle of the terrain if there is no
    /// arm.
    pub home_mm: Option<[f64; 3]>,
    /// The part in front of the arm, west, south, east, north, mm; otherwise the whole terrain.
    pub laid_mm: Option<[f64; 4]>,
    /// True if samples are sent while they are rendered.
    pub is_live: bool,
}

/// A picture whose terrain was read at its coarse levels, so that no device has to wait for that.
pub struct Prepared<'t> {
    pub(super) terrain: Terrain<'t>,
    pub(super) scene: Box<Scene>,
    layers: Vec<Layer>,
}

impl Prepared<'_> {
    /// Returns the picture with further reads of the terrain that do not wait.
    #[must_use]
    pub fn non_blocking(self) -> Self {
        Self {
            terrain: self.terrain.non_blocking(),
            ..self
        }
    }

    /// Returns the beginning of the stream: open message, scene and layers.
    pub(super) fn into_messages(self) -> Vec<Message> {
        let hello = Hello {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").into(),
        };
        let begin = [Message::Hello(hello), Message::Scene(self.scene)];
        let layers = self.layers.into_iter().map(Message::Layer);
        begin.into_iter().chain(layers).collect()
    }
}

impl<'t> Picture<'_, 't> {
    /// Reads the terrain at its coarse levels.
    #[must_use]
    pub fn prepare(self) -> Prepared<'t> {
        let terrain = self.terrain.clone();
        let scene = self.scene();
        let layers = layers::of(&terrain, home_cells(&scene));
        Prepared {
            terrain,
            scene: Box::new(scene),
            layers,
        }
    }

    pub(super) fn scene(self) -> Scene {
        let terrain = self.terrain;
        let [east_mm, north_mm] = terrain.size_mm();
        let (middle_mm, scale) = ([0.5 * east_mm, 0.5 * north_mm], terrain.scale());
        let height_mm = terrain.height_mm(middle_mm[0], middle_mm[1]);
        let middle_mm = [middle_mm[0], middle_mm[1], height_mm.unwrap_or(0.0)];
        let level_0_mm = terrain.scale_of_level_0().cell_mm();
        let metres = terrain.raster().metres_per_vertical_unit();
        let height_per_mm = metres / scale.height_mm_per_unit();
        Scene {
            title: self.title.to_owned(),
            facts: self.facts,
            is_live: self.is_live,
            keeps_tiles: false,
            level: terrain.level(),
            cell_mm: level_0_mm,
            mm_per_unit: scale.height_mm_per_unit(),
            tip_mm: terrain.grid().tip_mm(),
            home_mm: self.home_mm.unwrap_or(middle_mm),
            fitted_mm: self.laid_mm.unwrap_or([0.0, 0.0, east_mm, north_mm]),
            ground_m_per_mm: terrain.grid().side_m().map(|side| side / level_0_mm),
            // A terrain rendered flat has no heights to show.
            height_per_mm: if height_per_mm.is_finite() {
                height_per_mm
            } else {
                0.0
            },
            height_unit: "m".into(),
            coordinates: coordinates(terrain, level_0_mm),
            tick: None,
        }
    }
}

/// Returns the unit in which a device reports the cost of its ticks.
pub(super) fn tick_cost(device: &DeviceHello) -> TickCost {
    let hz = f64::from(device.clock_hz.max(1));
    let (per_count, unit) = match device.board.as_str() {
        EMULATED => (INSTRUCTIONS_PER_COUNT, "instructions"),
        _ => (1e6 / hz, "µs"),
    };
    TickCost {
        unit: unit.into(),
        per_count,
        bound: per_count * hz / f64::from(device.tick_hz.max(1)),
    }
}

/// Returns the home position in cells of level 0.
pub(super) fn home_cells(scene: &Scene) -> [f64; 2] {
    let [x, y, _] = scene.home_mm;
    [x, y].map(|mm| mm / scene.cell_mm)
}

/// Returns the file's coordinates as a function of millimetres, if the file has any.
fn coordinates(terrain: &Terrain<'_>, level_0_mm: f64) -> Option<Coordinates> {
    if terrain.raster().georeference().system() == System::Cells {
        return None;
    }
    let at = |cells: [f64; 2]| terrain.grid().to_ground(cells);
    let origin = at([0.0, 0.0]);
    let per_mm = |cells: [f64; 2]| {
        let [x, y] = at(cells);
        [x - origin[0], y - origin[1]].map(|step| step / level_0_mm)
    };
    let east = per_mm([1.0, 0.0]);
    let step = level_0_mm * east[0].hypot(east[1]);
    let decimals = (1.0 - step.max(1e-9).log10()).floor().clamp(0.0, 8.0);
    Some(Coordinates {
        origin,
        east,
        north: per_mm([0.0, 1.0]),
        decimals: decimals as u8,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Scale;
    use heightfield::Raster;

    #[test]
    fn terrain_without_an_arm_is_sent_around_its_middle() {
        let raster = Raster::from_fn(33, 17, |_, _| 3.0).expect("raster");
        let terrain = Terrain::new(&raster, Scale::new(2.0, 0.5).expect("scale"), 0);
        let terrain = terrain.expect("terrain");
        let picture = Picture {
            terrain: &terrain,
            title: "plain",
            facts: vec![],
            home_mm: None,
            laid_mm: None,
            is_live: false,
        };
        let scene = picture.scene();
        assert_eq!(scene.home_mm, [32.0, 16.0, 1.5]);
        assert_eq!(scene.fitted_mm, [0.0, 0.0, 64.0, 32.0]);
        assert_eq!(scene.height_per_mm, 2.0);
        // Cells of a metre are 2 device millimetres; their position is unknown.
        assert_eq!(
            (scene.coordinates, scene.ground_m_per_mm),
            (None, Some(0.5))
        );
    }
}
