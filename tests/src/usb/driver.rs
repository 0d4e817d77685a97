//! A USB peripheral for embassy's stack, driven by the script.
//!
//! No code here calls a waker: the owner of the futures polls them after each action of the script.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use embassy_usb_driver::{
    Bus, ControlPipe, Direction, Driver, Endpoint, EndpointAddress, EndpointAllocError,
    EndpointError, EndpointIn, EndpointInfo, EndpointOut, EndpointType, Event, Unsupported,
};

use super::{Answer, Handshake};

/// One direction of an endpoint.
#[derive(Default)]
struct Pipe {
    enabled: bool,
    stalled: bool,
    /// A single packet.
    packet: Option<Vec<u8>>,
}

/// The wire between script and stack.
#[derive(Default)]
pub(super) struct Wire {
    events: VecDeque<Event>,
    setup: Option<[u8; 8]>,
    into_device: [Pipe; 2],
    out_of_device: [Pipe; 2],
    /// True if the control endpoint accepts a packet now.
    control_listens: bool,
    /// Packets longer than the endpoint's: counted, but never acknowledged.
    pub(super) overlong_packets: u32,
}

impl Wire {
    fn pipe(&mut self, address: EndpointAddress) -> &mut Pipe {
        match address.direction() {
            Direction::In => &mut self.out_of_device[address.index()],
            Direction::Out => &mut self.into_device[address.index()],
        }
    }

    pub(super) fn report(&mut self, event: Event) {
        self.events.push_back(event);
    }

    pub(super) fn setup(&mut self, request: [u8; 8]) -> Handshake {
        self.setup = Some(request);
        for pipe in [&mut self.into_device[0], &mut self.out_of_device[0]] {
            *pipe = Pipe::default();
        }
        self.control_listens = false;
        Handshake::Ack
    }

    pub(super) fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake {
        let listens = endpoint != 0 || self.control_listens;
        let pipe = &mut self.into_device[endpoint];
        if pipe.stalled {
            return Handshake::Stall;
        }
        if packet.len() > 64 {
            self.overlong_packets += 1;
            return Handshake::Nak;
        }
        if !listens || (endpoint != 0 && !pipe.enabled) || pipe.packet.is_some() {
            return Handshake::Nak;
        }
        pipe.packet = Some(packet.to_vec());
        Handshake::Ack
    }

    pub(super) fn take_in(&mut self, endpoint: usize) -> Answer {
        let pipe = &mut self.out_of_device[endpoint];
        if pipe.stalled {
            return Answer::Stall;
        }
        pipe.packet.take().map_or(Answer::Nak, Answer::Data)
    }
}

/// The stack's side of the wire.
#[derive(Clone)]
pub(super) struct ScriptedDriver(pub(super) Rc<RefCell<Wire>>, pub(super) [usize; 2]);

/// An endpoint or the control pipe, with the wire.
pub(super) struct End {
    wire: Rc<RefCell<Wire>>,
    info: EndpointInfo,
}

impl ScriptedDriver {
    fn allocate(&mut self, direction: Direction, ep_type: EndpointType, size: u16) -> End {
        let next = &mut self.1[usize::from(direction == Direction::In)];
        *next += 1;
        let info = EndpointInfo {
            addr: EndpointAddress::from_parts(*next, direction),
            ep_type,
            max_packet_size: size,
            interval_ms: 0,
        };
        End {
            wire: Rc::clone(&self.0),
            info,
        }
    }
}

impl Driver<'static> for ScriptedDriver {
    type EndpointOut = End;
    type EndpointIn = End;
    type ControlPipe = End;
    type Bus = Self;

    fn alloc_endpoint_out(
        &mut self,
        ep_type: EndpointType,
        _address: Option<EndpointAddress>,
        size: u16,
        _interval_ms: u8,
    ) -> Result<End, EndpointAllocError> {
        Ok(self.allocate(Direction::Out, ep_type, size))
    }

    fn alloc_endpoint_in(
        &mut self,
        ep_type: EndpointType,
        _address: Option<EndpointAddress>,
        size: u16,
        _interval_ms: u8,
    ) -> Result<End, EndpointAllocError> {
        Ok(self.allocate(Direction::In, ep_type, size))
    }

    fn start(self, size: u16) -> (Self, End) {
        let info = EndpointInfo {
            addr: EndpointAddress::from_parts(0, Direction::Out),
            ep_type: EndpointType::Control,
            max_packet_size: size,
            interval_ms: 0,
        };
        let wire = Rc::clone(&self.0);
        (self, End { wire, info })
    }
}

