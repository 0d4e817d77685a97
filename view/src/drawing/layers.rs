//! The terrain at coarse levels: meshes in blocks, with the relief as texture.
//!
//! A mesh uses every m-th sample of its layer, its texture all of them. Where a finer layer or a
//! tile is shown, the mesh has no triangles; only the triangles are logged again when tiles are
//! shown or removed.

use std::collections::BTreeSet;

use anyhow::Result;
use hapterra_view_stream::Layer;
use re_sdk_types::archetypes::{Image, Mesh3D};

use super::ground::{Ground, cell_of};
use super::log::{Entry, Log};
use super::shade::{Heights, Shade};

/// Max cells of a mesh along a side.
const MESH_CELLS: usize = 320;
/// Cells of a mesh along a block's side.
const BLOCK_CELLS: usize = 32;

/// The layers of a terrain.
#[derive(Default)]
pub(super) struct Layers {
    /// The layers as received, to draw them for a placement with other heights.
    reported: Vec<Layer>,
    layers: Vec<Shown>,
    /// Colours, from the coarsest layer, which covers the whole terrain.
    shade: Option<Shade>,
    cut: Cut,
}

/// Area of the shown tiles: their south-west cells of level 0, and cells along their sides.
#[derive(Clone, Default, PartialEq, Eq)]
struct Cut {
    side: i32,
    tiles: BTreeSet<[i32; 2]>,
}

/// A layer in the picture.
struct Shown {
    blocks: Vec<Block>,
}

/// Part of a mesh.
struct Block {
    entity: String,
    /// Its cells with a surface: their extent in cells of level 0 (west, south, east, north) and
    /// the indices of their corners.
    cells: Vec<([i32; 4], [u32; 4])>,
    extent: [i32; 4],
}

/// Name of an entity's samples and triangles.
const MESH: &str = "mesh";
const TRIANGLES: &str = "triangles";

impl Layers {
    /// Shows a layer. If it replaces another one, the finer ones are removed as well, and the layer
    /// below is drawn completely until then, so that there is no gap.
    pub(super) fn put(&mut self, log: &Log, ground: &Ground, layer: Layer) -> Result<Vec<Entry>> {
        let number = layer.number as usize;
        if number > self.reported.len() {
            // A finer layer without a coarser one.
            return Ok(Vec::new());
        }
        let removed = self.layers.split_off(number);
        self.reported.truncate(number);
        let mut entries = Vec::new();
        if !removed.is_empty() {
            entries.extend(self.triangles(log, number.checked_sub(1))?);
        }
        for block in removed.iter().flat_map(|layer| &layer.blocks) {
            entries.push(block.clear_entry(log)?);
        }
        entries.extend(self.draw(log, ground, &layer)?);
        self.reported.push(layer);
        for block in removed.iter().flat_map(|layer| &layer.blocks) {
            if !self.has(&block.entity) {
                entries.push(block.forgotten(log)?);
            }
        }
        entries.extend(self.triangles(log, number.checked_sub(1))?);
        Ok(entries)
    }

    /// Returns true if an entity is part of a layer that is shown.
    fn has(&self, entity: &str) -> bool {
        let mut blocks = self.layers.iter().flat_map(|layer| &layer.blocks);
        blocks.any(|block| block.entity == entity)
    }

    /// Shows all layers again, with the heights of another placement.
    pub(super) fn redraw(&mut self, log: &Log, ground: &Ground) -> Result<Vec<Entry>> {
        let reported = std::mem::take(&mut self.reported);
        (self.shade, self.layers) = (None, Vec::new());
        let mut entries = Vec::new();
        for layer in &reported {
            entries.extend(self.draw(log, ground, layer)?);
        }
        self.reported = reported;
        for number in 0..self.layers.len() {
            entries.extend(self.triangles(log, Some(number))?);
        }
        Ok(entries)
    }

