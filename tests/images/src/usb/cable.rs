//! The cable between a chip and the scripted host, with the host controller's toggle of every
//! endpoint.

use hapterra_tests::usb::{Answer, Handshake};

use super::Peripheral;

/// Endpoint numbers in each direction.
const ENDPOINTS: usize = 16;
/// Standard requests that reset toggles: SET_CONFIGURATION and, for an endpoint's halt,
/// CLEAR_FEATURE.
const SET_CONFIGURATION: [u8; 2] = [0x00, 9];
const CLEAR_HALT: [u8; 4] = [0x02, 1, 0, 0];

/// A peripheral at the end of a cable.
///
/// A packet with an unexpected toggle is treated as a repetition: it is acknowledged and dropped
/// (USB 2.0, 8.6), so its content is lost.
pub struct Cable {
    peripheral: Box<dyn Peripheral>,
    to_device: [bool; ENDPOINTS],
    to_host: [bool; ENDPOINTS],
    /// A control transfer without data, which takes effect at its end.
    under_way: Option<[u8; 8]>,
    /// Number of the device's packets that were dropped.
    pub discarded: u32,
}

impl Cable {
    /// Plugs a peripheral in.
    #[must_use]
    pub fn new(peripheral: Box<dyn Peripheral>) -> Self {
        Self {
            peripheral,
            to_device: [false; ENDPOINTS],
            to_host: [false; ENDPOINTS],
            under_way: None,
            discarded: 0,
        }
    }

    /// Returns a word for the core.
    pub fn read(&mut self, offset: u32) -> u32 {
        self.peripheral.read(offset)
    }

    /// Writes a word from the core, in the bytes of `mask`.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32) {
        self.peripheral.write(offset, value, mask);
    }

    /// Returns true if the interrupt is asserted.
    #[must_use]
    pub fn is_asserting(&self) -> bool {
        self.peripheral.is_asserting()
    }

    /// Returns true if the device is attached to the bus.
    #[must_use]
    pub fn is_attached(&self) -> bool {
        self.peripheral.is_attached()
    }

    /// Resets the bus.
    pub fn bus_reset(&mut self) {
        self.to_device = [false; ENDPOINTS];
        self.to_host = [false; ENDPOINTS];
        self.under_way = None;
        self.peripheral.bus_reset();
    }

    /// Signals that the bus has been idle for 3 ms, as after an unplugging.
    pub fn suspend(&mut self) {
        self.peripheral.suspend();
    }

    /// Begins a control transfer; the packets after the SETUP start with DATA1.
    pub fn setup(&mut self, request: [u8; 8]) -> Handshake {
        let hand = self.peripheral.setup(request);
        if hand == Handshake::Ack {
            (self.to_device[0], self.to_host[0]) = (true, true);
            self.under_way = (request[6..] == [0, 0]).then_some(request);
        }
        hand
    }

    /// Sends a packet.
    pub fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake {
        let toggle = &mut self.to_device[endpoint];
        let hand = self.peripheral.out(endpoint, packet, *toggle);
        *toggle ^= hand == Handshake::Ack;
        hand
    }

    /// Requests a packet.
    pub fn take_in(&mut self, endpoint: usize) -> Answer {
        let (answer, toggle) = self.peripheral.take_in(endpoint);
        let expected = &mut self.to_host[endpoint];
        match answer {
            Answer::Data(_) if toggle != *expected => {
                self.discarded += 1;
                return Answer::Nak;
            }
            Answer::Data(_) => *expected ^= true,
            _ => return answer,
        }
        if endpoint == 0
            && let Some(request) = self.under_way.take()
        {
            self.take_effect(request);
        }
        answer
    }

    /// Applies the effect of a finished control transfer to the toggles.
    fn take_effect(&mut self, request: [u8; 8]) {
        let [kind, number, value, high, index, ..] = request;
        if [kind, number] == SET_CONFIGURATION {
            self.to_device[1..].fill(false);
            self.to_host[1..].fill(false);
        }
        if [kind, number, value, high] == CLEAR_HALT {
            let endpoint = usize::from(index & 0xF);
            let toggle = match index & 0x80 {
                0 => &mut self.to_device[endpoint],
                _ => &mut self.to_host[endpoint],
            };
            *toggle = false;
        }
    }
}
