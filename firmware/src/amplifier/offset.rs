//! Commands as voltages of a converter on the chip, and monitors as voltages at one: 12 bits over 0
//! to 3.3 V, where the middle is no current.

/// No current: 1.65 V.
const MIDDLE: f32 = 2048.0;
/// Codes from the middle to full scale: 1.44 V. The output is then 0.206 to 3.094 V. The G474's
/// buffered output is specified from 0.2 V to 0.2 V below its supply; beyond that it clips, which
/// would cut the largest currents. Buffered it drives 5 kΩ, so an offset stage can have the
/// resistor to the middle that detects a broken wire.
const SPAN: f32 = 1792.0;

/// Returns the 12-bit code for `fraction` of full scale, -1..=1. Rounded to the nearest code, with
/// an error of at most half a code (1.5 mA of 5.5 A).
#[must_use]
pub fn offset_code(fraction: f32) -> u16 {
    // The cast saturates; adding a half makes it round.
    (MIDDLE + SPAN * fraction + 0.5) as u16
}

/// Returns the current in mA for a monitor's 12-bit reading, where full scale is `full_scale_a`
/// amperes; the inverse of [`offset_code`].
#[must_use]
pub fn monitor_ma(code: u16, full_scale_a: f32) -> i16 {
    ((f32::from(code) - MIDDLE) / SPAN * full_scale_a * 1e3) as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the volts of a code.
    fn volts(code: u16) -> f64 {
        3.3 * f64::from(code) / 4096.0
    }

    /// Safety: 21, images.
    #[test]
    fn full_scale_stays_where_a_buffered_output_is_specified() {
        for fraction in [-1.0, 1.0] {
            let out = volts(offset_code(fraction));
            assert!((0.2..=3.3 - 0.2).contains(&out), "{out} V");
        }
    }

    #[test]
    fn converter_codes_span_the_range_and_are_nearest() {
        assert_eq!(offset_code(-1.0), 256);
        assert_eq!(offset_code(0.0), 2048);
        assert_eq!(offset_code(1.0), 3840);
        assert_eq!(offset_code(0.2501), 2496);
    }

    #[test]
    fn monitor_reads_back_the_commanded_current() {
        for fraction in [-1.0, -0.3, 0.0, 0.01, 0.77, 1.0] {
            let back = monitor_ma(offset_code(fraction), 5.5);
            let commanded = 5500.0 * fraction;
            assert!((f32::from(back) - commanded).abs() <= 3.1, "{back}");
        }
        assert_eq!(monitor_ma(0, 5.5), -6285);
        assert_eq!(monitor_ma(4095, 5.5), 6282);
    }
}
