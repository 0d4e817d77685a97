//! Queue of commands that wait for their time, or for earlier commands.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use super::Action;
use super::command::{Command, parse};

/// Max commands of a device that wait to be read or executed; beyond them the reader waits.
const MAX_WAITING: usize = 256;
/// The same if several devices are served: a lost device must not block the others' commands, so
/// its own are left out beyond this number.
const MAX_WAITING_EACH: usize = 1 << 16;

/// Max bytes of a line with its end; commands have a few dozen. A longer line is cut here and ends
/// the input.
const MAX: u64 = 1 << 16;

/// Source of commands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Standard input, line by line.
    StandardInput,
    /// A file, or a named pipe.
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

/// Commands for one device, in order.
#[derive(Default)]
pub struct CommandQueue {
    lines: Option<Receiver<Read>>,
    waiting: VecDeque<Command>,
    /// Number of commands that were left out because the queue was full.
    omitted: Arc<AtomicU64>,
}

/// The result of reading a line: a command, or the fault.
type Read = Result<Command, String>;

impl CommandQueue {
    /// Reads commands from now on, in a separate thread.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn of(origin: &Origin) -> io::Result<Self> {
        let (send, lines) = sync_channel(MAX_WAITING);
        let take = move |line: &str, number| {
            let read = for_each(line, number, 1).transpose();
            read.is_none_or(|read| send.send(read.map(|(_, command)| command)).is_ok())
        };
        read_lines(origin, take, || {})?;
        Ok(Self {
            lines: Some(lines),
            ..Self::default()
        })
    }

    /// Reads commands for `devices` devices from now on, in a separate thread, with a queue for
    /// each: `on 2 zoom 2` is for the second device, and a command without `on` is for all. No
    /// device's commands wait for another device. No line waits either, so `at_end` is always
    /// called at the end of the input, whatever was left undone.
    ///
    /// # Errors
    /// A file that cannot be opened.
    pub fn of_several(
        origin: &Origin,
        devices: usize,
        at_end: impl FnOnce() + Send + 'static,
    ) -> io::Result<Vec<Self>> {
        let (sends, queues): (Vec<_>, Vec<_>) = (0..devices)
            .map(|_| {
                let (send, lines) = sync_channel(MAX_WAITING_EACH);
                let queue = Self {
                    lines: Some(lines),
                    ..Self::default()
                };
                ((send, Arc::clone(&queue.omitted)), queue)
            })
            .unzip();
        let take = move |line: &str, number| distribute(line, number, &sends);
        read_lines(origin, take, at_end)?;
        Ok(queues)
    }

    /// Returns the next command that is due at a time of the device, s; `is_free` is true if the
    /// earlier ones are done. Faults of lines are reported.
    pub fn due(
        &mut self,
        t_s: f64,
        is_free: bool,
        notify: &mut dyn FnMut(String),
    ) -> Option<Action> {
        while self.waiting.len() < MAX_WAITING
            && let Some(Ok(read)) = self.lines.as_ref().map(Receiver::try_recv)
        {
            match read {
                Ok(command) => self.waiting.push_back(command),
                Err(why) => notify(why),
            }
        }
        let omitted = self.omitted.swap(0, Ordering::Relaxed);
        if omitted > 0 {
            notify(format!(
                "{omitted} commands were left out: this device was too far behind"
            ));
        }
        // A user's answer is due now, before earlier commands.
        let is_answer = |it: &Command| matches!(it.action, Action::Enter(_)) && it.at_s.is_none();
        if let Some(answer) = self.waiting.iter().position(is_answer) {
            return self.waiting.remove(answer).map(|command| command.action);
        }
        let next = self.waiting.front()?;
        let is_due = is_free && next.at_s.is_none_or(|at_s| t_s >= at_s);
        match is_due {
            true => self.waiting.pop_front().map(|command| command.action),
            false => None,
        }
    }
}

/// Sender to the queue of a device, and the number of left-out commands.
type DeviceSender = (SyncSender<Read>, Arc<AtomicU64>);

/// Sends a line to its devices, and a fault to the first one that is still served. Returns false if
/// none is.
fn distribute(line: &str, number: u64, senders: &[DeviceSender]) -> bool {
    let is_served = |sender: &DeviceSender, read: Read| match sender.0.try_send(read) {
        Ok(()) => true,
        Err(TrySendError::Full(_)) => {
            sender.1.fetch_add(1, Ordering::Relaxed);
            true
        }
        Err(TrySendError::Disconnected(_)) => false,
    };
    match for_each(line, number, senders.len()) {
        Ok(None) => true,
        Ok(Some((Some(device), command))) => {
            // Other devices may be served when this one no longer is.
            let sender = senders.get(device - 1);
            sender.map(|sender| is_served(sender, Ok(command)));
            true
        }
        Ok(Some((None, command))) => {
            let served = senders
                .iter()
                .filter(|sender| is_served(sender, Ok(command.clone())));
            served.count() > 0
        }
        Err(why) => senders
            .iter()
            .any(|sender| is_served(sender, Err(why.clone()))),
    }
}

