//! One terrain, one kind of reading and one latency: measured by a process of its own, so that its
//! memory is that of this case alone.

use std::path::Path;
use std::time::Instant;

use hapterra::terrain::{HapticCells, HapticGrid, Terrain};
use heightfield::{OpenOptions, Raster};
use serde::{Deserialize, Serialize};

use super::chain::{Chain, Pace, SentTile, board};
use super::hand::{Hand, LateTile};
use super::hip_path::{HipPath, HipPaths};
use super::measurement::{Reading, Row};
use super::meter::{Meter, Traffic, peak_bytes};
use super::run::{self, fastest};
use super::tick_counts::TickCounts;
use super::{CELL_MM, DEFAULT_SPEED, MeasureError, RATES, SPEEDS};

/// Case of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Case {
    /// Name of the terrain.
    pub(super) terrain: String,
    /// The file: a path, or a URL.
    pub(super) source: String,
    /// File of the HIP's paths.
    pub(super) paths_file: String,
    /// Reading of the file.
    pub(super) reading: Reading,
    /// Delay of the server, ms.
    pub(super) latency_ms: u32,
    /// Steps of the bisection for the fastest speed.
    pub(super) halvings: u32,
    /// True if virtual time stops while a block is read.
    pub(super) stands_while_reading: bool,
}

impl Case {
    /// Returns the options of a terrain.
    pub(super) fn options(reading: Reading) -> OpenOptions {
        OpenOptions {
            max_in_memory_bytes: match reading {
                Reading::Blocks => 0,
                Reading::Whole => u64::MAX,
            },
            ..OpenOptions::default()
        }
    }

    /// Returns the pace of this case in place of `pace`.
    const fn pace(&self, pace: Pace) -> Pace {
        match self.stands_while_reading {
            true => Pace::Paused,
            false => pace,
        }
    }

    fn is_remote(&self) -> bool {
        self.source.contains("://")
    }

    fn open(&self) -> Result<Raster, MeasureError> {
        if !self.is_remote() {
            drop_page_cache(Path::new(&self.source));
        }
        let options = Self::options(self.reading);
        Raster::open(&self.source, &options).map_err(|error| MeasureError(error.to_string()))
    }

    /// Measures everything, and calls `done` with a row for each link.
    ///
    /// # Errors
    /// If the file cannot be read, the arm does not reach the paths, or a session ends.
    pub(super) fn measure(&self, mut done: impl FnMut(Row)) -> Result<(), MeasureError> {
        let paths = HipPaths::read(Path::new(&self.paths_file))?;
        let hand = Hand::over(&paths);
        let benches = RATES.map(|kb_per_s| Bench {
            case: self,
            paths: &paths,
            hand: &hand,
            kb_per_s,
        });
        // Before the motions, whose many devices are kept until the program ends.
        let rows: Vec<Row> = benches.iter().map(Bench::first).collect::<Result<_, _>>()?;
        for (bench, mut row) in benches.iter().zip(rows) {
            if self.reading == Reading::Blocks {
                bench.motions(&mut row)?;
            }
            done(row);
        }
        Ok(())
    }
}

/// Returns a raster as a terrain true to scale, at the measured size in the hand.
///
/// # Errors
/// If it cannot be rendered at this scale.
pub(super) fn terrain(raster: &Raster) -> Result<Terrain<'_>, MeasureError> {
    let grid = HapticGrid::new(raster, HapticCells::default());
    let scale = grid
        .true_scale(CELL_MM)
        .map_err(|error| MeasureError(error.to_string()))?;
    Terrain::over(grid, scale, 0).map_err(|error| MeasureError(error.to_string()))
}

/// One link's measurements of a case.
struct Bench<'c> {
    case: &'c Case,
    paths: &'c HipPaths,
    hand: &'c Hand,
    kb_per_s: u32,
}

/// A session from the opening of the file to the end of a motion.
struct Motion {
    counts: TickCounts,
    tiles: Vec<SentTile>,
    /// The ticks in which the motion began and ended.
    motion_ticks: [u64; 2],
    host_ms: Vec<f64>,
}

