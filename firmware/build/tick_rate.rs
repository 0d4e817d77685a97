//! The tick rate that an image is built for.

/// Whole kilohertz up to ten: `hapterra_core::rate::TickRate` takes no others.
const KILOHERTZ: std::ops::RangeInclusive<u32> = 1..=10;

/// Ticks a second for a board whose tick timer counts `counts_a_second` times:
/// what `HAPTERRA_TICK_HZ` says, or 1,000.
///
/// # Errors
/// What to say of a value that the board cannot have.
pub(crate) fn tick_hz(
    chosen: Option<&str>,
    board: &str,
    counts_a_second: u32,
) -> Result<u32, String> {
    let allowed = || {
        let all = KILOHERTZ.map(|khz| 1_000 * khz);
        all.filter(|hz| counts_a_second.is_multiple_of(*hz))
    };
    let Some(text) = chosen else {
        return Ok(1_000);
    };
    let number = text.trim().parse().ok();
    let found = number.and_then(|hz: u32| allowed().find(|one| *one == hz));
    found.ok_or_else(|| {
        let all: Vec<_> = allowed().map(|hz| hz.to_string()).collect();
        format!(
            "HAPTERRA_TICK_HZ is {text:?}; {board} can tick {} times a second",
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
    fn one_kilohertz_where_nothing_is_said() {
        assert_eq!(tick_hz(None, "a board", G474), Ok(1_000));
    }

    #[test]
    fn what_divides_the_timers_clock_is_taken_and_core_takes_it_too() {
        for (clock, rates) in [
            (
                G474,
                &[
                    1_000, 2_000, 3_000, 4_000, 5_000, 6_000, 7_000, 8_000, 10_000,
                ][..],
            ),
            (
                H743,
                &[1_000, 2_000, 3_000, 4_000, 5_000, 6_000, 8_000, 10_000],
            ),
        ] {
            let taken: Vec<u32> = (0..=20_000)
                .filter(|hz| tick_hz(Some(&hz.to_string()), "a board", clock).is_ok())
                .collect();
            assert_eq!(taken, rates);
            assert!(taken.iter().all(|hz| TickRate::new(*hz).is_some()));
            // The auto-reload register has 16 bits.
            assert!(taken.iter().all(|hz| clock / hz <= 65_536));
        }
    }

    #[test]
    fn anything_else_is_named_with_what_there_is_instead() {
        for text in [
            "0", "999", "10001", "9000", "1500", "-1000", "1e3", "fast", "",
        ] {
            let why = tick_hz(Some(text), "nucleo-g474re", G474).expect_err(text);
            assert_eq!(
                why,
                format!(
                    "HAPTERRA_TICK_HZ is {text:?}; nucleo-g474re can tick 1000, 2000, 3000, \
                     4000, 5000, 6000, 7000, 8000, 10000 times a second"
                )
            );
        }
    }
}