/// Reads a line as a command, and the number of its device if it names one; returns `None` for the
/// command if the line has none.
///
/// # Errors
/// Its fault and its number.
fn for_each(
    line: &str,
    number: u64,
    devices: usize,
) -> Result<Option<(Option<usize>, Command)>, String> {
    let wrong = |why: String| format!("line {number} of the commands: {why}");
    let (device, command) = addressed(line, devices).map_err(wrong)?;
    let command = parse(command).map_err(|why| wrong(why.to_string()))?;
    // The questions of two devices may have the same number.
    let is_enter = |command: &Command| matches!(command.action, Action::Enter(_));
    if devices > 1 && device.is_none() && command.as_ref().is_some_and(is_enter) {
        return Err(wrong(
            "`enter` is for one device: `on DEVICE enter NUMBER`".into(),
        ));
    }
    Ok(command.map(|command| (device, command)))
}

/// Removes and reads `on NUMBER` at the beginning of a line.
fn addressed(line: &str, devices: usize) -> Result<(Option<usize>, &str), String> {
    let Some(rest) = line.trim_start().strip_prefix("on ") else {
        return Ok((None, line));
    };
    let rest = rest.trim_start();
    let (word, rest) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    match word.parse() {
        Ok(device) if (1..=devices).contains(&device) => Ok((Some(device), rest)),
        _ => Err(match devices {
            1 => "`on` is followed by the number of a device: there is one, 1".into(),
            _ => format!("`on` is followed by the number of a device, 1 to {devices}"),
        }),
    }
}

