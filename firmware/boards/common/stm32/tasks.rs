//! The tasks of a board for the USB stack and the link.

use core::cell::Cell;

use embassy_futures::join::join3;
use embassy_time::{Duration, Instant, Ticker};
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::Refusal;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::{LinkBoard, run};
use hapterra_firmware::monitor::{Monitor, WatchedPart};
use hapterra_firmware::usb::{BulkStream, EndpointFilter};

use super::calibration_memory::CalibrationMemory;
use super::supervisor::{CHECK_MS, LED};
use super::{loader, usb_interrupt};
use crate::application::TICK_DONE;
use crate::chip::{UsbDriver, WINDOW};
use crate::usb::EndpointHalts;

/// Time for the host to fetch the answer before the board enters its loader.
const LOADER_DELAY: Duration = Duration::from_millis(50);

/// Board for the link's task. A real board continues to tick independently of the link.
struct Board {
    memory: CalibrationMemory,
    /// Time of the request to enter the loader.
    leaving: Cell<Option<Instant>>,
}

impl LinkBoard for Board {
    async fn tick_done(&self) {
        TICK_DONE.wait().await;
    }

    fn after_poll<const D: usize>(&self, link: &Link<'_, D>) {
        LED.lock(|led| led.set(link.led_pattern()));
        if link.is_loader_due() {
            let since = self.leaving.get().unwrap_or_else(Instant::now);
            self.leaving.set(Some(since));
            if since.elapsed() >= LOADER_DELAY {
                loader::enter();
            }
        }
    }

    async fn store(&self, calibration: &Calibration) -> Result<(), Refusal> {
        self.memory.save(calibration)
    }
}

/// Serves the link forever.
#[embassy_executor::task]
pub(crate) async fn serve_link(
    link: &'static mut Link<'static, WINDOW>,
    rx: BulkStream<<UsbDriver as Driver<'static>>::EndpointOut>,
    tx: BulkStream<<UsbDriver as Driver<'static>>::EndpointIn>,
    memory: CalibrationMemory,
) {
    let board = Board {
        memory,
        leaving: Cell::new(None),
    };
    run(link, rx, tx, &board).await;
}

/// Runs the USB stack and the work of its interrupt, forever, and checks in for both.
#[embassy_executor::task]
pub(crate) async fn serve_usb(
    mut device: UsbDevice<'static, EndpointFilter<UsbDriver, EndpointHalts>>,
    monitor: &'static Monitor,
) {
    let checking_in = async {
        let mut ticker = Ticker::every(Duration::from_millis(CHECK_MS.into()));
        loop {
            monitor.check_in(WatchedPart::Usb);
            ticker.next().await;
        }
    };
    // The events of an interrupt are handled before the stack uses them.
    join3(usb_interrupt::serve(), device.run(), checking_in).await;
}
