//! Size of a file's tiles on the link, and the speed of the HIP that they allow.

use serde::Serialize;

use hapterra_core::terrain::{MARGIN_CELLS, TILE_CELLS, TILE_SAMPLES, TileKey};
use hapterra_core::wire::frame::{MAX_FRAME, encode};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice};
use hapterra_core::wire::session::{InSession, SessionNumber};
use heightfield::ReadStatus;

use crate::terrain::{HapticGrid, Terrain, TerrainError, TileBuffer};

/// Maximum tiles examined; of more, an evenly spread selection.
const MAX_TILES: u64 = 8192;

/// Figures of the level-0 tiles, true to scale with cells of 1 mm. No-data tiles and flat tiles, of
/// a few bytes, are not included.
#[derive(Serialize)]
pub(super) struct LinkFigures {
    /// Rate of the link, megabytes (10⁶ bytes) a second.
    mb_per_s: f64,
    /// Number of tiles included.
    tiles: u64,
    /// Number of flat and no-data tiles examined.
    others: u64,
    /// Number of tiles examined that cannot be read at present.
    unread: u64,
    /// The format on the link.
    sent: Form,
    /// Each sample as a single float.
    floats: Form,
}

/// A format of tiles.
#[derive(Serialize)]
struct Form {
    /// Bytes of a tile's frame: mean and maximum.
    mean_bytes: f64,
    worst_bytes: u64,
    /// Mean rate of the link.
    tiles_per_s: f64,
    /// Maximum speed along an axis at which tiles arrive in time, by the mean.
    cells_per_s: f64,
}

impl LinkFigures {
    /// Returns the figures of a grid's tiles on a link.
    ///
    /// # Errors
    /// The file cannot be rendered true to scale.
    pub(super) fn of(grid: &HapticGrid<'_>, mb_per_s: f64) -> Result<Self, TerrainError> {
        let scale = grid.true_scale(1.0)?;
        let terrain = Terrain::over(*grid, scale, 0)?;
        let [columns, rows] = terrain
            .size()
            .map(|cells| (cells.unsigned_abs() as usize).div_ceil(TILE_CELLS) as u64);
        let stride = (columns * rows).div_ceil(MAX_TILES) as usize;
        let mut buffer = TileBuffer::default();
        let (mut tiles, mut others, mut unread) = (0, 0, 0);
        let (mut sum, mut worst) = (0, 0);
        for at in (0..columns * rows).step_by(stride) {
            let key = TileKey::new(0, (at % columns) as i32, (at / columns) as i32);
            match terrain.tile(key, &mut buffer) {
                // A tile that a server did not send has no size to include.
                Some((_, ReadStatus::Pending)) => unread += 1,
                None | Some((Heights::NoData | Heights::Flat { .. }, _)) => others += 1,
                Some((heights, _)) => {
                    let bytes = frame_bytes(key, heights);
                    (tiles, sum, worst) = (tiles + 1, sum + bytes, worst.max(bytes));
                }
            }
        }
        let bytes = [1; 4 * TILE_SAMPLES * TILE_SAMPLES];
        let floats = frame_bytes(
            TileKey::new(0, 0, 0),
            Heights::Samples {
                base: 0,
                bytes: &bytes,
            },
        );
        Ok(Self {
            mb_per_s,
            tiles,
            others,
            unread,
            sent: Form::new(sum as f64 / tiles.max(1) as f64, worst, mb_per_s),
            floats: Form::new(floats as f64, floats, mb_per_s),
        })
    }

    pub(super) fn lines(&self) -> [String; 2] {
        let Self {
            mb_per_s,
            tiles,
            others,
            unread,
            ..
        } = self;
        let unread = match unread {
            0 => String::new(),
            unread => format!(", {unread} that cannot be read at present"),
        };
        let what = |form: &Form, of: String| {
            format!(
                "{:.0} bytes a tile, at worst {}; at {mb_per_s} MB/s {:.0} tiles and {:.0} cells along an axis a second: {of}",
                form.mean_bytes, form.worst_bytes, form.tiles_per_s, form.cells_per_s
            )
        };
        [
            what(
                &self.sent,
                format!("packed, {tiles} tiles and {others} of a few bytes{unread}"),
            ),
            what(&self.floats, "each sample a float".into()),
        ]
    }
}

impl Form {
    fn new(mean_bytes: f64, worst_bytes: u64, mb_per_s: f64) -> Self {
        let tiles_per_s = match mean_bytes > 0.0 {
            true => mb_per_s * 1e6 / mean_bytes,
            false => 0.0,
        };
        Self {
            mean_bytes,
            worst_bytes,
            tiles_per_s,
            cells_per_s: tiles_per_s * TILE_CELLS as f64 / f64::from(tiles_across()),
        }
    }
}

/// Returns the maximum tiles of a new column that the HIP requests in motion along a row: those
/// within the margin on both sides.
const fn tiles_across() -> i32 {
    (2 * MARGIN_CELLS + TILE_CELLS as i32 - 1) / TILE_CELLS as i32 + 1
}

/// Returns the bytes of a tile's frame.
fn frame_bytes(key: TileKey, heights: Heights<'_>) -> u64 {
    let message = InSession {
        session: SessionNumber::new(u32::MAX),
        message: ToDevice::Tile(TileMessage {
            epoch: u32::MAX,
            key,
            heights,
        }),
    };
    encode(&message, &mut [0; MAX_FRAME]).map_or(0, <[u8]>::len) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::HapticCells;
    use crate::terrain::in_file::in_file;
    use heightfield::{Raster, Wait};

    #[test]
    fn hip_along_an_axis_requests_two_tiles_every_32_cells() {
        assert_eq!(tiles_across(), 2);
        let metres = Raster::from_fn(100, 70, |x, y| (x * y % 50) as f32).expect("raster");
        let grid = HapticGrid::new(&metres, HapticCells::Square);
        let figures = LinkFigures::of(&grid, 2.0).expect("figures");
        assert_eq!((figures.tiles, figures.others), (12, 0));
        let floats = &figures.floats;
        assert!((4356..4450).contains(&floats.worst_bytes));
        let cells = 2e6 / floats.mean_bytes * 16.0;
        assert!((floats.cells_per_s - cells).abs() < 1e-6);
        assert!(figures.sent.worst_bytes < floats.worst_bytes / 2);
        assert!(figures.sent.mean_bytes <= figures.sent.worst_bytes as f64);
    }

    #[test]
    fn flat_and_no_data_tiles_are_excluded_from_link_figures() {
        let level = Raster::from_fn(70, 70, |x, _| if x > 40 { f32::NAN } else { 3.0 });
        let level = level.expect("raster");
        let figures = LinkFigures::of(&HapticGrid::new(&level, HapticCells::Square), 1.0);
        let figures = figures.expect("figures");
        assert_eq!((figures.tiles, figures.others), (3, 6));
    }

    #[test]
    fn pending_tiles_are_not_tiles_without_a_surface() {
        let folder = tempfile::tempdir().expect("a folder");
        let hills = in_file(folder.path(), [600, 600], |x, y| (x * y % 50) as f32);
        let grid = HapticGrid::new(&hills, HapticCells::Square).with_wait(Wait::Never);
        let figures = LinkFigures::of(&grid, 1.0).expect("figures");
        // A background read may finish early, but the first is always unread.
        assert!(figures.unread > 0);
        assert_eq!((figures.tiles + figures.unread, figures.others), (361, 0));
        let [line, _] = figures.lines();
        assert!(line.contains(" that cannot be read at present"), "{line}");
    }
}
