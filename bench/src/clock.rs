//! The time of a measurement.

use std::time::Duration;

/// Counts this thread's processor time, or the elapsed time if the system does not report it.
pub(crate) struct Stopwatch {
    begin: Duration,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { begin: now() }
    }

    pub(crate) fn elapsed(&self) -> Duration {
        now().saturating_sub(self.begin)
    }
}

#[cfg(unix)]
fn now() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    Duration::from_secs(seconds) + Duration::from_nanos(u64::try_from(time.tv_nsec).unwrap_or(0))
}

#[cfg(not(unix))]
fn now() -> Duration {
    use std::sync::LazyLock;
    use std::time::Instant;
    static ORIGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    ORIGIN.elapsed()
}
