//! A scene of the stress test for the emulated board: tiles and HIPs in their order of arrival on
//! the host, and the host's results of the contact, or of the loop on materials.
//!
//! The board's window has room for 16 × 16 tiles, as has the host's, so every scene can be
//! replayed, even if its tiles are pulled, late and in parts.

use crate::scene::run::Execution;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{Scene as SceneMessage, Source};
use hapterra_core::terrain::FieldSize;

use super::loop_replay::noted;
use super::run::{MIN_WORK_PER_TICK, Player, Scene, Surface};
use super::terrain::Terrain;
use super::tile_supply::Buffers;
use crate::cycles::Cycles;
use crate::instruction_counter::{Counted, Event, Replay, Samples, WINDOW};
use crate::whole_field::point;

/// The seed of the scenes that compare the emulated processor with the host.
const COMPARED: u64 = 77;

fn surface(number: u64) -> Surface {
    match number % 3 {
        0 => Surface::Rough,
        _ => Surface::Smooth,
    }
}

/// A scene, rendered on the host in real time.
pub struct EmulatorScene {
    /// Its settings.
    pub scene: Scene,
    /// True if the whole loop rendered it on its materials.
    is_on_materials: bool,
    /// The scene as the device receives it.
    message: SceneMessage,
    /// Tiles and HIPs in their order of arrival.
    events: Vec<Event>,
    /// The host's result of each tick, without costs.
    answers: Vec<Counted>,
}

impl EmulatorScene {
    /// Runs a scene of a seed in real time, as the board does, and records it.
    ///
    /// # Panics
    /// If a tick in real time has no result.
    #[must_use]
    pub fn random(seed: u64, number: u64, surface: Surface) -> Self {
        let scene = Scene {
            execution: Execution::RealTime,
            // Like the counting board, which counts at 10 kHz.
            work_per_tick: MIN_WORK_PER_TICK,
            ..Scene::random(seed, number).with_surface(surface)
        };
        let mut buffers = Buffers::new(WINDOW);
        let mut player = Player::<WINDOW>::new(&scene, &mut buffers, [0; 3], scene.supply);
        let (mut events, mut answers) = (vec![], vec![]);
        for hip in &scene.path {
            events.extend(player.supplied.installed.drain(..).map(Event::Tile));
            events.push(Event::Hip(point(*hip)));
            let output = player.step(*hip).expect("one tick is one answer");
            answers.push(Counted {
                instructions: 0,
                cycles: Cycles::default(),
                state: output.state as u32,
                converged: output.converged,
                work: output.work,
                vector: output.displacement,
                proxy: output.proxy,
            });
        }
        let message = SceneMessage {
            epoch: 1,
            level: 0,
            size: FieldSize::new(scene.terrain.size[0], scene.terrain.size[1]),
            top: scene.terrain.top(),
            fallback: None,
            cell_mm: 1.0,
            home: GridPoint::default(),
            params: SurfaceParams {
                friction: scene.friction,
                shading: scene.shading,
                texture: scene.texture,
                ..SurfaceParams::PREMIUM
            },
            source: Source::Points,
            hold_clock: false,
            materials: None,
        };
        Self {
            is_on_materials: false,
            scene,
            message,
            events,
            answers,
        }
    }

    /// Replays a scene of a seed on its materials, in lock-step as the board does, and records it;
    /// `None` if it has no materials.
    #[must_use]
    pub fn on_materials(seed: u64, number: u64, surface: Surface) -> Option<Self> {
        let scene = Scene::random(seed, number).with_surface(surface);
        let materials = scene.materials.as_ref()?;
        let (message, events, answers) = noted(&scene, materials);
        Some(Self {
            is_on_materials: true,
            scene,
            message,
            events,
            answers,
        })
    }

    /// Returns the scenes that compare the emulated processor with the host, with their numbers: a
    /// third of them with friction.
    #[must_use]
    pub fn compared() -> Vec<(u64, Self)> {
        let random = |number| (number, Self::random(COMPARED, number, surface(number)));
        (0..40).map(random).collect()
    }

    /// Returns the same on materials.
    #[must_use]
    pub fn compared_on_materials() -> Vec<(u64, Self)> {
        let on_materials = |number| {
            let recorded = Self::on_materials(COMPARED, number, surface(number))?;
            Some((number, recorded))
        };
        (0..120).filter_map(on_materials).collect()
    }

    /// Returns the scene as the counting board receives it.
    #[must_use]
    pub fn replay(&self) -> Replay<'_> {
        Replay {
            scene: &self.message,
            field: &self.scene.terrain,
            events: &self.events,
            materials: self
                .scene
                .materials
                .as_ref()
                .filter(|_| self.is_on_materials),
        }
    }

    /// Returns the first tick whose result on the board differs from the host's in a bit or a work
    /// unit.
    #[must_use]
    pub fn differs(&self, there: &[Counted]) -> Option<usize> {
        let pairs = self.answers.iter().zip(there);
        let mut same = pairs.map(|(here, there)| bits(here) == bits(there));
        same.position(|same| !same)
    }
}

impl Samples for Terrain {
    fn sample(&self, column: i32, row: i32) -> f32 {
        self.post(column, row)
    }
}

type Bits = (u32, bool, u32, [u32; 3], [i32; 3], [u32; 3]);

fn bits(tick: &Counted) -> Bits {
    (
        tick.state,
        tick.converged,
        tick.work,
        tick.vector.to_array().map(f32::to_bits),
        tick.proxy.cell(),
        tick.proxy.frac().to_array().map(f32::to_bits),
    )
}
