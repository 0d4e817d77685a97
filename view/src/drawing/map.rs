//! The terrain from above: its relief as a picture, and on it the hand and the tiles.
//!
//! Places are pixels of the relief, which is the coarsest layer, north up.

use anyhow::Result;
use hapterra_view_stream::{Layer, Sample, Scene, Tiles};
use re_sdk_types::archetypes::{Boxes2D, Image, Points2D};
use re_sdk_types::components::Radius;

use super::ground::Ground;
use super::hand::PROXY;
use super::log::{Entry, Log};
use super::shade::{Heights, Rgb, Shade};

/// Pixels along the longer side of the relief at most.
const LARGEST: usize = 512;
/// Pictures of the hand in a second.
const RATE_HZ: f64 = 20.0;
const HELD: Rgb = [64, 224, 208];
const REACH: Rgb = [255, 255, 255];

/// What the map shows.
#[derive(Default)]
pub(super) struct Map {
    frame: Option<Frame>,
    due_s: f64,
}

/// From cells to pixels.
#[derive(Clone, Copy)]
struct Frame {
    first: [f64; 2],
    /// Cells in a pixel.
    cells: f64,
    rows: f64,
}

impl Frame {
    fn pixel(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        let [west, south] = self.first;
        let (east, north) = ((x - west) / self.cells, (y - south) / self.cells);
        [east as f32 + 0.5, (self.rows - 0.5 - north) as f32]
    }

    /// A box: its middle and half its size.
    fn square(&self, low: [f64; 2], high: [f64; 2]) -> ([f32; 2], [f32; 2]) {
        let ([west, south], [east, north]) = (self.pixel(low), self.pixel(high));
        let middle = [0.5 * (west + east), 0.5 * (south + north)];
        (middle, [0.5 * (east - west), 0.5 * (south - north)])
    }
}

impl Map {
    /// The coarsest layer is the relief; the others are parts of it. One that comes again is
    /// of other cells.
    pub(super) fn layer(
        &mut self,
        log: &Log,
        scene: &Scene,
        ground: &Ground,
        layer: &Layer,
    ) -> Result<Vec<Entry>> {
        if layer.number > 0 {
            return Ok(Vec::new());
        }
        let (columns, rows) = (layer.columns as usize, layer.rows as usize);
        let every = columns.max(rows).div_ceil(LARGEST).max(1);
        let taken = |count: usize| (0..count).step_by(every);
        let up: Vec<f32> = taken(rows)
            .flat_map(|row| taken(columns).map(move |column| row * columns + column))
            .map(|index| layer.heights.get(index).copied().unwrap_or(f32::NAN))
            .collect();
        let up = ground.heights_of(&up);
        let step = layer.step.saturating_mul(every as i32);
        let heights = Heights {
            columns: taken(columns).count(),
            rows: taken(rows).count(),
            step: ground.step(step),
            up: &up,
        };
        let frame = Frame {
            first: layer.first.map(f64::from),
            cells: f64::from(step),
            rows: heights.rows as f64,
        };
        self.frame = Some(frame);
        let shade = Shade::of(&heights);
        let size = [heights.columns as u32, heights.rows as u32];
        let places = (0..heights.rows)
            .rev()
            .flat_map(|row| (0..heights.columns).map(move |column| (column, row)));
        let rgb: Vec<u8> = places
            .flat_map(|(column, row)| shade.colour(&heights, column, row))
            .collect();
        let looks = Points2D::update_fields()
            .with_colors([PROXY])
            .with_radii([Radius::new_ui_points(5.0)]);
        let mut entries = vec![
            log.standing("map/relief", "", &Image::from_rgb24(rgb, size))?,
            log.standing("map/hip", "looks", &looks)?,
        ];
        entries.extend(self.laid(log, scene)?);
        Ok(entries)
    }

    /// What is laid in front of the arm.
    pub(super) fn laid(&self, log: &Log, scene: &Scene) -> Result<Option<Entry>> {
        let Some(frame) = self.frame else {
            return Ok(None);
        };
        let [west, south, east, north] = scene.laid_mm.map(|mm| mm / scene.cell_mm);
        let (middle, half) = frame.square([west, south], [east, north]);
        let reach = Boxes2D::from_centers_and_half_sizes([middle], [half])
            .with_colors([REACH])
            .with_radii([Radius::new_ui_points(0.7)]);
        log.standing("map/laid", "", &reach).map(Some)
    }

    /// The tiles that the device holds.
    pub(super) fn tiles(&self, log: &Log, ground: &Ground, tiles: &Tiles) -> Result<Vec<Entry>> {
        let Some(frame) = self.frame else {
            return Ok(Vec::new());
        };
        let squares = tiles.held.iter().map(|index| {
            let low = ground.first_cell(*index).map(f64::from);
            frame.square(low, low.map(|cell| cell + f64::from(ground.tile_cells())))
        });
        let (middles, halves): (Vec<_>, Vec<_>) = squares.unzip();
        let boxes = Boxes2D::from_centers_and_half_sizes(middles, halves)
            .with_colors([HELD])
            .with_radii([Radius::new_ui_points(0.7)]);
        Ok(vec![log.standing("map/held", "", &boxes)?])
    }

    /// The HIP.
    pub(super) fn samples(
        &mut self,
        log: &Log,
        scene: &Scene,
        samples: &[Sample],
    ) -> Result<Vec<Entry>> {
        let Some(frame) = self.frame else {
            return Ok(Vec::new());
        };
        let (mut times, mut places) = (Vec::new(), Vec::new());
        for sample in samples {
            if sample.t_s >= self.due_s {
                self.due_s = sample.t_s + 1.0 / RATE_HZ;
                let [x, y, _] = sample.hip_mm;
                times.push(sample.t_s);
                places.push(frame.pixel([x, y].map(|mm| mm / scene.cell_mm)));
            }
        }
        if times.is_empty() {
            return Ok(Vec::new());
        }
        let points = Points2D::update_fields().with_positions(places);
        let columns = points.columns_of_unit_batches()?;
        Ok(vec![log.happened("map/hip", &times, columns)?])
    }
}