/// Sends lines with their numbers until the input ends or `take` returns false.
fn read_lines(
    origin: &Origin,
    mut take: impl FnMut(&str, u64) -> bool + Send + 'static,
    at_end: impl FnOnce() + Send + 'static,
) -> io::Result<()> {
    let input: Box<dyn io::Read + Send> = match origin {
        Origin::StandardInput => Box::new(io::stdin()),
        Origin::File(path) => Box::new(File::open(path)?),
    };
    std::thread::spawn(move || {
        let mut input = BufReader::new(input);
        for number in 1.. {
            let mut line = String::new();
            let read = input.by_ref().take(MAX).read_line(&mut line);
            let is_whole = line.ends_with('\n') || (line.len() as u64) < MAX;
            // After a cut line, the rest has no meaning.
            let is_accepted = matches!(read, Ok(1..)) && take(line.trim_end_matches('\n'), number);
            if !is_accepted || !is_whole {
                break;
            }
        }
        at_end();
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::PlacementChange;
    use crate::steering::Steer;
    use crate::timeouts::{next, wait_for, wait_until};

    fn change(change: PlacementChange) -> Action {
        Action::Steer(Steer::Change(change))
    }

    /// Safety: 29.
    #[cfg(unix)]
    #[test]
    fn endless_command_line_is_cut_and_ends_input() {
        let (send, lines) = sync_channel(4);
        let take = move |line: &str, number| send.send((line.len(), number)).is_ok();
        let endless = Origin::File("/dev/zero".into());
        read_lines(&endless, take, || {}).expect("opened");
        assert_eq!(next(&lines), Some((MAX as usize, 1)));
        assert_eq!(next(&lines), None);
    }

    #[test]
    fn commands_wait_for_their_time_and_predecessors() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("commands");
        let text = "# a tour\nat 1 zoom 2\nnonsense\nzoom 4\nat 0.5 reset\nmark done\n";
        std::fs::write(&path, text).expect("written");
        let origin: Origin = path.to_str().expect("text").parse().expect("a file");
        let mut queue = CommandQueue::of(&origin).expect("opened");
        let mut reported = Vec::new();
        wait_until("the line that is no command", || {
            let due = queue.due(0.9, true, &mut |line| reported.push(line));
            assert_eq!(due, None);
            !reported.is_empty()
        });
        let mut due = |t_s, is_free| queue.due(t_s, is_free, &mut |_| {});
        let zoom = |times| change(PlacementChange::Zoom(times));
        assert_eq!(due(1.0, true), Some(zoom(2.0)));
        assert_eq!(due(1.0, false), None, "not while that is under way");
        // The file is read meanwhile.
        let fourth = wait_for("the fourth line", || due(1.1, true));
        assert_eq!(fourth, zoom(4.0));
        let fifth = wait_for("the fifth line", || due(1.2, true));
        assert_eq!(fifth, change(PlacementChange::Reset));
        let sixth = wait_for("the sixth line", || due(1.2, true));
        assert_eq!(sixth, Action::Mark("done".to_owned()));
        assert_eq!(due(9.0, true), None);
        assert!(
            reported[0].starts_with("line 3 of the commands: `nonsense`"),
            "{reported:?}"
        );
        assert!(CommandQueue::of(&Origin::File(folder.path().join("none"))).is_err());
        assert_eq!("-".parse(), Ok(Origin::StandardInput));
    }

    /// Takes all due commands of some queues until each has its count.
    fn all_due(queues: &mut [CommandQueue], counts: &[usize]) -> (Vec<Vec<Action>>, Vec<String>) {
        let (mut due, mut reported) = (vec![vec![]; queues.len()], vec![]);
        wait_until("all commands", || {
            for (queue, due) in queues.iter_mut().zip(&mut due) {
                due.extend(queue.due(0.0, true, &mut |line| reported.push(line)));
            }
            due.iter().map(Vec::len).eq(counts.iter().copied())
        });
        (due, reported)
    }

    #[test]
    fn command_is_for_all_devices_or_the_named_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("commands");
        let text = "zoom 2\non 2 zoom 3\non 3 zoom 9\non x reset\non 1 at 0 zoom 4\non 2 nonsense\nenter 7\non 2 enter 7\nzoom 5";
        std::fs::write(&path, text).expect("written");
        let mut queues = CommandQueue::of_several(&Origin::File(path), 2, || {}).expect("opened");
        let (due, reported) = all_due(&mut queues, &[3, 4]);
        let zoom = |times| change(PlacementChange::Zoom(times));
        assert_eq!(due[0], [2.0, 4.0, 5.0].map(zoom));
        // An answer does not wait for earlier commands.
        let is_answer = |it: &&Action| matches!(it, Action::Enter(_));
        let (answers, others): (Vec<_>, Vec<_>) = due[1].iter().partition(is_answer);
        assert_eq!(others, [2.0, 3.0, 5.0].map(zoom).each_ref());
        assert_eq!(answers, [&Action::Enter(7)]);
        // An error is reported only once, not by each device.
        let [third, fourth, sixth, seventh] = &reported[..] else {
            panic!("{reported:?}");
        };
        assert!(third.starts_with("line 3 of the commands: `on` is followed"));
        assert!(third.contains("1 to 2"), "{third}");
        assert!(fourth.starts_with("line 4 "), "{fourth}");
        assert!(sixth.starts_with("line 6 of the commands: `nonsense`"));
        assert!(seventh.starts_with("line 7 of the commands: `enter` is for one device"));
    }

    #[test]
    fn answer_overtakes_pending_placement_changes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("commands");
        std::fs::write(&path, "zoom 2\nenter 7\n").expect("written");
        let mut queues = CommandQueue::of_several(&Origin::File(path), 1, || {}).expect("opened");
        let queue = &mut queues[0];
        let mut answer = None;
        while answer.is_none() {
            // A change is in progress.
            answer = queue.due(0.0, false, &mut |why| panic!("{why}"));
            std::thread::yield_now();
        }
        assert_eq!(answer, Some(Action::Enter(7)));
        assert_eq!(queue.due(0.0, false, &mut |why| panic!("{why}")), None);
        let zoom = queue.due(0.0, true, &mut |why| panic!("{why}"));
        assert_eq!(zoom, Some(change(PlacementChange::Zoom(2.0))));
    }

    #[test]
    fn stalled_device_does_not_block_commands_of_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("commands");
        let count = MAX_WAITING_EACH + 1000;
        let text = "on 2 reset\n".repeat(count) + "on 1 reset\nnonsense\n";
        std::fs::write(&path, text).expect("written");
        let mut queues = CommandQueue::of_several(&Origin::File(path), 3, || {}).expect("opened");
        let mut second = queues.remove(1);
        // The third device is not served any more, and the first one has its command.
        drop(queues.pop());
        let (due, _) = all_due(&mut queues, &[1]);
        assert_eq!(due[0], [change(PlacementChange::Reset)]);
        let mut reported = vec![];
        let (mut executed, t_s) = (0, 0.0);
        // A bounded queue keeps the commands that are not due yet.
        for _ in 0..3 {
            assert_eq!(
                second.due(t_s, false, &mut |line| reported.push(line)),
                None
            );
            assert_eq!(second.waiting.len(), MAX_WAITING);
        }
        while second
            .due(t_s, true, &mut |line| reported.push(line))
            .is_some()
        {
            executed += 1;
        }
        assert_eq!(executed, MAX_WAITING_EACH);
        assert_eq!(
            reported,
            [format!(
                "{} commands were left out: this device was too far behind",
                count - MAX_WAITING_EACH
            )]
        );
    }
}
