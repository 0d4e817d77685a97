//! Marks: moments of a session that the user names, to find them in its recording and in
//! measurements triggered by a pin of the board.

use std::collections::VecDeque;
use std::time::SystemTime;

use hapterra_core::wire::request::Request;

use crate::link::{Event, HostRequest};

/// Max characters of a mark's text.
pub(super) const MAX_MARK: usize = 200;
/// Max marks that wait for the device: it needs 20 ms for each.
const MAX_WAITING: usize = 64;

/// A mark as the user made it.
#[derive(Clone, Debug, PartialEq)]
pub struct UserMark {
    /// The user's name for it.
    pub text: String,
    /// The host's clock at the request, seconds since 1970 in UTC.
    pub host_unix_s: f64,
    /// The marked tick; `None` if the device has not answered.
    pub tick: Option<u32>,
}

/// Returns the text of a mark, trimmed.
///
/// # Errors
/// The fault of the text.
pub(super) fn text_of(text: &str) -> Result<String, &'static str> {
    let text = text.trim();
    if text.is_empty() {
        return Err("a text is missing");
    }
    if text.chars().count() > MAX_MARK {
        return Err("the text of a mark has at most 200 characters");
    }
    if text.contains(char::is_control) {
        return Err("the text of a mark has no control characters, as tabs");
    }
    Ok(text.to_owned())
}

/// Marks that are requested from a device, in order.
#[derive(Debug, Default)]
pub struct Marks {
    /// Text and host clock of the unanswered ones.
    waiting: VecDeque<(String, f64)>,
    requests: Vec<HostRequest>,
    done: Vec<UserMark>,
}

impl Marks {
    /// Requests a mark now. Returns a message for the user if too many are waiting.
    pub fn mark(&mut self, text: String) -> Option<String> {
        if self.waiting.len() >= MAX_WAITING {
            return Some(format!(
                "the mark `{text}` is left out: {MAX_WAITING} marks wait for the device"
            ));
        }
        self.waiting.push_back((text, host_unix_s()));
        self.requests.push(HostRequest::Request(Request::Mark));
        None
    }

    /// Processes an event of the device.
    pub fn on_event(&mut self, event: &Event<'_>) {
        let tick = match event {
            Event::Marked { tick } => Some(*tick),
            Event::Answered {
                request: Request::Mark,
                ..
            }
            | Event::Unanswered(HostRequest::Request(Request::Mark)) => None,
            _ => return,
        };
        // The device answers marks in their order.
        self.complete(tick);
    }

    fn complete(&mut self, tick: Option<u32>) {
        let done = self.waiting.pop_front();
        self.done.extend(done.map(|(text, host_unix_s)| UserMark {
            text,
            host_unix_s,
            tick,
        }));
    }

    /// Returns the requests to the device now.
    pub fn requests(&mut self) -> Vec<HostRequest> {
        std::mem::take(&mut self.requests)
    }

    /// Returns the marks made since the last call.
    pub fn take_marks(&mut self) -> Vec<UserMark> {
        std::mem::take(&mut self.done)
    }

    /// As [`Self::take_marks`], at the end of a session: unanswered marks get no tick.
    pub fn take_all(&mut self) -> Vec<UserMark> {
        while !self.waiting.is_empty() {
            self.complete(None);
        }
        self.take_marks()
    }
}

fn host_unix_s() -> f64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0.0, |since| since.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mark_is_requested_once_and_has_its_tick() {
        let mut marks = Marks::default();
        for text in ["a", "b", "c"] {
            assert_eq!(marks.mark(text.to_owned()), None);
        }
        assert_eq!(marks.requests(), [HostRequest::Request(Request::Mark); 3]);
        assert_eq!(marks.requests(), []);
        marks.on_event(&Event::Marked { tick: 7 });
        marks.on_event(&Event::Unanswered(&HostRequest::Request(Request::Disarm)));
        marks.on_event(&Event::Unanswered(&HostRequest::Request(Request::Mark)));
        let done: Vec<_> = (marks.take_marks().into_iter())
            .map(|done| (done.text, done.tick))
            .collect();
        assert_eq!(done, [("a".to_owned(), Some(7)), ("b".to_owned(), None)]);
        let rest = marks.take_all();
        assert!(rest.len() == 1 && rest[0].text == "c" && rest[0].tick.is_none());
        assert_eq!(marks.take_all(), []);
    }

    #[test]
    fn marks_beyond_the_queue_limit_are_reported() {
        let mut marks = Marks::default();
        for _ in 0..MAX_WAITING {
            assert_eq!(marks.mark("x".to_owned()), None);
        }
        let reported = marks.mark("y".to_owned()).expect("a line");
        assert!(reported.contains("`y` is left out"), "{reported}");
        assert_eq!(marks.requests().len(), MAX_WAITING);
    }
}
