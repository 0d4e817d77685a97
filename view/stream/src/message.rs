//! The messages.

use serde::{Deserialize, Serialize};

/// Cells along the side of a tile.
pub const TILE_CELLS: i32 = 32;
/// Heights along the side of a [`Tile`]: the corners of its cells and a margin of one all around,
/// for the slopes at its border.
pub const TILE_POSTS: usize = TILE_CELLS as usize + 3;

/// One message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// The first message.
    Hello(Hello),
    /// Scene and its size in the hand. A later one is another placement of the same terrain; the
    /// tiles and samples after it are in its millimetres.
    Scene(Box<Scene>),
    /// A part of the terrain, coarser than the rendered level.
    Layer(Layer),
    /// A tile as it is rendered.
    Tile(Tile),
    /// The tiles that the device stores and waits for.
    Tiles(Tiles),
    /// Samples in the order of time.
    Samples(Vec<Sample>),
    /// Statistics of the link.
    Link(Link),
    /// The end of the stream.
    End,
}

/// The first message.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// The writer's [`crate::VERSION`].
    pub version: u16,
    /// Version of the program that writes.
    pub program: String,
}

/// The touched terrain, its place and its size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// The user's name for the terrain.
    pub title: String,
    /// Position, scale and device as texts: name and value.
    pub facts: Vec<(String, String)>,
    /// True if samples arrive as they are rendered. A recording is already complete.
    pub is_live: bool,
    /// True if the device keeps the tiles of the previous placement.
    pub keeps_tiles: bool,
    /// Level of the tiles: every 2ᴸ-th sample, with haptic cells larger by that factor.
    pub level: u8,
    /// Side of a cell of level 0, mm.
    pub cell_mm: f64,
    /// Millimetres of a vertical unit of the file.
    pub mm_per_unit: f64,
    /// Radius of the ball whose centre the proxy is, mm; 0 for a point.
    pub tip_mm: f64,
    /// The position under the tip in the arm's home pose, mm. The picture's origin.
    pub home_mm: [f64; 3],
    /// The part in front of the arm: west, south, east, north, mm.
    pub fitted_mm: [f64; 4],
    /// Ground metres in a millimetre; `None` if the terrain's size is unknown, and all lengths are
    /// in millimetres.
    pub ground_m_per_mm: Option<f64>,
    /// Units of the sent heights in a millimetre.
    pub height_per_mm: f64,
    /// The unit of the sent heights, short: `m`.
    pub height_unit: String,
    /// The file's coordinates of positions, if it states any.
    pub coordinates: Option<Coordinates>,
    /// Units of a tick's cost, if they are known.
    pub tick: Option<TickCost>,
}

/// The file's coordinates: `origin + x · east + y · north` for x and y in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coordinates {
    /// Coordinates of the south-west sample.
    pub origin: [f64; 2],
    /// Change of the coordinates for a millimetre to the east.
    pub east: [f64; 2],
    /// Change of the coordinates for a millimetre to the north.
    pub north: [f64; 2],
    /// Decimals that distinguish neighbouring haptic cells.
    pub decimals: u8,
}

/// Units of a tick's cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TickCost {
    /// `µs`, or the unit that the emulated board counts.
    pub unit: String,
    /// Units in a count of [`Sample::cost`].
    pub per_count: f64,
    /// Units available for a tick: the time until the next one.
    pub bound: f64,
}

/// Samples of the terrain at every `step`-th cell of level 0. They belong to all placements until
/// one with other cells: all layers are sent again for it, the coarsest first.
///
/// A finer layer replaces its part of the next coarser one. A layer with the number of an earlier
/// one replaces it and removes those with higher numbers, which are sent again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Number, counted from the coarsest, which is 0 and shows the whole terrain.
    pub number: u32,
    /// Its south-west sample, in cells of level 0.
    pub first: [i32; 2],
    /// Cells between samples.
    pub step: i32,
    /// Samples west to east.
    pub columns: u32,
    /// Samples south to north.
    pub rows: u32,
    /// Heights in vertical units of the file, row by row from the south; NaN for no-data.
    pub heights: Vec<f32>,
}

/// A tile with all its samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tile {
    /// Its slot; a later tile in the same slot replaces it.
    pub slot: u32,
    /// Column and row among the tiles of the rendered level.
    pub index: [i32; 2],
    /// [`TILE_POSTS`]² heights, mm, row by row from the south, the first one cell south and west of
    /// the tile's own first; NaN for no-data and outside.
    pub heights_mm: Vec<f32>,
}

/// The tiles that the device stores and those that it waits for, by column and row.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tiles {
    /// Tiles that the device stores: the host has sent them, and no later ones to their slots.
    pub held: Vec<[i32; 2]>,
    /// Tiles without which the loop could not complete its tick.
    pub awaited: Vec<[i32; 2]>,
}

/// Record of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Time since the beginning, s.
    pub t_s: f64,
    /// The haptic interface point, mm.
    pub hip_mm: [f64; 3],
    /// The proxy, mm: at the HIP unless touching.
    pub proxy_mm: [f64; 3],
    /// Force on the hand, N: east, north, up.
    pub force_n: [f32; 3],
    /// Height of the surface over or under the HIP, mm; NaN for no-data and outside.
    pub ground_mm: f64,
    /// True if the surface is touched.
    pub contact: bool,
    /// Cost of the previous tick, in counts of the device's clock; `None` if it is unknown.
    pub cost: Option<u32>,
}

/// Traffic of the link since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// The device's time, s.
    pub t_s: f64,
    /// Tiles sent.
    pub tiles: u64,
    /// Their bytes, including framing.
    pub tile_bytes: u64,
    /// Samples received.
    pub samples: u64,
    /// Samples lost on the link or dropped by the device.
    pub lost: u64,
    /// Ticks that began or ended too late.
    pub late: u32,
    /// Messages that this stream's writer dropped, because its reader was slow.
    pub dropped: u64,
}
