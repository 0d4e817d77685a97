//! The finer layers of a large terrain, which follow the hand.

use super::layers::{self, Extent, Reading};
use super::queue::Queue;
use crate::terrain::Terrain;
use hapterra_view_stream::{Layer, Message};

/// Rows read in one call: the line to the device is polled between calls.
const ROWS: u32 = 32;

/// Keeps the finer layers around the present home position. The coarsest layer is the whole
/// terrain, and stays.
#[derive(Debug)]
pub(super) struct Surroundings {
    /// All layers, sent or pending.
    extents: Vec<Extent>,
    /// Pending layers, the next one last.
    due: Vec<(usize, Extent)>,
    reading: Option<Reading>,
    /// A layer that is read, but not sent yet.
    read: Option<Layer>,
}

impl Surroundings {
    /// Begins with a terrain whose layers around `home` (cells) are sent.
    pub(super) fn new(terrain: &Terrain<'_>, home: [f64; 2]) -> Self {
        Self {
            extents: layers::around(terrain, home),
            due: vec![],
            reading: None,
            read: None,
        }
    }

    /// Moves to another home position (cells) if it is not in the middle of the present layers.
    pub(super) fn follow(&mut self, terrain: &Terrain<'_>, home: [f64; 2]) {
        let mut finer = self.extents.iter().skip(1);
        if finer.all(|extent| extent.is_around(home)) {
            return;
        }
        let extents = layers::around(terrain, home);
        if extents == self.extents {
            // The border of the terrain is near.
            return;
        }
        let finer = extents.iter().copied().enumerate().skip(1);
        self.due = finer.rev().collect();
        (self.reading, self.read) = (None, None);
        self.extents = extents;
    }

    /// Begins again with the coarsest layer, around a home position (cells), because the cells have
    /// changed.
    pub(super) fn restart(&mut self, terrain: &Terrain<'_>, home: [f64; 2]) {
        *self = Self::new(terrain, home);
        self.due = self.extents.iter().copied().enumerate().rev().collect();
    }

    /// Reads a few rows, and sends a layer that is complete: the caller waits for no more than
    /// these rows.
    pub(super) fn send_pending(&mut self, terrain: &Terrain<'_>, queue: &Queue) {
        if let Some(layer) = self.read.take() {
            let message = Message::Layer(layer);
            if let Err(Message::Layer(layer)) = queue.offer_or_return(message) {
                self.read = Some(layer);
            }
            return;
        }
        let next = || {
            let (number, extent) = self.due.pop()?;
            Some(Reading::new(number, &extent))
        };
        let Some(mut reading) = self.reading.take().or_else(next) else {
            return;
        };
        match reading.read(terrain, ROWS) {
            true => self.reading = Some(reading),
            false => self.read = Some(reading.into_layer()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Scale;
    use crate::timeouts::HANG;
    use crate::view_feed::pipe::Pipe;
    use hapterra_view_stream::read;
    use heightfield::Raster;
    use std::sync::mpsc::sync_channel;

    /// More than all messages of these tests need.
    const ROOM: usize = 64 << 20;

    fn height(column: u32, row: u32) -> f32 {
        (column % 1000 + 7 * row) as f32
    }

    /// Returns the layers sent while home moves along these positions, with a number of calls at
    /// each.
    fn reported(homes: &[([f64; 2], usize)]) -> Vec<Layer> {
        let raster = Raster::from_fn(20_001, 65, height).expect("raster");
        let terrain = Terrain::new(&raster, Scale::new(0.5, 0.1).expect("scale"), 0);
        let terrain = terrain.expect("terrain");
        let (pipe, out) = sync_channel(4096);
        let queue = Queue::start(Pipe(pipe), vec![], ROOM);
        let mut surroundings = Surroundings::new(&terrain, [1000.0, 30.0]);
        for (home, looks) in homes {
            surroundings.follow(&terrain, *home);
            for _ in 0..*looks {
                surroundings.send_pending(&terrain, &queue);
            }
        }
        queue.end(HANG);
        let bytes: Vec<u8> = out.try_iter().flatten().collect();
        let mut rest = bytes.as_slice();
        let messages = std::iter::from_fn(|| read(&mut rest).expect("whole"));
        let layers = messages.filter_map(|message| match message {
            Message::Layer(layer) => Some(layer),
            _ => None,
        });
        layers.collect()
    }

    #[test]
    fn finer_layers_follow_only_far_pans() {
        assert_eq!(reported(&[([2000.0, 30.0], 9), ([1000.0, 10.0], 9)]), []);
        let layers = reported(&[([15_000.0, 30.0], 9), ([15_100.0, 30.0], 9)]);
        let [layer] = layers.as_slice() else {
            panic!("{} layers", layers.len());
        };
        assert_eq!((layer.number, layer.step), (1, 8));
        let (west, cells) = (layer.first[0], 8 * (layer.columns as i32 - 1));
        assert!(
            (9000..15_000).contains(&west) && west + cells > 15_000,
            "{west}"
        );
        assert_eq!(layer.heights.len(), (layer.columns * layer.rows) as usize);
        for (i, reported) in layer.heights.iter().enumerate() {
            let (column, row) = (i as u32 % layer.columns, i as u32 / layer.columns);
            assert_eq!(*reported, height(west as u32 + 8 * column, 8 * row), "{i}");
        }
    }

    #[test]
    fn pan_cancels_the_layer_being_read() {
        let layers = reported(&[([9000.0, 30.0], 1), ([15_000.0, 30.0], 9)]);
        let wests: Vec<_> = layers.iter().map(|layer| layer.first[0]).collect();
        assert!(matches!(wests[..], [west] if west > 9000), "{wests:?}");
    }
}
