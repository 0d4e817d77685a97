//! The steps' interface to the board: status, requests and scenes.

use std::cell::Cell;

use hapterra_core::guard::{Fault, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, TickRecord};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::status::Status;

use super::attendant::{Attendant, Stopped, Task};
use super::finding::Finding;
use super::halt::Halt;
use crate::link::{ControlSession, LinkError};

/// Interval of status requests, ms of the board's time.
const STATUS_INTERVAL_MS: u32 = 100;
/// Time limit for the board to detect a user's action, in status requests.
const MAX_POLLS: usize = 600;
/// Status requests within which a board must remove the force after a disarm command.
const MAX_POLLS_TO_DISARM: usize = 20;
/// Largest change between two status requests of an encoder at rest.
const STILL_COUNTS: u32 = 3;

/// A board on the link.
pub(super) struct Board<'d, 't> {
    control: &'d mut ControlSession<'t>,
    /// True if the attendant wants to stop.
    stop_requested: fn() -> bool,
    /// True from a request that drives the arm until the board confirms that it is disarmed.
    may_be_armed: bool,
}

impl<'d, 't> Board<'d, 't> {
    /// Wraps the session of a board. `stop_requested` returns true if the attendant wants to stop.
    pub(super) fn new(control: &'d mut ControlSession<'t>, stop_requested: fn() -> bool) -> Self {
        Self {
            control,
            stop_requested,
            may_be_armed: false,
        }
    }

    /// Returns the board's introduction.
    #[must_use]
    pub(super) fn device(&self) -> &DeviceHello {
        self.control.device()
    }

