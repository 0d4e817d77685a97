//! A quad converter on SPI, as the data sheet of the AD5754R describes it.

/// Registers, as a frame's first byte has them.
const DATA: u8 = 0b000;
const RANGE: u8 = 0b001;
const POWER: u8 = 0b010;
/// The channel that stands for all.
const ALL: u8 = 0b100;
/// ±10 V.
const BIPOLAR_10_V: u16 = 0b100;
/// The end-of-transfer bit of the SPI's status.
const EOT: u32 = 1 << 3;
/// Bytes of a frame.
const FRAME: usize = 3;

/// The converter, and the wires to it.
#[derive(Debug, Default)]
pub struct Converter {
    codes: [i32; 4],
    bipolar: bool,
    powered: u16,
    is_selected: bool,
    frame: Vec<u8>,
    /// Whether the SPI's clock has failed: frames do not go out.
    pub is_cut: bool,
}

impl Converter {
    /// Codes of the first three channels: nothing unless they have power and
    /// their range.
    #[must_use]
    pub fn codes(&self) -> [i32; 3] {
        let [a, b, c, _] = self.codes;
        let on = self.bipolar && self.powered & 0b1_0111 == 0b1_0111;
        if on { [a, b, c] } else { [0; 3] }
    }

    /// The SPI's status.
    #[must_use]
    pub fn status(&self, others: u32) -> u32 {
        let sent = self.frame.len() >= FRAME && !self.is_cut;
        others | if sent { EOT } else { 0 }
    }

    /// A byte is clocked out.
    pub fn take(&mut self, byte: u8) {
        self.frame.push(byte);
    }

    /// The level of SYNC: a frame takes effect when it rises. Gives the channel
    /// (0 to 2) that has a new code.
    pub fn select(&mut self, is_selected: bool) -> Option<(usize, i32)> {
        let falls = is_selected && !self.is_selected;
        let rises = !is_selected && self.is_selected;
        self.is_selected = is_selected;
        if falls {
            self.frame.clear();
        }
        match self.frame[..] {
            [head, high, low] if rises && !self.is_cut => {
                self.execute(head >> 3, head & 7, u16::from_be_bytes([high, low]))
            }
            _ => None,
        }
    }

    fn execute(&mut self, register: u8, channel: u8, value: u16) -> Option<(usize, i32)> {
        let code = i32::from(value.cast_signed());
        match (register, usize::from(channel)) {
            (DATA, _) if channel == ALL => self.codes = [code; 4],
            (DATA, channel) => {
                *self.codes.get_mut(channel)? = code;
                return (channel < 3).then_some((channel, code));
            }
            (RANGE, _) => self.bipolar = channel == ALL && value == BIPOLAR_10_V,
            (POWER, 0) => self.powered = value,
            _ => panic!("no such register: {register} {channel}"),
        }
        None
    }
}
