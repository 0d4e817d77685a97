//! A rate limit for lines that another program can cause.

use std::time::{Duration, Instant};

/// Time for which lines are counted together.
const WINDOW: Duration = Duration::from_secs(1);

/// Lets so many lines through in a second, and counts the others.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineLimit {
    most: u32,
    /// When the present second began, and the lines let through in it.
    window: Option<(Instant, u32)>,
    left_out: u64,
}

impl LineLimit {
    /// Lets `most` lines a second through.
    pub(super) const fn new(most: u32) -> Self {
        Self {
            most,
            window: None,
            left_out: 0,
        }
    }

    /// Returns the number of lines that were left out since the last one, if a line at `now` is
    /// allowed.
    pub(super) fn admit(&mut self, now: Instant) -> Option<u64> {
        let open = self
            .window
            .filter(|(began, _)| now.saturating_duration_since(*began) < WINDOW);
        let (began, said) = open.unwrap_or((now, 0));
        if said >= self.most {
            self.left_out += 1;
            return None;
        }
        self.window = Some((began, said + 1));
        Some(std::mem::take(&mut self.left_out))
    }

    /// Returns the number of lines that were left out since the last one.
    pub(super) const fn left_out(&self) -> u64 {
        self.left_out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_so_many_a_second_lines_are_counted_and_the_count_is_told_once() {
        let began = Instant::now();
        let at = |ms: u64| began + Duration::from_millis(ms);
        let mut one = LineLimit::new(1);
        assert_eq!(one.admit(at(0)), Some(0));
        for ms in 1..1000 {
            assert_eq!(one.admit(at(ms)), None);
        }
        assert_eq!(one.left_out(), 999);
        assert_eq!(one.admit(at(1000)), Some(999));
        assert_eq!(one.admit(at(1001)), None);
        assert_eq!(one.admit(at(2500)), Some(1));
        let mut three = LineLimit::new(3);
        let said = (0..10).filter(|_| three.admit(at(5)).is_some()).count();
        assert_eq!((said, three.left_out()), (3, 7));
    }
}
