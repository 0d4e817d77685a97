//! Path of the HIP over a terrain, at one depth below the surface.

use std::fmt::Write as _;
use std::path::Path;

use hapterra::terrain::Terrain;

use super::relief::PERIOD;
use super::{CELL_MM, MeasureError};

/// Cells between a path and the border of a field, or of the square that repeats: more than a tile
/// and the margin around the HIP.
const BORDER_MARGIN: u32 = 130;
/// Cells of the straight path, if the field has room for it.
const STRAIGHT_CELLS: u32 = 2800;
/// Side of the square that the turning path crosses, cells, if there is room.
const TURNING_SIDE: u32 = 1400;
/// Fewest cells of a path.
const MIN_CELLS: u32 = 200;
/// Cells after which the turning path turns by a right angle: fewer than a HIP at 2,000 cells a
/// second covers in the time of the device's prediction.
const LEG_CELLS: u32 = 150;
/// Names of the paths in files.
const NAMES: [&str; 2] = ["straight", "turning"];

/// Points on the surface, a cell apart along the path.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HipPath {
    /// Cells east and north of the south-west sample, and height in cells.
    places: Vec<[f64; 3]>,
}

/// The two paths over a terrain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HipPaths {
    /// Along a row of tiles, from west to east.
    pub(super) straight: HipPath,
    /// In steps: east, north, east, each [`LEG_CELLS`] cells long.
    pub(super) turning: HipPath,
}

impl HipPath {
    /// Returns its length, cells.
    pub(super) fn cells(&self) -> f64 {
        (self.places.len() - 1) as f64
    }

    /// Returns the point on the surface at this distance along the path, cells, or its end.
    pub(super) fn at(&self, cells: f64) -> [f64; 3] {
        let along = cells.clamp(0.0, self.cells());
        let first = (along.floor() as usize).min(self.places.len() - 2);
        let part = along - first as f64;
        let [from, to] = [self.places[first], self.places[first + 1]];
        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * part)
    }

    /// Returns the surface under a line of points.
    fn over(
        terrain: &Terrain<'_>,
        places: impl Iterator<Item = [u32; 2]>,
    ) -> Result<Self, MeasureError> {
        let on_surface = |[east, north]: [u32; 2]| {
            let [east, north] = [east, north].map(f64::from);
            let height = terrain.height_mm(east * CELL_MM, north * CELL_MM);
            let why = || {
                let place = format!("at column {east} and row {north} from the south-west");
                MeasureError(format!("it has no data {place}, where the HIP would move"))
            };
            Ok([east, north, height.ok_or_else(why)? / CELL_MM])
        };
        Ok(Self {
            places: places.map(on_surface).collect::<Result<_, _>>()?,
        })
    }
}

impl HipPaths {
    /// Returns the paths over a terrain: in its middle, or where synthetic terrains of any size
    /// have the same samples.
    ///
    /// # Errors
    /// If the terrain is too small, or has no data there.
    pub(super) fn over(terrain: &Terrain<'_>, is_synthetic: bool) -> Result<Self, MeasureError> {
        let size = terrain.size().map(|patches| patches as u32 + 1);
        let space = size[0].min(size[1]).saturating_sub(2 * BORDER_MARGIN);
        if space < MIN_CELLS {
            let min = MIN_CELLS + 2 * BORDER_MARGIN;
            let [columns, rows] = size;
            let has = format!("{columns} × {rows} samples; the paths need {min} along each side");
            return Err(MeasureError(has));
        }
        let (long, side) = (STRAIGHT_CELLS.min(space), TURNING_SIDE.min(space));
        let [west, south] = match is_synthetic {
            true => corner_in_square(size, long),
            false => size.map(|samples| (samples - long) / 2),
        };
        let middle = south + long / 2;
        let steps = (0..2 * side).scan([west, south], |at, step| {
            let now = *at;
            at[(step / LEG_CELLS % 2) as usize] += 1;
            Some(now)
        });
        let inside = |at: &[u32; 2]| at[0] <= west + side && at[1] <= south + side;
        Ok(Self {
            straight: HipPath::over(terrain, (west..=west + long).map(|east| [east, middle]))?,
            turning: HipPath::over(terrain, steps.take_while(inside))?,
        })
    }

    /// Returns the cell in the middle of all points.
    pub(super) fn middle(&self) -> [f64; 3] {
        let all = || self.straight.places.iter().chain(&self.turning.places);
        std::array::from_fn(|axis| {
            let of_axis = || all().map(|place| place[axis]);
            0.5 * (of_axis().fold(f64::MAX, f64::min) + of_axis().fold(f64::MIN, f64::max))
        })
    }

