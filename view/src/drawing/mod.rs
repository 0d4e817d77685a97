//! Messages as rerun's entities: the terrain, the hand and the plots, in ground metres around the
//! home position.
//!
//! | entity | content | when |
//! | --- | --- | --- |
//! | `/terrain/LAYER/BLOCK` | a block of a coarse layer, with its relief as texture | static; its triangles change where tiles are shown |
//! | `/terrain/tiles/SLOT` | a tile as it is rendered | static until another tile uses its slot |
//! | `/terrain/held/SLOT`, `/terrain/awaited` | outlines of the tiles that the device stores and waits for | static until these tiles change |
//! | `/hand/proxy`, `hip`, `ray`, `force`, `trace` | the hand | 60 a second |
//! | `/frame/border`, `corners`, `bar` | a frame around the hand, its coordinates, a scale bar | static until the hand leaves it |
//! | `/map/…` | the same from above, in pixels of the relief | |
//! | `/plot/…` | a thousand samples a second | |
//! | `/words` | position, scale and coordinates | four a second |
//!
//! Another placement of the terrain while it is touched is another scene: the terrain stays where
//! it is on the ground, the eye moves nearer or farther, and plots and time continue.
//!
//! Entries without a time are logged as static, and the latest replaces the one before, in the
//! history as in the page: a session of hours grows only by its samples.

mod captions;
mod frame;
mod ground;
mod hand;
mod layers;
mod layout;
mod lengths;
mod log;
mod map;
mod plots;
mod shade;
mod tiles;

use std::collections::BTreeSet;

use anyhow::Result;
use hapterra_view_stream::{Message, Scene};

pub use log::{APPLICATION, Entry, TIMELINE};

use captions::Words;
use frame::Frame;
use ground::Ground;
use hand::Hand;
use layers::Layers;
use log::Log;
use map::Map;
use plots::Plots;
use tiles::Tiles;

/// State of the drawing of a scene.
pub struct Drawing {
    log: Log,
    scene: Scene,
    /// Ground under the hand, in the current placement.
    ground: Ground,
    /// Ground of the drawn terrain; in a recording that of its first placement.
    terrain: Ground,
    layers: Layers,
    tiles: Tiles,
    map: Map,
    frame: Frame,
    hand: Hand,
    plots: Plots,
    words: Words,
}

impl Drawing {
    /// Draws a message. `drawing` is `None` before the first scene.
    ///
    /// # Errors
    /// An entry that rerun's format cannot encode; this should not happen.
    pub fn take(drawing: &mut Option<Self>, message: Message) -> Result<Vec<Entry>> {
        if let Message::Scene(scene) = message {
            let mut entries = Vec::new();
            match drawing {
                Some(drawing) => drawing.change(*scene, &mut entries)?,
                None => *drawing = Some(Self::begin(*scene, &mut entries)?),
            }
            return Ok(entries);
        }
        match drawing {
            Some(drawing) => drawing.draw_message(message),
            // Message before any scene.
            None => Ok(Vec::new()),
        }
    }

    /// Draws the waiting samples, at the end of the stream.
    ///
    /// # Errors
    /// As [`Drawing::take`].
    pub fn finish(&mut self) -> Result<Vec<Entry>> {
        self.plots.finish(&self.log)
    }

    /// Returns true if samples arrive as they are rendered.
    #[must_use]
    pub fn is_live(&self) -> bool {
        self.scene.is_live
    }

    fn begin(scene: Scene, entries: &mut Vec<Entry>) -> Result<Self> {
        let log = Log::new();
        let ground = Ground::new(&scene);
        entries.push(log.opened());
        entries.extend(layout::entries(&scene, &ground)?);
        entries.extend(hand::style_entries(&log, &ground)?);
        entries.extend(plots::style_entries(&log)?);
        Ok(Self {
            plots: Plots::new(&scene),
            hand: Hand::default(),
            words: Words::new(&scene),
            layers: Layers::default(),
            tiles: Tiles::default(),
            map: Map::default(),
            frame: Frame::default(),
            log,
            ground,
            terrain: ground,
            scene,
        })
    }

    /// Changes to another placement of the same terrain. Earlier samples stay.
    fn change(&mut self, scene: Scene, entries: &mut Vec<Entry>) -> Result<()> {
        let log = &self.log;
        let ground = self.ground.after(&scene);
        entries.extend(self.plots.change(log, &scene)?);
        self.words.change(&scene);
        self.hand.start_new_line();
        self.frame.change();
        match scene.is_live {
            true => {
                self.draw_placement(&scene, &ground, entries)?;
                self.ground = ground;
            }
            // The terrain of a recording is the same for all of its time.
            false => self.ground = ground.over(&self.terrain),
        }
        self.scene = scene;
        Ok(())
    }

