//! Measurements of one terrain, over one latency and one link.

use serde::{Deserialize, Serialize};

/// A row of the table. Times depend on this machine; all other figures are counts, the same in
/// every run if the file is on disk.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the terrain.
    pub terrain: String,
    /// Reading of the file: `blocks` on demand, or `whole` before the session.
    pub reading: Reading,
    /// Latency of a web server, ms; 0 for a file on disk.
    pub latency_ms: u32,
    /// Bandwidth of the link to the device each way, 1,000 bytes a second.
    pub link_kb_per_s: u32,
    /// Samples of the terrain.
    pub samples: u64,
    /// Opening the file, ms.
    pub open_ms: f64,
    /// Time from there until the host receives the first contact, ms.
    pub first_force_ms: f64,
    /// Peak memory of the process up to then, 10⁶ bytes, with the device in it; `None` if the
    /// system does not report it.
    pub peak_mb: Option<f64>,
    /// Requests to the server, or reads of a file, during the opening.
    pub open_requests: Option<u64>,
    /// Bytes of these.
    pub open_bytes: Option<u64>,
    /// Requests or reads from then on: a touch, and the straight path at [`DEFAULT_SPEED`] cells a
    /// second.
    ///
    /// [`DEFAULT_SPEED`]: super::DEFAULT_SPEED
    pub way_requests: Option<u64>,
    /// Bytes of these.
    pub way_bytes: Option<u64>,
    /// Cells of the straight path; empty, like the next figures, without a measured motion.
    pub straight_cells: Option<u32>,
    /// Cells of the turning path.
    pub turning_cells: Option<u32>,
    /// Tiles sent for a touch and the straight path at [`DEFAULT_SPEED`](super::DEFAULT_SPEED)
    /// cells a second.
    pub tiles: Option<u64>,
    /// Mean bytes of their frames.
    pub tile_bytes_mean: Option<f64>,
    /// 99th percentile of the bytes of their frames.
    pub tile_bytes_p99: Option<u64>,
    /// Tiles a second while the HIP outruns the link, 20,000 cells a second on the straight path.
    pub tiles_per_s: Option<f64>,
    /// Mean time of the host for a tick that requests tiles, ms, in the same run.
    pub host_ms_mean: Option<f64>,
    /// Largest such time, ms.
    pub host_ms_worst: Option<f64>,
    /// Fastest HIP without a missing tick on the straight path, cells a second.
    pub held_straight: Option<f64>,
    /// The same on the turning path.
    pub held_turning: Option<f64>,
    /// Without a fallback: ticks with missing terrain, on the straight path at 500 cells a second.
    pub missing_straight_500: Option<u32>,
    /// At 2,000 cells a second.
    pub missing_straight_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub missing_straight_5000: Option<u32>,
    /// On the turning path at 500 cells a second.
    pub missing_turning_500: Option<u32>,
    /// At 2,000 cells a second.
    pub missing_turning_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub missing_turning_5000: Option<u32>,
    /// With a fallback: ticks on it or on a tile that blends from it, on the straight path at 500
    /// cells a second.
    pub coarse_straight_500: Option<u32>,
    /// At 2,000 cells a second.
    pub coarse_straight_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub coarse_straight_5000: Option<u32>,
    /// On the turning path at 500 cells a second.
    pub coarse_turning_500: Option<u32>,
    /// At 2,000 cells a second.
    pub coarse_turning_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub coarse_turning_5000: Option<u32>,
    /// With a fallback: ticks without any terrain, in these six motions and one of 20,000 cells a
    /// second.
    pub no_data_over_fallback: Option<u32>,
}

impl Row {
    /// Returns the ticks over a fallback, in the order of [`Row::missing`].
    #[must_use]
    pub const fn coarse(&self) -> [[Option<u32>; 3]; 2] {
        [
            [
                self.coarse_straight_500,
                self.coarse_straight_2000,
                self.coarse_straight_5000,
            ],
            [
                self.coarse_turning_500,
                self.coarse_turning_2000,
                self.coarse_turning_5000,
            ],
        ]
    }

    /// Returns the missing ticks of the straight and the turning path, at the speeds of
    /// [`SPEEDS`](super::SPEEDS).
    #[must_use]
    pub const fn missing(&self) -> [[Option<u32>; 3]; 2] {
        [
            [
                self.missing_straight_500,
                self.missing_straight_2000,
                self.missing_straight_5000,
            ],
            [
                self.missing_turning_500,
                self.missing_turning_2000,
                self.missing_turning_5000,
            ],
        ]
    }
}

/// Reading of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reading {
    /// In blocks, on demand.
    #[default]
    Blocks,
    /// As a whole into memory, before the rendering.
    Whole,
}

impl Reading {
    /// Returns its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blocks => "blocks",
            Self::Whole => "whole",
        }
    }
}
