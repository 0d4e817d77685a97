//! Patterns of the status LED.

use hapterra_core::guard::{Fault, Mode, Report};

/// A pattern of the status LED.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LedPattern {
    /// Off: a short flash every two seconds.
    #[default]
    Disarmed,
    /// Arming, with the wait for the dead-man switch or for a small force: four flashes a second.
    Waiting,
    /// Amplifiers on: lit.
    On,
    /// Amplifiers on and touching: lit, with four short gaps a second.
    Touching,
    /// A fault: its number as a count of flashes, then a pause.
    Fault(u8),
    /// A chip that the program does not support: a long and a short flash, then a pause.
    WrongChip,
}

/// Length of a fault's flash, ms.
const FLASH: u32 = 200;
/// Time from one flash of a fault to the next, ms.
const FLASH_AND_GAP: u32 = 400;
/// Time after the last flash of a fault, ms.
const PAUSE: u32 = 1_500;

impl LedPattern {
    /// States and their patterns, as texts for the user.
    pub const MEANINGS: [(&'static str, &'static str); 6] = [
        ("amplifiers off", "a short flash every two seconds"),
        (
            "waits for the dead-man switch or for a small force",
            "four flashes a second",
        ),
        ("amplifiers on", "lit"),
        (
            "amplifiers on, in contact",
            "lit, with four short gaps a second",
        ),
        ("a fault", "as many flashes as its number, then a pause"),
        (
            "a chip that the program refuses",
            "a long and a short flash, then a pause",
        ),
    ];

    /// Returns the pattern for the guard's report and for contact of the HIP.
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

    /// Returns true if the LED is lit at the time `ms`, in milliseconds from any origin.
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
            Self::WrongChip => matches!(ms % 2_000, 0..600 | 800..1_000),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flashes(signal: LedPattern, ms: u32) -> usize {
        let lit = |at: &u32| signal.is_lit(*at);
        (1..ms).filter(|at| lit(at) && !lit(&(at - 1))).count()
    }

    #[test]
    fn fault_flashes_its_number_and_pauses() {
        for fault in Fault::ALL {
            let number = fault.number();
            let signal = LedPattern::Fault(number);
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
    fn led_patterns_differ_within_ten_seconds() {
        let mut all = vec![
            LedPattern::Disarmed,
            LedPattern::Waiting,
            LedPattern::On,
            LedPattern::Touching,
        ];
        all.extend(Fault::ALL.map(|fault| LedPattern::Fault(fault.number())));
        let patterns: Vec<Vec<bool>> = all
            .iter()
            .map(|signal| (0..10_000).map(|ms| signal.is_lit(ms)).collect())
            .collect();
        for (i, pattern) in patterns.iter().enumerate() {
            assert!(!patterns[..i].contains(pattern), "{:?}", all[i]);
        }
        assert_eq!(flashes(LedPattern::Disarmed, 10_000), 4);
    }

    #[test]
    fn fault_has_priority_over_all_patterns() {
        let mut report = Report {
            mode: Mode::Armed,
            ..Report::default()
        };
        assert_eq!(LedPattern::of(&report, false), LedPattern::On);
        assert_eq!(LedPattern::of(&report, true), LedPattern::Touching);
        report.fault = Some(Fault::EmergencyStop);
        assert_eq!(LedPattern::of(&report, true), LedPattern::Fault(5));
    }
}