    /// Returns the calibration record in force.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn calibration(&mut self) -> Result<Option<Calibration>, Halt> {
        Ok(self.control.calibration()?)
    }

    /// Returns the status after `STATUS_INTERVAL_MS`, or as soon as `on` returns true for a sample.
    /// Sends the flat tiles that the board requests.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn poll_status_until(
        &mut self,
        on: &mut dyn FnMut(&TickRecord) -> bool,
    ) -> Result<Status, Halt> {
        if (self.stop_requested)() {
            return Err(Stopped.into());
        }
        let done = Cell::new(false);
        let check_done = || done.get();
        let passed =
            self.control.run_for(
                STATUS_INTERVAL_MS,
                &check_done,
                &mut |message| match message {
                    ToHost::TileRequest { epoch, key } => Some(ToDevice::Tile(TileMessage {
                        epoch: *epoch,
                        key: *key,
                        heights: Heights::Flat {
                            base: 0,
                            height: 0.0,
                        },
                    })),
                    ToHost::Telemetry(telemetry) => {
                        for sample in &telemetry.samples {
                            done.set(done.get() | on(sample));
                        }
                        None
                    }
                    _ => None,
                },
            );
        Ok(passed?)
    }

    /// Returns the status after one interval; calls `on` for each sample.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn poll_status_with(
        &mut self,
        on: &mut dyn FnMut(&TickRecord),
    ) -> Result<Status, Halt> {
        self.poll_status_until(&mut |sample| {
            on(sample);
            false
        })
    }

    /// Returns the status after one interval.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn poll_status(&mut self) -> Result<Status, Halt> {
        self.poll_status_with(&mut |_| {})
    }

    /// Requests an action of the attendant and waits until the board detects it.
    ///
    /// # Errors
    /// [`Finding::NotDetected`], [`Halt::Link`].
    pub(super) fn wait_for_task(
        &mut self,
        attendant: &mut dyn Attendant,
        task: Task,
        is_done: impl Fn(&Status) -> bool,
    ) -> Result<Status, Halt> {
        attendant.begin(task);
        for _ in 0..MAX_POLLS {
            let status = self.poll_status()?;
            if is_done(&status) {
                return Ok(status);
            }
        }
        Err(Finding::NotDetected(task).into())
    }

    /// Waits until the encoders are at rest; returns their counts.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn wait_for_rest(
        &mut self,
        attendant: &mut dyn Attendant,
    ) -> Result<[i32; 3], Halt> {
        let mut before = self.poll_status()?.health.sense.counts;
        for poll in 0.. {
            let now = self.poll_status()?.health.sense.counts;
            if (0..3).all(|i| now[i].abs_diff(before[i]) <= STILL_COUNTS) {
                return Ok(now);
            }
            before = now;
            if poll == MAX_POLLS / 10 {
                attendant.notify("the arm moves: hold it still");
            }
        }
        Ok(before)
    }

    /// Sends a request.
    ///
    /// # Errors
    /// [`Finding::NotReady`], [`Finding::Refused`], [`Halt::Link`].
    pub(super) fn request(&mut self, request: &Request) -> Result<(), Halt> {
        match self.control.request(request)? {
            Ok(()) => Ok(()),
            Err(Refusal::Blocked(why)) => Err(Finding::NotReady(why).into()),
            Err(refusal) => Err(Finding::Refused(refusal).into()),
        }
    }

    /// Sends a request that drives the arm, once the user presses the switch.
    ///
    /// # Errors
    /// As [`Board::request`].
    pub(super) fn drive(
        &mut self,
        attendant: &mut dyn Attendant,
        request: &Request,
    ) -> Result<(), Halt> {
        self.may_be_armed = true;
        attendant.may_be_armed(true);
        self.request(request)
    }

    /// Activates a scene.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn put_scene(&mut self, scene: Scene) -> Result<(), Halt> {
        Ok(self.control.put_scene(scene)?)
    }

    /// Arms for the active scene at the attendant's dead-man press.
    ///
    /// # Errors
    /// A blocker or a fault.
    pub(super) fn arm(&mut self, attendant: &mut dyn Attendant) -> Result<(), Halt> {
        self.drive(attendant, &Request::Arm)?;
        let ends = |status: &Status| {
            let report = &status.health.report;
            report.mode == Mode::Armed || report.fault.is_some()
        };
        let status = self.wait_for_task(attendant, Task::PressDeadMan, ends)?;
        match status.health.report.fault {
            Some(fault) => Err(Finding::Fault(fault).into()),
            None => Ok(()),
        }
    }

    /// Requests an action of the attendant that must cause a fault, and clears the fault.
    ///
    /// # Errors
    /// [`Finding::NotDetected`]; another fault.
    pub(super) fn expect_fault(
        &mut self,
        attendant: &mut dyn Attendant,
        task: Task,
        fault: Fault,
    ) -> Result<(), Halt> {
        let status = self.wait_for_task(attendant, task, |s| s.health.report.fault.is_some())?;
        match status.health.report.fault {
            Some(found) if found != fault => Err(Finding::Fault(found).into()),
            _ => Ok(()),
        }
    }

    /// Disarms, clears the step's latched faults and removes its scene.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] if the board received a request to drive the arm and does not
    /// confirm that it is disarmed.
    pub(super) fn disarm_and_clear(&mut self) -> Result<(), LinkError> {
        match self.disarm() {
            Ok(true) => self.may_be_armed = false,
            _ if self.may_be_armed => return Err(LinkError::NotConfirmed),
            // The board may be disconnected; then nothing is left to do.
            _ => return Ok(()),
        }
        let latched = self.control.fresh_status().ok();
        let fault = latched.and_then(|status| status.health.report.fault);
        for request in [Request::DropScene, Request::ClearFault { fault }] {
            // A refusal is no error here: the cause may still be present.
            let _ = self.control.request(&request);
        }
        Ok(())
    }

    /// Sends the disarm command and returns true if the board confirms it.
    fn disarm(&mut self) -> Result<bool, LinkError> {
        let answer = self.control.request(&Request::Disarm)?;
        for _ in 0..MAX_POLLS_TO_DISARM {
            let status = self
                .control
                .run_for(STATUS_INTERVAL_MS, &|| false, &mut |_| None)?;
            if status.health.report.mode == Mode::Disarmed {
                return Ok(answer.is_ok());
            }
        }
        Ok(false)
    }
}
