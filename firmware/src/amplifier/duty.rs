//! Commands as duty cycles, for an amplifier that measures each period (Maxon ESCON).
//!
//! The ESCON 50/5 accepts 10 Hz to 5 kHz and 10 to 90 %. Its hardware reference (rel9051, 3.3.4.1)
//! states the typical error of a reading: 0.1 % of the period at 10 Hz, 0.5 % at 1 kHz, 2.5 % at 5
//! kHz: some 5 µs each. With a span of 70 % for ±5.5 A that is:
//!
//! | frequency | error of the reading | error of the current | delay of a command |
//! | --- | --- | --- | --- |
//! | 1 kHz | 0.5 % | 0.08 A | 1 to 2 ms |
//! | 2 kHz | 1 % | 0.16 A | 0.5 to 1 ms |
//! | 5 kHz | 2.5 % | 0.39 A | 0.2 to 0.4 ms |
//!
//! A command waits for the beginning of the next period and is read at the end of that period.

/// Frequency of the duty cycles, Hz. At 2 kHz a command is late by less than a tick of 1 kHz, and
/// the error of the reading is 0.25 N at the tip of a Premium 1.5.
pub const DUTY_HZ: u32 = 2_000;

/// Distance of full scale from 50 %, as a share of the period. It leaves 5 % to either end of the
/// amplifier's range, five times the error of its reading: the amplifier treats a reading beyond 10
/// or 90 % as a broken wire.
const SPAN: f32 = 0.35;

/// Returns the compare count for `fraction` of full scale, -1..=1, of a timer whose duty cycle is
/// 100 % at `max` counts: 15 % is the largest negative current and 85 % the largest positive one.
/// Rounded to the nearest count.
#[must_use]
pub fn duty_code(fraction: f32, max: u16) -> u16 {
    (f32::from(max) * (0.5 + SPAN * fraction) + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error of an ESCON's reading of a duty cycle, s.
    const ESCON_READS_S: f64 = 5e-6;

    /// Safety: 21, images.
    #[test]
    fn full_scale_duty_stays_clear_of_escon_broken_wire_range() {
        // The timer's counts at 228 MHz, and smaller ones.
        for max in [60_000, 1_000, 200] {
            for (fraction, end) in [(-1.0, 0.1), (1.0, 0.9)] {
                let duty = f64::from(duty_code(fraction, max)) / f64::from(max);
                let margin = (duty - end).abs();
                let wrong = ESCON_READS_S * f64::from(DUTY_HZ);
                assert!((0.1..0.9).contains(&duty));
                assert!(margin > 4.0 * wrong, "{duty}: {margin} {wrong}");
            }
        }
    }

    #[test]
    fn escon_reading_error_is_below_a_thirtieth_of_full_scale() {
        let wrong = ESCON_READS_S * f64::from(DUTY_HZ) / f64::from(SPAN);
        assert!(wrong < 1.0 / 30.0, "{wrong}");
    }

    #[test]
    fn half_the_period_is_no_current() {
        assert_eq!(duty_code(0.0, 60_000), 30_000);
        assert_eq!(duty_code(1.0, 60_000), 51_000);
        assert_eq!(duty_code(-1.0, 60_000), 9_000);
    }
}
