//! Tiles as they are rendered, and outlines of the tiles that the device stores and waits for.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;
use hapterra_view_stream::{TILE_CELLS, TILE_POSTS, Tile, Tiles as Reported};
use re_sdk_types::archetypes::{LineStrips3D, Mesh3D};
use re_sdk_types::components::{Color, Radius};

use super::ground::Ground;
use super::layers::Layers;
use super::log::{Entry, Log};
use super::shade::{Heights, NO_DATA, Rgb};

/// Samples along the side of a tile.
const SIDE: usize = TILE_CELLS as usize + 1;
/// Height of an outline above the surface, in haptic cells.
const FLOAT_CELLS: f64 = 0.35;
/// Name of a tile's samples among the parts of its entity.
const MESH: &str = "mesh";
/// Colours of outlines.
const HELD: Rgb = [64, 224, 208];
const AWAITED: Rgb = [255, 176, 32];

/// The tiles that are shown.
#[derive(Default)]
pub(super) struct Tiles {
    /// The tile in each slot.
    slots: BTreeMap<u32, [i32; 2]>,
    /// The tiles by column and row, with the colours around each.
    tiles: BTreeMap<[i32; 2], (Lifted, Vec<Rgb>)>,
    /// Outline of each shown tile.
    outlines: BTreeMap<[i32; 2], Vec<Vec<[f32; 3]>>>,
    /// The outlined tile in each slot of the picture.
    outlined: BTreeMap<u32, [i32; 2]>,
}

/// A tile with its heights in the picture.
struct Lifted {
    slot: u32,
    index: [i32; 2],
    up: Vec<f32>,
    step: f64,
}

impl Lifted {
    fn heights(&self) -> Heights<'_> {
        Heights {
            columns: TILE_POSTS,
            rows: TILE_POSTS,
            step: self.step,
            up: &self.up,
        }
    }
}

impl Tiles {
    /// Shows a tile in its slot.
    pub(super) fn add(
        &mut self,
        log: &Log,
        ground: &Ground,
        layers: &Layers,
        tile: &Tile,
    ) -> Result<Vec<Entry>> {
        if tile.heights_mm.len() != TILE_POSTS * TILE_POSTS {
            return Ok(Vec::new());
        }
        let mut changed = vec![tile.index];
        if let Some(before) = self.slots.insert(tile.slot, tile.index) {
            self.outlines.remove(&before);
            self.tiles.remove(&before);
            changed.push(before);
        }
        let lifted = Lifted {
            slot: tile.slot,
            index: tile.index,
            up: ground.heights_of_mm(&tile.heights_mm),
            step: ground.step(ground.haptic_cell()),
        };
        let heights = lifted.heights();
        let posts = Posts {
            heights: &heights,
            ground,
            first: ground.first_cell(tile.index),
        };
        self.outlines.insert(tile.index, posts.outline());
        // Their heights may have changed.
        self.outlined.remove(&tile.slot);
        let colour = |column: usize, row: usize| {
            let shade = layers.shade();
            shade.map_or(NO_DATA, |shade| shade.colour(&heights, column + 1, row + 1))
        };
        let mesh = posts.mesh(&colour);
        let around = ring().iter().map(|(x, y)| colour(*x, *y)).collect();
        self.tiles.insert(tile.index, (lifted, around));
        let mut entries = vec![log.log_static(&entity(tile.slot), MESH, &mesh)?];
        entries.extend(self.skirts(log, ground, layers, &changed)?);
        Ok(entries)
    }

    /// Draws the sides of all tiles, after the mesh around them has changed.
    pub(super) fn close(&self, log: &Log, ground: &Ground, layers: &Layers) -> Result<Vec<Entry>> {
        let all: Vec<_> = self.tiles.keys().copied().collect();
        self.skirts(log, ground, layers, &all)
    }

    /// Draws the sides of changed tiles and of their neighbours: only sides without a neighbour.
    fn skirts(
        &self,
        log: &Log,
        ground: &Ground,
        layers: &Layers,
        changed: &[[i32; 2]],
    ) -> Result<Vec<Entry>> {
        let every = (layers.mesh_cell() / ground.haptic_cell()).clamp(1, TILE_CELLS);
        let near = changed.iter().flat_map(|index| {
            [[0, 0], [0, -1], [1, 0], [0, 1], [-1, 0]].map(|step| neighbour(*index, step))
        });
        let near: BTreeSet<_> = near.collect();
        let shown = near.iter().filter_map(|index| self.tiles.get(index));
        let entries = shown.map(|(tile, colours)| {
            let heights = tile.heights();
            let posts = Posts {
                heights: &heights,
                ground,
                first: ground.first_cell(tile.index),
            };
            // In the order of the ring.
            let open = [[0, -1], [1, 0], [0, 1], [-1, 0]]
                .map(|step| !self.tiles.contains_key(&neighbour(tile.index, step)));
            let mesh = posts.skirt(colours, open, every as usize);
            log.log_static(&skirt(tile.slot), "", &mesh)
        });
        entries.collect()
    }