    /// Draws a layer after those that are shown.
    fn draw(&mut self, log: &Log, ground: &Ground, layer: &Layer) -> Result<Vec<Entry>> {
        let up = ground.heights_of(&layer.heights);
        let heights = Heights {
            columns: layer.columns as usize,
            rows: layer.rows as usize,
            step: ground.step(layer.step),
            up: &up,
        };
        let shade = *self.shade.get_or_insert_with(|| Shade::of(&heights));
        let every = mesh_step(heights.columns.max(heights.rows));
        let (columns, rows) = (lines(heights.columns, every), lines(heights.rows, every));
        let mut shown = Shown { blocks: Vec::new() };
        let mut entries = Vec::new();
        for south in (0..rows.len().saturating_sub(1)).step_by(BLOCK_CELLS) {
            for west in (0..columns.len().saturating_sub(1)).step_by(BLOCK_CELLS) {
                let part = Part {
                    layer,
                    heights: &heights,
                    columns: slice(&columns, west),
                    rows: slice(&rows, south),
                };
                let number = shown.blocks.len();
                let entity = format!("terrain/layer{}/{number}", self.layers.len());
                entries.push(log.log_static(&entity, MESH, &part.mesh(ground, &shade))?);
                shown.blocks.push(part.block(entity));
            }
        }
        for block in &shown.blocks {
            entries.push(block.triangles(log, None, &self.cut)?);
        }
        self.layers.push(shown);
        Ok(entries)
    }

    /// Returns the visible triangles of a layer: without the parts that the next finer layer or
    /// tiles show.
    fn triangles(&self, log: &Log, number: Option<usize>) -> Result<Vec<Entry>> {
        let Some(layer) = number.and_then(|number| self.layers.get(number)) else {
            return Ok(Vec::new());
        };
        let inner = number.and_then(|number| self.inner(number));
        let blocks = layer.blocks.iter();
        blocks
            .map(|block| block.triangles(log, inner, &self.cut))
            .collect()
    }

    /// Returns the part of a layer that a finer one shows, in cells of level 0: west, south, east,
    /// north.
    fn inner(&self, number: usize) -> Option<[i32; 4]> {
        let finer = self.reported.get(number + 1)?;
        Some(extent(finer))
    }

    /// Returns the cells of level 0 along the side of a cell of the finest mesh; 1 before the first
    /// layer.
    pub(super) fn mesh_cell(&self) -> i32 {
        let of = |layer: &Layer| {
            let every = mesh_step(layer.columns.max(layer.rows) as usize);
            layer.step.saturating_mul(every as i32)
        };
        self.reported.last().map_or(1, of).max(1)
    }

    /// Returns west, south, east and north of the terrain, in cells of level 0; `None` before the
    /// first layer.
    pub(super) fn extent(&self) -> Option<[i32; 4]> {
        self.reported.first().map(extent)
    }

    /// Returns the surface at a position (cells of level 0) in the picture's units, from the finest
    /// layer there; `None` for no-data and outside.
    pub(super) fn up_at(&self, ground: &Ground, place: [f64; 2]) -> Option<f32> {
        let unit = { self.reported.iter().rev() }.find_map(|layer| height_at(layer, place))?;
        ground.heights_of(&[unit]).first().copied()
    }

    /// Returns the colours of this terrain; `None` before the first layer.
    pub(super) fn shade(&self) -> Option<Shade> {
        self.shade
    }

    /// Removes the area of the shown tiles.
    pub(super) fn cut(
        &mut self,
        log: &Log,
        ground: &Ground,
        tiles: &BTreeSet<[i32; 2]>,
    ) -> Result<Vec<Entry>> {
        let cut = Cut {
            side: ground.tile_cells(),
            tiles: tiles.iter().map(|tile| ground.first_cell(*tile)).collect(),
        };
        let before = std::mem::replace(&mut self.cut, cut);
        let changed = before.changes_to(&self.cut);
        let mut entries = Vec::new();
        for (number, layer) in self.layers.iter().enumerate() {
            let inner = self.inner(number);
            let touched = |block: &&Block| changed.iter().any(|tile| block.has(*tile));
            for block in layer.blocks.iter().filter(touched) {
                entries.push(block.triangles(log, inner, &self.cut)?);
            }
        }
        Ok(entries)
    }
}

