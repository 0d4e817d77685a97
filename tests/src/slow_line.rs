//! A line to a device with a limited number of bytes a tick, and devices whose ticks wait for it.

use std::collections::VecDeque;

use hapterra::link::{Tcp, Transport};
use hapterra::phantom::HeldPhantom;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::plant::{Currents, PlantState};
use hapterra_core::wire::session::{InSession, SessionNumber};
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;

use crate::link_campaign::frames::{from_host, parse_host_frame};
use crate::timeouts::HANG;

/// Tiles along the side of the window, as on the emulated board.
const WINDOW: usize = 16;

/// Frames to the device. A frame arrives with its last byte.
pub struct SlowLine {
    bytes_a_tick: usize,
    waiting: VecDeque<Vec<u8>>,
    /// Bytes that the line may carry now.
    credit: usize,
}

impl SlowLine {
    /// An empty line of this rate.
    #[must_use]
    pub const fn new(bytes_a_tick: usize) -> Self {
        Self {
            bytes_a_tick,
            waiting: VecDeque::new(),
            credit: 0,
        }
    }

    /// Queues whole frames from the host.
    pub fn send(&mut self, frames: &[u8]) {
        let frames = frames.split_inclusive(|byte| *byte == 0);
        self.waiting.extend(frames.map(<[u8]>::to_vec));
    }

    /// Returns the frames that arrive in the next tick.
    pub fn carry(&mut self) -> Vec<u8> {
        self.credit += self.bytes_a_tick;
        let mut arrived = vec![];
        while let Some(frame) = self
            .waiting
            .pop_front_if(|frame| frame.len() <= self.credit)
        {
            self.credit -= frame.len();
            arrived.extend(frame);
        }
        // Unused capacity of an idle line is lost.
        if self.waiting.is_empty() {
            self.credit = 0;
        }
        arrived
    }
}

/// A device whose time advances tick by tick, controlled by its host.
pub trait Stepped {
    /// Sends frames without a tick. Returns the device's messages since the last call.
    fn exchange(&mut self, frames: &[u8]) -> Vec<u8>;

    /// Runs one tick, then delivers frames of this session. Returns all messages of the device
    /// until it has processed both.
    fn tick(&mut self, session: SessionNumber, frames: &[u8]) -> Vec<u8>;
}

/// The device in this program, and its arm.
pub struct InMemory {
    device: Device<StoppedClock, WINDOW>,
    arm: HeldPhantom,
    /// Bytes that the device reads only after a tick.
    unread: Vec<u8>,
}

impl InMemory {
    /// Creates a device after its start, with a Premium 1.5's calibration.
    #[must_use]
    pub fn new(arm: HeldPhantom) -> Self {
        // The two halves of the application exchange tile buffers by reference, as long as the
        // program runs.
        let tiles = Box::leak(Box::new(TileBuffers::VACANT));
        let memory = Box::leak(Box::new(WorkingMemory::new()));
        let stored = Stored::Found(Calibration::PREMIUM_1_5);
        let device = Device::new(tiles, memory, StoppedClock, stored, BootReport::default());
        let unread = vec![];
        Self {
            device,
            arm,
            unread,
        }
    }
}

impl Stepped for InMemory {
    fn exchange(&mut self, frames: &[u8]) -> Vec<u8> {
        self.unread.extend(frames);
        let (mut received, mut chunk) = (vec![], [0; 512]);
        loop {
            let taken = self.device.receive(&self.unread);
            self.unread.drain(..taken);
            let n = self.device.link.transmit(&mut chunk);
            received.extend(&chunk[..n]);
            if (taken, n) == (0, 0) {
                return received;
            }
        }
    }

    fn tick(&mut self, _: SessionNumber, frames: &[u8]) -> Vec<u8> {
        let drive = self.device.tick(self.arm.guard_inputs());
        if self.device.link.is_arm_in_use() {
            let currents_a = drive.currents_a.to_array().map(f64::from);
            self.arm.step(currents_a, 1e-3);
        }
        self.exchange(frames)
    }
}

