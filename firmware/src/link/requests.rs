//! Handling of requests: each is done once, even if it is repeated, and answered when it is done.

use hapterra_core::guard::Jog;
use hapterra_core::phantom::Calibration;
use hapterra_core::tick::Command;
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::request::{Answer, Refusal, Request};

use super::Link;
use super::commands::CommandRoom;
use crate::queues::Marked;

/// Progress of a request.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Progress {
    /// The loop decides about arming.
    Arming,
    /// The board stores the calibration.
    Storing,
    /// The loop makes a mark of this number.
    Marking(u8),
    /// The loop has marked this tick.
    Marked(u32),
    /// The loop decides about the cancel of a change of placement.
    Cancelling,
    /// It is done, or refused.
    Done(Result<(), Refusal>),
}

impl Progress {
    /// Returns true if there is an answer.
    const fn is_over(self) -> bool {
        matches!(self, Self::Done(_) | Self::Marked(_))
    }
}

/// The latest request of the session. The host sends the next one only after this one was answered
/// or cancelled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LatestRequest {
    latest: Option<(u8, Progress)>,
    /// True if the answer is ready and was not sent yet, or was requested again.
    answer_is_due: bool,
}

impl LatestRequest {
    /// Returns true if a request with this number is new. A repeated latest request is answered
    /// again; older ones are ignored.
    fn is_new(&mut self, number: u8) -> bool {
        let Some((latest, progress)) = self.latest else {
            return true;
        };
        if number == latest {
            self.answer_is_due = progress.is_over();
            return false;
        }
        number.wrapping_sub(latest) < 128
    }

    fn set_progress(&mut self, number: u8, progress: Progress) {
        self.answer_is_due = progress.is_over();
        self.latest = Some((number, progress));
    }

    /// Records the end of a request; does nothing if the latest request is another.
    fn finish(&mut self, was: Progress, result: Result<(), Refusal>) {
        if let Some((number, progress)) = self.latest.filter(|(_, progress)| *progress == was) {
            debug_assert!(!progress.is_over());
            self.set_progress(number, Progress::Done(result));
        }
    }

    /// Records the loop's decision on the arm command.
    pub(super) fn arm_decided(&mut self, result: Result<(), Refusal>) {
        self.finish(Progress::Arming, result);
    }

    /// Records the result of storing the calibration.
    pub(super) fn stored(&mut self, result: Result<(), Refusal>) {
        self.finish(Progress::Storing, result);
    }

    /// Records the loop's decision on the cancel of a change.
    pub(super) fn cancel_decided(&mut self, result: Result<(), Refusal>) {
        self.finish(Progress::Cancelling, result);
    }

    /// Records a mark of the loop.
    pub(super) fn marked(&mut self, mark: Marked) {
        if let Some((number, progress)) = self.latest
            && progress == Progress::Marking(mark.number)
        {
            self.set_progress(number, Progress::Marked(mark.tick));
        }
    }

    /// Returns the pending answer, once.
    pub(super) fn take_answer(&mut self) -> Option<ToHost> {
        let (number, progress) = self.latest?;
        let answer = match progress {
            Progress::Done(result) => ToHost::Answer(Answer { number, result }),
            Progress::Marked(tick) => ToHost::Marked { number, tick },
            Progress::Arming | Progress::Storing | Progress::Marking(_) | Progress::Cancelling => {
                return None;
            }
        };
        core::mem::take(&mut self.answer_is_due).then_some(answer)
    }
}

impl<const D: usize> Link<'_, D> {
    /// Handles a request. A repeated request is answered again and not done again.
    pub(super) fn on_request(&mut self, number: u8, request: &Request, room: CommandRoom) {
        if self.device.request.is_new(number) {
            let progress = self.begin(request, room);
            self.device.request.set_progress(number, progress);
        }
        // There is room: this message has no other answer.
        if let Some(answer) = self.device.request.take_answer() {
            self.send(&answer);
        }
    }

    fn begin(&mut self, request: &Request, room: CommandRoom) -> Progress {
        Progress::Done(match *request {
            Request::EnterLoader => self.request_loader(room),
            _ if self.is_entering_loader() => Err(Refusal::Busy),
            // While the board stores, this link is not polled.
            Request::Arm | Request::Jog(_) if self.to_store().is_some() => Err(Refusal::Busy),
            Request::Arm => {
                self.device.arming = Some(self.device.health.report.decision.count);
                self.command(room, Command::Arm);
                return Progress::Arming;
            }
            Request::Jog(jog) => match self.begin_jog(jog, room) {
                Ok(()) => return Progress::Arming,
                refused => refused,
            },
            Request::HoldOutputs(shares) => self
                .device
                .may_hold_outputs()
                .and_then(|()| self.send_command(room, Command::HoldOutputs(shares))),
            Request::StoreCalibration => match self.device.begin_storing(self.ends.monitor.ticks())
            {
                Ok(()) => return Progress::Storing,
                refused => refused,
            },
            Request::Disarm => self.send_command(room, Command::Disarm),
            Request::Clutch { hold } => {
                self.set_clutch(hold, room);
                Ok(())
            }
            Request::CancelChange { epoch } => match self.begin_cancel(epoch, room) {
                Ok(()) => return Progress::Cancelling,
                refused => refused,
            },
            Request::Mark => {
                let number = self.device.next_mark();
                self.command(room, Command::Mark(number));
                return Progress::Marking(number);
            }
            Request::ClearFault { fault } => self
                .device
                .may_clear(fault)
                .and_then(|()| self.send_command(room, Command::ClearFault(fault))),
            Request::Zero { counts } => self
                .device
                .may_change_settings()
                .and_then(|()| self.send_command(room, Command::Zero(counts))),
            Request::SetCalibration { calibration } => self.set_calibration(&calibration),
            Request::DropScene => {
                self.drop_scene(room);
                Ok(())
            }
        })
    }

    /// Sends a command to the loop.
    #[allow(clippy::unnecessary_wraps)] // Returned as the request's result.
    fn send_command(
        &mut self,
        room: CommandRoom,
        command: Command<'static>,
    ) -> Result<(), Refusal> {
        self.command(room, command);
        Ok(())
    }

    /// Checks a jog and sends it to the loop, which drops the scene.
    fn begin_jog(&mut self, jog: Jog, room: CommandRoom) -> Result<(), Refusal> {
        self.device.may_change_settings()?;
        let record = self.device.calibration.as_ref();
        if !jog.is_valid(record.ok_or(Refusal::NoCalibration)?) {
            return Err(Refusal::NoSuchJog);
        }
        self.clear_scene();
        self.device.arming = Some(self.device.health.report.decision.count);
        self.command(room, Command::Jog(jog));
        Ok(())
    }

    /// Checks a calibration and sends it to the loop.
    fn set_calibration(&mut self, calibration: &Calibration) -> Result<(), Refusal> {
        self.device.may_change_settings()?;
        let mechanism = self.device.checked(calibration)?;
        if self.device.is_storing() {
            return Err(Refusal::Busy);
        }
        let handed_over = self.ends.settings.enqueue(mechanism);
        handed_over.map_err(|_| Refusal::Busy)?;
        self.device.set_calibration(calibration);
        Ok(())
    }
}