    /// Writes both paths, one point a line.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut text = String::new();
        for (name, path) in NAMES.iter().zip([&self.straight, &self.turning]) {
            for [east, north, height] in &path.places {
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{name} {east} {north} {height}");
            }
        }
        std::fs::write(path, text)
    }

    /// Reads the file from [`HipPaths::write`].
    ///
    /// # Errors
    /// If the file is missing or invalid.
    pub(super) fn read(path: &Path) -> Result<Self, MeasureError> {
        let wrong = |why: String| MeasureError(format!("{}: {why}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
        let place = |line: &str| {
            let mut numbers = line.split(' ').map(str::parse::<f64>);
            let mut next = || numbers.next()?.ok();
            Some([next()?, next()?, next()?])
        };
        let paths = NAMES.map(|name| {
            let lines = text.lines().filter_map(|line| line.strip_prefix(name));
            let places: Option<Vec<_>> = lines.map(|line| place(line.trim_start())).collect();
            let places = places.filter(|places| places.len() > 1);
            places.map(|places| HipPath { places })
        });
        let [Some(straight), Some(turning)] = paths else {
            return Err(wrong("it has no room for two paths".into()));
        };
        Ok(Self { straight, turning })
    }
}

/// Returns the south-west corner of the paths around the middle of a synthetic terrain, whose rows
/// count from the north: the same samples in a terrain of any size with room for them.
fn corner_in_square([columns, rows]: [u32; 2], long: u32) -> [u32; 2] {
    let first = |count: u32| count / 2 / PERIOD * PERIOD + BORDER_MARGIN;
    [first(columns), rows - 1 - first(rows) - long]
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra::terrain::Scale;
    use heightfield::Raster;

    fn paths(columns: u32, rows: u32, is_synthetic: bool) -> Result<HipPaths, MeasureError> {
        let raster = Raster::from_fn(columns, rows, |x, y| x as f32 + 2.0 * y as f32);
        let raster = raster.expect("a field");
        let terrain = Terrain::new(&raster, Scale::new(CELL_MM, 1.0).expect("valid"), 0);
        HipPaths::over(&terrain.expect("a terrain"), is_synthetic)
    }

    #[test]
    fn paths_stay_inside_and_round_trip_through_a_file() {
        let paths = paths(700, 640, false).expect("room");
        assert_eq!(
            (paths.straight.cells(), paths.turning.cells()),
            (380.0, 680.0)
        );
        let all = paths.straight.places.iter().chain(&paths.turning.places);
        for [east, north, height] in all {
            assert!((130.0..=570.0).contains(east) && (130.0..=510.0).contains(north));
            assert!((height - (east + 2.0 * north) / CELL_MM).abs() < 1e-6);
        }
        let near = paths.straight.at(7.25);
        assert!((near[0] - paths.straight.at(7.0)[0] - 0.25).abs() < 1e-9);
        assert_eq!(paths.straight.at(1e9), paths.straight.at(380.0));
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("ways");
        paths.write(&path).expect("written");
        assert_eq!(HipPaths::read(&path).expect("read"), paths);
        std::fs::write(&path, "straight 1 2 3\nstraight 2 2").expect("written");
        assert!(HipPaths::read(&path).is_err());
    }

    #[test]
    fn terrain_without_room_for_the_path_is_refused_by_place() {
        let why = paths(700, 300, false).expect_err("too narrow").to_string();
        assert!(why.contains("700 × 300 samples"), "{why}");
        let raster = Raster::from_fn(640, 640, |x, y| if x + y == 700 { f32::NAN } else { 1.0 });
        let raster = raster.expect("a field");
        let terrain = Terrain::new(&raster, Scale::new(CELL_MM, 1.0).expect("valid"), 0);
        let why = HipPaths::over(&terrain.expect("a terrain"), false).expect_err("a hole");
        assert!(why.to_string().contains("no data at column"), "{why}");
    }

    #[test]
    fn straight_path_crosses_same_samples_at_every_terrain_size() {
        for side in [3168, 10_016, 31_648, 100_000] {
            let [west, south] = corner_in_square([side; 2], STRAIGHT_CELLS);
            let top = side - 1 - south - STRAIGHT_CELLS;
            assert_eq!([west % PERIOD, top % PERIOD], [BORDER_MARGIN; 2]);
            assert!(top + STRAIGHT_CELLS + BORDER_MARGIN <= side);
            // Tiles count from the south: their borders are at the same samples.
            assert_eq!(side % 32, 0);
        }
    }
}