impl Bench<'_> {
    /// Opens the file, touches it in real time, and if it is read in blocks moves over the straight
    /// path once: the row's times, memory and traffic.
    fn first(&self) -> Result<Row, MeasureError> {
        let case = self.case;
        let meter = match case.is_remote() {
            true => Meter::Server,
            false => Meter::System,
        };
        let board = board();
        let before = meter.traffic()?;
        let started = Instant::now();
        let raster = case.open()?;
        let open_ms = ms_since(started);
        let opened = meter.traffic()?;
        let started = Instant::now();
        let terrain = terrain(&raster)?;
        let scene = self.hand.scene(&terrain, LateTile::Fallback)?;
        let terrain = terrain.non_blocking();
        let pace = case.pace(Pace::Real);
        let mut chain = Chain::new(&terrain, scene, board, self.bytes_a_tick(), pace);
        run::touch(&mut chain, self.hand, &self.paths.straight)?;
        let first_force_ms = ms_since(started);
        let mut row = Row::of_opening(case, self.kb_per_s, &terrain, [open_ms, first_force_ms]);
        if case.reading == Reading::Blocks {
            chain.set_pace(case.pace(Pace::Virtual));
            let (path, speed) = (&self.paths.straight, f64::from(DEFAULT_SPEED));
            let (counts, motion_ticks) = run::travel(&mut chain, self.hand, path, speed, false)?;
            row.set_tiles(&Motion::of(chain, counts, motion_ticks));
        }
        row.peak_mb = peak_bytes().map(|bytes| round(bytes as f64 / 1e6));
        row.set_traffic(before, opened, meter.traffic()?);
        Ok(row)
    }

    /// Measures speeds without missing tiles, and missing tiles.
    fn motions(&self, row: &mut Row) -> Result<(), MeasureError> {
        let HipPaths { straight, turning } = self.paths;
        row.straight_cells = Some(straight.cells() as u32);
        row.turning_cells = Some(turning.cells() as u32);
        let top = self.motion(straight, run::SPEEDS[1], LateTile::NoData, false)?;
        let motion_ticks = top.motion_ticks;
        let is_in_motion =
            |tile: &&SentTile| (motion_ticks[0]..motion_ticks[1]).contains(&tile.tick);
        let tiles = top.tiles.iter().filter(is_in_motion).count() as f64;
        row.tiles_per_s = Some(round(
            1e3 * tiles / (motion_ticks[1] - motion_ticks[0]) as f64,
        ));
        let missing = |path, speed: u32| {
            let motion = self.motion(path, speed.into(), LateTile::NoData, false)?;
            Ok::<_, MeasureError>(Some(motion.counts.missing))
        };
        row.missing_straight_500 = missing(straight, SPEEDS[0])?;
        row.missing_straight_2000 = missing(straight, SPEEDS[1])?;
        row.missing_straight_5000 = missing(straight, SPEEDS[2])?;
        row.missing_turning_500 = missing(turning, SPEEDS[0])?;
        row.missing_turning_2000 = missing(turning, SPEEDS[1])?;
        row.missing_turning_5000 = missing(turning, SPEEDS[2])?;
        let max_speed = |path| {
            let is_complete = |speed| {
                Ok(self
                    .motion(path, speed, LateTile::NoData, true)?
                    .counts
                    .missing
                    == 0)
            };
            Ok::<_, MeasureError>(Some(fastest(self.case.halvings, is_complete)?.round()))
        };
        row.held_straight = max_speed(straight)?;
        row.held_turning = max_speed(turning)?;
        self.underlaid(row)
    }

    /// Measures ticks over a fallback, and ticks without terrain.
    fn underlaid(&self, row: &mut Row) -> Result<(), MeasureError> {
        let HipPaths { straight, turning } = self.paths;
        let fastest = self.motion(straight, run::SPEEDS[1], LateTile::Fallback, false)?;
        let mut no_data = fastest.counts.missing;
        let mut coarse = |path, speed: u32| {
            let counts = self
                .motion(path, speed.into(), LateTile::Fallback, false)?
                .counts;
            no_data += counts.missing;
            Ok::<_, MeasureError>(Some(counts.coarse))
        };
        row.coarse_straight_500 = coarse(straight, SPEEDS[0])?;
        row.coarse_straight_2000 = coarse(straight, SPEEDS[1])?;
        row.coarse_straight_5000 = coarse(straight, SPEEDS[2])?;
        row.coarse_turning_500 = coarse(turning, SPEEDS[0])?;
        row.coarse_turning_2000 = coarse(turning, SPEEDS[1])?;
        row.coarse_turning_5000 = coarse(turning, SPEEDS[2])?;
        row.no_data_over_fallback = Some(no_data);
        Ok(())
    }

    /// Returns the bytes on the link in a tick of 1 ms.
    const fn bytes_a_tick(&self) -> usize {
        self.kb_per_s as usize
    }

    /// Runs a motion in a session of its own, with no data of the file cached.
    fn motion(
        &self,
        path: &HipPath,
        speed: f64,
        late_tile: LateTile,
        stop_at_no_data: bool,
    ) -> Result<Motion, MeasureError> {
        let raster = self.case.open()?;
        let terrain = terrain(&raster)?;
        let scene = self.hand.scene(&terrain, late_tile)?;
        let terrain = terrain.non_blocking();
        let pace = self.case.pace(Pace::Virtual);
        let mut chain = Chain::new(&terrain, scene, board(), self.bytes_a_tick(), pace);
        run::touch(&mut chain, self.hand, path)?;
        let (counts, motion_ticks) =
            run::travel(&mut chain, self.hand, path, speed, stop_at_no_data)?;
        Ok(Motion::of(chain, counts, motion_ticks))
    }
}

