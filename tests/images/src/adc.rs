//! An analogue-to-digital converter of the chips (RM0440 21, RM0433 25): calibration,
//! enable, and an injected sequence that the program starts.

const ISR: u32 = 0x00;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
const JSQR: u32 = 0x4C;
const JDR1: u32 = 0x80;

/// Bits of ISR: ready, and the end of the injected sequence.
const ADRDY: u32 = 1 << 0;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;
/// Bits of CR.
const ADEN: u32 = 1 << 0;
const JADSTART: u32 = 1 << 3;
const ADCAL: u32 = 1 << 31;
/// Bit of CFGR: no queue of injected sequences. With a queue the program cannot start one.
const JQDIS: u32 = 1 << 31;
/// How long a sequence takes, ns: three conversions of the slower chip in its slower revision,
/// an H743 of revision V, whose converter halves its clock once more.
const SEQUENCE_NS: u64 = 75_000;

/// The converter, and the voltages at its channels.
pub struct Adc {
    registers: [u32; 64],
    /// Bits of a conversion.
    bits: u32,
    /// Until when a sequence is under way, ns.
    busy_until_ns: Option<u64>,
    /// Readings of 12 bits at the channels, by their numbers.
    pub levels: [u16; 20],
}

impl Adc {
    /// A converter in reset, whose conversions have so many bits.
    #[must_use]
    pub fn new(bits: u32) -> Self {
        let mut registers = [0; 64];
        registers[(CFGR / 4) as usize] = JQDIS;
        Self {
            registers,
            bits,
            busy_until_ns: None,
            levels: [2048; 20],
        }
    }

    fn register(&mut self, offset: u32) -> &mut u32 {
        &mut self.registers[(offset / 4) as usize]
    }

    /// A register that the core reads.
    pub fn read(&mut self, offset: u32, now_ns: u64) -> u32 {
        self.finish(now_ns);
        *self.register(offset)
    }

    /// A write of the core's.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32, now_ns: u64) {
        self.finish(now_ns);
        let written = *self.register(offset) & !mask | value & mask;
        match offset {
            // What is written as set is cleared.
            ISR => *self.register(ISR) &= !(value & mask),
            // A calibration is done at once.
            CR => {
                *self.register(CR) = written & !(ADCAL | JADSTART);
                if written & ADEN != 0 {
                    *self.register(ISR) |= ADRDY;
                }
                let may_start = written & ADEN != 0 && *self.register(CFGR) & JQDIS != 0;
                if written & JADSTART != 0 && may_start && self.busy_until_ns.is_none() {
                    self.busy_until_ns = Some(now_ns + SEQUENCE_NS);
                }
            }
            _ => *self.register(offset) = written,
        }
    }

    /// Ends a sequence whose time is up.
    fn finish(&mut self, now_ns: u64) {
        if self.busy_until_ns.is_none_or(|until_ns| now_ns < until_ns) {
            return;
        }
        self.busy_until_ns = None;
        let sequence = *self.register(JSQR);
        for rank in 0..=(sequence & 3) {
            let channel = sequence >> (9 + 6 * rank) & 0x1F;
            let level = self.levels.get(channel as usize).map_or(0, |level| *level);
            *self.register(JDR1 + 4 * rank) = u32::from(level) << (self.bits - 12);
        }
        *self.register(ISR) |= JEOC | JEOS;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_is_there_when_its_time_is_up() {
        let mut adc = Adc::new(16);
        adc.levels[9] = 0x123;
        adc.write(JSQR, 1 | 9 << 9 | 2 << 15, u32::MAX, 0);
        adc.write(CR, ADEN, u32::MAX, 0);
        assert_eq!(adc.read(ISR, 0), ADRDY);
        adc.write(CR, ADEN | JADSTART, u32::MAX, 0);
        assert_eq!(adc.read(ISR, SEQUENCE_NS - 1), ADRDY);
        assert_eq!(adc.read(ISR, SEQUENCE_NS), ADRDY | JEOC | JEOS);
        assert_eq!(adc.read(JDR1, SEQUENCE_NS), 0x1230);
        adc.write(ISR, JEOS, u32::MAX, SEQUENCE_NS);
        assert_eq!(adc.read(ISR, SEQUENCE_NS), ADRDY | JEOC);
    }

    #[test]
    fn with_a_queue_nothing_starts() {
        let mut adc = Adc::new(12);
        adc.write(CFGR, 0, u32::MAX, 0);
        adc.write(CR, ADEN | JADSTART, u32::MAX, 0);
        assert_eq!(adc.read(ISR, 1_000_000), ADRDY);
    }
}
