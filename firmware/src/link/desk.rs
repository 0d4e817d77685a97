//! Everything of a session that is not about terrain: arming, calibration,
//! status.

use hapterra_core::guard::{Limits, Mode, Report};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::message::{DeviceHello, Sample, ToHost};
use hapterra_core::wire::status::{
    Answer, CalibrationSource, Health, Refusal, Request, StackFigures, Status, TickFigures,
};

use super::Identity;
use crate::vitals::Vitals;

/// Where storing a calibration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Storing {
    No,
    /// It waits for the board.
    Wanted,
    /// The board has answered; the host has not been told yet.
    Done(Result<(), Refusal>),
}

/// What the session itself counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counts {
    pub(super) bad_frames: u32,
    pub(super) dropped: u32,
}

/// What is known about the loop and its arm, and what the host is to be told.
pub(super) struct Desk {
    identity: Identity,
    source: CalibrationSource,
    health: Health,
    /// What the host was last told of the guard.
    told: Option<Report>,
    /// An arm command is open: the count of decisions when it came.
    arming: Option<u8>,
    storing: Storing,
}

impl Desk {
    pub(super) fn new(identity: Identity) -> Self {
        let source = match identity.calibration {
            Some(_) => CalibrationSource::Stored,
            None => CalibrationSource::None,
        };
        Self {
            identity,
            source,
            health: Health::default(),
            told: None,
            arming: None,
            storing: Storing::No,
        }
    }

    /// A session begins: its host has been told nothing.
    pub(super) fn opened(&mut self) {
        self.told = None;
        self.arming = None;
    }

    pub(super) fn hello(&self, epoch: Option<u32>) -> DeviceHello {
        DeviceHello {
            epoch,
            ..self.identity.hello.clone()
        }
    }

    /// The application's time in milliseconds, from its ticks.
    pub(super) fn milliseconds(&self, ticks: u32) -> u32 {
        ticks / self.ticks_per_ms()
    }

    pub(super) fn ticks_per_ms(&self) -> u32 {
        (self.identity.hello.tick_hz / 1000).max(1)
    }

    pub(super) fn take(&mut self, health: Health) {
        self.health = health;
    }

    pub(super) fn arm(&mut self) {
        self.arming = Some(self.health.report.decision.count);
    }

    pub(super) const fn report(&self) -> &Report {
        &self.health.report
    }

    pub(super) const fn drives(&self) -> bool {
        self.health.report.mode.drives()
    }

    /// Nothing is driven, and no request waits for the loop.
    pub(super) fn is_at_rest(&self) -> bool {
        !self.drives() && self.arming.is_none()
    }

    /// Settings change only while nothing depends on them.
    pub(super) fn may_change_settings(&self) -> Result<(), Refusal> {
        match self.health.report.mode {
            Mode::Disarmed => Ok(()),
            _ => Err(Refusal::NotWhileArmed),
        }
    }

    pub(super) const fn calibration(&self) -> Option<Calibration> {
        self.identity.calibration
    }

    pub(super) fn is_storing(&self) -> bool {
        self.storing != Storing::No
    }

    pub(super) fn set_calibration(&mut self, calibration: &Calibration, store: bool) {
        self.identity.calibration = Some(*calibration);
        self.source = CalibrationSource::Session;
        if store {
            self.storing = Storing::Wanted;
        }
    }

    pub(super) fn to_store(&self) -> Option<Calibration> {
        let wanted = self.storing == Storing::Wanted;
        self.identity.calibration.filter(|_| wanted)
    }

    pub(super) fn stored(&mut self, result: Result<(), Refusal>) {
        if result.is_ok() {
            self.source = CalibrationSource::Stored;
        }
        self.storing = Storing::Done(result);
    }

    /// What the host should hear next, once.
    pub(super) fn next_to_say(&mut self) -> Option<ToHost> {
        self.arm_decided()
            .or_else(|| self.storing_done())
            .map(ToHost::Answer)
            .or_else(|| self.guard_changed().map(ToHost::Guard))
    }

    fn arm_decided(&mut self) -> Option<Answer> {
        let decision = self.health.report.decision;
        self.arming.filter(|before| *before != decision.count)?;
        self.arming = None;
        let result = match decision.refused.is_empty() {
            true => Ok(()),
            false => Err(Refusal::Blocked(decision.refused)),
        };
        let request = Request::Arm;
        Some(Answer { request, result })
    }

    fn storing_done(&mut self) -> Option<Answer> {
        let Storing::Done(result) = self.storing else {
            return None;
        };
        self.storing = Storing::No;
        let request = Request::StoreCalibration;
        Some(Answer { request, result })
    }

    /// Limits come and go with every touch, and each sample has them.
    fn guard_changed(&mut self) -> Option<Report> {
        let report = Report {
            limits: Limits::empty(),
            ..self.health.report
        };
        if self.told == Some(report) {
            return None;
        }
        self.told = Some(report);
        Some(report)
    }

    pub(super) fn status(
        &self,
        vitals: &Vitals,
        latest: &Sample,
        epoch: Option<u32>,
        counts: Counts,
    ) -> Status {
        let (size, high_water) = vitals.stack();
        Status {
            device: self.hello(epoch),
            boot: self.identity.boot.clone(),
            calibration: self.source,
            model: self.calibration().map(|calibration| calibration.model),
            health: self.health,
            ticks: TickFigures {
                run: vitals.ticks(),
                cost: latest.cost,
                worst_cost: latest.worst_cost,
                late: latest.late,
            },
            stack: StackFigures { size, high_water },
            bad_frames: counts.bad_frames,
            dropped: counts.dropped.wrapping_add(vitals.dropped()),
        }
    }
}