impl Motion {
    fn of(chain: Chain<'_>, counts: TickCounts, motion_ticks: [u64; 2]) -> Self {
        let host = chain.host.iter().map(|spent| 1e3 * spent.as_secs_f64());
        Self {
            counts,
            motion_ticks,
            host_ms: host.collect(),
            tiles: chain.tiles,
        }
    }
}

impl Row {
    /// Returns a row with only the figures of the opening.
    fn of_opening(
        case: &Case,
        kb_per_s: u32,
        terrain: &Terrain<'_>,
        [open_ms, first_force_ms]: [f64; 2],
    ) -> Self {
        let raster = terrain.raster();
        Self {
            terrain: case.terrain.clone(),
            // Some formats are always read as a whole.
            reading: match raster.is_summary_complete() {
                true => Reading::Whole,
                false => case.reading,
            },
            latency_ms: case.latency_ms,
            link_kb_per_s: kb_per_s,
            samples: u64::from(raster.columns()) * u64::from(raster.rows()),
            open_ms: round(open_ms),
            first_force_ms: round(first_force_ms),
            ..Self::default()
        }
    }

    fn set_traffic(
        &mut self,
        before: Option<Traffic>,
        opened: Option<Traffic>,
        after: Option<Traffic>,
    ) {
        let between = |from: Option<Traffic>, to: Option<Traffic>| {
            let (from, to) = (from?, to?);
            Some((to.requests - from.requests, to.bytes - from.bytes))
        };
        (self.open_requests, self.open_bytes) = between(before, opened).unzip();
        (self.way_requests, self.way_bytes) = between(opened, after).unzip();
    }

    fn set_tiles(&mut self, motion: &Motion) {
        let mut bytes: Vec<usize> = motion.tiles.iter().map(|tile| tile.bytes).collect();
        bytes.sort_unstable();
        let count = bytes.len().max(1) as f64;
        let sum = bytes.iter().sum::<usize>() as f64;
        self.tiles = Some(bytes.len() as u64);
        self.tile_bytes_mean = Some(round(sum / count));
        let p99 = bytes.get((0.99 * (count - 1.0)).round() as usize);
        self.tile_bytes_p99 = p99.map(|bytes| *bytes as u64);
        let host = &motion.host_ms;
        let mean = host.iter().sum::<f64>() / host.len().max(1) as f64;
        self.host_ms_mean = Some(round(mean));
        self.host_ms_worst = host.iter().copied().reduce(f64::max).map(round);
    }
}

fn ms_since(started: Instant) -> f64 {
    1e3 * started.elapsed().as_secs_f64()
}

/// Rounds to a hundredth.
fn round(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

/// Requests that the system drops its cache of a file, so that it is read from the disk. If the
/// system keeps the cache, the file is read from memory.
#[cfg(unix)]
fn drop_page_cache(path: &Path) {
    use rustix::fs::{Advice, fadvise};
    if let Ok(file) = std::fs::File::open(path) {
        let _ = fadvise(&file, 0, None, Advice::DontNeed);
    }
}

#[cfg(not(unix))]
fn drop_page_cache(_: &Path) {}
