//! An analogue-to-digital converter of the chips (RM0440 21, RM0433 25): its regulator, enable, the
//! connected channels, and an injected sequence that the program starts.
//!
//! Modelled: of CR DEEPPWD, ADVREGEN with its start-up time, ADCAL, ADEN, JADSTART; of ISR ADRDY,
//! JEOC, JEOS; JQDIS of CFGR; JSQR and JDR; on an H743 PCSEL; on a G474 the wrong first conversion
//! after a millisecond without one (ES0430).
//!
//! Not modelled: the corrections of a calibration, sampling times and prescalers (a sequence takes
//! the longest that the slower chip's can take), DIFSEL, offsets, oversampling, resolutions,
//! queues, triggers, interrupts, DMA, the regular sequence, BOOST, LDORDY, ADDIS and JADSTP.

const ISR: u32 = 0x00;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
/// The connected channels, on an H743 only.
const PCSEL: u32 = 0x1C;
const JSQR: u32 = 0x4C;
const JDR1: u32 = 0x80;

/// Bits of ISR: ready, and the end of the injected sequence.
const ADRDY: u32 = 1 << 0;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;
/// Bits of CR.
const ADEN: u32 = 1 << 0;
const JADSTART: u32 = 1 << 3;
const ADVREGEN: u32 = 1 << 28;
const DEEPPWD: u32 = 1 << 29;
const ADCAL: u32 = 1 << 31;
/// Bit of CFGR: no queue of injected sequences. With a queue the program cannot start one.
const JQDIS: u32 = 1 << 31;
/// Duration of a sequence, ns: three conversions of the slower chip in its slower revision, an H743
/// of revision V, whose converter halves its clock again.
const SEQUENCE_NS: u64 = 75_000;
/// Time without a conversion after which the next one is wrong on a G474, ns: a tenth less than the
/// millisecond of ES0430, for the tolerance of a chip's clock and its temperature.
const STALE_NS: u64 = 900_000;
/// Result of a wrong conversion.
const WRONG: u32 = 0xFFF;
/// Start-up time of the regulator, ns: a G474's 20 µs, an H743's 10.
const REGULATOR_NS: [u64; 2] = [20_000, 10_000];

/// The converter, and the voltages at its channels.
pub struct Adc {
    registers: [u32; 64],
    /// Bits of a conversion: 12 on a G474, 16 on an H743.
    bits: u32,
    /// The time at which the regulator was switched on, ns.
    regulator_ns: Option<u64>,
    /// The time at which the present sequence ends, ns.
    busy_until_ns: Option<u64>,
    /// The time at which the last sequence ended, ns.
    ended_ns: Option<u64>,
    /// True if the first conversion of the present sequence is wrong.
    first_is_wrong: bool,
    /// 12-bit readings at the channels, by their numbers.
    pub levels: [u16; 20],
}

impl Adc {
    /// Creates a converter in reset with this number of bits.
    #[must_use]
    pub fn new(bits: u32) -> Self {
        let mut registers = [0; 64];
        registers[(CFGR / 4) as usize] = JQDIS;
        registers[(CR / 4) as usize] = DEEPPWD;
        Self {
            registers,
            bits,
            regulator_ns: None,
            busy_until_ns: None,
            ended_ns: None,
            first_is_wrong: false,
            levels: [2048; 20],
        }
    }

    const fn is_h743(&self) -> bool {
        self.bits == 16
    }

    /// Follows the regulator's bits, and clears the enable without a regulator.
    fn follow_regulator(&mut self, control: u32, now_ns: u64) -> u32 {
        let is_on = control & (ADVREGEN | DEEPPWD) == ADVREGEN;
        self.regulator_ns = match self.regulator_ns {
            _ if !is_on => None,
            None => Some(now_ns),
            since => since,
        };
        let start_ns = REGULATOR_NS[usize::from(self.is_h743())];
        let is_up = self.regulator_ns.is_some_and(|ns| now_ns >= ns + start_ns);
        if is_up { control } else { control & !ADEN }
    }

    /// Returns the level of a channel: zero if it is not connected.
    fn level(&self, channel: u32) -> u16 {
        let connected = self.registers[(PCSEL / 4) as usize] >> channel & 1 == 1;
        let level = self.levels.get(channel as usize).copied();
        level.filter(|_| connected || !self.is_h743()).unwrap_or(0)
    }

    fn register(&mut self, offset: u32) -> &mut u32 {
        &mut self.registers[(offset / 4) as usize]
    }

    /// Returns a register for the core.
    pub fn read(&mut self, offset: u32, now_ns: u64) -> u32 {
        self.finish(now_ns);
        *self.register(offset)
    }

