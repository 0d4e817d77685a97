//! Wild walks for the emulated processor, and what this one feels on them.

use hapterra_core::contact::{Contact, Pace};
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{TILE_CELLS, Tile, TileKey, Window};
use hapterra_core::wire::message::{Scene as SceneMessage, Source};

use crate::chance::Chance;
use crate::counting::{Counted, Event, WINDOW, tiles};
use crate::field::point;
use crate::scene::run::Scene;
use crate::scene::stage::Supply;
use crate::scene::terrain::Terrain;

/// A terrain, and what happens on it: tiles that arrive and hands, in turns.
pub struct Walk {
    /// What is felt.
    pub terrain: Terrain,
    /// In the order they happen.
    pub events: Vec<Event>,
    /// As the device is told of it.
    pub message: SceneMessage,
}

/// The first so many of the soak's scenes of a seed that a window of
/// [`WINDOW`] tiles can hold; in every other one the tiles arrive late.
pub fn walks(seed: u64, count: usize) -> impl Iterator<Item = Walk> {
    let scenes = (0..).map(move |number| (number, Scene::random(seed, number)));
    scenes
        .filter(|(_, scene)| scene.supply == Supply::Held)
        .map(|(number, scene)| walk(&scene, &mut Chance::new(number)))
        .take(count)
}

fn walk(scene: &Scene, chance: &mut Chance) -> Walk {
    let terrain = scene.terrain.clone();
    let hands = scene.path.iter().map(|hip| Event::Hand(point(*hip)));
    let mut events: Vec<Event> = hands.collect();
    let late = chance.below(2) == 1;
    for key in tiles(terrain.size) {
        let at = if late {
            chance.below(events.len() / 2)
        } else {
            0
        };
        events.insert(at, Event::Tile(key));
    }
    let message = SceneMessage {
        epoch: 1,
        level: 0,
        size: terrain.size,
        top: terrain.top(),
        cell_mm: 1.0,
        home: GridPoint::default(),
        law: ForceLaw::PREMIUM,
        rule: scene.rule,
        source: Source::Points,
        hold_clock: false,
    };
    Walk {
        terrain,
        events,
        message,
    }
}

impl Walk {
    /// A sample, as the counting board asks for it.
    #[must_use]
    pub fn post(&self, x: i32, y: i32) -> f32 {
        self.terrain.post(x, y)
    }

    /// What is felt on this processor, at no cost.
    ///
    /// # Panics
    /// When a tile does not fit the window.
    #[must_use]
    pub fn felt_here(&self) -> Vec<Counted> {
        let mut buffers = vec![Tile::VACANT; WINDOW * WINDOW + 1];
        let mut free = buffers.iter_mut();
        let mut next = || free.next().expect("one for every slot, and one");
        let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let mut window: Box<Window<'_, WINDOW>> = Box::new(Window::new(slots));
        let mut spare = next();
        window.reset(0, self.message.size, self.message.top);
        let mut contact = Contact::new();
        let mut felt = Vec::new();
        for event in &self.events {
            match event {
                Event::Tile(key) => {
                    self.fill(spare, *key);
                    spare = window.install(spare);
                }
                Event::Hand(hip) => {
                    let answer = contact.step(&window, hip, self.message.rule, Pace::RealTime);
                    felt.push(Counted {
                        instructions: 0,
                        state: answer.state as u32,
                        settled: answer.settled,
                        work: answer.work,
                        vector: answer.stretch,
                        proxy: answer.proxy,
                    });
                }
            }
        }
        felt
    }

    fn fill(&self, tile: &mut Tile, key: TileKey) {
        let side = TILE_CELLS as i32;
        tile.fill(key, 0, |col, row| {
            self.post(key.col * side + col as i32, key.row * side + row as i32)
        })
        .expect("the base is in range");
    }
}
