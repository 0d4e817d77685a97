//! Keeps requests about endpoints that do not exist from the USB driver.
//!
//! A host may ask to halt any of 32 endpoints. embassy's stack passes the request on
//! unchecked, and a driver panics at an endpoint number that it does not have.

use embassy_usb::driver::{
    Bus, Driver, EndpointAddress, EndpointAllocError, EndpointType, Event, Unsupported,
};

/// The highest endpoint number in use.
const LAST: usize = 1;

/// A driver that gets requests only about endpoints that it has.
pub struct EndpointFilter<D>(pub(super) D);

impl<'d, D: Driver<'d>> Driver<'d> for EndpointFilter<D> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = D::ControlPipe;
    type Bus = FilteredBus<D::Bus>;

    fn alloc_endpoint_out(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        size: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointOut, EndpointAllocError> {
        self.0.alloc_endpoint_out(kind, address, size, interval_ms)
    }

    fn alloc_endpoint_in(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        size: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointIn, EndpointAllocError> {
        self.0.alloc_endpoint_in(kind, address, size, interval_ms)
    }

    fn start(self, control_size: u16) -> (Self::Bus, Self::ControlPipe) {
        let (bus, pipe) = self.0.start(control_size);
        (FilteredBus(bus), pipe)
    }
}

/// The bus of an [`EndpointFilter`] driver.
pub struct FilteredBus<B>(B);

impl<B: Bus> Bus for FilteredBus<B> {
    async fn enable(&mut self) {
        self.0.enable().await;
    }

    async fn disable(&mut self) {
        self.0.disable().await;
    }

    async fn poll(&mut self) -> Event {
        self.0.poll().await
    }

    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        if address.index() <= LAST {
            self.0.endpoint_set_enabled(address, enabled);
        }
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        if address.index() <= LAST {
            self.0.endpoint_set_stalled(address, stalled);
        }
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        address.index() <= LAST && self.0.endpoint_is_stalled(address)
    }

    fn force_reset(&mut self) -> Result<(), Unsupported> {
        self.0.force_reset()
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        self.0.remote_wakeup().await
    }
}
