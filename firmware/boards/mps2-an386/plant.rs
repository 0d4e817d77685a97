//! The virtual Phantom at the other end of UART1: it sends what encoders and switches
//! read in a tick and gets the currents of that tick.
//!
//! In a scene that is rendered through the encoders every tick waits for its counts:
//! from the end of one tick until the counts of the next are there, the board's time
//! stands still. However long the plant computes, its answer is in time.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_io_async::{Read, Write};
use hapterra_core::guard::GuardOutputs;
use hapterra_core::wire::frame::{FrameReader, decode, encode};
use hapterra_core::wire::plant::{Currents, Sensed};
use hapterra_firmware::board::{Encoders, GuardInputs, TickClock};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::ConstStaticCell;

use crate::serial::{Receiver, Sender};
use crate::time::{self, Reason};

/// Longest frame on this line.
const FRAME: usize = 64;

static COUNTS: ConstStaticCell<Queue<Sensed, 4>> = ConstStaticCell::new(Queue::new());
static CURRENTS: ConstStaticCell<Queue<Currents, 4>> = ConstStaticCell::new(Queue::new());
/// True if counts wait for a tick.
static COUNTS_WAIT: AtomicBool = AtomicBool::new(false);
/// Raised when a tick has left its currents.
pub(crate) static ANSWERED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Connects the interrupt's side of the line with the task's.
pub(crate) fn open() -> (PlantEncoders, PlantPort) {
    let (to_tick, counts) = COUNTS.take().split();
    let (to_plant, currents) = CURRENTS.take().split();
    let encoders = PlantEncoders {
        counts,
        currents: to_plant,
        latest: GuardInputs::default(),
        unanswered: None,
    };
    let port = PlantPort {
        counts: to_tick,
        currents,
    };
    (encoders, port)
}

/// Takes whether the scene is rendered through the encoders, so that ticks have to wait
/// for counts.
pub(crate) fn expect(counts: bool) {
    if counts && !COUNTS_WAIT.load(Ordering::Acquire) {
        time::hold(Reason::Plant);
    } else {
        time::release(Reason::Plant);
    }
}

/// The virtual Phantom's encoders, as the tick reads them.
pub(crate) struct PlantEncoders {
    counts: Consumer<'static, Sensed>,
    currents: Producer<'static, Currents>,
    latest: GuardInputs,
    /// The number of the tick whose counts were read and not yet answered.
    unanswered: Option<u32>,
}

impl Encoders for PlantEncoders {
    fn sense(&mut self) -> GuardInputs {
        // Looked at in its place: taken out as an option it is copied byte by byte, twice
        // (150 instructions a tick).
        if let Some(Sensed { tick, sense }) = self.counts.peek() {
            self.latest = *sense;
            self.unanswered = Some(*tick);
            self.counts.dequeue();
        }
        COUNTS_WAIT.store(self.counts.ready(), Ordering::Release);
        self.latest
    }
}

impl PlantEncoders {
    /// Answers the counts that were read with the currents of their tick. Time stands
    /// still until there are counts for the next.
    pub(crate) fn answer(&mut self, drive: GuardOutputs) {
        let Some(tick) = self.unanswered.take() else {
            return;
        };
        // Full only if the plant sends on without waiting for answers.
        let _ = self.currents.enqueue(Currents {
            tick,
            currents_a: drive.currents_a.to_array(),
            enabled: drive.enabled,
            tick_ns: time::Clock::PERIOD * (1_000_000_000 / time::Clock::HZ),
        });
        if !self.counts.ready() {
            time::hold(Reason::Plant);
        }
    }
}

/// The task's side of the line.
pub(crate) struct PlantPort {
    counts: Producer<'static, Sensed>,
    currents: Consumer<'static, Currents>,
}

impl PlantPort {
    /// Serves the line for ever.
    pub(crate) async fn run(mut self, mut rx: Receiver, mut tx: Sender) {
        let mut reader = FrameReader::<FRAME>::new();
        let mut chunk = [0; FRAME];
        loop {
            match select(rx.read(&mut chunk), ANSWERED.wait()).await {
                Either::First(Ok(n)) => self.take(&mut reader, chunk.get(..n).unwrap_or(&[])),
                Either::First(Err(never)) => match never {},
                Either::Second(()) => self.answer(&mut tx).await,
            }
        }
    }

    fn take(&mut self, reader: &mut FrameReader<FRAME>, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (taken, frame) = reader.push(bytes);
            if let Some(Ok(counts)) = frame.map(|frame| frame.and_then(decode)) {
                // A plant that runs ahead of its answers loses counts.
                let _ = self.counts.enqueue(counts);
                COUNTS_WAIT.store(true, Ordering::Release);
                time::release(Reason::Plant);
            }
            bytes = bytes.get(taken..).unwrap_or(&[]);
        }
    }

    async fn answer(&mut self, tx: &mut Sender) {
        while let Some(currents) = self.currents.dequeue() {
            let mut frame = [0; FRAME];
            if let Some(bytes) = encode(&currents, &mut frame) {
                let Ok(()) = tx.write_all(bytes).await;
            }
        }
    }
}