    /// Removes all tiles from the picture: another placement has none of them.
    pub(super) fn clear(&mut self, log: &Log) -> Result<Vec<Entry>> {
        let Self {
            slots, outlined, ..
        } = std::mem::take(self);
        let empty = Mesh3D::new([[0.0; 3]]).with_triangle_indices(or_one_degenerate(Vec::new()));
        let mut entries = Vec::new();
        for slot in slots.keys() {
            entries.push(log.log_static(&entity(*slot), MESH, &empty)?);
            entries.push(log.log_static(&skirt(*slot), "", &empty)?);
        }
        for slot in outlined.keys() {
            entries.push(drawn(log, &held_entity(*slot), vec![], HELD)?);
        }
        Ok(entries)
    }

    /// Returns the shown tiles, by column and row.
    pub(super) fn shown(&self) -> BTreeSet<[i32; 2]> {
        self.slots.values().copied().collect()
    }

    /// Draws the outlines of the tiles that the device stores and waits for. An outline is sent
    /// when its tile arrives, and not again with every other one: a window has hundreds.
    pub(super) fn outline(
        &mut self,
        log: &Log,
        ground: &Ground,
        reported: &Reported,
    ) -> Result<Vec<Entry>> {
        let mut entries = Vec::new();
        let held_keys: BTreeSet<_> = reported.held.iter().copied().collect();
        for (slot, index) in &self.slots {
            let lines = self
                .outlines
                .get(index)
                .filter(|_| held_keys.contains(index));
            let before = self.outlined.get(slot);
            match lines {
                Some(_) if before == Some(index) => {}
                Some(lines) => {
                    entries.push(drawn(log, &held_entity(*slot), lines.clone(), HELD)?);
                    self.outlined.insert(*slot, *index);
                }
                None if before.is_none() => {}
                None => {
                    entries.push(drawn(log, &held_entity(*slot), vec![], HELD)?);
                    self.outlined.remove(slot);
                }
            }
        }
        let unknown = held_keys
            .iter()
            .filter(|index| !self.outlines.contains_key(*index));
        let squares = unknown.map(|index| flat(ground, *index)).collect();
        entries.push(drawn(log, "terrain/held", squares, HELD)?);
        let awaited = reported.awaited.iter();
        let awaited = awaited.flat_map(|index| match self.outlines.get(index) {
            Some(lines) => lines.clone(),
            None => vec![flat(ground, *index)],
        });
        entries.push(drawn(log, "terrain/awaited", awaited.collect(), AWAITED)?);
        Ok(entries)
    }
}

/// Returns lines in a colour.
fn drawn(log: &Log, entity: &str, lines: Vec<Vec<[f32; 3]>>, colour: Rgb) -> Result<Entry> {
    let width = if colour == AWAITED { 2.0 } else { 0.9 };
    let strips = LineStrips3D::new(lines)
        .with_colors([colour])
        .with_radii([Radius::new_ui_points(width)]);
    log.log_static(entity, "", &strips)
}

/// Returns the outline of an unknown tile: a square at the home position's height.
fn flat(ground: &Ground, index: [i32; 2]) -> Vec<[f32; 3]> {
    let [x, y] = ground.first_cell(index).map(f64::from);
    let side = f64::from(ground.tile_cells());
    let [_, _, up] = ground.home();
    [
        [0.0, 0.0],
        [side, 0.0],
        [side, side],
        [0.0, side],
        [0.0, 0.0],
    ]
    .map(|[east, north]| {
        let [x, y, _] = ground.sample([x + east, y + north], 0.0);
        [x, y, up]
    })
    .to_vec()
}

/// The samples of a tile in the picture.
struct Posts<'p> {
    heights: &'p Heights<'p>,
    ground: &'p Ground,
    first: [i32; 2],
}