    /// Draws the terrain as it is rendered from now on, and sets the eye's distance by its size.
    fn draw_placement(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        entries: &mut Vec<Entry>,
    ) -> Result<()> {
        let log = &self.log;
        if !scene.keeps_tiles {
            // First the layers under the tiles, so that there is no gap.
            entries.extend(self.layers.cut(log, ground, &BTreeSet::new())?);
            entries.extend(self.tiles.clear(log)?);
        }
        if !ground.has_heights_of(&self.terrain) {
            entries.extend(self.layers.redraw(log, ground)?);
        }
        if (ground.near - self.terrain.near).abs() > 1e-6 * ground.near {
            entries.extend(layout::entries(scene, ground)?);
            entries.extend(hand::style_entries(log, ground)?);
        }
        entries.extend(self.map.fitted_area(log, scene)?);
        self.terrain = *ground;
        Ok(())
    }

    fn draw_message(&mut self, message: Message) -> Result<Vec<Entry>> {
        let (log, ground, terrain) = (&self.log, &self.ground, &self.terrain);
        match message {
            Message::Layer(layer) => {
                let mut entries = self.map.layer(log, &self.scene, terrain, &layer)?;
                let before = self.layers.mesh_cell();
                entries.extend(self.layers.put(log, terrain, layer)?);
                self.frame.change();
                if self.layers.mesh_cell() != before {
                    entries.extend(self.tiles.close(log, terrain, &self.layers)?);
                }
                Ok(entries)
            }
            Message::Tile(tile) => {
                let mut entries = self.tiles.add(log, terrain, &self.layers, &tile)?;
                entries.extend(self.layers.cut(log, terrain, &self.tiles.shown())?);
                Ok(entries)
            }
            Message::Tiles(tiles) => {
                let mut entries = self.tiles.outline(log, terrain, &tiles)?;
                entries.extend(self.map.tiles(log, terrain, &tiles)?);
                Ok(entries)
            }
            Message::Samples(samples) => {
                let mut entries = self.plots.take(log, &samples)?;
                entries.extend(self.hand.take(log, ground, &samples)?);
                let grounds = (ground, terrain);
                let drawn = (&self.layers, &self.map);
                entries.extend({ &mut self.frame }.take(
                    log,
                    &self.scene,
                    grounds,
                    drawn,
                    &samples,
                )?);
                entries.extend(self.map.samples(log, &self.scene, &samples)?);
                entries.extend(self.words.take(log, &self.scene, &samples)?);
                Ok(entries)
            }
            Message::Link(link) => {
                self.words.link(&link);
                self.plots.link(log, &link)
            }
            Message::Hello(_) | Message::Scene(_) | Message::End => Ok(Vec::new()),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use hapterra_view_stream::{Layer, Sample, TILE_POSTS, Tile};
    use re_sdk_types::archetypes::Points3D;

    /// Returns a static entry with a key, or an event.
    pub(crate) fn entry(key: Option<&str>) -> Entry {
        let log = Log::new();
        let points = Points3D::new((0..100).map(|i| [i as f32, 0.0, 1.0]));
        match key {
            Some(key) => log.log_static(key, "", &points).expect("encodes"),
            None => {
                let columns = points.columns_of_unit_batches().expect("columns");
                log.log_timed("it", &(0..100).map(f64::from).collect::<Vec<_>>(), columns)
                    .expect("encodes")
            }
        }
    }

    /// Returns an event at a time, s.
    pub(crate) fn at(t_s: f64) -> Entry {
        let point = Points3D::new([[1.0, 2.0, 3.0]]);
        Log::new().at("it", t_s, &point).expect("encodes")
    }

    fn scene(change: impl FnOnce(&mut Scene)) -> Message {
        let mut scene = super::ground::tests::scene();
        change(&mut scene);
        Message::Scene(Box::new(scene))
    }

    fn layer() -> Message {
        Message::Layer(Layer {
            number: 0,
            first: [0, 0],
            step: 2,
            columns: 81,
            rows: 81,
            heights: (0..81 * 81).map(|i| ((i * 31) % 97) as f32).collect(),
        })
    }

    fn tile() -> Message {
        Message::Tile(Tile {
            slot: 2,
            index: [1, 1],
            heights_mm: vec![1.0; TILE_POSTS * TILE_POSTS],
        })
    }

    /// Returns the keys of the entries that a message draws again.
    fn keys(drawing: &mut Option<Drawing>, message: Message) -> BTreeSet<String> {
        let entries = Drawing::take(drawing, message).expect("it is drawn");
        entries.into_iter().filter_map(|entry| entry.key).collect()
    }

    fn has(keys: &BTreeSet<String>, begin: &str) -> bool {
        keys.iter().any(|key| key.starts_with(begin))
    }

    #[test]
    fn new_placement_redraws_only_what_it_changes() {
        let mut drawing = None;
        let mut all = BTreeSet::new();
        for message in [scene(|_| {}), layer(), tile()] {
            all.extend(keys(&mut drawing, message));
        }
        // Panned: the tiles and the eye stay.
        let panned = scene(|scene| {
            scene.keeps_tiles = true;
            scene.home_mm = [50.0, 30.0, 12.0];
        });
        let drawn = keys(&mut drawing, panned);
        assert_eq!(drawn, BTreeSet::from(["map/laid ".to_owned()]));
        // Zoomed: the eye moves nearer.
        let zoom = |scene: &mut Scene| {
            scene.cell_mm *= 2.0;
            scene.mm_per_unit *= 2.0;
            scene.fitted_mm = scene.fitted_mm.map(|mm| 2.0 * mm);
            scene.ground_m_per_mm = scene.ground_m_per_mm.map(|metres| 0.5 * metres);
        };
        let zoomed = scene(|scene| {
            zoom(scene);
            scene.keeps_tiles = true;
        });
        let drawn = keys(&mut drawing, zoomed);
        assert!(
            has(&drawn, " opened, layout") && !has(&drawn, "terrain/"),
            "{drawn:?}"
        );
        // Steeper: the terrain is another one, and its tiles have not arrived yet.
        let steeper = scene(|scene| {
            zoom(scene);
            scene.mm_per_unit *= 1.5;
        });
        let drawn = keys(&mut drawing, steeper);
        assert!(has(&drawn, "terrain/layer0/0 mesh") && has(&drawn, "terrain/tiles/2 mesh"));
        // All entries that it draws replace earlier ones.
        assert!(drawn.is_subset(&all), "{drawn:?}");
        assert!(keys(&mut drawing, tile()).is_subset(&all));
    }

    #[test]
    fn frame_is_redrawn_on_leaving_it_and_on_new_placement() {
        let mut drawing = None;
        let samples = |x: f64, scale: f64| {
            Message::Samples(vec![Sample {
                t_s: 0.0,
                hip_mm: [scale * x, scale * 30.0, 0.0],
                proxy_mm: [scale * x, scale * 30.0, 0.0],
                force_n: [0.0; 3],
                ground_mm: 0.0,
                contact: false,
                cost: None,
            }])
        };
        for message in [scene(|_| {}), layer()] {
            keys(&mut drawing, message);
        }
        let fitted = [
            "frame/bar ",
            "frame/border ",
            "frame/corners ",
            "map/frame ",
        ];
        let mut is_laid = |message: Message| {
            let drawn = keys(&mut drawing, message);
            let count = fitted.iter().filter(|key| drawn.contains(**key)).count();
            assert!(count == 0 || count == fitted.len(), "{drawn:?}");
            count > 0
        };
        assert!(is_laid(samples(40.0, 1.0)));
        assert!(!is_laid(samples(41.0, 1.0)));
        assert!(is_laid(samples(75.0, 1.0)));
        assert!(is_laid(samples(40.0, 1.0)));
        is_laid(scene(|scene| {
            scene.keeps_tiles = true;
            scene.cell_mm *= 2.0;
            scene.mm_per_unit *= 2.0;
            scene.home_mm = scene.home_mm.map(|mm| 2.0 * mm);
            scene.fitted_mm = scene.fitted_mm.map(|mm| 2.0 * mm);
            scene.ground_m_per_mm = scene.ground_m_per_mm.map(|metres| 0.5 * metres);
        }));
        // At the same position of the ground.
        assert!(is_laid(samples(40.0, 2.0)));
    }

    #[test]
    fn terrain_of_a_recording_is_drawn_once() {
        let mut drawing = None;
        let recorded = |steeper: f64| {
            scene(move |scene| {
                scene.is_live = false;
                scene.mm_per_unit *= steeper;
            })
        };
        for message in [recorded(1.0), layer(), tile()] {
            keys(&mut drawing, message);
        }
        assert!(keys(&mut drawing, recorded(3.0)).is_empty());
    }
}
