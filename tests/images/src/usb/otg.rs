//! Synopsys' OTG as a full-speed device, whose FIFOs the core serves (RM0433, 57).
//!
//! One part is modelled after embassy's driver, which works on hardware, and not after the manual:
//! after an OUT packet the endpoint stays enabled, with NAK set, and clearing NAK is enough for the
//! next.

use std::collections::{HashMap, VecDeque};

use hapterra_tests::usb::{Answer, Handshake};

use super::Peripheral;

const GAHBCFG: u32 = 0x008;
const GRSTCTL: u32 = 0x010;
const GINTSTS: u32 = 0x014;
const GINTMSK: u32 = 0x018;
const GRXSTSP: u32 = 0x020;
const DIEPTXF0: u32 = 0x028;
const CID: u32 = 0x03C;
const DIEPTXF1: u32 = 0x104;
const DCTL: u32 = 0x804;
const DSTS: u32 = 0x808;
const DIEPMSK: u32 = 0x810;
const DOEPMSK: u32 = 0x814;
const DAINT: u32 = 0x818;
const DAINTMSK: u32 = 0x81C;
const DIEPEMPMSK: u32 = 0x834;
const IN: u32 = 0x900;
const OUT: u32 = 0xB00;
const FIFO: u32 = 0x1000;
/// Offsets in an endpoint's block of 0x20.
const CTL: u32 = 0x00;
const INT: u32 = 0x08;
const SIZE: u32 = 0x10;
const SPACE: u32 = 0x18;

/// Bits of GINTSTS.
const RXFLVL: u32 = 1 << 4;
const USBSUSP: u32 = 1 << 11;
const USBRST: u32 = 1 << 12;
const ENUMDNE: u32 = 1 << 13;
const IEPINT: u32 = 1 << 18;
const OEPINT: u32 = 1 << 19;
/// Bits of an endpoint's control register.
const ACTIVE: u32 = 1 << 15;
const NAK: u32 = 1 << 17;
const STALL: u32 = 1 << 21;
const DPID: u32 = 1 << 16;
const CNAK: u32 = 1 << 26;
const SNAK: u32 = 1 << 27;
const SD0PID: u32 = 1 << 28;
const SD1PID: u32 = 1 << 29;
const DISABLE: u32 = 1 << 30;
const ENABLE: u32 = 1 << 31;
/// Bits of an endpoint's interrupts.
const DONE: u32 = 1 << 0;
const DISABLED: u32 = 1 << 1;
const SETUP_DONE: u32 = 1 << 3;
const EMPTY: u32 = 1 << 7;
/// Kinds of entries in the receive FIFO.
const OUT_DATA: u32 = 2;
const OUT_DONE: u32 = 3;
const SETUP_COMPLETE: u32 = 4;
const SETUP_DATA: u32 = 6;

const ENDPOINTS: u32 = 9;

/// The peripheral.
#[derive(Default)]
pub struct Otg {
    registers: HashMap<u32, u32>,
    flags: u32,
    statuses: VecDeque<u32>,
    received: VecDeque<u32>,
    sending: [Vec<u8>; ENDPOINTS as usize],
}

impl Otg {
    fn get(&self, offset: u32) -> u32 {
        self.registers.get(&offset).copied().unwrap_or(0)
    }

    fn set(&mut self, offset: u32, value: u32) {
        self.registers.insert(offset, value);
    }

    fn raise(&mut self, block: u32, endpoint: u32, bits: u32) {
        let at = block + 0x20 * endpoint + INT;
        self.set(at, self.get(at) | bits);
    }

    /// Returns the endpoints with an interrupt: IN in the lower half, OUT in the upper.
    fn endpoints_asserting(&self) -> u32 {
        let mut all = 0;
        for i in 0..ENDPOINTS {
            let empty = self.sending[i as usize].is_empty() && self.get(DIEPEMPMSK) >> i & 1 == 1;
            let mask = self.get(DIEPMSK);
            let sent = self.get(IN + 0x20 * i + INT) & mask != 0 || empty;
            let got = self.get(OUT + 0x20 * i + INT) & self.get(DOEPMSK) != 0;
            all |= u32::from(sent) << i | u32::from(got) << (16 + i);
        }
        all
    }

    fn status(&self) -> u32 {
        let endpoints = self.endpoints_asserting() & self.get(DAINTMSK);
        let mut status = self.flags;
        for (bit, is_set) in [
            (RXFLVL, !self.statuses.is_empty()),
            (IEPINT, endpoints & 0xFFFF != 0),
            (OEPINT, endpoints >> 16 != 0),
        ] {
            status |= if is_set { bit } else { 0 };
        }
        status
    }

    /// Returns the next status to the core, and applies its event.
    fn pop_status(&mut self) -> u32 {
        let status = self.statuses.pop_front().unwrap_or(0);
        let endpoint = status & 0xF;
        match status >> 17 & 0xF {
            OUT_DONE => self.raise(OUT, endpoint, DONE),
            SETUP_COMPLETE => self.raise(OUT, endpoint, SETUP_DONE),
            _ => {}
        }
        status
    }

    fn receive(&mut self, kind: u32, endpoint: u32, packet: &[u8]) {
        let status = |kind: u32, bytes: usize| endpoint | (bytes as u32) << 4 | kind << 17;
        self.statuses.push_back(status(kind, packet.len()));
        for chunk in packet.chunks(4) {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            self.received.push_back(u32::from_le_bytes(word));
        }
        let done = if kind == SETUP_DATA {
            SETUP_COMPLETE
        } else {
            OUT_DONE
        };
        self.statuses.push_back(status(done, 0));
    }

