//! A host in memory that serves the tiles of a field far larger than the device's window, in the
//! link's messages.
//!
//! ```text
//! cargo run -p hapterra-core --example serve_tiles
//! ```

use std::collections::VecDeque;

use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactSettings, ContactState};
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{
    FieldSize, RequestHint, TILE_SAMPLES, Tile, TileArena, TileKey, TileRequester, Window,
};
use hapterra_core::wire::frame::{FrameError, FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::session::{InSession, SessionNumber};

/// 8,000 × 8,000 cells; the window stores 128 × 128.
const SIZE: FieldSize = FieldSize::new(8_000, 8_000);
const TOP: i32 = 4;
const EPOCH: u32 = 1;
const SESSION: SessionNumber = SessionNumber::new(1);
/// Ticks between a request and the arrival of its tile.
const LATENCY: u32 = 20;

fn height(x: i32, y: i32) -> f32 {
    let (x, y) = (x as f32, y as f32);
    2.0 + (0.11 * x).sin() + (0.07 * y).cos()
}

/// Returns the bytes of a frame, as received at the other end of the link.
fn travel(frame: &[u8]) -> Result<Vec<u8>, FrameError> {
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let (_, content) = reader.push(frame);
    content.unwrap_or(Err(FrameError::Encoding)).map(Vec::from)
}

/// Answers a request for a tile with its heights, as a host.
fn host(request: &[u8]) -> Result<Vec<u8>, FrameError> {
    let content = travel(request)?;
    let InSession { session, message } = decode(&content)?;
    let ToHost::TileRequest { epoch, key } = message else {
        return Err(FrameError::Content);
    };
    let first = key.index.first_cell();
    let samples = (0..(TILE_SAMPLES * TILE_SAMPLES) as i32).map(|i| {
        let (x, y) = (
            first.x + i % TILE_SAMPLES as i32,
            first.y + i / TILE_SAMPLES as i32,
        );
        let inside = x <= SIZE.columns && y <= SIZE.rows;
        if inside { height(x, y) } else { f32::NAN }
    });
    let bytes: Vec<u8> = samples.flat_map(f32::to_le_bytes).collect();
    let heights = Heights::Samples {
        base: 0,
        bytes: &bytes,
    };
    let tile = ToDevice::Tile(TileMessage {
        epoch,
        key,
        heights,
    });
    let mut buffer = [0; MAX_FRAME];
    let message = tile;
    let framed = InSession { session, message };
    Ok(encode(&framed, &mut buffer).expect("a tile fits").to_vec())
}

/// Loads a tile into a free buffer, as a device; returns its key.
fn load(frame: &[u8], buffer: &mut Tile) -> Result<TileKey, FrameError> {
    let content = travel(frame)?;
    let InSession { message, .. } = decode(&content)?;
    let ToDevice::Tile(TileMessage { key, heights, .. }) = message else {
        return Err(FrameError::Content);
    };
    let Heights::Samples { base, bytes } = heights else {
        return Err(FrameError::Content);
    };
    buffer.load(key, base, bytes).or(Err(FrameError::Content))?;
    Ok(key)
}

pub(crate) fn main() -> Result<(), FrameError> {
    let mut storage = TileArena::<4>::new();
    let mut spare = Tile::VACANT;
    let mut free = &mut spare;
    let mut window = Window::new(storage.slots());
    window.reset(0, SIZE, TOP);
    let mut requester = TileRequester::<4>::new();
    requester.reset(0, SIZE);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);

    // The link: the arrival time of each tile, and its frame.
    let mut link: VecDeque<(u32, Vec<u8>)> = VecDeque::new();
    let (mut served, mut bytes, mut touching, mut waiting) = (0, 0, 0, 0);
    println!("  tick   HIP x   tiles served   state");
    for tick in 0..5_000_u32 {
        // From the air down to the ground, and 500 cells east along it.
        let t = tick as f32 / 5_000.0;
        let at = Vec3::new(4_000.0 + 500.0 * t, 4_039.3, (6.0 - 100.0 * t).max(1.5));
        let hip = GridPoint::new([0; 3], at);
        let output = *contact.step(&window, &hip);
        touching += u32::from(output.state == ContactState::Touching);
        waiting += u32::from(output.missing_tile.is_some());
        let hint = RequestHint {
            missing_tile: output.missing_tile,
            proxy: output.proxy.column(),
            hip: hip.column(),
            velocity: [0.1, 0.0],
        };
        while let Some(key) = requester.next_request(tick, &hint) {
            let message = ToHost::TileRequest { epoch: EPOCH, key };
            let session = SESSION;
            let mut buffer = [0; 32];
            let frame =
                encode(&InSession { session, message }, &mut buffer).expect("a request fits");
            link.push_back((tick + LATENCY, host(frame)?));
        }
        while let Some((_, frame)) = link.pop_front_if(|(due, _)| *due <= tick) {
            let key = load(&frame, free)?;
            free = window.install(free);
            requester.received(key);
            (served, bytes) = (served + 1, bytes + frame.len());
        }
        if tick % 500 == 0 {
            println!("{tick:6} {:7.1} {served:14}   {:?}", at.x, output.state);
        }
    }
    println!(
        "{served} tiles in {} kB; {touching} ticks in contact",
        bytes / 1000
    );
    println!("{waiting} ticks had to wait for a tile: it was requested in time");
    assert!(touching > 4_000 && waiting == 0);
    Ok(())
}
