//! Blocks requests that the USB driver cannot handle, and sets the toggle that the host expects
//! when an endpoint is enabled.
//!
//! - A host may request a halt of any of 32 endpoints. embassy's stack passes the request on
//!   unchecked, and a driver panics at an endpoint number that it does not have.
//! - A host may end a halt that did not exist: some do when they open a pipe. embassy-stm32's
//!   driver of the full-speed peripheral then writes the endpoint's register until it reads a value
//!   that is never written (`endpoint_set_stalled` of its `usb/usb.rs`), and the executor hangs. So
//!   the end of a halt is handled by [`EndpointHalt`] instead, which each chip's image implements.
//! - The control endpoint has no halt: the next SETUP ends a refusal there by itself (USB 2.0,
//!   8.5.3.4), and its registers belong to a transfer in progress.

use core::marker::PhantomData;

use embassy_usb::driver::{
    Bus, Driver, EndpointAddress, EndpointAllocError, EndpointType, Event, Unsupported,
};

/// The link's endpoint, the only one that can be halted.
const LINK: usize = 1;

/// End of an endpoint's halt on a chip's USB peripheral.
pub trait EndpointHalt {
    /// Ends the halt of an endpoint, if it has one, and sets the toggle of its next packet to DATA0
    /// in any case (USB 2.0, 9.4.5). An unused endpoint stays unused. A packet that waits in the
    /// endpoint may be lost.
    fn end(bus: &mut impl Bus, address: EndpointAddress);
}

/// A driver `D` that receives only requests that it can handle; `H` ends halts for it.
pub struct EndpointFilter<D, H> {
    driver: D,
    halt: PhantomData<fn() -> H>,
}

impl<D, H> EndpointFilter<D, H> {
    pub(super) const fn new(driver: D) -> Self {
        Self {
            driver,
            halt: PhantomData,
        }
    }
}

impl<'d, D: Driver<'d>, H: EndpointHalt + 'd> Driver<'d> for EndpointFilter<D, H> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = D::ControlPipe;
    type Bus = FilteredBus<D::Bus, H>;

    fn alloc_endpoint_out(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        size: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointOut, EndpointAllocError> {
        let driver = &mut self.driver;
        driver.alloc_endpoint_out(kind, address, size, interval_ms)
    }

    fn alloc_endpoint_in(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        size: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointIn, EndpointAllocError> {
        let driver = &mut self.driver;
        driver.alloc_endpoint_in(kind, address, size, interval_ms)
    }

    fn start(self, control_size: u16) -> (Self::Bus, Self::ControlPipe) {
        let (bus, pipe) = self.driver.start(control_size);
        let halt = PhantomData;
        (FilteredBus { bus, halt }, pipe)
    }
}

/// The bus of an [`EndpointFilter`] driver.
pub struct FilteredBus<B, H> {
    bus: B,
    halt: PhantomData<fn() -> H>,
}

impl<B: Bus, H: EndpointHalt> Bus for FilteredBus<B, H> {
    async fn enable(&mut self) {
        self.bus.enable().await;
    }

    async fn disable(&mut self) {
        self.bus.disable().await;
    }

    async fn poll(&mut self) -> Event {
        self.bus.poll().await
    }

    /// Sets the toggle to DATA0, as every configuration does (USB 2.0, 9.1.1.5). Drivers do not do
    /// that for a second configuration without a bus reset in between.
    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        if address.index() != LINK {
            return;
        }
        self.bus.endpoint_set_enabled(address, enabled);
        if enabled {
            H::end(&mut self.bus, address);
        }
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        match (address.index(), stalled) {
            (LINK, true) => self.bus.endpoint_set_stalled(address, true),
            (LINK, false) => H::end(&mut self.bus, address),
            _ => {}
        }
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        address.index() == LINK && self.bus.endpoint_is_stalled(address)
    }

    fn force_reset(&mut self) -> Result<(), Unsupported> {
        self.bus.force_reset()
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        self.bus.remote_wakeup().await
    }
}
