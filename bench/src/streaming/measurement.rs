//! Measurements of one terrain, over one latency and one link.

use serde::{Deserialize, Serialize};

/// A row of the table. Times are of this machine, all others are counts: the same in every run where
/// nothing is elsewhere.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the terrain.
    pub terrain: String,
    /// Reading of the file: `blocks` when they are touched, or `whole` before the session.
    pub reading: Reading,
    /// Latency of a web server, ms; 0 for a file on disk.
    pub latency_ms: u32,
    /// Bandwidth of the link to the device each way, 1,000 bytes a second.
    pub link_kb_per_s: u32,
    /// Samples of the terrain.
    pub samples: u64,
    /// Opening the file, ms.
    pub open_ms: f64,
    /// From there until the host hears of the first contact, ms.
    pub first_force_ms: f64,
    /// Most memory that the process had so far, 10⁶ bytes, the device in it included; none where the
    /// system does not tell.
    pub peak_mb: Option<f64>,
    /// Requests to the server, or reads of a file, while it was opened.
    pub open_requests: Option<u64>,
    /// Bytes that these brought.
    pub open_bytes: Option<u64>,
    /// Requests or reads from there on: a touch, and the straight way at [`USUAL`] cells a second.
    ///
    /// [`USUAL`]: super::USUAL
    pub way_requests: Option<u64>,
    /// Bytes that these brought.
    pub way_bytes: Option<u64>,
    /// Cells of the straight way; this and what follows is empty where only the first force was measured.
    pub straight_cells: Option<u32>,
    /// Cells of the turning way.
    pub turning_cells: Option<u32>,
    /// Tiles sent for a touch and the straight way at [`USUAL`](super::USUAL) cells a second.
    pub tiles: Option<u64>,
    /// Bytes of their frames, mean.
    pub tile_bytes_mean: Option<f64>,
    /// Bytes of their frames, which 99 % do not exceed.
    pub tile_bytes_p99: Option<u64>,
    /// Tiles a second while the HIP outruns the link, 20,000 cells a second on the straight way.
    pub tiles_per_s: Option<f64>,
    /// Time of the host for a tick that requests tiles, ms: mean of the same run as the tiles.
    pub host_ms_mean: Option<f64>,
    /// The same at worst.
    pub host_ms_worst: Option<f64>,
    /// Fastest HIP without a missing tick on the straight way, cells a second.
    pub held_straight: Option<f64>,
    /// The same on the turning way.
    pub held_turning: Option<f64>,
    /// Without a fallback: ticks whose terrain was missing, of the straight way at 500 cells a second.
    pub missing_straight_500: Option<u32>,
    /// At 2,000 cells a second.
    pub missing_straight_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub missing_straight_5000: Option<u32>,
    /// Of the turning way at 500 cells a second.
    pub missing_turning_500: Option<u32>,
    /// At 2,000 cells a second.
    pub missing_turning_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub missing_turning_5000: Option<u32>,
    /// With a fallback: ticks on it, or a tile that settled from it, of the straight way at
    /// 500 cells a second.
    pub coarse_straight_500: Option<u32>,
    /// At 2,000 cells a second.
    pub coarse_straight_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub coarse_straight_5000: Option<u32>,
    /// Of the turning way at 500 cells a second.
    pub coarse_turning_500: Option<u32>,
    /// At 2,000 cells a second.
    pub coarse_turning_2000: Option<u32>,
    /// At 5,000 cells a second.
    pub coarse_turning_5000: Option<u32>,
    /// With a fallback: ticks that had nothing to feel, in these six motions and one of 20,000 cells a
    /// second.
    pub holes_underlaid: Option<u32>,
}

impl Row {
    /// Ticks over a fallback, as [`Row::missing`] has them without one.
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

    /// Missing ticks of the straight way and of the turning one, at the speeds of
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
    /// Blocks of it, when they are touched.
    #[default]
    Blocks,
    /// All of it, into memory, before anything is rendered.
    Whole,
}

impl Reading {
    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blocks => "blocks",
            Self::Whole => "whole",
        }
    }
}