/// Returns west, south, east and north of a layer, in cells of level 0.
fn extent(layer: &Layer) -> [i32; 4] {
    let last = |count: u32| count.saturating_sub(1) as usize;
    let [east, north] = cell_of(layer, last(layer.columns), last(layer.rows));
    [layer.first[0], layer.first[1], east, north]
}

/// Returns a layer's interpolated height at a position (cells of level 0), in vertical units of the
/// file; `None` for no-data and outside.
fn height_at(layer: &Layer, place: [f64; 2]) -> Option<f32> {
    let step = f64::from(layer.step.max(1));
    let [x, y] = [0, 1].map(|axis| (place[axis] - f64::from(layer.first[axis])) / step);
    let ([columns, rows], inside) = ([layer.columns, layer.rows], |at: f64, count: u32| {
        // A position on the border may be rounded to the wrong side.
        let last = f64::from(count.saturating_sub(1));
        (-1e-6..=last + 1e-6)
            .contains(&at)
            .then(|| at.clamp(0.0, last))
    });
    let (x, y) = (inside(x, columns)?, inside(y, rows)?);
    let (column, row) = (x.floor(), y.floor());
    let corner = |right: f64, up: f64| {
        let column = (column + right).min(f64::from(columns - 1)) as usize;
        let row = (row + up).min(f64::from(rows - 1)) as usize;
        { layer.heights.get(row * columns as usize + column) }.copied()
    };
    let mean = |low: f32, high: f32, share: f64| low + (high - low) * share as f32;
    let south = mean(corner(0.0, 0.0)?, corner(1.0, 0.0)?, x - column);
    let north = mean(corner(0.0, 1.0)?, corner(1.0, 1.0)?, x - column);
    Some(mean(south, north, y - row)).filter(|height| height.is_finite())
}

/// Returns the step between the samples of a mesh.
fn mesh_step(samples: usize) -> usize {
    let mut step = 1;
    while samples.saturating_sub(1) / step > MESH_CELLS {
        step *= 2;
    }
    step
}

/// Returns the samples along a side that a mesh uses, including the last one.
fn lines(samples: usize, every: usize) -> Vec<usize> {
    let last = samples.saturating_sub(1);
    let mut lines: Vec<_> = (0..last).step_by(every).collect();
    lines.push(last);
    lines
}

fn slice(lines: &[usize], first: usize) -> &[usize] {
    let last = (first + BLOCK_CELLS + 1).min(lines.len());
    lines.get(first..last).unwrap_or_default()
}

/// Part of a block.
struct Part<'p> {
    layer: &'p Layer,
    heights: &'p Heights<'p>,
    /// Columns and rows of the layer that it uses.
    columns: &'p [usize],
    rows: &'p [usize],
}

