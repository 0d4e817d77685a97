//! The virtual Phantom at the other end of UART1: it sends what encoders and
//! switches say in a tick and gets the currents of that tick.
//!
//! In a scene felt through the encoders every tick waits for its counts: from
//! the end of one tick until the counts of the next are there, the board's time
//! stands still. However long the plant computes, its answer is in time.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_io_async::{Read, Write};
use hapterra_core::guard::Drive;
use hapterra_core::wire::frame::{FrameReader, decode, encode};
use hapterra_core::wire::plant::{Currents, Sensed};
use hapterra_firmware::board::{Encoders, Sense, TickClock};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::ConstStaticCell;

use crate::serial::{Receiver, Sender};
use crate::time::{self, Reason};

/// Longest frame on this line.
const FRAME: usize = 64;

static COUNTS: ConstStaticCell<Queue<Sensed, 4>> = ConstStaticCell::new(Queue::new());
static CURRENTS: ConstStaticCell<Queue<Currents, 4>> = ConstStaticCell::new(Queue::new());
/// Whether counts wait for a tick.
static COUNTS_WAIT: AtomicBool = AtomicBool::new(false);
/// A tick has left its currents.
pub(crate) static ANSWERED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Connects the interrupt's side of the line with the task's.
pub(crate) fn open() -> (PlantArm, Answers, PlantPort) {
    let (to_tick, counts) = COUNTS.take().split();
    let (to_plant, currents) = CURRENTS.take().split();
    let arm = PlantArm {
        counts,
        latest: Sense::default(),
        sensed: None,
    };
    let port = PlantPort {
        counts: to_tick,
        currents,
    };
    (arm, Answers(to_plant), port)
}

/// Says whether the scene is felt through the encoders, so that ticks have to
/// wait for counts.
pub(crate) fn expect(counts: bool) {
    if counts && !COUNTS_WAIT.load(Ordering::Acquire) {
        time::hold(Reason::Plant);
    } else {
        time::release(Reason::Plant);
    }
}

/// The virtual Phantom's encoders, as the tick reads them.
pub(crate) struct PlantArm {
    counts: Consumer<'static, Sensed>,
    latest: Sense,
    /// The number of the tick whose counts were read and not yet answered.
    pub(crate) sensed: Option<u32>,
}

impl PlantArm {
    pub(crate) fn has_counts(&self) -> bool {
        self.counts.ready()
    }
}

impl Encoders for PlantArm {
    fn sense(&mut self) -> Sense {
        if let Some(Sensed { tick, sense }) = self.counts.dequeue() {
            self.latest = sense;
            self.sensed = Some(tick);
        }
        COUNTS_WAIT.store(self.counts.ready(), Ordering::Release);
        self.latest
    }
}

/// Takes the currents of a tick from the interrupt.
pub(crate) struct Answers(Producer<'static, Currents>);

impl Answers {
    pub(crate) fn give(&mut self, tick: u32, drive: Drive) {
        // Full only if the plant sends on without waiting for answers.
        let _ = self.0.enqueue(Currents {
            tick,
            currents_a: drive.currents_a.to_array(),
            enabled: drive.enabled,
            tick_ns: time::Clock::PERIOD * (1_000_000_000 / time::Clock::HZ),
        });
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
