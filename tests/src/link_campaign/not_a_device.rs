//! A host connects to a program that is not a device.

use hapterra::link::LinkError;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::message::ToDevice;

use super::frames;
use super::host::{End, Host};
use super::hostile_programs::Behaviour;
use super::run_outcomes::Outcome;
use super::segment::Segment;

/// Time that the host stays connected to it, ms.
const SESSION_TICKS: u64 = 12_000;
/// Time that a session may take to open or to fail, ms.
const OPENS: u64 = 8_500;
/// Time that closing may take, ms.
const LEAVES: u64 = 3_500;
/// Most bytes that a host may send in a second, whatever it is connected to.
const MAX_BYTES_PER_SECOND: usize = 1 << 20;

/// Connects a host to such a program. Returns the outcome.
///
/// # Errors
/// If the run does not end, or the host sends without bound.
pub fn run_against_other_program(segment: &mut Segment<'_>) -> Result<Outcome, String> {
    let behaviour = Behaviour::ALL[segment.random.below(Behaviour::ALL.len())];
    let outcome = run_session(segment, behaviour);
    outcome.map_err(|what| format!("{behaviour:?}: {what}"))
}

fn run_session(segment: &mut Segment<'_>, behaviour: Behaviour) -> Result<Outcome, String> {
    let began = segment.now;
    let chance = &mut segment.random;
    let mut out = Vec::new();
    let mut host = Host::start(segment.terrain, segment.scene, began, chance, &mut out);
    let mut hellos = Hellos::default();
    let mut sent = 0;
    for now in began..=began + SESSION_TICKS + LEAVES {
        if now == began + SESSION_TICKS {
            host.leave(now, &mut out);
        }
        sent += out.len();
        hellos.receive(&out);
        out.clear();
        let reported = (host.session(), hellos.last);
        let received = behaviour.bytes_to_send(now, &segment.scene, reported, chance);
        host.step(now, &received, &mut out);
        host.samples.clear();
        let seconds = 1 + ((now - began) / 1_000) as usize;
        if sent > seconds * MAX_BYTES_PER_SECOND {
            return Err(format!("the host sent {sent} bytes in {seconds} s"));
        }
        match &host.end {
            Some(End::Agreed) => return Err("the end was agreed on with no device".into()),
            Some(End::Reported(LinkError::Version { ours, theirs })) if ours == theirs => {
                return Err(format!("both speak protocol {ours}"));
            }
            Some(End::Reported(error)) => return Ok(Outcome::Reported(error.to_string())),
            None if !host.opened && now > began + OPENS => return Err("opening hangs".into()),
            None => {}
        }
    }
    Err("the host does not end".into())
}

/// Reads the number of the host's last open, which an answer must repeat.
#[derive(Default)]
struct Hellos {
    reader: Box<FrameReader<MAX_FRAME>>,
    last: u8,
}

impl Hellos {
    fn receive(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            let message = frame.and_then(|frame| frames::parse_host_frame(frame.ok()?));
            if let Some(ToDevice::Hello(hello)) = message.map(|message| message.message) {
                self.last = hello.number;
            }
        }
    }
}
