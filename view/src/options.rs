//! Options of the command line.

use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use lexopt::{Arg, Parser, ValueExt as _};

/// Shown for `--help`.
pub const HELP: &str = "\
hapterra-view: shows what the hand feels, as a page in a browser

hapterra starts this program: `hapterra run|demo|replay --view`, or `hapterra view RECORDING`.
Options reach it through HAPTERRA_VIEW_OPTIONS, separated by spaces.

  --port N        port of the page [default: 8760, or a free one where that is taken]
  --bind ADDRESS  address that the page is served on [default: 127.0.0.1, this machine alone]
  --no-browser    only print where the page is
  --history-mb N  megabytes of a live session that a page that comes later is told [default: 48]
  --page-mb N     megabytes from which on a page begins anew [default: 1024]
  --linger S      seconds that the page stays after the session's end, once nobody looks
                  [default: 15; until hapterra ends where nobody has looked yet]
  --rrd FILE      write a recording for rerun's own viewer, too
";

/// The port that is tried first.
const PORT: u16 = 8760;

/// Options of the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The page's port; `None` for the default port or a free one.
    pub port: Option<u16>,
    /// The page's address.
    pub bind: IpAddr,
    /// True if a browser is to be opened.
    pub browser: bool,
    /// Bytes of a live session's history.
    pub history_bytes: usize,
    /// Memory of a page at which it reloads, bytes.
    pub page_bytes: u64,
    /// Time for which the page remains after the session's end, when no page is open; `None`: until
    /// a page has opened, and then the default time.
    pub linger: Option<Duration>,
    /// A recording for rerun's own viewer.
    pub rrd: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            port: None,
            bind: Ipv4Addr::LOCALHOST.into(),
            browser: true,
            history_bytes: 48 << 20,
            page_bytes: 1 << 30,
            linger: None,
            rrd: None,
        }
    }
}

impl Options {
    /// Returns the ports in the order in which they are tried.
    #[must_use]
    pub fn ports(&self) -> Vec<u16> {
        match self.port {
            Some(port) => vec![port],
            None => vec![PORT, 0],
        }
    }

    /// Parses the words of a command line; `None` for a request for help.
    ///
    /// # Errors
    /// A word that is no option, or an invalid value.
    pub fn read(words: impl IntoIterator<Item = OsString>) -> Result<Option<Self>> {
        let mut options = Self::default();
        let mut parser = Parser::from_args(words);
        while let Some(word) = parser.next()? {
            match word {
                Arg::Long("port") => options.port = Some(parser.value()?.parse()?),
                Arg::Long("bind") => options.bind = parser.value()?.parse()?,
                Arg::Long("no-browser") => options.browser = false,
                Arg::Long("history-mb") => {
                    options.history_bytes = megabytes(&mut parser)? as usize;
                }
                Arg::Long("page-mb") => options.page_bytes = megabytes(&mut parser)?,
                Arg::Long("linger") => {
                    let seconds: f64 = parser.value()?.parse()?;
                    let linger = Duration::try_from_secs_f64(seconds);
                    options.linger = Some(linger.context("--linger takes seconds")?);
                }
                Arg::Long("rrd") => options.rrd = Some(parser.value()?.into()),
                Arg::Long("help") | Arg::Short('h') => return Ok(None),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(Some(options))
    }
}

fn megabytes(parser: &mut Parser) -> Result<u64> {
    let megabytes: u32 = parser.value()?.parse()?;
    if megabytes == 0 {
        bail!("at least 1 megabyte");
    }
    Ok(u64::from(megabytes) << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &[&str]) -> Result<Option<Options>> {
        Options::read(words.iter().map(OsString::from))
    }

    #[test]
    fn default_options_bind_to_loopback_only() {
        let options = read(&[]).expect("valid").expect("no help");
        assert!(options.bind.is_loopback());
        assert_eq!(options, Options::default());
    }

    #[test]
    fn valid_options_are_read_and_invalid_ones_refused() {
        let words = [
            "--port",
            "9",
            "--bind",
            "::",
            "--linger=0.5",
            "--page-mb",
            "2",
        ];
        let options = read(&words).expect("valid").expect("no help");
        assert_eq!((options.ports(), options.page_bytes), (vec![9], 2 << 20));
        assert_eq!(options.linger, Some(Duration::from_millis(500)));
        assert_eq!(read(&["--help"]).expect("valid"), None);
        let bad = [
            ["--bind", "here"],
            ["--port", "-1"],
            ["--linger", "-1"],
            ["--page-mb", "0"],
        ];
        for words in bad {
            assert!(read(&words).is_err(), "{words:?}");
        }
        assert!(read(&["file"]).is_err());
    }
}