impl Part<'_> {
    fn ends(&self) -> Option<[usize; 4]> {
        Some([
            *self.columns.first()?,
            *self.rows.first()?,
            *self.columns.last()?,
            *self.rows.last()?,
        ])
    }

    /// Returns a corner's height; for no-data the mean around it, up to the next corners. The
    /// texture shows such no-data at its true size.
    fn height(&self, column: usize, row: usize) -> Option<f32> {
        if let Some(height) = self.heights.at(column, row) {
            return Some(height);
        }
        let every = mesh_step(self.heights.columns.max(self.heights.rows));
        let near = |middle: usize| middle.saturating_sub(every)..=middle + every;
        let around = near(row).flat_map(|row| near(column).map(move |column| (column, row)));
        let heights = around.filter_map(|(column, row)| self.heights.at(column, row));
        let (sum, count) = heights.fold((0.0, 0), |(sum, count), height| (sum + height, count + 1));
        // Without samples between the corners, the mesh has a gap for no-data.
        (every > 1 && count > 0).then(|| sum / count as f32)
    }

    fn mesh(&self, ground: &Ground, shade: &Shade) -> Mesh3D {
        let [west, south, east, north] = self.ends().unwrap_or_default();
        let (width, height) = (east - west + 1, north - south + 1);
        let (mut positions, mut texcoords) = (Vec::new(), Vec::new());
        for row in self.rows {
            for column in self.columns {
                let cell = cell_of(self.layer, *column, *row).map(f64::from);
                let up = self.height(*column, *row).unwrap_or(0.0);
                positions.push(ground.sample(cell, up));
                // Rows of a texture count from the north.
                texcoords.push([
                    ((column - west) as f32 + 0.5) / width as f32,
                    ((north - row) as f32 + 0.5) / height as f32,
                ]);
            }
        }
        let places = (south..=north)
            .rev()
            .flat_map(|row| (west..=east).map(move |column| (column, row)));
        let rgb: Vec<u8> = places
            .flat_map(|(column, row)| shade.colour(self.heights, column, row))
            .collect();
        Mesh3D::update_fields()
            .with_vertex_positions(positions)
            .with_vertex_texcoords(texcoords)
            .with_albedo_texture_image(Image::from_rgb24(rgb, [width as u32, height as u32]))
    }

    fn block(&self, entity: String) -> Block {
        let across = self.columns.len();
        let number = |i: usize, j: usize| (j * across + i) as u32;
        let mut cells = Vec::new();
        for (j, rows) in self.rows.windows(2).enumerate() {
            for (i, columns) in self.columns.windows(2).enumerate() {
                let ([west, east], [south, north]) = (columns, rows) else {
                    continue;
                };
                let corners = [(west, south), (east, south), (east, north), (west, north)];
                let is_known = corners.iter().all(|(x, y)| self.height(**x, **y).is_some());
                if is_known {
                    let [low, high] = [
                        cell_of(self.layer, *west, *south),
                        cell_of(self.layer, *east, *north),
                    ];
                    let numbers = [
                        number(i, j),
                        number(i + 1, j),
                        number(i + 1, j + 1),
                        number(i, j + 1),
                    ];
                    cells.push(([low[0], low[1], high[0], high[1]], numbers));
                }
            }
        }
        let [west, south, east, north] = self.ends().unwrap_or_default();
        let [low, high] = [
            cell_of(self.layer, west, south),
            cell_of(self.layer, east, north),
        ];
        Block {
            entity,
            cells,
            extent: [low[0], low[1], high[0], high[1]],
        }
    }
}

impl Block {
    /// Returns true if it contains a square or part of one, stated by its first cell and its side.
    fn has(&self, ([x, y], side): ([i32; 2], i32)) -> bool {
        let [west, south, east, north] = self.extent;
        let ends = |first: i32| first.saturating_add(side);
        x < east && ends(x) > west && y < north && ends(y) > south
    }

    fn triangles(&self, log: &Log, inner: Option<[i32; 4]>, cut: &Cut) -> Result<Entry> {
        let shown = self.cells.iter().filter(|(extent, _)| {
            let in_inner = inner.is_some_and(|inner| contains(inner, *extent));
            !in_inner && !cut.hides(*extent)
        });
        let triangles: Vec<[u32; 3]> = shown
            .flat_map(|(_, [a, b, c, d])| [[*a, *b, *c], [*a, *c, *d]])
            .collect();
        match triangles.is_empty() {
            true => self.clear_entry(log),
            false => {
                let mesh = Mesh3D::update_fields().with_triangle_indices(triangles);
                log.log_static(&self.entity, TRIANGLES, &mesh)
            }
        }
    }

    /// Returns the entry without triangles. The viewer would draw the vertices of an empty mesh as
    /// triangles.
    fn clear_entry(&self, log: &Log) -> Result<Entry> {
        let mesh = Mesh3D::update_fields().with_triangle_indices([[0, 0, 0]]);
        log.log_static(&self.entity, TRIANGLES, &mesh)
    }

