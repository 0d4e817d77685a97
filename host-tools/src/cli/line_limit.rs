//! A rate limit for lines that another program can cause.

use std::time::{Duration, Instant};

/// Interval for which lines are counted.
const WINDOW: Duration = Duration::from_secs(1);

/// Allows a number of lines a second and counts the omitted ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineLimit {
    max_lines: u32,
    /// Start of the current interval, and the lines allowed in it.
    window: Option<(Instant, u32)>,
    omitted: u64,
}

impl LineLimit {
    /// Creates a limit of `max_lines` lines a second.
    pub(super) const fn new(max_lines: u32) -> Self {
        Self {
            max_lines,
            window: None,
            omitted: 0,
        }
    }

    /// Returns the number of lines omitted since the last allowed one, if a line at `now` is
    /// allowed.
    pub(super) fn admit(&mut self, now: Instant) -> Option<u64> {
        let open = self
            .window
            .filter(|(start, _)| now.saturating_duration_since(*start) < WINDOW);
        let (start, shown) = open.unwrap_or((now, 0));
        if shown >= self.max_lines {
            self.omitted += 1;
            return None;
        }
        self.window = Some((start, shown + 1));
        Some(std::mem::take(&mut self.omitted))
    }

    /// Returns the number of lines omitted since the last allowed one.
    pub(super) const fn omitted(&self) -> u64 {
        self.omitted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_over_the_rate_limit_are_counted_and_reported_once() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut one = LineLimit::new(1);
        assert_eq!(one.admit(at(0)), Some(0));
        for ms in 1..1000 {
            assert_eq!(one.admit(at(ms)), None);
        }
        assert_eq!(one.omitted(), 999);
        assert_eq!(one.admit(at(1000)), Some(999));
        assert_eq!(one.admit(at(1001)), None);
        assert_eq!(one.admit(at(2500)), Some(1));
        let mut three = LineLimit::new(3);
        let shown = (0..10).filter(|_| three.admit(at(5)).is_some()).count();
        assert_eq!((shown, three.omitted()), (3, 7));
    }
}