impl Posts<'_> {
    /// Returns a sample's height; the heights have a margin of one around the tile.
    fn height(&self, column: usize, row: usize) -> Option<f32> {
        self.heights.at(column + 1, row + 1)
    }

    /// Returns a sample's position, at a height.
    fn at(&self, column: usize, row: usize, up: f32) -> [f32; 3] {
        let [x, y] = self.first.map(f64::from);
        let side = f64::from(self.ground.haptic_cell());
        let cell = [x + side * column as f64, y + side * row as f64];
        self.ground.sample(cell, up)
    }

    fn surface(&self, column: usize, row: usize) -> [f32; 3] {
        self.at(column, row, self.height(column, row).unwrap_or(0.0))
    }

    fn mesh(&self, colour: &dyn Fn(usize, usize) -> Rgb) -> Mesh3D {
        let places = || (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
        let positions = places().map(|(column, row)| self.surface(column, row));
        let colours = places().map(|(column, row)| Color::from(colour(column, row)));
        let mut triangles = Vec::new();
        for row in 0..SIDE - 1 {
            for column in 0..SIDE - 1 {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (column + x, row + y));
                if corners.iter().all(|(x, y)| self.height(*x, *y).is_some()) {
                    let [a, b, c, d] = corners.map(|(x, y)| (y * SIDE + x) as u32);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        Mesh3D::new(positions)
            .with_vertex_colors(colours)
            .with_triangle_indices(or_one_degenerate(triangles))
    }

    /// Returns walls at the tile's open sides, which close the gap to the coarse mesh: it is
    /// straight between every `every`-th sample.
    fn skirt(&self, colours: &[Rgb], open: [bool; 4], every: usize) -> Mesh3D {
        let ring = ring();
        let tops = ring.iter().map(|(x, y)| self.surface(*x, *y));
        let coarse = ring.iter().enumerate().map(|(i, (x, y))| {
            let up = self.coarse(&ring, i, every).or_else(|| self.height(*x, *y));
            self.at(*x, *y, up.unwrap_or(0.0))
        });
        let positions: Vec<_> = tops.chain(coarse).collect();
        let colours = colours.iter().chain(colours).copied().map(Color::from);
        let mut triangles = Vec::new();
        for (i, pair) in ring.windows(2).enumerate() {
            let is_open = open.get(i / (SIDE - 1)).copied().unwrap_or(false);
            let is_known = pair.iter().all(|(x, y)| self.height(*x, *y).is_some());
            if is_open && is_known {
                let (a, c) = (i as u32, (i + ring.len()) as u32);
                triangles.extend([[a, c, a + 1], [a + 1, c, c + 1]]);
            }
        }
        Mesh3D::new(positions)
            .with_vertex_colors(colours)
            .with_triangle_indices(or_one_degenerate(triangles))
    }

    /// Returns the height of the coarse mesh at a position of the ring; `None` beside no-data.
    fn coarse(&self, ring: &[(usize, usize)], i: usize, every: usize) -> Option<f32> {
        let (from, share) = (i - i % every, (i % every) as f32 / every as f32);
        let height = |i: usize| ring.get(i).and_then(|(x, y)| self.height(*x, *y));
        let low = height(from)?;
        match share > 0.0 {
            true => Some(low + share * (height(from + every)? - low)),
            false => Some(low),
        }
    }

    /// Returns lines around the tile, broken at no-data.
    fn outline(&self) -> Vec<Vec<[f32; 3]>> {
        let float = (FLOAT_CELLS * self.ground.step(self.ground.haptic_cell())) as f32;
        let ring = ring();
        let is_known = |place: &(usize, usize)| self.height(place.0, place.1).is_some();
        let lines = ring
            .split(|place| !is_known(place))
            .filter(|line| line.len() > 1);
        lines
            .map(|line| {
                let up = |x, y| self.height(x, y).unwrap_or(0.0) + float;
                line.iter()
                    .map(|(x, y)| self.at(*x, *y, up(*x, *y)))
                    .collect()
            })
            .collect()
    }
}

/// Returns the name of a slot in the picture.
fn entity(slot: u32) -> String {
    format!("terrain/tiles/{slot}")
}

fn skirt(slot: u32) -> String {
    format!("terrain/tiles/{slot}/skirt")
}

/// Returns the name of the outline of the stored tile in a slot.
fn held_entity(slot: u32) -> String {
    format!("terrain/held/{slot}")
}

/// Returns the tile at a distance of columns and rows.
fn neighbour([col, row]: [i32; 2], [east, north]: [i32; 2]) -> [i32; 2] {
    [col.saturating_add(east), row.saturating_add(north)]
}

/// Adds a degenerate triangle if there is none: the viewer would draw the vertices of an empty mesh
/// as triangles.
fn or_one_degenerate(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    if triangles.is_empty() {
        triangles.push([0, 0, 0]);
    }
    triangles
}

/// Returns columns and rows around a tile, the first also at the end.
fn ring() -> Vec<(usize, usize)> {
    let last = SIDE - 1;
    let south = (0..last).map(|i| (i, 0));
    let east = (0..last).map(|i| (last, i));
    let north = (0..last).map(|i| (last - i, last));
    let west = (0..=last).map(|i| (0, last - i));
    south.chain(east).chain(north).chain(west).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ring_is_closed_and_advances_one_sample_at_a_time() {
        let ring = ring();
        assert_eq!(ring.len(), 4 * (SIDE - 1) + 1);
        assert_eq!(ring.first(), ring.last());
        for pair in ring.windows(2) {
            let [(x, y), (u, v)] = pair else {
                unreachable!()
            };
            assert_eq!(x.abs_diff(*u) + y.abs_diff(*v), 1);
        }
    }

    #[test]
    fn skirt_ends_on_the_coarse_mesh() {
        let ground = Ground::new(&super::super::ground::tests::scene());
        let up: Vec<f32> = (0..TILE_POSTS * TILE_POSTS)
            .map(|i| ((i * 7919) % 101) as f32)
            .collect();
        let heights = Heights {
            columns: TILE_POSTS,
            rows: TILE_POSTS,
            step: 1.0,
            up: &up,
        };
        let posts = Posts {
            heights: &heights,
            ground: &ground,
            first: [0, 0],
        };
        let ring = ring();
        for (i, (x, y)) in ring.iter().enumerate() {
            let own = posts.height(*x, *y).expect("no hole");
            let coarse = posts.coarse(&ring, i, 4).expect("no hole");
            // At a corner of the coarse mesh there is no gap.
            assert!(i % 4 != 0 || coarse == own, "{i}");
            let corner = |k: usize| posts.height(ring[k].0, ring[k].1).expect("no hole");
            let ends = [
                corner(i / 4 * 4),
                corner((i / 4 * 4 + 4).min(ring.len() - 1)),
            ];
            assert!(
                (ends[0].min(ends[1])..=ends[0].max(ends[1])).contains(&coarse),
                "{i}"
            );
        }
        assert_eq!(posts.coarse(&ring, 5, 1), posts.height(5, 0));
    }

    #[test]
    fn cleared_tiles_leave_empty_slots() {
        let (log, layers) = (Log::new(), Layers::default());
        let ground = Ground::new(&super::super::ground::tests::scene());
        let mut tiles = Tiles::default();
        let tile = Tile {
            slot: 3,
            index: [1, 2],
            heights_mm: vec![1.0; TILE_POSTS * TILE_POSTS],
        };
        let drawn = tiles
            .add(&log, &ground, &layers, &tile)
            .expect("it is drawn");
        let keys = |entries: &[Entry]| -> BTreeSet<_> {
            entries.iter().map(|entry| entry.key.clone()).collect()
        };
        let cleared = tiles.clear(&log).expect("it is drawn");
        assert_eq!(keys(&cleared), keys(&drawn));
        assert!(tiles.shown().is_empty() && tiles.clear(&log).expect("nothing").is_empty());
    }

    #[test]
    fn outlines_are_sent_only_for_tiles_added_or_removed() {
        let (log, layers) = (Log::new(), Layers::default());
        let ground = Ground::new(&super::super::ground::tests::scene());
        let mut tiles = Tiles::default();
        let add_tile = |tiles: &mut Tiles, slot, index| {
            let heights_mm = vec![1.0; TILE_POSTS * TILE_POSTS];
            let tile = Tile {
                slot,
                index,
                heights_mm,
            };
            tiles.add(&log, &ground, &layers, &tile).expect("drawn");
        };
        let reported = |tiles: &mut Tiles, held: &[[i32; 2]]| -> Vec<String> {
            let held = Reported {
                held: held.to_vec(),
                awaited: vec![],
            };
            let entries = tiles.outline(&log, &ground, &held).expect("drawn");
            let keys = entries.into_iter().filter_map(|entry| entry.key);
            keys.filter(|key| key.starts_with("terrain/held/"))
                .collect()
        };
        add_tile(&mut tiles, 3, [1, 2]);
        add_tile(&mut tiles, 4, [2, 2]);
        let [third, fourth] = ["terrain/held/3 ", "terrain/held/4 "];
        assert_eq!(reported(&mut tiles, &[[1, 2], [2, 2]]), [third, fourth]);
        assert!(reported(&mut tiles, &[[1, 2], [2, 2]]).is_empty());
        // Another in the same slot, and one that is no longer stored.
        add_tile(&mut tiles, 3, [9, 2]);
        assert_eq!(reported(&mut tiles, &[[9, 2], [2, 2]]), [third]);
        assert_eq!(reported(&mut tiles, &[[9, 2]]), [fourth]);
        assert!(reported(&mut tiles, &[[9, 2]]).is_empty());
    }
}