    fn write_control(&mut self, offset: u32, value: u32) {
        let old = self.get(offset);
        let commands = CNAK | SNAK | SD0PID | SD1PID | DISABLE | ENABLE;
        let mut new = value & !(commands | NAK | DPID);
        new |= old & (NAK | ENABLE | DPID) | value & ENABLE;
        if value & SD0PID != 0 {
            new &= !DPID;
        }
        if value & SD1PID != 0 {
            new |= DPID;
        }
        if value & CNAK != 0 {
            new &= !NAK;
        }
        if value & SNAK != 0 {
            new |= NAK;
        }
        if value & DISABLE != 0 {
            new &= !ENABLE;
            let block = offset & !0x1F;
            self.set(block + INT, self.get(block + INT) | DISABLED);
        }
        if offset == IN || offset == OUT {
            new |= ACTIVE; // endpoint 0 always is
        }
        self.set(offset, new);
    }

    fn write_reset(&mut self, value: u32) {
        if value & 1 << 5 != 0 {
            let which = value >> 6 & 0x1F;
            for (i, fifo) in self.sending.iter_mut().enumerate() {
                if which == 0x10 || which as usize == i {
                    fifo.clear();
                }
            }
        }
        if value & 1 << 4 != 0 {
            self.statuses.clear();
            self.received.clear();
        }
    }

    /// Returns the free words of an endpoint's transmit FIFO.
    fn space(&self, endpoint: u32) -> u32 {
        let at = match endpoint {
            0 => DIEPTXF0,
            n => DIEPTXF1 + 4 * (n - 1),
        };
        let held = self.sending[endpoint as usize].len() as u32 / 4;
        (self.get(at) >> 16).saturating_sub(held)
    }
}

impl Peripheral for Otg {
    fn read(&mut self, offset: u32) -> u32 {
        let endpoint = offset.saturating_sub(IN) / 0x20;
        match offset {
            FIFO.. => self.received.pop_front().unwrap_or(0),
            CID => 0x2300,
            GRSTCTL => 1 << 31,
            GINTSTS => self.status(),
            GRXSTSP => self.pop_status(),
            DSTS => 0b11 << 1,
            DAINT => self.endpoints_asserting(),
            IN..OUT if offset & 0x1F == SPACE => self.space(endpoint),
            IN..OUT if offset & 0x1F == INT && self.sending[endpoint as usize].is_empty() => {
                self.get(offset) | EMPTY
            }
            _ => self.get(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _mask: u32) {
        match offset {
            FIFO.. => {
                let endpoint = (offset / FIFO - 1) as usize;
                self.sending[endpoint].extend(value.to_le_bytes());
            }
            GRSTCTL => self.write_reset(value),
            GINTSTS => self.flags &= !value,
            IN..0xE00 if offset & 0x1F == CTL => self.write_control(offset, value),
            IN..0xE00 if offset & 0x1F == INT => self.set(offset, self.get(offset) & !value),
            _ => self.set(offset, value),
        }
    }

    fn is_asserting(&self) -> bool {
        self.get(GAHBCFG) & 1 != 0 && self.status() & self.get(GINTMSK) != 0
    }

    fn is_attached(&self) -> bool {
        self.get(GAHBCFG) & 1 != 0 && self.get(DCTL) & 1 << 1 == 0
    }

    fn bus_reset(&mut self) {
        self.flags |= USBRST | ENUMDNE;
    }

    fn suspend(&mut self) {
        self.flags |= USBSUSP;
    }

    fn setup(&mut self, request: [u8; 8]) -> Handshake {
        for block in [IN, OUT] {
            // The packets after a SETUP start with DATA1.
            self.set(block, self.get(block) & !STALL | NAK | DPID);
        }
        self.receive(SETUP_DATA, 0, &request);
        Handshake::Ack
    }

    fn out(&mut self, endpoint: usize, packet: &[u8], toggle: bool) -> Handshake {
        let control = OUT + 0x20 * endpoint as u32;
        let value = self.get(control);
        if value & STALL != 0 {
            return Handshake::Stall;
        }
        let ready = endpoint == 0 || value & (ACTIVE | ENABLE) == ACTIVE | ENABLE;
        if !ready || value & NAK != 0 {
            return Handshake::Nak;
        }
        let largest = if endpoint == 0 {
            64
        } else {
            (value & 0x7FF) as usize
        };
        if packet.len() > largest {
            return Handshake::Nak; // babble: never acknowledged
        }
        if toggle != (value & DPID != 0) {
            return Handshake::Ack; // treated as a repetition of the last one
        }
        self.set(control, (value | NAK) ^ DPID);
        self.receive(OUT_DATA, endpoint as u32, packet);
        Handshake::Ack
    }

    fn take_in(&mut self, endpoint: usize) -> (Answer, bool) {
        let block = IN + 0x20 * endpoint as u32;
        let control = self.get(block);
        let toggle = control & DPID != 0;
        if control & STALL != 0 {
            return (Answer::Stall, toggle);
        }
        let bytes = (self.get(block + SIZE) & 0x7FFFF) as usize;
        let ready = control & ENABLE != 0 && control & NAK == 0;
        if !ready || self.sending[endpoint].len() < bytes {
            return (Answer::Nak, toggle);
        }
        let mut packet = std::mem::take(&mut self.sending[endpoint]);
        packet.truncate(bytes);
        self.set(block, control & !ENABLE ^ DPID);
        self.set(block + SIZE, 0);
        self.raise(IN, endpoint as u32, DONE);
        (Answer::Data(packet), toggle)
    }
}
