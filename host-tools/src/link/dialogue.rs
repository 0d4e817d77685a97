//! Questions and requests to a device, without a terrain: who it is, how it is,
//! its calibration, arming.

use std::time::{Duration, Instant};

use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::{Answer, Refusal, Request};
use hapterra_core::wire::status::Status;

use super::conversation::{Ask, Conversation, News};
use super::error::LinkError;
use super::messages::{FromDevice, from_device, next_frame};
use super::patience::Patience;
use super::transport::Transport;

/// In this time a device tells where it stands at least once.
const MOMENT: Duration = Duration::from_millis(150);
/// Between two looks at the clock while an answer is waited for.
const LOOK: Duration = Duration::from_millis(50);

/// Is told of a message that comes unasked; what it returns is said to that.
type OnMessage<'o> = &'o mut dyn FnMut(&ToHost) -> Option<ToDevice<'static>>;

/// A conversation with a device. The device keeps the scene that it holds. It ends
/// without a word: whoever speaks with the device next begins a session of its own.
pub struct Dialogue<'t> {
    line: Line<'t>,
    device: DeviceHello,
}

/// Messages both ways.
struct Line<'t> {
    transport: Box<dyn Transport + 't>,
    talk: Conversation,
    reader: Box<FrameReader<MAX_FRAME>>,
    began: Instant,
    out: Vec<u8>,
    incoming: Box<[u8; 1024]>,
}

impl<'t> Dialogue<'t> {
    /// Says hello.
    ///
    /// # Errors
    /// [`LinkError`]: nobody answers within `patience`, or in another protocol.
    pub fn open(transport: Box<dyn Transport + 't>, patience: Duration) -> Result<Self, LinkError> {
        let patience = Patience::of_a_dialogue(patience);
        let mut line = Line {
            transport,
            talk: Conversation::new(None, patience, fastrand::Rng::new()),
            reader: Box::default(),
            began: Instant::now(),
            out: vec![],
            incoming: Box::new([0; 1024]),
        };
        line.talk.greet(line.began.elapsed(), &mut line.out);
        let device = line.wait_for(|news| match news {
            News::Greeted { device, .. } => Some(device),
            _ => None,
        })?;
        Ok(Self { line, device })
    }

    /// How the device introduced itself.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// Ends the conversation and gives the way to the device back.
    #[must_use]
    pub fn into_transport(self) -> Box<dyn Transport + 't> {
        self.line.transport
    }

    /// The state of the device as it answers: guard, calibration, ticks, stack.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn status(&mut self) -> Result<Status, LinkError> {
        self.line.ask(Ask::Status, |message| match message {
            ToHost::Status(status) => Some(status),
            _ => None,
        })
    }

    /// As [`Dialogue::status`], after a moment, so that nothing that happened before is still on
    /// its way.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn fresh_status(&mut self) -> Result<Status, LinkError> {
        self.line.listen(MOMENT)?;
        self.status()
    }

    /// The calibration in force on the device; none where it has none.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn calibration(&mut self) -> Result<Option<Calibration>, LinkError> {
        self.line.ask(Ask::Calibration, |message| match message {
            ToHost::Calibration(calibration) => Some(calibration),
            _ => None,
        })
    }

    /// Asks for something to be done; the device does it, once, or says why not.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn request(&mut self, request: &Request) -> Result<Result<(), Refusal>, LinkError> {
        if matches!(request, Request::DropScene | Request::Jog(_)) {
            self.line.talk.forget_scene();
        }
        self.line
            .ask(Ask::Request(*request), |message| match message {
                ToHost::Answer(Answer { result, .. }) => Some(result),
                _ => None,
            })
    }

    /// Puts a scene in force.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn put_scene(&mut self, scene: Scene) -> Result<(), LinkError> {
        let line = &mut self.line;
        let now = line.began.elapsed();
        line.talk.listen_from(now);
        line.talk.put_scene(scene, now, &mut line.out);
        line.wait_for(|news| matches!(news, News::SceneTaken).then_some(()))
    }

    /// Lets `ms` of the device's time pass, tells `on` of what comes unasked, and says
    /// what `on` says to it. Returns the state of the device at the end.
    ///
    /// # Errors
    /// [`LinkError`]; also where the device's time stands still.
    pub fn pass(&mut self, ms: u32, on: OnMessage<'_>) -> Result<Status, LinkError> {
        let line = &mut self.line;
        let began = line.began.elapsed();
        line.talk.listen_from(began);
        let first = line.status(on)?;
        let ticks = ms * (first.device.tick_hz / 1000).max(1);
        let patience = line.talk.patience().give_up + Duration::from_millis(u64::from(ms));
        loop {
            line.converse(&mut |_| {}, on)?;
            let status = line.status(on)?;
            if status.ticks.run.wrapping_sub(first.ticks.run) >= ticks {
                return Ok(status);
            }
            let waited = line.began.elapsed().saturating_sub(began);
            if waited > patience {
                return Err(LinkError::Silent(waited));
            }
        }
    }

    /// Puts a calibration in force and has it stored, once somebody has pressed the
    /// dead-man switch.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn store(&mut self, calibration: Calibration) -> Result<Result<(), Refusal>, LinkError> {
        match self.request(&Request::SetCalibration { calibration })? {
            Ok(()) => self.request(&Request::StoreCalibration),
            refused => Ok(refused),
        }
    }
}

