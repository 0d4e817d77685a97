//! The device-only full-speed peripheral with packet memory (RM0440, 45).

use hapterra_tests::usb::{Answer, Handshake};

use super::Peripheral;

const CNTR: u32 = 0x40;
const ISTR: u32 = 0x44;
const DADDR: u32 = 0x4C;
const BCDR: u32 = 0x58;
/// Offset of the packet memory from the registers.
const MEMORY: u32 = 0x400;

/// Bits of an endpoint's register.
const CTR_RX: u16 = 1 << 15;
const DTOG_RX: u16 = 1 << 14;
const STAT_RX: u16 = 0b11 << 12;
const SETUP: u16 = 1 << 11;
const CTR_TX: u16 = 1 << 7;
const DTOG_TX: u16 = 1 << 6;
const STAT_TX: u16 = 0b11 << 4;
/// Writing a one inverts these.
const TOGGLED: u16 = DTOG_RX | STAT_RX | DTOG_TX | STAT_TX;
const PLAIN: u16 = 0b111 << 8 | 0xF;
/// Values of both STAT fields.
const STALL: u16 = 1;
const NAK: u16 = 2;
const VALID: u16 = 3;

/// Bits of ISTR.
const CTR: u16 = 1 << 15;
const SUSP: u16 = 1 << 11;
const RESET: u16 = 1 << 10;
const DIR: u16 = 1 << 4;

/// The peripheral.
pub struct FullSpeed {
    endpoints: [u16; 8],
    control: u16,
    status: u16,
    address: u16,
    charger: u16,
    memory: [u8; 1024],
}

impl Default for FullSpeed {
    fn default() -> Self {
        Self {
            endpoints: [0; 8],
            control: 3,
            status: 0,
            address: 0,
            charger: 0,
            memory: [0; 1024],
        }
    }
}

impl FullSpeed {
    fn events(&self) -> u16 {
        let done = |e: &u16| e & (CTR_RX | CTR_TX) != 0;
        match self.endpoints.iter().position(done) {
            Some(i) => {
                let received = self.endpoints[i] & CTR_RX != 0;
                self.status | CTR | if received { DIR } else { 0 } | i as u16
            }
            None => self.status,
        }
    }

    /// Writes an endpoint's register: some bits are written, some are inverted by a one, some are
    /// cleared by a zero, and SETUP is read-only.
    fn write_endpoint(&mut self, index: usize, value: u16) {
        let old = self.endpoints[index];
        self.endpoints[index] =
            value & PLAIN | (old ^ value) & TOGGLED | old & value & (CTR_RX | CTR_TX) | old & SETUP;
    }

    fn half(&self, at: usize) -> usize {
        u16::from_le_bytes([self.memory[at], self.memory[at + 1]]).into()
    }

    /// Stores a packet in the endpoint's buffer. Returns false if it does not fit.
    fn store(&mut self, index: usize, packet: &[u8]) -> bool {
        let entry = 8 * index + 4;
        let (at, count) = (self.half(entry), self.half(entry + 2));
        let blocks = count >> 10 & 0x1F;
        let room = if count & 0x8000 == 0 {
            2 * blocks
        } else {
            32 * (blocks + 1)
        };
        if packet.len() > room {
            return false;
        }
        self.memory[at..at + packet.len()].copy_from_slice(packet);
        let count = (count & 0xFC00 | packet.len()) as u16;
        self.memory[entry + 2..entry + 4].copy_from_slice(&count.to_le_bytes());
        true
    }

    fn of(&self, endpoint: usize) -> Option<usize> {
        let is = |e: &u16| usize::from(e & 0xF) == endpoint;
        (self.address & 0x80 != 0).then(|| self.endpoints.iter().position(is))?
    }

    fn set_stat(&mut self, index: usize, field: u16, to: u16) {
        let shift = field.trailing_zeros();
        let endpoint = &mut self.endpoints[index];
        *endpoint = *endpoint & !field | to << shift;
    }
}

