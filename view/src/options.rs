//! Options of the command line.

use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, Result, anyhow, bail};
use lexopt::{Arg, Parser, ValueExt as _};

/// Shown for `--help`.
pub const HELP: &str = "\
hapterra-view: shows terrain, hand and forces as a page in a browser

hapterra starts this program: `hapterra run|demo|replay --view`, or `hapterra view RECORDING`.
Options are read from HAPTERRA_VIEW_OPTIONS, separated by spaces.

  --port N        port of the page [default: 8760, or a free one if that is in use]
  --bind ADDRESS  address at which the page is served [default: 127.0.0.1, only this machine]
  --no-browser    print the page's address, and open no browser
  --history SIZE  size of a live session's history for pages that open later [default: 48MB]
  --page SIZE     memory of a page at which it reloads [default: 1024MB]
  --linger TIME   time from the session's end, with no page open, to the end of this program
                  [default: 15s; if no page was opened: until hapterra ends]
  -o, --out FILE  write a recording for rerun's own viewer
  -h, --help      print this help
";

/// Sizes and their units in megabytes; without a unit, megabytes.
const SIZES: &[(&str, f64)] = &[("MB", 1.0), ("GB", 1024.0)];
/// Times and their units in seconds; without a unit, seconds.
const TIMES: &[(&str, f64)] = &[("s", 1.0), ("ms", 1e-3), ("min", 60.0)];

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
                Arg::Long("history") => options.history_bytes = size(&mut parser)? as usize,
                Arg::Long("page") => options.page_bytes = size(&mut parser)?,
                Arg::Long("linger") => {
                    let linger = Duration::try_from_secs_f64(quantity(&mut parser, TIMES)?);
                    options.linger = Some(linger.context("--linger takes a time, such as 15s")?);
                }
                Arg::Short('o') | Arg::Long("out") => options.rrd = Some(parser.value()?.into()),
                Arg::Long("help") | Arg::Short('h') => return Ok(None),
                other => return Err(refused(other)),
            }
        }
        Ok(Some(options))
    }
}

/// Parses a size, bytes.
fn size(parser: &mut Parser) -> Result<u64> {
    let megabytes = quantity(parser, SIZES)?;
    if !(1.0..=f64::from(u32::MAX)).contains(&megabytes) {
        bail!("a size is at least 1MB");
    }
    Ok((megabytes * f64::from(1 << 20)) as u64)
}

/// Parses a number and its unit; a number alone is in the first unit.
fn quantity(parser: &mut Parser, units: &[(&str, f64)]) -> Result<f64> {
    let text = parser.value()?.string()?;
    let number = text.trim_end_matches(char::is_alphabetic);
    let unit = &text[number.len()..];
    let factor = match unit {
        "" => Some(1.0),
        _ => units
            .iter()
            .find(|(known, _)| *known == unit)
            .map(|it| it.1),
    };
    match (number.parse::<f64>(), factor) {
        (Ok(number), Some(factor)) => Ok(number * factor),
        _ => {
            let names: Vec<_> = units.iter().map(|(name, _)| *name).collect();
            bail!(
                "`{text}` is no number with one of the units {}",
                names.join(", ")
            );
        }
    }
}

/// Returns the error of an unknown option; it names the replacement of an option of earlier versions.
fn refused(word: Arg<'_>) -> anyhow::Error {
    match word {
        Arg::Long("history-mb") => anyhow!("--history-mb is now --history, such as --history 48MB"),
        Arg::Long("page-mb") => anyhow!("--page-mb is now --page, such as --page 1024MB"),
        Arg::Long("rrd") => anyhow!("--rrd is now -o, such as -o FILE.rrd"),
        other => other.unexpected().into(),
    }
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
            "--linger=0.5s",
            "--page",
            "2MB",
            "--history",
            "1.5GB",
            "-o",
            "a.rrd",
        ];
        let options = read(&words).expect("valid").expect("no help");
        assert_eq!((options.ports(), options.page_bytes), (vec![9], 2 << 20));
        assert_eq!(options.history_bytes, 1536 << 20);
        assert_eq!(options.linger, Some(Duration::from_millis(500)));
        assert_eq!(options.rrd, Some("a.rrd".into()));
        let options = read(&["--linger", "500ms", "--page", "64"]);
        let options = options.expect("valid").expect("no help");
        assert_eq!(options.linger, Some(Duration::from_millis(500)));
        assert_eq!(options.page_bytes, 64 << 20);
        assert_eq!(read(&["--help"]).expect("valid"), None);
        for (words, part) in [
            (["--bind", "here"], "here"),
            (["--port", "-1"], "-1"),
            (["--linger", "-1s"], "a time, such as 15s"),
            (["--linger", "soon"], "s, ms, min"),
            (["--page", "0MB"], "at least 1MB"),
            (["--page", "2kB"], "MB, GB"),
            (["--page", "infMB"], "MB, GB"),
            (["--history-mb", "48"], "--history 48MB"),
            (["--page-mb", "1024"], "--page 1024MB"),
            (["--rrd", "a.rrd"], "now -o"),
        ] {
            let why = format!("{:#}", read(&words).expect_err("refused"));
            assert!(why.contains(part), "{words:?}: {why}");
        }
        assert!(read(&["file"]).is_err());
    }
}