impl Bus for ScriptedDriver {
    async fn enable(&mut self) {}

    async fn disable(&mut self) {}

    async fn poll(&mut self) -> Event {
        poll_fn(|_| match self.0.borrow_mut().events.pop_front() {
            Some(event) => Poll::Ready(event),
            None => Poll::Pending,
        })
        .await
    }

    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        *self.0.borrow_mut().pipe(address) = Pipe {
            enabled,
            ..Pipe::default()
        };
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        self.0.borrow_mut().pipe(address).stalled = stalled;
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        self.0.borrow_mut().pipe(address).stalled
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}

impl End {
    /// Waits until `poll` returns a value.
    async fn until<T>(&self, mut poll: impl FnMut(&mut Wire) -> Option<T>) -> T {
        poll_fn(|_| match poll(&mut self.wire.borrow_mut()) {
            Some(found) => Poll::Ready(found),
            None => Poll::Pending,
        })
        .await
    }

    /// Sends a packet of the control pipe to the host; fails if another request interrupts it.
    async fn hand_over(&self, packet: &[u8]) -> Result<(), EndpointError> {
        self.wire.borrow_mut().out_of_device[0].packet = Some(packet.to_vec());
        self.until(|wire| match (&wire.setup, &wire.out_of_device[0].packet) {
            (Some(_), _) => Some(Err(EndpointError::Disabled)),
            (None, None) => Some(Ok(())),
            (None, Some(_)) => None,
        })
        .await
    }

    async fn listen(&self) -> Result<Vec<u8>, EndpointError> {
        self.wire.borrow_mut().control_listens = true;
        let received = self.until(|wire| {
            if wire.setup.is_some() {
                return Some(Err(EndpointError::Disabled));
            }
            wire.into_device[0].packet.take().map(Ok)
        });
        let received = received.await;
        self.wire.borrow_mut().control_listens = false;
        received
    }
}

impl Endpoint for End {
    fn info(&self) -> &EndpointInfo {
        &self.info
    }

    async fn wait_enabled(&mut self) {
        let address = self.info.addr;
        self.until(|wire| wire.pipe(address).enabled.then_some(()))
            .await;
    }
}

impl EndpointOut for End {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, EndpointError> {
        let address = self.info.addr;
        let packet = self
            .until(|wire| {
                let pipe = wire.pipe(address);
                if !pipe.enabled {
                    return Some(Err(EndpointError::Disabled));
                }
                pipe.packet.take().map(Ok)
            })
            .await?;
        let room = buffer.get_mut(..packet.len());
        room.ok_or(EndpointError::BufferOverflow)?
            .copy_from_slice(&packet);
        Ok(packet.len())
    }
}

impl EndpointIn for End {
    async fn write(&mut self, packet: &[u8]) -> Result<(), EndpointError> {
        if packet.len() > usize::from(self.info.max_packet_size) {
            return Err(EndpointError::BufferOverflow);
        }
        let address = self.info.addr;
        self.until(|wire| {
            let pipe = wire.pipe(address);
            if !pipe.enabled {
                return Some(Err(EndpointError::Disabled));
            }
            if pipe.packet.is_some() {
                return None;
            }
            pipe.packet = Some(packet.to_vec());
            Some(Ok(()))
        })
        .await
    }
}

impl ControlPipe for End {
    fn max_packet_size(&self) -> usize {
        self.info.max_packet_size.into()
    }

    async fn setup(&mut self) -> [u8; 8] {
        self.until(|wire| wire.setup.take()).await
    }

    async fn data_out(
        &mut self,
        buffer: &mut [u8],
        _: bool,
        _: bool,
    ) -> Result<usize, EndpointError> {
        let packet = self.listen().await?;
        let room = buffer.get_mut(..packet.len());
        room.ok_or(EndpointError::BufferOverflow)?
            .copy_from_slice(&packet);
        Ok(packet.len())
    }

    async fn data_in(&mut self, data: &[u8], _: bool, last: bool) -> Result<(), EndpointError> {
        self.hand_over(data).await?;
        if last {
            self.listen().await?;
        }
        Ok(())
    }

    async fn accept(&mut self) {
        let _ = self.hand_over(&[]).await;
    }

    async fn reject(&mut self) {
        let mut wire = self.wire.borrow_mut();
        wire.into_device[0].stalled = true;
        wire.out_of_device[0].stalled = true;
    }

    async fn accept_set_address(&mut self, _address: u8) {
        self.accept().await;
    }
}