impl Line<'_> {
    /// Asks for something and waits for the answer.
    fn ask<T>(
        &mut self,
        ask: Ask,
        mut read: impl FnMut(ToHost) -> Option<T>,
    ) -> Result<T, LinkError> {
        // Between two questions nobody listens: the user may think for a while.
        self.talk.listen_from(self.began.elapsed());
        self.talk.ask(ask);
        self.wait_for(|news| match news {
            News::Answered(asked, message) if asked.is_like(&ask) => read(message),
            _ => None,
        })
    }

    /// Asks for the status and converses until it comes.
    fn status(&mut self, on: OnMessage<'_>) -> Result<Status, LinkError> {
        self.talk.ask(Ask::Status);
        loop {
            let mut found = None;
            let mut answered = |news| {
                if let News::Answered(Ask::Status, ToHost::Status(status)) = news {
                    found = Some(status);
                }
            };
            self.converse(&mut answered, on)?;
            if let Some(status) = found {
                return Ok(status);
            }
        }
    }

    /// Takes what has come, and says what `on` says to what comes unasked.
    fn converse(
        &mut self,
        answered: &mut dyn FnMut(News),
        on: OnMessage<'_>,
    ) -> Result<(), LinkError> {
        let mut replies = vec![];
        self.poll(LOOK, &mut |news| match news {
            News::Other(message) => replies.extend(on(&message)),
            news => answered(news),
        })?;
        for reply in replies {
            self.talk.say(&reply, &mut self.out);
        }
        self.flush()
    }

    fn wait_for<T>(&mut self, mut read: impl FnMut(News) -> Option<T>) -> Result<T, LinkError> {
        loop {
            let mut found = None;
            self.poll(LOOK, &mut |news| {
                found = found.take().or_else(|| read(news));
            })?;
            if let Some(found) = found {
                return Ok(found);
            }
        }
    }

    /// Hears what the device tells for a while.
    fn listen(&mut self, time: Duration) -> Result<(), LinkError> {
        self.talk.listen_from(self.began.elapsed());
        let end = self.began.elapsed() + time;
        while self.began.elapsed() < end {
            self.poll(LOOK, &mut |_| {})?;
        }
        Ok(())
    }

    fn poll(&mut self, wait: Duration, on: &mut dyn FnMut(News)) -> Result<(), LinkError> {
        self.talk.due(self.began.elapsed(), &mut self.out)?;
        if let Some(ask) = self.talk.take_unanswered().pop() {
            tracing::debug!(?ask, "given up");
            return Err(LinkError::Silent(self.talk.patience().give_up));
        }
        self.flush()?;
        let received = self.transport.receive(self.incoming.as_mut_slice(), wait);
        let received = received.map_err(LinkError::Gone)?;
        let mut bytes = self.incoming.get(..received).unwrap_or(&[]);
        let now = self.began.elapsed();
        while let Some(frame) = next_frame(&mut self.reader, &mut bytes, from_device) {
            match frame {
                Ok(FromDevice::Version(check)) => self.talk.on_version_check(check)?,
                Ok(FromDevice::Message(message)) => {
                    if let Some(news) = self.talk.hear(now, message, &mut self.out)? {
                        on(news);
                    }
                }
                // The rest of something earlier.
                Err(_) => {}
            }
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        if self.out.is_empty() {
            return Ok(());
        }
        let sent = self.transport.send(&self.out);
        self.out.clear();
        sent.map_err(LinkError::Gone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Meddler, Native};
    use hapterra_core::wire::frame::encode;
    use hapterra_core::wire::version::VersionCheck;
    use std::io;

    const PATIENCE: Duration = Duration::from_secs(20);

    #[test]
    fn a_device_says_who_and_how_it_is() {
        let device = Box::new(Native::for_replay().restless());
        let mut dialogue = Dialogue::open(device, PATIENCE).expect("it answers");
        assert_eq!(dialogue.device().board.as_str(), "native");
        let status = dialogue.fresh_status().expect("it answers");
        assert!(!status.health.report.blockers.is_empty());
        let known = dialogue.calibration().expect("it answers");
        assert_eq!(known, Some(Calibration::PREMIUM_1_5));
    }

    #[test]
    fn a_calibration_is_taken_stored_and_refused_with_a_reason() {
        let press: Meddler = Box::new(|tick, sense, _| sense.dead_man = tick % 1_000 >= 500);
        let device = Box::new(Native::for_replay().restless().meddled_with(press));
        let mut dialogue = Dialogue::open(device, PATIENCE).expect("it answers");
        let mut calibration = Calibration::OMNI;
        assert_eq!(dialogue.store(calibration).expect("it answers"), Ok(()));
        assert_eq!(dialogue.calibration().expect("answers"), Some(calibration));
        calibration.l1_mm = -1.0;
        let refused = dialogue.store(calibration).expect("it answers");
        assert!(
            matches!(refused, Err(Refusal::Calibration(_))),
            "{refused:?}"
        );
        let blocked = dialogue.request(&Request::Arm).expect("it answers");
        assert!(matches!(blocked, Err(Refusal::Blocked(_))), "{blocked:?}");
    }

    /// Something that listens and says one thing.
    struct Says(Vec<u8>);

    impl Transport for Says {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }

        fn receive(&mut self, into: &mut [u8], _: Duration) -> io::Result<usize> {
            let n = self.0.len().min(into.len());
            into[..n].copy_from_slice(&self.0[..n]);
            self.0.drain(..n);
            Ok(n)
        }
    }

    #[test]
    fn one_that_says_nothing_or_nonsense_or_another_protocol_is_told_apart() {
        let ask = |said: Vec<u8>| {
            let opened = Dialogue::open(Box::new(Says(said)), Duration::from_millis(5));
            opened.map(|_| ())
        };
        assert!(matches!(ask(vec![]), Err(LinkError::Silent(_))));
        let nonsense = b"HTTP/1.1 400\0\0".to_vec();
        assert!(matches!(ask(nonsense), Err(LinkError::Silent(_))));
        let mut frame = [0; MAX_FRAME];
        let refused = VersionCheck::Refused { protocol: 77 };
        let bytes = encode(&refused, &mut frame).expect("fits").to_vec();
        assert!(matches!(
            ask(bytes),
            Err(LinkError::Version { theirs: 77, .. })
        ));
    }
}
