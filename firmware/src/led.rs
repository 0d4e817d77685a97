//! What the status LED says.

use hapterra_core::guard::{Fault, Mode, Report};

/// What there is to say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Signal {
    /// Off: a short flash every two seconds.
    #[default]
    Disarmed,
    /// Asked to arm, waits for the dead-man switch or for a small force: four
    /// flashes a second.
    Waiting,
    /// Amplifiers on: lit.
    On,
    /// Amplifiers on and touching: lit, with four short gaps a second.
    Touching,
    /// A fault: as many flashes as its number, then a pause.
    Fault(u8),
}

/// Of a fault's flashes, ms.
const FLASH: u32 = 200;
const FLASH_AND_GAP: u32 = 500;
const PAUSE: u32 = 1_500;

impl Signal {
    /// What the guard's report and the contact come to.
    #[must_use]
    pub const fn of(report: &Report, touching: bool) -> Self {
        match (report.fault, report.mode) {
            (Some(fault), _) => Self::Fault(Fault::number(fault)),
            (None, Mode::Disarmed) => Self::Disarmed,
            (None, Mode::Requested | Mode::Confirming) => Self::Waiting,
            (None, _) if touching => Self::Touching,
            (None, _) => Self::On,
        }
    }

    /// Whether the LED is lit at a time, in milliseconds from anywhere.
    #[must_use]
    pub const fn is_lit(self, ms: u32) -> bool {
        match self {
            Self::Disarmed => ms % 2_000 < 50,
            Self::Waiting => ms % 250 < 125,
            Self::On => true,
            Self::Touching => ms % 250 >= 50,
            Self::Fault(number) => {
                let flashes = number as u32 * FLASH_AND_GAP;
                let at = ms % (flashes + PAUSE);
                at < flashes && at % FLASH_AND_GAP < FLASH
            }
        }
    }

    /// As one number, to be handed on by a single store.
    #[must_use]
    pub const fn to_bits(self) -> u8 {
        match self {
            Self::Disarmed => 0,
            Self::Waiting => 1,
            Self::On => 2,
            Self::Touching => 3,
            Self::Fault(number) => 0x80 | number,
        }
    }

    /// Back from [`Self::to_bits`].
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        match bits {
            1 => Self::Waiting,
            2 => Self::On,
            3 => Self::Touching,
            0x80.. => Self::Fault(bits & 0x7F),
            _ => Self::Disarmed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flashes(signal: Signal, ms: u32) -> usize {
        let lit = |at: &u32| signal.is_lit(*at);
        (1..ms).filter(|at| lit(at) && !lit(&(at - 1))).count()
    }

    #[test]
    fn a_fault_flashes_its_number_and_pauses() {
        for fault in Fault::ALL {
            let number = fault.number();
            let signal = Signal::Fault(number);
            let round = u32::from(number) * FLASH_AND_GAP + PAUSE;
            // From one pause to the next.
            let shown = (round - 1..2 * round - 1)
                .filter(|ms| signal.is_lit(ms + 1) && !signal.is_lit(*ms))
                .count();
            assert_eq!(shown, number.into(), "{fault:?}");
            assert!((round - PAUSE..round).all(|ms| !signal.is_lit(ms)));
        }
    }

    #[test]
    fn every_signal_looks_different_within_ten_seconds() {
        let mut all = vec![
            Signal::Disarmed,
            Signal::Waiting,
            Signal::On,
            Signal::Touching,
        ];
        all.extend(Fault::ALL.map(|fault| Signal::Fault(fault.number())));
        let looks: Vec<Vec<bool>> = all
            .iter()
            .map(|signal| (0..10_000).map(|ms| signal.is_lit(ms)).collect())
            .collect();
        for (i, look) in looks.iter().enumerate() {
            assert!(!looks[..i].contains(look), "{:?}", all[i]);
            assert_eq!(Signal::from_bits(all[i].to_bits()), all[i]);
        }
        assert_eq!(flashes(Signal::Disarmed, 10_000), 4);
    }

    #[test]
    fn a_fault_outranks_everything() {
        let mut report = Report {
            mode: Mode::Armed,
            ..Report::default()
        };
        assert_eq!(Signal::of(&report, false), Signal::On);
        assert_eq!(Signal::of(&report, true), Signal::Touching);
        report.fault = Some(Fault::EmergencyStop);
        assert_eq!(Signal::of(&report, true), Signal::Fault(5));
    }
}
