//! Tiles on the link: requests, and the owners of the buffers.

use hapterra_core::terrain::{RequestHint, Tile, TileError};
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::FrameError;
use hapterra_core::wire::materials::TileMaterials;
use hapterra_core::wire::message::{Heights, TileMessage, ToHost};

use super::Link;
use super::commands::CommandRoom;
use crate::queues::QueuedTick;

impl<'t, const D: usize> Link<'t, D> {
    /// Reclaims the tile buffers that the loop has returned.
    pub(super) fn reclaim_buffers(&mut self) {
        while let Some(tile) = self.ends.spent.dequeue() {
            self.nothing_to_request_at = None;
            // A buffer returns with the key of a tile that the window has refused or replaced: that
            // tile is not stored.
            if let Some(key) = tile.key() {
                self.requester.lost(key);
            }
            self.return_buffer(tile);
        }
    }

    fn return_buffer(&mut self, tile: &'t mut Tile) {
        // There is room for all buffers.
        let _ = self.spare.push(tile);
    }

    /// Fills a spare buffer with a tile, checks it and sends it to the loop.
    pub(super) fn on_tile(
        &mut self,
        message: &TileMessage<'_>,
        materials: Option<TileMaterials<'_>>,
        room: CommandRoom,
    ) {
        let ours = self.scene.is_some_and(|s| s.epoch == message.epoch);
        if !ours || !self.requester.is_pending(message.key) {
            return;
        }
        self.reclaim_buffers();
        let Some(tile) = self.spare.pop() else {
            return;
        };
        let key = message.key;
        let filled = fill_tile(tile, message);
        let filled = filled.and_then(|()| self.fill_materials(tile, key, materials));
        if filled.is_err() {
            tile.vacate();
            self.return_buffer(tile);
            return self.on_bad_frame(FrameError::Content);
        }
        self.requester.received(key);
        self.command(room, Command::Tile(tile));
    }

    /// Requests tiles, each with a buffer reserved for it.
    pub(super) fn request_tiles(&mut self) {
        let may_request = self.session.is_open() && !self.is_cancelling();
        let (true, Some(scene)) = (may_request, self.scene) else {
            return;
        };
        let request_hint = self.request_hint.unwrap_or_else(|| RequestHint {
            proxy: scene.home.column(),
            hip: scene.home.column(),
            ..RequestHint::default()
        });
        let now = self.ends.monitor.ticks() / self.device.ticks_per_ms();
        if self.nothing_to_request_at == Some(now) {
            return;
        }
        while self.tx.has_room() {
            // A tile that was requested before has its buffer already.
            let key = match self.spare.len() > self.requester.in_flight() {
                true if self.waits_for_change() => {
                    self.requester.next_of_fallback(now, &request_hint)
                }
                true => self.requester.next_request(now, &request_hint),
                false => self.requester.next_repeat(now, &request_hint),
            };
            let Some(key) = key else {
                self.nothing_to_request_at = Some(now);
                return;
            };
            let epoch = scene.epoch;
            self.send(&ToHost::TileRequest { epoch, key });
        }
    }
}

/// Fills a tile buffer from the host's message.
///
/// # Errors
/// [`TileError`] if the message's heights are not those of a tile. The caller then vacates the
/// buffer.
pub fn fill_tile(tile: &mut Tile, message: &TileMessage<'_>) -> Result<(), TileError> {
    let key = message.key;
    let mut flat = |base, height| tile.fill(key, base, |_, _| height);
    match message.heights {
        Heights::NoData => flat(0, f32::NAN),
        Heights::Flat { base, height } => flat(base, height),
        Heights::Samples { base, bytes } => tile.load(key, base, bytes),
        Heights::Packed { base, bytes } => tile.unpack(key, base, bytes),
    }
}

/// Returns where the loop needs terrain after `record`, the successor of `last`. The velocity is in
/// cells a millisecond, the tile requester's unit, at every tick rate.
pub(super) fn request_hint(
    last: &QueuedTick,
    record: &QueuedTick,
    ticks_per_ms: u32,
) -> RequestHint {
    let (last, sample) = (&last.sample, &record.sample);
    let ticks = sample.tick.wrapping_sub(last.tick);
    // A new scene restarts the count of ticks, and another placement has other cells: neither gives
    // a velocity.
    let velocity = if ticks == 0 || ticks > 100 * ticks_per_ms || last.view != sample.view {
        [0.0; 2]
    } else {
        let step = last.hip.to(&sample.hip) * (ticks_per_ms as f32 / ticks as f32);
        [step.x, step.y]
    };
    RequestHint {
        missing_tile: sample.missing_tile,
        proxy: sample.proxy.column(),
        hip: sample.hip.column(),
        velocity,
    }
}
