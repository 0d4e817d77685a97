//! Questions and requests to a device, without a scene: who it is, how it is,
//! its calibration, arming.

use std::time::{Duration, Instant};

use hapterra_core::phantom::Calibration;
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::status::{Refusal, Request, Status};

use super::error::LinkError;
use super::messages::{Inbox, send};
use super::transport::Transport;

/// Between two tries to be understood.
const AGAIN: Duration = Duration::from_millis(400);

/// In this time a device tells where it stands at least once.
const MOMENT: Duration = Duration::from_millis(150);

/// A conversation with a device. The device keeps the scene that it holds.
pub struct Dialogue<'t> {
    line: Line<'t>,
    device: DeviceHello,
}

/// Messages both ways, and how long an answer may take.
struct Line<'t> {
    transport: Box<dyn Transport + 't>,
    inbox: Inbox,
    patience: Duration,
}

impl<'t> Dialogue<'t> {
    /// Says hello.
    ///
    /// # Errors
    /// [`LinkError`]: nobody answers within `patience`, or in another protocol.
    pub fn open(transport: Box<dyn Transport + 't>, patience: Duration) -> Result<Self, LinkError> {
        let mut line = Line {
            transport,
            inbox: Inbox::default(),
            patience,
        };
        // A zero first ends whatever may have been under way.
        line.transport.send(&[0]).map_err(LinkError::Gone)?;
        let hello = ToDevice::Hello(HostHello { protocol: PROTOCOL });
        let device = line.ask(&hello, |message| match message {
            ToHost::Hello(device) if device.protocol == PROTOCOL => Some(Ok(device)),
            ToHost::Hello(DeviceHello { protocol, .. }) | ToHost::Refused { protocol } => {
                Some(Err(LinkError::version(protocol)))
            }
            _ => None,
        })??;
        Ok(Self { line, device })
    }

    /// How the device introduced itself.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// The state of the device as it answers: guard, calibration, ticks, stack.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn status(&mut self) -> Result<Status, LinkError> {
        self.line.ask(&ToDevice::Status, |message| match message {
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
        match self.line.wait_for(MOMENT, &mut |_| None::<()>) {
            Ok(()) | Err(LinkError::Silent(_)) => self.status(),
            Err(error) => Err(error),
        }
    }

    /// The calibration in force on the device; none where it has none.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn calibration(&mut self) -> Result<Option<Calibration>, LinkError> {
        self.line
            .ask(&ToDevice::GetCalibration, |message| match message {
                ToHost::Calibration(calibration) => Some(calibration),
                _ => None,
            })
    }

    /// Asks for something; the device does it or says why not. Asked again where
    /// the answer does not come: to do any of it twice is to do it once.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn request(&mut self, message: &ToDevice<'_>) -> Result<Result<(), Refusal>, LinkError> {
        let wanted = match message {
            ToDevice::Arm => Request::Arm,
            ToDevice::Disarm => Request::Disarm,
            ToDevice::Zero { .. } => Request::Zero,
            ToDevice::SetCalibration { .. } => Request::SetCalibration,
            ToDevice::ClearFault => Request::ClearFault,
            _ => Request::DropScene,
        };
        self.line.ask(message, answers(wanted))
    }

    /// Puts a calibration in force and has it stored.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn store(&mut self, calibration: Calibration) -> Result<Result<(), Refusal>, LinkError> {
        let message = ToDevice::SetCalibration {
            calibration,
            store: true,
        };
        match self.request(&message)? {
            Ok(()) => {
                let patience = self.line.patience;
                self.line
                    .wait_for(patience, &mut answers(Request::StoreCalibration))
            }
            refused => Ok(refused),
        }
    }
}

impl Line<'_> {
    /// Says something and waits for the answer.
    fn ask<T>(
        &mut self,
        message: &ToDevice<'_>,
        mut answer: impl FnMut(ToHost) -> Option<T>,
    ) -> Result<T, LinkError> {
        let began = Instant::now();
        loop {
            send(&mut *self.transport, message).map_err(LinkError::Gone)?;
            match self.wait_for(AGAIN.min(self.patience), &mut answer) {
                Err(LinkError::Silent(_)) if began.elapsed() < self.patience => {}
                Err(LinkError::Silent(_)) => return Err(LinkError::Silent(began.elapsed())),
                other => return other,
            }
        }
    }

    fn wait_for<T>(
        &mut self,
        patience: Duration,
        answer: &mut impl FnMut(ToHost) -> Option<T>,
    ) -> Result<T, LinkError> {
        let began = Instant::now();
        let wait = Duration::from_millis(50);
        loop {
            let next = self.inbox.next(&mut *self.transport, wait);
            match next.map_err(LinkError::Gone)? {
                Some(message) => {
                    if let Some(found) = answer(message) {
                        return Ok(found);
                    }
                }
                None if began.elapsed() >= patience => {
                    return Err(LinkError::Silent(began.elapsed()));
                }
                None => {}
            }
        }
    }
}

fn answers(wanted: Request) -> impl FnMut(ToHost) -> Option<Result<(), Refusal>> {
    move |message| match message {
        ToHost::Answer(answer) if answer.request == wanted => Some(answer.result),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Native;
    use hapterra_core::wire::frame::{MAX_FRAME, encode};
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
        let device = Box::new(Native::for_replay().restless());
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
        let blocked = dialogue.request(&ToDevice::Arm).expect("it answers");
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
        let refused = ToHost::Refused { protocol: 77 };
        let bytes = encode(&refused, &mut frame).expect("fits").to_vec();
        assert!(matches!(
            ask(bytes),
            Err(LinkError::Version { theirs: 77, .. })
        ));
    }
}
