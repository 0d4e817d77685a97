//! A quad converter on SPI, by the data sheet of the AD5754R, and the wires to it.
//!
//! Its timing is the data sheet's (rev. G, table 4): SYNC must be high for 100 ns after a frame
//! that writes and for 200 ns after one that reads; an earlier frame is lost. The outputs take 10
//! µs to power up, and a code written in this time is lost as well. The result of a read returns in
//! the next frame.
//!
//! The emulated core's time advances every 200 instructions (1.6 µs), unless a test sets fewer: two
//! frames within this time have no gap here, so a test of the gaps advances time with every
//! instruction.

/// Registers, in a frame's first byte.
const DATA: u8 = 0b000;
const RANGE: u8 = 0b001;
const POWER: u8 = 0b010;
/// Marks a read of a register.
const READ: u8 = 1 << 7;
/// The channel number for all channels.
const ALL: u8 = 0b100;
/// The range ±10 V.
const BIPOLAR_10_V: u16 = 0b100;
/// The end-of-transfer bit of the SPI's status.
const EOT: u32 = 1 << 3;
/// Bytes of a frame.
const FRAME: usize = 3;
/// Time that SYNC must be high after a frame that writes and after one that reads, ns.
const HIGH_AFTER_WRITE_NS: u64 = 100;
const HIGH_AFTER_READ_NS: u64 = 200;
/// Power-up time of the outputs, ns.
const POWER_UP_NS: u64 = 10_000;

/// The converter, and the wires to it.
#[derive(Debug, Default)]
pub struct Converter {
    codes: [u16; 4],
    ranges: [u16; 4],
    powered: u16,
    /// The time at which the outputs were powered, ns.
    powered_ns: u64,
    is_selected: bool,
    /// The time at which SYNC rose, ns, and true if the frame before it was a read.
    rising_edge: Option<(u64, bool)>,
    /// True if SYNC fell too early, so that the frame is lost.
    is_lost: bool,
    frame: Vec<u8>,
    /// Request of the last frame.
    requested: u16,
    /// Bytes received and not read yet.
    response: Vec<u8>,
    /// True if the SPI's clock has failed: no frames are sent.
    pub is_cut: bool,
    /// True if the return wire is broken: the pull-up makes all bits ones.
    pub is_silent: bool,
    /// Shortest time that SYNC was high after a frame that writes and after one that reads, ns;
    /// zero before the first.
    pub min_high_ns: (u64, u64),
    /// Frames that were lost because SYNC was high too briefly, or the outputs were not powered up
    /// yet.
    pub lost: u32,
}

impl Converter {
    /// Returns the codes of the first three channels: zero unless they have power and their range.
    #[must_use]
    pub fn codes(&self) -> [i32; 3] {
        let [a, b, c, _] = self.codes.map(|code| i32::from(code.cast_signed()));
        let in_range = self.ranges[..3].iter().all(|range| *range == BIPOLAR_10_V);
        let on = in_range && self.powered & 0b1_0111 == 0b1_0111;
        if on { [a, b, c] } else { [0; 3] }
    }

    /// Cycles the supply: all registers are as after power-up.
    pub fn clear(&mut self) {
        self.codes = [0; 4];
        self.ranges = [0; 4];
        self.powered = 0;
    }

    /// Returns the converter after a reset of the chip: it keeps its registers and its outputs, as
    /// CLR is not tied to the chip's reset here. Time restarts from zero.
    #[must_use]
    pub fn after_reset(self) -> Self {
        Self {
            codes: self.codes,
            ranges: self.ranges,
            powered: self.powered,
            ..Self::default()
        }
    }

    /// Returns the SPI's status.
    #[must_use]
    pub fn status(&self, others: u32) -> u32 {
        let sent = self.frame.len() >= FRAME && !self.is_cut;
        others | if sent { EOT } else { 0 }
    }

    /// Sends a byte and receives one.
    pub fn receive(&mut self, byte: u8) {
        let [high, low] = self.requested.to_be_bytes();
        let response = [0, high, low].get(self.frame.len()).copied();
        let response = response.filter(|_| !self.is_silent && !self.is_lost);
        self.response.push(response.unwrap_or(u8::MAX));
        self.frame.push(byte);
    }

    /// Returns the oldest byte received.
    pub fn next_byte(&mut self) -> u8 {
        match self.response.is_empty() {
            true => 0,
            false => self.response.remove(0),
        }
    }