/// The emulated board, and the arm on its plant line, in this thread.
///
/// The board's clock stops from the end of a tick until the counts of the next arrive. They are
/// sent when the board has answered a heartbeat sent after the tick and its frames: by then it has
/// read the frames, and its requests have arrived.
pub struct OnBoard {
    /// The link.
    pub link: Tcp,
    /// The plant line.
    pub plant: Tcp,
    /// The arm.
    pub arm: HeldPhantom,
    from_link: Box<FrameReader<MAX_FRAME>>,
    from_plant: Box<FrameReader<MAX_FRAME>>,
    ticks: u32,
    /// Heartbeats that the board has not answered.
    unanswered: i32,
}

impl OnBoard {
    /// Creates a board after its start.
    #[must_use]
    pub fn new(link: Tcp, plant: Tcp, arm: HeldPhantom) -> Self {
        Self {
            link,
            plant,
            arm,
            from_link: Box::default(),
            from_plant: Box::default(),
            ticks: 0,
            unanswered: 0,
        }
    }

    /// Returns the next bytes of the link.
    fn read(&mut self) -> Vec<u8> {
        let mut chunk = [0; 4096];
        let n = self
            .link
            .receive(&mut chunk, HANG)
            .expect("the board is there");
        assert!(n > 0, "the board sent nothing for {HANG:?}");
        chunk[..n].to_vec()
    }

    /// Counts the answers to heartbeats that end in these bytes.
    fn receive(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (taken, frame) = self.from_link.push(bytes);
            bytes = &bytes[taken..];
            let frame = frame.map(|frame| frame.and_then(decode::<InSession<ToHost>>));
            if let Some(Ok(framed)) = frame {
                self.unanswered -= i32::from(matches!(framed.message, ToHost::Heartbeat { .. }));
            }
        }
    }

    /// Sends a frame, and counts it if it is a heartbeat of the host.
    fn send(&mut self, frame: &[u8]) {
        let mut reader = FrameReader::<MAX_FRAME>::new();
        let (_, content) = reader.push(frame);
        let message = content.and_then(Result::ok).and_then(parse_host_frame);
        self.unanswered +=
            i32::from(message.is_some_and(|framed| framed.message == ToDevice::Heartbeat));
        self.link.send(frame).expect("the board is there");
    }

    /// Waits until the board has processed everything. Returns its messages.
    fn wait_until_processed(&mut self, session: SessionNumber) -> Vec<u8> {
        self.send(&from_host(session, &ToDevice::Heartbeat));
        let mut received = vec![];
        while self.unanswered > 0 {
            let more = self.read();
            self.receive(&more);
            received.extend(more);
        }
        received
    }

    fn currents(&mut self) -> Currents {
        let mut chunk = [0; 64];
        loop {
            let n = self.plant.receive(&mut chunk, HANG);
            let n = n.expect("the board is there");
            assert!(n > 0, "no currents for {HANG:?}");
            // After a tick's currents nothing follows until the next counts are sent.
            if let (_, Some(frame)) = self.from_plant.push(&chunk[..n]) {
                return frame.and_then(decode).expect("currents");
            }
        }
    }
}

impl Stepped for OnBoard {
    fn exchange(&mut self, frames: &[u8]) -> Vec<u8> {
        self.link.send(frames).expect("the board is there");
        let received = self.read();
        self.receive(&received);
        received
    }

    fn tick(&mut self, session: SessionNumber, frames: &[u8]) -> Vec<u8> {
        let (tick, sense) = (self.ticks, self.arm.guard_inputs());
        let mut frame = [0; 64];
        let sensed = encode(&PlantState { tick, sense }, &mut frame).expect("it fits");
        self.plant.send(sensed).expect("the board is there");
        let currents = self.currents();
        assert_eq!(currents.tick, tick);
        let tick_s = f64::from(currents.tick_ns) / 1e9;
        self.arm.step(currents.currents_a.map(f64::from), tick_s);
        self.ticks += 1;
        let mut received = self.wait_until_processed(session);
        // One by one, so that the effect of a frame does not depend on the arrival of the next.
        for frame in frames.split_inclusive(|byte| *byte == 0) {
            self.send(frame);
            received.extend(self.wait_until_processed(session));
        }
        // Answers overtake waiting samples, which are sent before the next answer.
        received.extend(self.wait_until_processed(session));
        received
    }
}