    /// Writes a register from the core.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32, now_ns: u64) {
        self.finish(now_ns);
        let written = *self.register(offset) & !mask | value & mask;
        match offset {
            // Writing a one clears a bit.
            ISR => *self.register(ISR) &= !(value & mask),
            // A calibration finishes at once.
            CR => {
                let written = self.follow_regulator(written, now_ns);
                *self.register(CR) = written & !(ADCAL | JADSTART);
                if written & ADEN != 0 {
                    *self.register(ISR) |= ADRDY;
                }
                let may_start = written & ADEN != 0 && *self.register(CFGR) & JQDIS != 0;
                if written & JADSTART != 0 && may_start && self.busy_until_ns.is_none() {
                    self.busy_until_ns = Some(now_ns + SEQUENCE_NS);
                    let is_stale = |ended_ns| now_ns > ended_ns + STALE_NS;
                    self.first_is_wrong = !self.is_h743() && self.ended_ns.is_none_or(is_stale);
                }
            }
            _ => *self.register(offset) = written,
        }
    }

    /// Ends a sequence that is due.
    fn finish(&mut self, now_ns: u64) {
        let Some(until_ns) = self.busy_until_ns.filter(|until_ns| now_ns >= *until_ns) else {
            return;
        };
        self.busy_until_ns = None;
        self.ended_ns = Some(until_ns);
        let sequence = *self.register(JSQR);
        for rank in 0..=(sequence & 3) {
            let channel = sequence >> (9 + 6 * rank) & 0x1F;
            let level = match rank == 0 && self.first_is_wrong {
                true => WRONG,
                false => u32::from(self.level(channel)),
            };
            *self.register(JDR1 + 4 * rank) = level << (self.bits - 12);
        }
        *self.register(ISR) |= JEOC | JEOS;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ON: u32 = ADVREGEN | ADEN;
    const UP_NS: u64 = 20_000;

    /// Returns a converter whose regulator is ready at [`UP_NS`].
    fn with_regulator(bits: u32) -> Adc {
        let mut adc = Adc::new(bits);
        adc.write(CR, ADVREGEN, u32::MAX, 0);
        adc
    }

    #[test]
    fn sequence_is_complete_after_its_duration() {
        let mut adc = with_regulator(16);
        adc.levels[9] = 0x123;
        adc.write(JSQR, 1 | 9 << 9 | 2 << 15, u32::MAX, UP_NS);
        adc.write(PCSEL, 1 << 9, u32::MAX, UP_NS);
        adc.write(CR, ON, u32::MAX, UP_NS);
        assert_eq!(adc.read(ISR, UP_NS), ADRDY);
        adc.write(CR, ON | JADSTART, u32::MAX, UP_NS);
        let done_ns = UP_NS + SEQUENCE_NS;
        assert_eq!(adc.read(ISR, done_ns - 1), ADRDY);
        assert_eq!(adc.read(ISR, done_ns), ADRDY | JEOC | JEOS);
        assert_eq!(adc.read(JDR1, done_ns), 0x1230);
        assert_eq!(adc.read(JDR1 + 4, done_ns), 0, "channel 2 is not connected");
        adc.write(ISR, JEOS, u32::MAX, done_ns);
        assert_eq!(adc.read(ISR, done_ns), ADRDY | JEOC);
    }

    #[test]
    fn first_conversion_after_a_millisecond_is_wrong() {
        let mut adc = with_regulator(12);
        adc.levels[9] = 0x123;
        adc.write(JSQR, 1 | 9 << 9 | 9 << 15, u32::MAX, UP_NS);
        adc.write(CR, ON, u32::MAX, UP_NS);
        let mut convert = |at_ns: u64| {
            adc.write(CR, ON | JADSTART, u32::MAX, at_ns);
            let done_ns = at_ns + SEQUENCE_NS;
            [JDR1, JDR1 + 4].map(|register| adc.read(register, done_ns))
        };
        assert_eq!(convert(UP_NS), [WRONG, 0x123]);
        assert_eq!(convert(UP_NS + 500_000), [0x123; 2]);
        assert_eq!(convert(UP_NS + 1_500_000), [WRONG, 0x123]);
    }

    #[test]
    fn adc_is_not_enabled_before_its_regulator_is_up() {
        for (control, at_ns) in [(ADEN, UP_NS), (ON | DEEPPWD, UP_NS), (ON, UP_NS - 1)] {
            let mut adc = with_regulator(12);
            adc.write(CR, control, u32::MAX, at_ns);
            assert_eq!(adc.read(ISR, at_ns), 0, "{control:#x} at {at_ns}");
            assert_eq!(adc.read(CR, at_ns) & ADEN, 0);
        }
    }

    #[test]
    fn injected_queue_prevents_conversions() {
        let mut adc = with_regulator(12);
        adc.write(CFGR, 0, u32::MAX, UP_NS);
        adc.write(CR, ON | JADSTART, u32::MAX, UP_NS);
        assert_eq!(adc.read(ISR, 1_000_000), ADRDY);
    }
}
