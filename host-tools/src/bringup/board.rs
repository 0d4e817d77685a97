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

/// Duration of a look, the interval of status requests, ms of the board's time.
const LOOK_MS: u32 = 100;
/// Time limit for the board to detect a user's action, in looks.
const LOOKS: usize = 600;
/// Looks within which a board must remove the force after a disarm command.
const LOOKS_TO_DISARM: usize = 20;
/// Largest change between two looks of an encoder at rest.
const STILL_COUNTS: u32 = 3;

/// A board on the link.
pub(super) struct Board<'d, 't> {
    control: &'d mut ControlSession<'t>,
    /// True if the attendant wants to stop.
    stops: fn() -> bool,
    /// True from a request that drives the arm until the board confirms that it is disarmed.
    may_be_armed: bool,
}

impl<'d, 't> Board<'d, 't> {
    /// Wraps the session of a board. `stops` returns true if the attendant wants to stop.
    pub(super) fn new(control: &'d mut ControlSession<'t>, stops: fn() -> bool) -> Self {
        Self {
            control,
            stops,
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

    /// Returns the status after `LOOK_MS` (one look), or as soon as `on` returns true for a sample.
    /// Sends the flat tiles that the board requests.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn look_until(
        &mut self,
        on: &mut dyn FnMut(&TickRecord) -> bool,
    ) -> Result<Status, Halt> {
        if (self.stops)() {
            return Err(Stopped.into());
        }
        let is_enough = Cell::new(false);
        let enough = || is_enough.get();
        let passed = self
            .control
            .pass(LOOK_MS, &enough, &mut |message| match message {
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
                        is_enough.set(is_enough.get() | on(sample));
                    }
                    None
                }
                _ => None,
            });
        Ok(passed?)
    }

    /// Returns the status after one look; calls `on` for each sample.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn look_with(&mut self, on: &mut dyn FnMut(&TickRecord)) -> Result<Status, Halt> {
        self.look_until(&mut |sample| {
            on(sample);
            false
        })
    }

    /// Returns the status after one look.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn look(&mut self) -> Result<Status, Halt> {
        self.look_with(&mut |_| {})
    }

    /// Requests an action of the attendant and waits until the board detects it.
    ///
    /// # Errors
    /// [`Finding::NotSeen`], [`Halt::Link`].
    pub(super) fn see(
        &mut self,
        attendant: &mut dyn Attendant,
        task: Task,
        seen: impl Fn(&Status) -> bool,
    ) -> Result<Status, Halt> {
        attendant.begin(task);
        for _ in 0..LOOKS {
            let status = self.look()?;
            if seen(&status) {
                return Ok(status);
            }
        }
        Err(Finding::NotSeen(task).into())
    }

    /// Waits until the encoders are at rest; returns their counts.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn still(&mut self, attendant: &mut dyn Attendant) -> Result<[i32; 3], Halt> {
        let mut before = self.look()?.health.sense.counts;
        for look in 0.. {
            let now = self.look()?.health.sense.counts;
            if (0..3).all(|i| now[i].abs_diff(before[i]) <= STILL_COUNTS) {
                return Ok(now);
            }
            before = now;
            if look == LOOKS / 10 {
                attendant.hear("the arm moves: hold it still");
            }
        }
        Ok(before)
    }

    /// Sends a request.
    ///
    /// # Errors
    /// [`Finding::NotReady`], [`Finding::Refused`], [`Halt::Link`].
    pub(super) fn ask(&mut self, request: &Request) -> Result<(), Halt> {
        match self.control.request(request)? {
            Ok(()) => Ok(()),
            Err(Refusal::Blocked(why)) => Err(Finding::NotReady(why).into()),
            Err(refusal) => Err(Finding::Refused(refusal).into()),
        }
    }

    /// Sends a request that drives the arm, once the user presses the switch.
    ///
    /// # Errors
    /// As [`Board::ask`].
    pub(super) fn drive(
        &mut self,
        attendant: &mut dyn Attendant,
        request: &Request,
    ) -> Result<(), Halt> {
        self.may_be_armed = true;
        attendant.may_be_armed(true);
        self.ask(request)
    }

    /// Activates a scene.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn put(&mut self, scene: Scene) -> Result<(), Halt> {
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
        let status = self.see(attendant, Task::PressDeadMan, ends)?;
        match status.health.report.fault {
            Some(fault) => Err(Finding::Fault(fault).into()),
            None => Ok(()),
        }
    }

    /// Requests an action of the attendant that must cause a fault, and clears the fault.
    ///
    /// # Errors
    /// [`Finding::NotSeen`]; another fault.
    pub(super) fn trips(
        &mut self,
        attendant: &mut dyn Attendant,
        task: Task,
        fault: Fault,
    ) -> Result<(), Halt> {
        let status = self.see(attendant, task, |s| s.health.report.fault.is_some())?;
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
    pub(super) fn leave(&mut self) -> Result<(), LinkError> {
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
        for _ in 0..LOOKS_TO_DISARM {
            let status = self.control.pass(LOOK_MS, &|| false, &mut |_| None)?;
            if status.health.report.mode == Mode::Disarmed {
                return Ok(answer.is_ok());
            }
        }
        Ok(false)
    }
}
