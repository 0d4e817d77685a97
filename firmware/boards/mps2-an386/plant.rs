//! The virtual Phantom at the other end of UART1: it sends the encoder counts and switches of a
//! tick and receives the currents of that tick.
//!
//! In a scene that is rendered through the encoders every tick waits for its counts: from the end
//! of one tick until the counts of the next arrive, the board's time stands still. So the plant's
//! answer is in time, however long it computes.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_io_async::{Read, Write};
use hapterra_core::guard::GuardOutputs;
use hapterra_core::wire::frame::{FrameReader, decode, encode};
use hapterra_core::wire::plant::{Currents, PlantState};
use hapterra_firmware::board::{Encoders, GuardInputs, TickClock};
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::ConstStaticCell;

use crate::serial::{Receiver, Sender};
use crate::time::{self, Reason};

/// Maximum length of a frame on this line.
const FRAME: usize = 64;

static COUNTS: ConstStaticCell<Queue<PlantState, 4>> = ConstStaticCell::new(Queue::new());
static CURRENTS: ConstStaticCell<Queue<Currents, 4>> = ConstStaticCell::new(Queue::new());
/// True if counts wait for a tick.
static COUNTS_PENDING: AtomicBool = AtomicBool::new(false);
/// Raised when a tick has stored its currents.
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

/// Sets whether the scene is rendered through the encoders, so that ticks wait for counts.
pub(crate) fn expect(counts: bool) {
    if counts && !COUNTS_PENDING.load(Ordering::Acquire) {
        time::hold(Reason::Plant);
    } else {
        time::release(Reason::Plant);
    }
}

/// The virtual Phantom's encoders, as the tick reads them.
pub(crate) struct PlantEncoders {
    counts: Consumer<'static, PlantState>,
    currents: Producer<'static, Currents>,
    latest: GuardInputs,
    /// The number of the tick whose counts were read but not answered yet.
    unanswered: Option<u32>,
}

impl Encoders for PlantEncoders {
    fn sense(&mut self) -> GuardInputs {
        // Read in place: taking it out of the queue would copy it byte by byte, twice (150
        // instructions a tick).
        if let Some(PlantState { tick, sense }) = self.counts.peek() {
            self.latest = *sense;
            self.unanswered = Some(*tick);
            self.counts.dequeue();
        }
        COUNTS_PENDING.store(self.counts.ready(), Ordering::Release);
        self.latest
    }
}

impl PlantEncoders {
    /// Answers the counts that were read with the currents of their tick. Time stands still until
    /// the next counts arrive.
    pub(crate) fn answer(&mut self, drive: GuardOutputs) {
        let Some(tick) = self.unanswered.take() else {
            return;
        };
        // Full only if the plant sends without waiting for answers.
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
    counts: Producer<'static, PlantState>,
    currents: Consumer<'static, Currents>,
}

impl PlantPort {
    /// Serves the line forever.
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
            let (consumed, frame) = reader.push(bytes);
            if let Some(Ok(counts)) = frame.map(|frame| frame.and_then(decode)) {
                // A plant that does not wait for its answers loses counts.
                let _ = self.counts.enqueue(counts);
                COUNTS_PENDING.store(true, Ordering::Release);
                time::release(Reason::Plant);
            }
            bytes = bytes.get(consumed..).unwrap_or(&[]);
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