impl Peripheral for FullSpeed {
    fn read(&mut self, offset: u32) -> u32 {
        if offset >= MEMORY {
            let at = (offset - MEMORY) as usize;
            return u32::from_le_bytes(self.memory[at..at + 4].try_into().unwrap_or_default());
        }
        let value = match offset {
            0..0x20 => self.endpoints[(offset / 4) as usize],
            CNTR => self.control,
            ISTR => self.events(),
            DADDR => self.address,
            BCDR => self.charger,
            _ => 0,
        };
        value.into()
    }

    fn write(&mut self, offset: u32, value: u32, mask: u32) {
        if offset >= MEMORY {
            let at = (offset - MEMORY) as usize;
            for (i, byte) in value.to_le_bytes().into_iter().enumerate() {
                if mask >> (8 * i) & 0xFF != 0 {
                    self.memory[at + i] = byte;
                }
            }
            return;
        }
        let value = value as u16;
        match offset {
            0..0x20 => self.write_endpoint((offset / 4) as usize, value),
            CNTR => self.control = value,
            ISTR => self.status &= value,
            DADDR => self.address = value,
            BCDR => self.charger = value,
            _ => {}
        }
    }

    fn is_asserting(&self) -> bool {
        self.events() & self.control & 0xFF00 != 0
    }

    fn is_attached(&self) -> bool {
        // The pull-up at D+, and neither reset nor power-down.
        self.charger & 1 << 15 != 0 && self.control & 3 == 0
    }

    fn bus_reset(&mut self) {
        self.endpoints = [0; 8];
        self.address = 0;
        self.status |= RESET;
    }

    fn suspend(&mut self) {
        self.status |= SUSP;
    }

    fn setup(&mut self, request: [u8; 8]) -> Handshake {
        // Never refused, but accepted only if no earlier packet waits.
        if self.of(0) != Some(0) || self.endpoints[0] & CTR_RX != 0 || !self.store(0, &request) {
            return Handshake::Nak;
        }
        self.set_stat(0, STAT_RX, NAK);
        self.set_stat(0, STAT_TX, NAK);
        // The SETUP itself is DATA0; the packets after it start with DATA1, in both directions.
        self.endpoints[0] |= CTR_RX | SETUP | DTOG_RX | DTOG_TX;
        Handshake::Ack
    }

    fn out(&mut self, endpoint: usize, packet: &[u8], toggle: bool) -> Handshake {
        let Some(index) = self.of(endpoint) else {
            return Handshake::Nak;
        };
        let expected = self.endpoints[index] & DTOG_RX != 0;
        match (self.endpoints[index] & STAT_RX) >> 12 {
            // Treated as a repetition of the last packet: nothing is stored or reported.
            VALID if toggle != expected => return Handshake::Ack,
            VALID if self.store(index, packet) => {}
            STALL => return Handshake::Stall,
            _ => return Handshake::Nak,
        }
        self.set_stat(index, STAT_RX, NAK);
        self.endpoints[index] = (self.endpoints[index] & !SETUP | CTR_RX) ^ DTOG_RX;
        Handshake::Ack
    }

    fn take_in(&mut self, endpoint: usize) -> (Answer, bool) {
        let Some(index) = self.of(endpoint) else {
            return (Answer::Nak, false);
        };
        let toggle = self.endpoints[index] & DTOG_TX != 0;
        match (self.endpoints[index] & STAT_TX) >> 4 {
            VALID => {}
            STALL => return (Answer::Stall, toggle),
            _ => return (Answer::Nak, toggle),
        }
        let (at, count) = (self.half(8 * index), self.half(8 * index + 2) & 0x3FF);
        self.set_stat(index, STAT_TX, NAK);
        self.endpoints[index] = (self.endpoints[index] | CTR_TX) ^ DTOG_TX;
        (Answer::Data(self.memory[at..at + count].to_vec()), toggle)
    }
}
