//! Terrain larger than memory and farther away than the disk: the cost of opening, memory, tiles
//! and the speed of the hand, by the size of the file and the latency of its server.
//!
//! - `relief`, `cog`: terrains of 10⁶ to 10¹⁰ samples, whose blocks repeat;
//! - `hip_path`, `hand`: the path of the HIP, and the encoder counts along it;
//! - `chain`, `link`: the host's own code, a link of a stated rate in virtual time, and the device's
//!   own application;
//! - `tick_counts`: the ticks on tiles, on the fallback and without ground;
//! - `run`, `case`: the measurements of one terrain, in a process of its own;
//! - `server`: a web server with latency, with the feature `remote`;
//! - `meter`, `processes`: memory and bytes, and all cases in turn.

mod case;
mod chain;
mod cog;
mod hand;
mod hip_path;
mod link;
mod measurement;
mod meter;
mod processes;
mod relief;
mod run;
#[cfg(feature = "remote")]
mod server;
mod tick_counts;

pub use crate::effects::MeasureError;
pub use measurement::{Reading, Row};
pub use processes::{measure, measure_case};

/// Side of a cell in the hand, millimetres: a path of 2,800 cells is 140 mm long, within the arm's
/// reach, and 20,000 cells a second are 1 m/s.
const CELL_MM: f64 = 0.05;
/// Sides of the synthetic terrains, samples: 10⁶, 10⁷, 10⁸, 10⁹ and 10¹⁰ of them to within 5 %, in
/// whole tiles.
pub const SIDES: [u32; 5] = [1024, 3168, 10_016, 31_648, 100_000];
/// Latencies of a web server, ms; 0 is a file on disk.
pub const LATENCIES_MS: [u32; 5] = [0, 20, 50, 100, 200];
/// Links, 1,000 bytes a second each way: full-speed USB, and a slow serial line.
pub const RATES: [u32; 2] = [1000, 200];
/// Speeds at which missing ticks are counted, cells a second.
pub const SPEEDS: [u32; 3] = [500, 2_000, 5_000];
/// The speed of the run in which tiles and bytes are counted, cells a second.
pub const DEFAULT_SPEED: u32 = SPEEDS[1];

/// Plan of the measurements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Sizes of the synthetic terrains, as powers of ten, 6 to 10.
    pub exponents: Vec<u32>,
    /// Latencies, ms.
    pub latencies_ms: Vec<u32>,
    /// Steps of the bisection for the highest speed: six find it within 9 %, four within 40 %.
    pub halvings: u32,
    /// True if virtual time stops while a block of a file is read, so that counts do not depend on
    /// the machine. A web server's latency still counts.
    pub stands_while_reading: bool,
}
