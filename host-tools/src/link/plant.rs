//! The virtual Phantom at the emulated board's second line: encoders and
//! switches in, motor currents out, one exchange a tick.

use std::io;
use std::time::Duration;

use hapterra_core::wire::frame::{FrameReader, decode, encode};
use hapterra_core::wire::plant::{Currents, Sensed};

use super::Transport;
use crate::phantom::Rig;

/// Longest frame on this line.
const FRAME: usize = 64;

/// One end of the plant's line.
pub struct PlantLine<'a> {
    transport: &'a mut dyn Transport,
    reader: FrameReader<FRAME>,
    incoming: [u8; 256],
    /// Bytes of `incoming` that are still to be read.
    unread: std::ops::Range<usize>,
}

impl<'a> PlantLine<'a> {
    /// Over a transport.
    #[must_use]
    pub fn new(transport: &'a mut dyn Transport) -> Self {
        Self {
            transport,
            reader: FrameReader::new(),
            incoming: [0; 256],
            unread: 0..0,
        }
    }

    /// Tells the board what encoders and switches say at a tick.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn tell(&mut self, sensed: &Sensed) -> io::Result<()> {
        let mut frame = [0; FRAME];
        let bytes = encode(sensed, &mut frame).unwrap_or(&[]); // 64 bytes hold it
        self.transport.send(bytes)
    }

    /// The currents of a tick, after waiting for at most `wait`.
    ///
    /// # Errors
    /// When the board is gone.
    pub fn currents(&mut self, wait: Duration) -> io::Result<Option<Currents>> {
        if self.unread.is_empty() {
            let n = self.transport.receive(&mut self.incoming, wait)?;
            self.unread = 0..n;
        }
        while let Some(bytes) = self.incoming.get(self.unread.clone()) {
            if bytes.is_empty() {
                break;
            }
            let (taken, frame) = self.reader.push(bytes);
            self.unread.start += taken;
            if let Some(Ok(currents)) = frame.map(|frame| frame.and_then(decode)) {
                return Ok(Some(currents));
            }
        }
        Ok(None)
    }
}

/// Moves the rig with the board's ticks until `stop` says so or the board is
/// gone. The board's time stands still until each tick's counts are there.
///
/// # Errors
/// When the board is gone.
pub fn serve_plant(
    transport: &mut dyn Transport,
    rig: &mut Rig,
    stop: &dyn Fn() -> bool,
) -> io::Result<()> {
    let mut line = PlantLine::new(transport);
    let mut tick = 0;
    while !stop() {
        let sense = rig.sense();
        line.tell(&Sensed { tick, sense })?;
        let currents = loop {
            if let Some(currents) = line.currents(Duration::from_millis(100))? {
                break currents;
            }
            if stop() {
                return Ok(());
            }
        };
        // A board that failed says so with a number of its own.
        if currents.tick != tick && !currents.enabled {
            return Err(io::Error::other("the board has failed"));
        }
        let tick_s = f64::from(currents.tick_ns) / 1e9;
        rig.step(currents.currents_a.map(f64::from), tick_s);
        tick = tick.wrapping_add(1);
    }
    Ok(())
}
