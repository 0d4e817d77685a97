//! Memory of a process, and the bytes that it reads.

use std::io::{self, BufRead as _, Write as _};

use super::MeasureError;

/// Requests or reads, and their bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Traffic {
    /// The number.
    pub(super) requests: u64,
    /// Received bytes.
    pub(super) bytes: u64,
}

/// Query on standard output, which is answered on standard input.
pub(super) const TRAFFIC_QUERY: &str = "seen?";

/// Counter of the traffic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meter {
    /// The system, for reads of this process.
    System,
    /// The server, queried through the parent process.
    Server,
}

impl Meter {
    /// Returns the traffic of reads; `None` if it is unknown.
    ///
    /// # Errors
    /// If the parent process does not answer.
    pub(super) fn traffic(self) -> Result<Option<Traffic>, MeasureError> {
        match self {
            Self::System => Ok(read_by_this_process()),
            Self::Server => query_server().map(Some),
        }
    }
}

fn query_server() -> Result<Traffic, MeasureError> {
    let send_query = || -> io::Result<String> {
        let mut out = io::stdout().lock();
        writeln!(out, "{TRAFFIC_QUERY}")?;
        out.flush()?;
        let mut line = String::new();
        io::stdin().lock().read_line(&mut line)?;
        Ok(line)
    };
    let line = send_query()
        .map_err(|error| MeasureError(format!("the counter does not answer: {error}")))?;
    let mut numbers = line.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(requests)), Some(Ok(bytes))) => Ok(Traffic { requests, bytes }),
        _ => Err(MeasureError(format!(
            "the counter does not answer: {line:?} was answered"
        ))),
    }
}

/// Returns the calls of `read` and the like, and their bytes, from any file, as reported by Linux.
fn read_by_this_process() -> Option<Traffic> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    Some(Traffic {
        requests: number_after(&text, "syscr:")?,
        bytes: number_after(&text, "rchar:")?,
    })
}

/// Returns the peak memory of this process, bytes, as reported by Linux.
pub(super) fn peak_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    Some(1024 * number_after(&text, "VmHWM:")?)
}

fn number_after(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_the_systems_tables_are_parsed() {
        let text = "Name:\tbench\nVmPeak:\t  900 kB\nVmHWM:\t   123456 kB\n";
        assert_eq!(number_after(text, "VmHWM:"), Some(123_456));
        assert_eq!(number_after(text, "VmSwap:"), None);
        assert_eq!(number_after("VmHWM:", "VmHWM:"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn reads_of_this_process_are_counted() {
        let before = read_by_this_process().expect("Linux reports it");
        let read = std::fs::read(std::env::current_exe().expect("a path")).expect("readable");
        let after = read_by_this_process().expect("Linux reports it");
        assert!(after.bytes - before.bytes >= read.len() as u64);
        assert!(after.requests > before.requests);
        assert!(peak_bytes() > Some(1 << 20));
    }
}
