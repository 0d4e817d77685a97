//! The board as the steps use it: looked at, asked for things, given a plane.

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

/// Between two looks, ms of the board's time.
const LOOK_MS: u32 = 100;
/// Time for which the board looks out for what the user was asked to do, in looks.
const LOOKS: usize = 600;
/// Checks within which a board that received a disarm command has let the force out.
const LOOKS_TO_DISARM: usize = 20;
/// Encoders that move by more than this between two looks are not still.
const STILL_COUNTS: u32 = 3;

/// A board on the link.
pub(super) struct Board<'d, 't> {
    control: &'d mut ControlSession<'t>,
    /// True if the attendant wants to stop.
    stops: fn() -> bool,
    /// It was asked for something that drives, and has not confirmed that it is disarmed
    /// since.
    may_be_armed: bool,
}

impl<'d, 't> Board<'d, 't> {
    /// The board at the other end of a dialogue, for an attendant who wants to stop when
    /// `stops` returns true.
    pub(super) fn new(control: &'d mut ControlSession<'t>, stops: fn() -> bool) -> Self {
        Self {
            control,
            stops,
            may_be_armed: false,
        }
    }

    /// Returns its introduction.
    #[must_use]
    pub(super) fn device(&self) -> &DeviceHello {
        self.control.device()
    }

    /// The record in force.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn calibration(&mut self) -> Result<Option<Calibration>, Halt> {
        Ok(self.control.calibration()?)
    }

    /// Looks at it after a moment, or as soon as `on` says of a sample that it is enough;
    /// sends the flat tiles that it asks for.
    ///
    /// # Errors
    /// [`Halt::Link`].
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

    /// Looks at it after a moment; tells `on` of each sample.
    ///
    /// # Errors
    /// [`Halt::Stopped`], [`Halt::Link`].
    pub(super) fn look_with(&mut self, on: &mut dyn FnMut(&TickRecord)) -> Result<Status, Halt> {
        self.look_until(&mut |sample| {
            on(sample);
            false
        })
    }

    /// Looks at it after a moment.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn look(&mut self) -> Result<Status, Halt> {
        self.look_with(&mut |_| {})
    }

    /// Asks the attendant to do something and looks until the board sees it.
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

    /// Looks until the encoders stand still; returns their counts.
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

    /// Asks for something to be done.
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

    /// Asks for something that drives the arm, once the user presses the switch.
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

    /// Puts a scene in force.
    ///
    /// # Errors
    /// [`Halt::Link`].
    pub(super) fn put(&mut self, scene: Scene) -> Result<(), Halt> {
        Ok(self.control.put_scene(scene)?)
    }

    /// Arms for the scene in force, with the attendant's press.
    ///
    /// # Errors
    /// A blocker, or a fault.
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

    /// Has the attendant do something that is to end in a fault, and clears the fault.
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

    /// Disarms, clears what the step has latched and drops its scene.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] where the board was asked to drive the arm and does not
    /// say that it is disarmed.
    pub(super) fn leave(&mut self) -> Result<(), LinkError> {
        match self.disarm() {
            Ok(true) => self.may_be_armed = false,
            _ if self.may_be_armed => return Err(LinkError::NotConfirmed),
            // The board may be gone; then nothing is left to be done.
            _ => return Ok(()),
        }
        let latched = self.control.fresh_status().ok();
        let seen = latched.and_then(|status| status.health.report.fault);
        for request in [Request::DropScene, Request::ClearFault { seen }] {
            // Whether it does depends on what it still sees.
            let _ = self.control.request(&request);
        }
        Ok(())
    }

    /// Checks that the board says that it is disarmed, after the command.
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
