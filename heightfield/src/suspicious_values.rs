//! Stored values that are probably no-data, though the file does not declare them.

/// Max magnitude of a height (in the file's vertical unit), on any planet: a larger sample is a
/// no-data value that the file does not declare.
pub const MAX_HEIGHT: f64 = 1e30;

/// Values that programs often write for no-data.
const LOW: [f64; 5] = [-32_768.0, -32_767.0, -9999.0, -99_999.0, -999.0];
const HIGH: [f64; 3] = [9999.0, 32_767.0, 99_999.0];
/// Zero is suspect if the gap to the next value is at least this share of the other values' range
/// ...
const GAP: f64 = 0.25;
/// ... and at least one value in `ONE_IN` is zero.
const ONE_IN: u64 = 200;

/// The extremes of the stored values that were read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outermost {
    lowest: f64,
    next: f64,
    highest: f64,
    lowest_count: u64,
    count: u64,
    /// Values too large for heights.
    beyond: u64,
}

impl Outermost {
    /// Extremes of no values.
    pub(super) const NONE: Self = Self {
        lowest: f64::INFINITY,
        next: f64::INFINITY,
        highest: f64::NEG_INFINITY,
        lowest_count: 0,
        count: 0,
        beyond: 0,
    };

    /// Counts a stored value that is not declared no-data.
    pub(super) fn add(&mut self, stored: f64) {
        if stored.is_nan() {
            return;
        }
        if stored.abs() > MAX_HEIGHT {
            self.beyond += 1;
            return;
        }
        self.count += 1;
        self.highest = self.highest.max(stored);
        if stored == self.lowest {
            self.lowest_count += 1;
        } else if stored < self.lowest {
            self.next = self.lowest;
            (self.lowest, self.lowest_count) = (stored, 1);
        } else {
            self.next = self.next.min(stored);
        }
    }

    /// Returns remarks for the user; `is_declared` is true if the file has a no-data value.
    pub(super) fn remarks(&self, is_declared: bool) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.beyond > 0 {
            remarks.push(format!(
                "{} of its samples are infinite or beyond ±1e30, which are no heights: they count as no data",
                self.beyond
            ));
        }
        if self.count == 0 {
            return remarks;
        }
        let low = LOW.contains(&self.lowest) || (!is_declared && self.zero_may_mean_no_data());
        let suspects = [
            ("lowest", self.lowest, low),
            ("highest", self.highest, HIGH.contains(&self.highest)),
        ];
        for (which, value, _) in suspects.iter().filter(|(_, _, is_suspect)| *is_suspect) {
            remarks.push(format!(
                "its {which} stored value is {value}, which many files have where there is no data, and it does not declare that: if these are no heights, state it: --input no-data={value}"
            ));
        }
        remarks
    }

    /// Returns true if zeros lie far below all other values, as in the border of a warped image.
    fn zero_may_mean_no_data(&self) -> bool {
        let others = self.highest - self.next;
        self.lowest == 0.0
            && self.lowest_count.saturating_mul(ONE_IN) >= self.count
            && others > 0.0
            && self.next > GAP * others
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remarks(values: &[f64], is_declared: bool) -> String {
        let mut outermost = Outermost::NONE;
        values.iter().for_each(|value| outermost.add(*value));
        outermost.remarks(is_declared).join("; ")
    }

    #[test]
    fn common_no_data_values_are_reported() {
        for value in LOW.into_iter().chain(HIGH) {
            let reported = remarks(&[367.0, value, 400.0], false);
            assert!(
                reported.contains(&format!("--input no-data={value}")),
                "{reported}"
            );
        }
        assert!(remarks(&[0.0, 367.0, 960.0], false).contains("--input no-data=0"));
        assert!(remarks(&[f64::INFINITY, f64::NEG_INFINITY, 1.0], false).starts_with("2 of"));
    }

    #[test]
    fn ordinary_heights_are_not_suspected() {
        for values in [
            &[367.0, 960.0, -12.5][..],
            &[0.0, 1.0, 2.0, 960.0],
            &[0.0, 10.0, 10.0],
            &[0.0, 0.0],
            &[f64::NAN],
        ] {
            assert_eq!(remarks(values, false), "", "{values:?}");
        }
        assert_eq!(remarks(&[0.0, 367.0, 960.0], true), "");
    }
}
