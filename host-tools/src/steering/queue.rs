//! Commands that wait: for their time, or for the ones before them.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::mpsc::{Receiver, sync_channel};

use super::Steer;
use super::command::{Command, parse};

/// Lines that wait to be read; a writer waits beyond them.
const WAITING: usize = 256;

/// Where commands come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Standard input, line by line as it comes.
    StandardInput,
    /// A file, or a pipe with a name.
    File(PathBuf),
}

impl FromStr for Origin {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "-" => Self::StandardInput,
            file => Self::File(Path::new(file).to_owned()),
        })
    }
}

/// Commands in their order.
#[derive(Default)]
pub struct CommandQueue {
    lines: Option<Receiver<String>>,
    line: u64,
    waiting: VecDeque<Command>,
}

impl CommandQueue {
    /// Reads commands from now on, in a thread of its own.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn of(origin: &Origin) -> io::Result<Self> {
        let lines = match origin {
            Origin::StandardInput => lines_of(io::stdin()),
            Origin::File(path) => lines_of(File::open(path)?),
        };
        Ok(Self {
            lines: Some(lines),
            ..Self::default()
        })
    }

    /// The next command that is due at a time of the device, s; `is_free` tells whether what came
    /// before is done. What is wrong with a line is told.
    pub fn due(&mut self, t_s: f64, is_free: bool, tell: &mut dyn FnMut(String)) -> Option<Steer> {
        while let Some(Ok(line)) = self.lines.as_ref().map(Receiver::try_recv) {
            self.line += 1;
            match parse(&line) {
                Ok(command) => self.waiting.extend(command),
                Err(why) => tell(format!("line {} of the commands: {why}", self.line)),
            }
        }
        let next = self.waiting.front()?;
        let is_due = is_free && next.at_s.is_none_or(|at_s| t_s >= at_s);
        match is_due {
            true => self.waiting.pop_front().map(|command| command.steer),
            false => None,
        }
    }
}

/// Reads lines until the input ends, or nobody takes them.
fn lines_of(input: impl Read + Send + 'static) -> Receiver<String> {
    let (send, lines) = sync_channel(WAITING);
    std::thread::spawn(move || {
        for line in BufReader::new(input).lines().map_while(Result::ok) {
            if send.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::ViewChange;
    use std::time::{Duration, Instant};

    #[test]
    fn commands_wait_for_their_time_and_for_the_ones_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("commands");
        let text = "# a tour\nat 1 zoom 2\nnonsense\nzoom 4\nat 0.5 reset\n";
        std::fs::write(&path, text).expect("written");
        let origin: Origin = path.to_str().expect("text").parse().expect("a file");
        let mut queue = CommandQueue::of(&origin).expect("opened");
        let mut told = Vec::new();
        let until = Instant::now() + Duration::from_secs(20);
        while told.is_empty() && Instant::now() < until {
            let due = queue.due(0.9, true, &mut |line| told.push(line));
            assert_eq!(due, None);
        }
        std::thread::sleep(Duration::from_millis(50));
        let mut due = |t_s, is_free| queue.due(t_s, is_free, &mut |_| {});
        let zoom = |times| Some(Steer::Change(ViewChange::Zoom(times)));
        assert_eq!(due(1.0, true), zoom(2.0));
        assert_eq!(due(1.0, false), None, "not while that is under way");
        assert_eq!(due(1.1, true), zoom(4.0));
        assert_eq!(due(1.2, true), Some(Steer::Change(ViewChange::Reset)));
        assert_eq!(due(9.0, true), None);
        assert!(
            told[0].starts_with("line 3 of the commands: `nonsense`"),
            "{told:?}"
        );
        assert!(CommandQueue::of(&Origin::File(folder.path().join("none"))).is_err());
        assert_eq!("-".parse(), Ok(Origin::StandardInput));
    }
}
