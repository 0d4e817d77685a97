//! The application with embassy's USB stack over the scripted wire: the code of the real boards,
//! from the link's task down to the endpoints.

use std::cell::RefCell;
use std::future::Future;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Waker};

use embassy_futures::join::join;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::signal::Signal;
use embassy_usb_driver::{Bus, EndpointAddress, Event};
use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::amplifier::CURRENT_LOOP_US;
use hapterra_firmware::app::{Application, Hardware, TileBuffers, WorkingMemory, assemble};
use hapterra_firmware::board::GuardInputs;
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::{LinkBoard, run};
use hapterra_firmware::monitor::{Monitor, WatchedPart};
use hapterra_firmware::native::{
    FULL_SCALE_A, StoppedClock, VirtualAmplifiersOff, VirtualEncoders,
};
use hapterra_firmware::store::Stored;
use hapterra_firmware::usb::{DescriptorBuffers, EndpointHalt, device};

use super::driver::{ScriptedDriver, Wire};
use super::{Answer, Handshake, MOMENTS_A_MS, Port};

/// Tiles along the side of the window.
const WINDOW: usize = 4;
/// Polls after which all pending work is done.
const POLLS: usize = 8;
/// The serial number it reports.
pub const SERIAL: &str = "0123456789ABCDEF";

/// Signals the end of a tick to the link.
#[derive(Clone)]
struct TickDone(Rc<Signal<NoopRawMutex, ()>>);

impl LinkBoard for TickDone {
    async fn tick_done(&self) {
        self.0.wait().await;
    }

    fn after_poll<const D: usize>(&self, _link: &Link<'_, D>) {}
}

/// Does nothing: whole packets have no toggles.
struct EndpointHalts;

impl EndpointHalt for EndpointHalts {
    fn end(bus: &mut impl Bus, address: EndpointAddress) {
        bus.endpoint_set_stalled(address, false);
    }
}

/// A board without a chip.
pub struct Board {
    wire: Rc<RefCell<Wire>>,
    tasks: Pin<Box<dyn Future<Output = ()>>>,
    haptic_loop: HapticLoop<'static, VirtualEncoders, VirtualAmplifiersOff, StoppedClock, WINDOW>,
    monitor: &'static Monitor,
    done: TickDone,
    moments: u64,
}

impl Board {
    /// Creates a board that is powered by the cable. Its memory is leaked, as a board's is never
    /// freed.
    #[must_use]
    pub fn plugged_in() -> Self {
        let hardware = Hardware {
            encoders: VirtualEncoders::default(),
            amplifiers: VirtualAmplifiersOff,
            clock: StoppedClock,
            full_scale_a: FULL_SCALE_A,
            latency_us: CURRENT_LOOP_US,
            calibration: Stored::Found(Calibration::PREMIUM_1_5),
            motors: Temperatures::AIR,
            serial: SerialNumber::NONE,
            boot: BootReport::default(),
        };
        let tiles = Box::leak(Box::new(TileBuffers::VACANT));
        let memory = Box::leak(Box::new(WorkingMemory::new()));
        let Application {
            haptic_loop,
            mut link,
            monitor,
        } = assemble(tiles, memory, hardware, "scripted");
        let wire = Rc::new(RefCell::new(Wire::default()));
        wire.borrow_mut().report(Event::PowerDetected);
        let driver = ScriptedDriver(Rc::clone(&wire), [0; 2]);
        let buffers = Box::leak(Box::new(DescriptorBuffers::EMPTY));
        let (mut stack, rx, tx) = device::<_, EndpointHalts>(driver, SERIAL, buffers);
        let done = TickDone(Rc::new(Signal::new()));
        let host = done.clone();
        let tasks = Box::pin(async move {
            let link = async { run(&mut link, rx, tx, &host).await };
            join(stack.run(), link).await;
        });
        Self {
            wire,
            tasks,
            haptic_loop,
            monitor,
            done,
            moments: 0,
        }
    }

    /// Sets the encoders' counts.
    pub fn feed_encoders(&mut self, counts: [i32; 3]) {
        *self.haptic_loop.encoders_mut() = VirtualEncoders(GuardInputs {
            counts,
            ..GuardInputs::default()
        });
    }

    /// Pulls the cable. Boards that do not sense the supply's voltage only detect an idle bus.
    pub fn unplug(&mut self) {
        self.wire.borrow_mut().report(Event::Suspend);
        self.settle();
    }

    /// Returns the number of packets longer than an endpoint's.
    #[must_use]
    pub fn babbles(&self) -> u32 {
        self.wire.borrow().babbles
    }

    /// Returns true if the watchdog is fed now: loop and link have both run since the last check.
    pub fn is_alive(&mut self) -> bool {
        self.monitor
            .may_feed_watchdog(&[WatchedPart::Tick, WatchedPart::Link])
    }

    fn settle(&mut self) {
        let mut context = Context::from_waker(Waker::noop());
        for _ in 0..POLLS {
            let ended = self.tasks.as_mut().poll(&mut context).is_ready();
            assert!(!ended, "tasks never end");
        }
    }
}

impl Port for Board {
    fn is_attached(&self) -> bool {
        true
    }

    fn bus_reset(&mut self) {
        self.wire.borrow_mut().report(Event::Reset);
        self.settle();
    }

    fn setup(&mut self, request: [u8; 8]) -> Handshake {
        self.wire.borrow_mut().setup(request)
    }

    fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake {
        let hand = self.wire.borrow_mut().out(endpoint, packet);
        self.settle();
        hand
    }

    fn take_in(&mut self, endpoint: usize) -> Answer {
        let answer = self.wire.borrow_mut().take_in(endpoint);
        self.settle();
        answer
    }

    fn wait(&mut self) -> Result<(), String> {
        self.moments += 1;
        if self.moments.is_multiple_of(MOMENTS_A_MS) {
            self.haptic_loop.tick();
            self.done.0.signal(());
        }
        self.settle();
        Ok(())
    }
}
