//! The tick rate of an image.

/// Whole kilohertz up to ten: `hapterra_core::rate::TickRate` accepts no others.
const KILOHERTZ: std::ops::RangeInclusive<u32> = 1..=10;

/// Maximum tick rate of each board, Hz: its whole interrupt, by the bound of
/// docs/reference/hardware.md ("From encoder to output"), takes at most a period. A test of the
/// images compares both.
pub(crate) const FASTEST_HZ: [(&str, u32); 3] = [
    ("nucleo-g474re", 4_000),
    ("nucleo-h743zi2", 8_000),
    ("nucleo-h743zi2-spi", 6_000),
];

/// Returns the tick rate for a board whose tick timer counts `counts_a_second` times a second:
/// `HAPTERRA_TICK_HZ`, or 1,000 if it is not set.
///
/// # Errors
/// A message about a rate that the board does not support.
pub(crate) fn tick_hz(
    chosen: Option<&str>,
    board: &str,
    counts_a_second: u32,
) -> Result<u32, String> {
    let allowed = || {
        let fastest = FASTEST_HZ.iter().find(|(name, _)| *name == board);
        let fastest = fastest.map_or(1_000, |(_, hz)| *hz);
        let all = KILOHERTZ.map(|khz| 1_000 * khz);
        all.filter(move |hz| *hz <= fastest && counts_a_second.is_multiple_of(*hz))
    };
    let Some(text) = chosen else {
        return Ok(1_000);
    };
    let number = text.trim().parse().ok();
    let found = number.and_then(|hz: u32| allowed().find(|one| *one == hz));
    found.ok_or_else(|| {
        let all: Vec<_> = allowed().map(|hz| hz.to_string()).collect();
        format!(
            "HAPTERRA_TICK_HZ is {text:?}; {board} can tick {} times a second; at another rate \
             its ticks may come late (docs/reference/hardware.md, \"From encoder to output\")",
            all.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::tick_hz;
    use hapterra_core::rate::TickRate;

    /// The tick timers of the two chips.
    const G474: u32 = 42_000_000;
    const H743: u32 = 57_000_000;

    #[test]
    fn tick_rate_defaults_to_one_kilohertz() {
        assert_eq!(tick_hz(None, "a board", G474), Ok(1_000));
    }

    #[test]
    fn rates_that_divide_the_clock_and_meet_timing_are_accepted() {
        for (board, clock, rates) in [
            ("nucleo-g474re", G474, &[1_000, 2_000, 3_000, 4_000][..]),
            (
                "nucleo-h743zi2",
                H743,
                &[1_000, 2_000, 3_000, 4_000, 5_000, 6_000, 8_000],
            ),
            (
                "nucleo-h743zi2-spi",
                H743,
                &[1_000, 2_000, 3_000, 4_000, 5_000, 6_000],
            ),
        ] {
            let accepted: Vec<u32> = (0..=20_000)
                .filter(|hz| tick_hz(Some(&hz.to_string()), board, clock).is_ok())
                .collect();
            assert_eq!(accepted, rates, "{board}");
            assert!(accepted.iter().all(|hz| TickRate::new(*hz).is_some()));
            // The auto-reload register has 16 bits.
            assert!(accepted.iter().all(|hz| clock / hz <= 65_536));
        }
    }

    #[test]
    fn other_rate_is_refused_with_the_possible_rates() {
        for text in [
            "0", "999", "5000", "9000", "1500", "-1000", "1e3", "fast", "",
        ] {
            let why = tick_hz(Some(text), "nucleo-g474re", G474).expect_err(text);
            let begin = format!(
                "HAPTERRA_TICK_HZ is {text:?}; nucleo-g474re can tick 1000, 2000, 3000, 4000 \
                 times a second; at another rate"
            );
            assert!(why.starts_with(&begin), "{why}");
        }
    }
}
