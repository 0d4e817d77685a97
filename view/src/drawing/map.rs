//! The terrain from above: its relief as a picture, with the hand and the tiles.
//!
//! Positions are pixels of the relief, which is the coarsest layer, north up.

use anyhow::Result;
use hapterra_view_stream::{Layer, Sample, Scene, Tiles};
use re_sdk_types::archetypes::{Boxes2D, Image, LineStrips2D, Points2D};
use re_sdk_types::components::Radius;

use super::captions;
use super::ground::Ground;
use super::hand::HIP;
use super::lengths::{distances, round_below, written};
use super::log::{Entry, Log};
use super::shade::{Heights, Rgb, Shade};

/// Max pixels along the longer side of the relief.
const MAX: usize = 512;
/// Updates of the hand in a second.
const RATE_HZ: f64 = 20.0;
const HELD: Rgb = [64, 224, 208];
const FITTED: Rgb = [190, 200, 210];
const WHITE: Rgb = [255, 255, 255];
/// Maximum length of the scale bar, as a share of the relief's width.
const BAR: f64 = 0.4;
/// Margin beside the relief, and above and below it for coordinates and the bar, as shares of its
/// longer side.
const ROOM: [f32; 2] = [0.02, 0.14];

/// The map.
#[derive(Default)]
pub(super) struct Map {
    frame: Option<Frame>,
    due_s: f64,
}

/// Conversion of cells to pixels.
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

    /// Returns a box: its middle and half its size.
    fn square(&self, low: [f64; 2], high: [f64; 2]) -> ([f32; 2], [f32; 2]) {
        let ([west, south], [east, north]) = (self.pixel(low), self.pixel(high));
        let middle = [0.5 * (west + east), 0.5 * (south + north)];
        (middle, [0.5 * (east - west), 0.5 * (south - north)])
    }
}

impl Frame {
    /// Draws a scale bar below the relief, and coordinates of its south-west and north-east sample.
    fn scale(
        &self,
        log: &Log,
        scene: &Scene,
        ground: &Ground,
        size: [u32; 2],
    ) -> Result<Vec<Entry>> {
        let size = size.map(|pixels| pixels as f32);
        let [width, height] = size;
        let room = ROOM.map(|share| share * width.max(height));
        // This box sets the size of the view, which ignores labels.
        let whole = Boxes2D::from_mins_and_sizes(
            [room.map(|room| -room)],
            [[width + 2.0 * room[0], height + 2.0 * room[1]]],
        );
        let mut entries = vec![
            log.log_static("map/room", "", &whole.with_colors([[0, 0, 0]]))?,
            log.log_static(
                "map/corners",
                "",
                &self.corners(scene, ground, size, room[1]),
            )?,
        ];
        if let Some(bar) = self.bar(scene, ground, size, room[1]) {
            entries.push(log.log_static("map/bar", "", &bar)?);
        }
        Ok(entries)
    }

    /// Returns a bar of a round length below the eastern half of the relief.
    fn bar(
        &self,
        scene: &Scene,
        ground: &Ground,
        [width, height]: [f32; 2],
        room: f32,
    ) -> Option<LineStrips2D> {
        let of_pixel = self.cells * ground.step(1);
        let length = round_below(BAR * f64::from(width) * of_pixel)?;
        let half = (0.5 * length / of_pixel) as f32;
        let strip = [-half, half].map(|right| [0.75 * width + right, height + 0.3 * room]);
        let label = written(length, scene.ground_m_per_mm.is_some());
        Some(
            LineStrips2D::new([strip])
                .with_colors([WHITE])
                .with_radii([Radius::new_ui_points(2.0)])
                .with_labels([label])
                .with_show_labels(true),
        )
    }

    /// Returns the outermost samples' coordinates, below and above the relief, if there is room.
    fn corners(
        &self,
        scene: &Scene,
        ground: &Ground,
        [width, height]: [f32; 2],
        room: f32,
    ) -> Points2D {
        let last = [width, height].map(|pixels| f64::from(pixels - 1.0) * self.cells);
        let [west, south] = self.first;
        let text = |name: &str, cell: [f64; 2]| {
            let [x, y] = cell.map(|cells| cells * scene.cell_mm);
            let coordinates = captions::coordinates(scene, x, y).unwrap_or_else(|| {
                let place = cell.map(|cells| cells * ground.step(1));
                distances(place, scene.ground_m_per_mm.is_some())
            });
            format!("{name} {coordinates}")
        };
        let places = [
            [0.3 * width, height + 0.1 * room],
            [0.7 * width, -0.8 * room],
        ];
        Points2D::new(places)
            .with_colors([WHITE])
            .with_radii([Radius::new_ui_points(0.0)])
            .with_labels([
                text("SW", self.first),
                text("NE", [west + last[0], south + last[1]]),
            ])
            .with_show_labels(true)
    }
}

impl Map {
    /// Draws the coarsest layer as the relief; the others are parts of it. If it is sent again, its
    /// cells differ.
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
        let every = columns.max(rows).div_ceil(MAX).max(1);
        let subsampled = |count: usize| (0..count).step_by(every);
        let up: Vec<f32> = subsampled(rows)
            .flat_map(|row| subsampled(columns).map(move |column| row * columns + column))
            .map(|index| layer.heights.get(index).copied().unwrap_or(f32::NAN))
            .collect();
        let up = ground.heights_of(&up);
        let step = layer.step.saturating_mul(every as i32);
        let heights = Heights {
            columns: subsampled(columns).count(),
            rows: subsampled(rows).count(),
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
        let style = Points2D::update_fields()
            .with_colors([HIP])
            .with_radii([Radius::new_ui_points(6.0)]);
        let mut entries = vec![
            log.log_static("map/relief", "", &Image::from_rgb24(rgb, size))?,
            log.log_static("map/hip", "looks", &style)?,
        ];
        entries.extend(frame.scale(log, scene, ground, size)?);
        entries.extend(self.fitted_area(log, scene)?);
        Ok(entries)
    }

    /// Returns the outline of the terrain in front of the arm.
    pub(super) fn fitted_area(&self, log: &Log, scene: &Scene) -> Result<Option<Entry>> {
        let Some(frame) = self.frame else {
            return Ok(None);
        };
        let [west, south, east, north] = scene.fitted_mm.map(|mm| mm / scene.cell_mm);
        let (middle, half) = frame.square([west, south], [east, north]);
        let reach = Boxes2D::from_centers_and_half_sizes([middle], [half])
            .with_colors([FITTED])
            .with_radii([Radius::new_ui_points(0.7)]);
        log.log_static("map/laid", "", &reach).map(Some)
    }

    /// Returns the square of the visible part, as the frame on the terrain, by its south-west and
    /// north-east corner in cells of level 0; `None` without a frame.
    pub(super) fn visible_box(&self, corners: Option<[[f64; 2]; 2]>) -> Option<Boxes2D> {
        let frame = self.frame?;
        let squares = corners.map(|[low, high]| frame.square(low, high));
        let (middles, halves): (Vec<_>, Vec<_>) = squares.into_iter().unzip();
        Some(
            Boxes2D::from_centers_and_half_sizes(middles, halves)
                .with_colors([WHITE])
                .with_radii([Radius::new_ui_points(1.2)]),
        )
    }

    /// Draws the tiles that the device stores.
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
        Ok(vec![log.log_static("map/held", "", &boxes)?])
    }

    /// Draws the HIP.
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
        Ok(vec![log.log_timed("map/hip", &times, columns)?])
    }
}