    /// Sets the level of SYNC: a frame takes effect when it rises. Returns the channel (0 to 2)
    /// with a new code.
    pub fn select(&mut self, is_selected: bool, now_ns: u64) -> Option<(usize, i32)> {
        let falls = is_selected && !self.is_selected;
        let rises = !is_selected && self.is_selected;
        self.is_selected = is_selected;
        if falls {
            self.frame.clear();
            self.response.clear();
            self.is_lost = self.rising_edge.is_some_and(|(rose_ns, requested)| {
                let (writes, reads) = &mut self.min_high_ns;
                let (min, min_high) = match requested {
                    true => (HIGH_AFTER_READ_NS, reads),
                    false => (HIGH_AFTER_WRITE_NS, writes),
                };
                let high_ns = now_ns - rose_ns;
                *min_high = if *min_high == 0 {
                    high_ns
                } else {
                    high_ns.min(*min_high)
                };
                high_ns < min
            });
            self.lost += u32::from(self.is_lost);
        }
        if !rises {
            return None;
        }
        let is_read = self.frame.first().is_some_and(|head| head & READ != 0);
        self.rising_edge = Some((now_ns, is_read));
        match self.frame[..] {
            [head, high, low] if !self.is_cut && !self.is_lost => {
                self.requested = 0;
                self.execute(head, u16::from_be_bytes([high, low]), now_ns)
            }
            _ => None,
        }
    }

    fn execute(&mut self, head: u8, value: u16, now_ns: u64) -> Option<(usize, i32)> {
        let (register, channel) = (head >> 3 & 7, head & 7);
        let at = usize::from(channel);
        match (head & READ != 0, register) {
            (true, DATA) => self.requested = *self.codes.get(at)?,
            (true, RANGE) => self.requested = *self.ranges.get(at)?,
            (true, POWER) if at == 0 => self.requested = self.powered,
            (false, DATA) if channel == ALL => self.codes = [value; 4],
            (false, DATA) => return self.output(at, value, now_ns),
            (false, RANGE) if channel == ALL => self.ranges = [value & 7; 4],
            (false, RANGE) => *self.ranges.get_mut(at)? = value & 7,
            (false, POWER) if at == 0 => {
                if self.powered != value {
                    self.powered_ns = now_ns;
                }
                self.powered = value;
            }
            // The control register: no operation.
            (false, 0b011) => {}
            _ => panic!("no such register: {head:#x}"),
        }
        None
    }

    fn output(&mut self, channel: usize, value: u16, now_ns: u64) -> Option<(usize, i32)> {
        if self.powered != 0 && now_ns - self.powered_ns < POWER_UP_NS {
            self.lost += 1;
            return None;
        }
        *self.codes.get_mut(channel)? = value;
        (channel < 3).then_some((channel, i32::from(value.cast_signed())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends a frame that begins at a time. Returns the data received.
    fn send(converter: &mut Converter, frame: [u8; 3], at_ns: u64) -> u16 {
        converter.select(true, at_ns);
        frame.iter().for_each(|byte| converter.receive(*byte));
        converter.select(false, at_ns + 3_200);
        let [_, high, low] = [(); 3].map(|()| converter.next_byte());
        u16::from_be_bytes([high, low])
    }

    fn set_up() -> Converter {
        let mut converter = Converter::default();
        send(&mut converter, [0x0C, 0, 4], 0);
        send(&mut converter, [0x10, 0, 0x17], 10_000);
        converter
    }

    #[test]
    fn frame_before_the_minimum_gap_is_lost() {
        let mut converter = set_up();
        send(&mut converter, [0, 1, 2], 50_000);
        assert_eq!(converter.codes()[0], 0x0102);
        send(&mut converter, [0, 3, 4], 53_200 + 99);
        assert_eq!((converter.codes()[0], converter.lost), (0x0102, 1));
        send(&mut converter, [0x88, 0, 0], 60_000);
        send(&mut converter, [0, 5, 6], 63_200 + 199);
        assert_eq!((converter.codes()[0], converter.lost), (0x0102, 2));
        send(&mut converter, [0, 7, 8], 66_600 + 100);
        assert_eq!((converter.codes()[0], converter.lost), (0x0708, 2));
    }

    #[test]
    fn code_before_the_outputs_power_up_is_lost() {
        let mut converter = set_up();
        send(&mut converter, [0, 1, 2], 14_000);
        assert_eq!((converter.codes()[0], converter.lost), (0, 1));
        send(&mut converter, [0, 1, 2], 24_000);
        assert_eq!(converter.codes()[0], 0x0102);
    }

    #[test]
    fn register_value_is_returned_in_the_next_frame() {
        let mut converter = set_up();
        assert_eq!(send(&mut converter, [0x8A, 0, 0], 50_000), 0);
        assert_eq!(send(&mut converter, [0x90, 0, 0], 60_000), 4);
        assert_eq!(send(&mut converter, [0x18, 0, 0], 70_000), 0x17);
    }
}