    /// Returns the entry without samples, for a block without triangles.
    fn forgotten(&self, log: &Log) -> Result<Entry> {
        let mesh = Mesh3D::update_fields()
            .with_vertex_positions([[0.0; 3]])
            .with_vertex_texcoords([[0.0; 2]])
            .with_albedo_texture_image(Image::from_rgb24(vec![0; 3], [1, 1]));
        log.log_static(&self.entity, MESH, &mesh)
    }
}

fn contains(outer: [i32; 4], [west, south, east, north]: [i32; 4]) -> bool {
    let [w, s, e, n] = outer;
    west >= w && south >= s && east <= e && north <= n
}

impl Cut {
    /// Returns true if a cell of a mesh is within a shown tile. Cells of the finest layer are not
    /// larger than a tile; a larger one is never under a single tile, and stays.
    fn hides(&self, [west, south, east, north]: [i32; 4]) -> bool {
        let side = self.side.max(1);
        let first = |cell: i32| cell.div_euclid(side).saturating_mul(side);
        let low = [west, south].map(first);
        low == [east - 1, north - 1].map(first) && self.tiles.contains(&low)
    }

    /// Returns the squares that only one of the two hides.
    fn changes_to(&self, other: &Self) -> Vec<([i32; 2], i32)> {
        let squares = |cut: &Self| -> BTreeSet<_> {
            let side = cut.side;
            cut.tiles.iter().map(|tile| (*tile, side)).collect()
        };
        let (ours, theirs) = (squares(self), squares(other));
        ours.symmetric_difference(&theirs).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mesh_includes_the_last_sample_and_is_not_too_fine() {
        for samples in [2, 3, 33, 321, 322, 1000, 1025] {
            let every = mesh_step(samples);
            let lines = lines(samples, every);
            assert!(lines.len() <= MESH_CELLS + 2, "{samples}");
            assert_eq!(
                (lines.first(), lines.last()),
                (Some(&0), Some(&(samples - 1)))
            );
            assert!(lines.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    #[test]
    fn tile_hides_only_the_cells_under_it() {
        let cut = Cut {
            side: 32,
            tiles: BTreeSet::from([[32, 32]]),
        };
        assert!(cut.hides([32, 32, 36, 36]));
        assert!(cut.hides([60, 60, 64, 64]));
        assert!(!cut.hides([28, 32, 32, 36]));
        assert!(!cut.hides([64, 32, 68, 36]));
        assert!(!cut.hides([0, 0, 64, 64]));
    }

    #[test]
    fn tiles_of_another_level_update_the_hidden_cells() {
        let cut = |side, tile| Cut {
            side,
            tiles: BTreeSet::from([tile]),
        };
        let changed = cut(32, [32, 32]).changes_to(&cut(64, [64, 0]));
        assert_eq!(changed, [([32, 32], 32), ([64, 0], 64)]);
        assert_eq!(cut(32, [32, 32]).changes_to(&cut(32, [32, 32])), []);
        let block = Block {
            entity: String::new(),
            cells: vec![],
            extent: [0, 0, 40, 40],
        };
        assert!(block.has(changed[0]) && !block.has(changed[1]));
    }

    /// Creates a layer with a sample every `step` cells, from cell `first`.
    fn layer(number: u32, first: i32, step: i32, posts: u32) -> Layer {
        Layer {
            number,
            first: [first; 2],
            step,
            columns: posts,
            rows: posts,
            heights: (0..posts * posts).map(|i| (i % 97) as f32).collect(),
        }
    }

    /// Returns the visible triangles of each key after these entries.
    fn cell_counts(layers: &Layers) -> Vec<usize> {
        let shown = |(number, layer): (usize, &Shown)| {
            let inner = layers.inner(number);
            let cells = layer.blocks.iter().flat_map(|block| &block.cells);
            let is_shown = |cell: [i32; 4]| !inner.is_some_and(|inner| contains(inner, cell));
            cells.filter(|(cell, _)| is_shown(*cell)).count()
        };
        layers.layers.iter().enumerate().map(shown).collect()
    }

    #[test]
    fn position_has_the_height_of_its_finest_layer() {
        let ground = Ground::new(&super::super::ground::tests::scene());
        // Heights that encode their position and layer.
        let reported = |number: u32, first: i32, step: i32, posts: i32| Layer {
            heights: (0..posts * posts)
                .map(|i| (first + step * (i % posts)) as f32 + 1000.0 * number as f32)
                .collect(),
            ..layer(number, first, step, posts as u32)
        };
        let mut layers = Layers {
            reported: vec![reported(0, 0, 16, 5), reported(1, 16, 2, 9)],
            ..Layers::default()
        };
        let unit = ground.heights_of(&[1.0])[0];
        let up = |layers: &Layers, x: f64, y: f64| layers.up_at(&ground, [x, y]);
        let is = |found: Option<f32>, units: f32| {
            let found = found.expect("a height");
            assert!(
                (found - units * unit).abs() < 1e-4 * unit * units.max(1.0),
                "{found}"
            );
        };
        assert_eq!(layers.extent(), Some([0, 0, 64, 64]));
        is(up(&layers, 3.0, 50.0), 3.0);
        is(up(&layers, 64.0, 64.0), 64.0);
        is(up(&layers, 21.5, 17.3), 1021.5);
        is(up(&layers, 40.0, 17.0), 40.0);
        for outside in [[-0.1, 5.0], [64.1, 5.0], [5.0, 70.0]] {
            assert_eq!(up(&layers, outside[0], outside[1]), None);
        }
        // No-data, and the cells beside it.
        layers.reported.truncate(1);
        layers.reported[0].heights[0] = f32::NAN;
        assert_eq!(up(&layers, 3.0, 3.0), None);
        is(up(&layers, 20.0, 20.0), 20.0);
    }

    #[test]
    fn moved_finer_layer_leaves_no_gap_or_leftover() {
        let (log, mut layers) = (Log::new(), Layers::default());
        let ground = Ground::new(&super::super::ground::tests::scene());
        let put = |layers: &mut Layers, layer| {
            let entries = layers.put(&log, &ground, layer).expect("it is drawn");
            let keys = entries.into_iter().filter_map(|entry| entry.key);
            keys.collect::<Vec<_>>()
        };
        put(&mut layers, layer(0, 0, 16, 65));
        assert_eq!(cell_counts(&layers), [64 * 64]);
        // 512 cells replace 32 × 32 coarse ones, in several blocks.
        put(&mut layers, layer(1, 0, 8, 65));
        assert_eq!(cell_counts(&layers), [64 * 64 - 32 * 32, 64 * 64]);
        let blocks = layers.layers[1].blocks.len();
        assert_eq!(blocks, 4);
        // Smaller, and elsewhere: the area of the previous one is drawn again.
        let keys = put(&mut layers, layer(1, 512, 8, 33));
        assert_eq!(cell_counts(&layers), [64 * 64 - 16 * 16, 32 * 32]);
        let [whole, cut] = ["terrain/layer0/0 triangles"; 2];
        let at = |key: &str| keys.iter().position(|other| other == key);
        let last = |key: &str| keys.iter().rposition(|other| other == key);
        let (whole, cut) = (at(whole).expect("whole"), last(cut).expect("cut"));
        for block in 0..blocks {
            let mesh = at(&format!("terrain/layer1/{block} mesh")).expect("drawn");
            let removed = at(&format!("terrain/layer1/{block} triangles"));
            let removed = removed.expect("taken out");
            assert!(whole < removed && removed < mesh && mesh < cut, "{keys:?}");
        }
        // A layer that does not follow the last number is ignored.
        assert!(put(&mut layers, layer(3, 0, 2, 33)).is_empty());
        // The coarsest again: the finer ones belong to another terrain.
        put(&mut layers, layer(0, 0, 16, 65));
        assert_eq!(cell_counts(&layers), [64 * 64]);
    }
}
