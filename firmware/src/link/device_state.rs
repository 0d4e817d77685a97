//! The link's data about the device (its arm, calibration and last start), and the parts that are
//! not reported yet.

use hapterra_core::guard::{Blockers, Fault, Limits, Mode, Report};
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::scene::Health;
use hapterra_core::scene::Scene;
use hapterra_core::wire::hello::{DeviceHello, PROTOCOL, SerialNumber};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::request::Refusal;
use hapterra_core::wire::session::LastSession;
use hapterra_core::wire::status::{BootReport, CalibrationSource};

use super::requests::LatestRequest;
use super::session::Session;
use crate::board::TickClock;
use crate::dead_man_press::PressWait;

/// Progress of storing a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Storing {
    Idle,
    /// The user has to press the dead-man switch.
    AwaitingPress(PressWait),
    /// The calibration waits for the board.
    Due,
}

/// Data of the arm at the board's start.
pub(crate) struct ArmConfig {
    /// The calibration in force.
    pub(crate) calibration: Option<Calibration>,
    /// Its source, or the reason why there is none.
    pub(crate) source: CalibrationSource,
    /// The current at the ends of the amplifiers' range, A.
    pub(crate) full_scale_a: f32,
    /// Time from the beginning of a tick until the motors have its current, µs.
    pub(crate) latency_us: u16,
}

/// The link's data about the device.
pub(crate) struct DeviceState {
    hello: DeviceHello,
    pub(super) boot: BootReport,
    pub(super) calibration: Option<Calibration>,
    /// Source of the calibration.
    pub(super) source: CalibrationSource,
    /// Maximum current of a calibration, A.
    full_scale_a: f32,
    /// The loop's latest report.
    pub(super) health: Health,
    /// The last report of the guard to the host.
    reported: Option<Report>,
    /// True if the loop has received a command that may lead to driving, and has not reported since
    /// that it is disarmed.
    pub(super) may_drive: bool,
    /// The guard's count of decisions before the arm command, while one is pending.
    pub(super) arming: Option<u8>,
    /// Number of the latest mark.
    mark: u8,
    /// The host's latest request.
    pub(super) request: LatestRequest,
    /// Progress of storing the calibration.
    storing: Storing,
}

impl DeviceState {
    /// Creates the state from the board's name, cut to the length in the message, its serial
    /// number, its boot report, and its arm. The window has `D × D` tiles.
    pub(crate) fn new<C: TickClock, const D: usize>(
        (board, serial): (&str, SerialNumber),
        boot: BootReport,
        arm: ArmConfig,
    ) -> Self {
        Self {
            hello: DeviceHello {
                protocol: PROTOCOL,
                number: 0,
                opened_by: 0,
                board: cut(board),
                serial,
                version: cut(env!("CARGO_PKG_VERSION")),
                window: u8::try_from(D).unwrap_or(u8::MAX),
                tick_hz: C::RATE.hz(),
                latency_us: arm.latency_us,
                clock_hz: C::HZ,
                epoch: None,
                last: LastSession::default(),
            },
            boot,
            calibration: arm.calibration,
            source: arm.source,
            full_scale_a: arm.full_scale_a,
            health: Health::default(),
            reported: None,
            may_drive: false,
            arming: None,
            mark: 0,
            request: LatestRequest::default(),
            storing: Storing::Idle,
        }
    }

    /// Begins a session: nothing is reported to its host yet.
    pub(super) fn session_opened(&mut self) {
        self.reported = None;
        self.arming = None;
        self.request = LatestRequest::default();
        self.cancel_press();
    }

    /// Answers the open message with this number, of a host that may return to `scene`.
    pub(super) fn hello(&self, number: u8, scene: Option<Scene>, session: &Session) -> DeviceHello {
        DeviceHello {
            number,
            opened_by: session.opened_by,
            epoch: scene.map(|scene| scene.epoch),
            last: session.last(),
            ..self.hello.clone()
        }
    }

    pub(super) fn tick_hz(&self) -> u32 {
        self.hello.tick_hz
    }

    pub(super) fn ticks_per_ms(&self) -> u32 {
        (self.hello.tick_hz / 1000).max(1)
    }

    /// Returns true if the amplifiers are on.
    pub(super) const fn is_driving(&self) -> bool {
        self.health.report.mode.is_driving()
    }

    /// Returns true if nothing is driven, no arm command waits for the loop and no calibration for
    /// a press.
    pub(super) fn is_idle(&self) -> bool {
        !self.is_driving() && self.arming.is_none() && !self.is_awaiting_press()
    }

    /// Returns true if a dead-man press will store a calibration.
    pub(super) const fn is_awaiting_press(&self) -> bool {
        matches!(self.storing, Storing::AwaitingPress(_))
    }

    /// Handles a report of the loop, received in tick `now`.
    pub(super) fn on_health(&mut self, health: Health, now: u32) {
        self.health = health;
        if let Storing::AwaitingPress(wait) = &mut self.storing
            && let Some(decided) = wait.check(&self.health, now)
        {
            match decided {
                Ok(()) => self.storing = Storing::Due,
                Err(refused) => {
                    self.storing = Storing::Idle;
                    self.request.stored(Err(refused));
                }
            }
        }
    }

    /// Returns the number of the next mark: not 0, which means none.
    pub(super) const fn next_mark(&mut self) -> u8 {
        self.mark = match self.mark.checked_add(1) {
            Some(next) => next,
            None => 1,
        };
        self.mark
    }

    /// Ends the wait for a press, because its host has left: a later press would have another
    /// purpose.
    pub(super) fn cancel_press(&mut self) {
        if matches!(self.storing, Storing::AwaitingPress(_)) {
            self.storing = Storing::Idle;
        }
    }

    /// Ends the wait for a press, because its host is silent. The host receives an answer if it
    /// returns.
    pub(super) fn expire_press(&mut self) {
        if self.is_awaiting_press() {
            self.storing = Storing::Idle;
            self.request.stored(Err(Refusal::NotPressed));
        }
    }

    /// Checks a calibration as a whole, including this board's limits.
    pub(super) fn checked(&self, calibration: &Calibration) -> Result<Kinematics, Refusal> {
        let fits = calibration.check_board(self.full_scale_a);
        let mechanism = Kinematics::new(calibration).and_then(|arm| fits.map(|()| arm));
        mechanism.map_err(Refusal::Calibration)
    }

    /// Returns true if an arm command is pending and the amplifiers are still off.
    pub(super) fn is_being_armed(&self) -> bool {
        self.may_drive && !self.is_driving()
    }

    /// Checks that the arm is disarmed, as every change of settings requires.
    pub(super) fn may_change_settings(&self) -> Result<(), Refusal> {
        match self.health.report.mode {
            Mode::Disarmed => Ok(()),
            _ => Err(Refusal::NotWhileArmed),
        }
    }

    /// Checks that the fault to clear is the one reported to the host.
    pub(super) fn may_clear(&self, acknowledged: Option<Fault>) -> Result<(), Refusal> {
        match self.health.report.fault {
            Some(fault) if Some(fault) != acknowledged => {
                Err(Refusal::Blocked(Blockers::FAULT_LATCHED))
            }
            _ => Ok(()),
        }
    }

    /// Checks that outputs may be held: only while disarmed and without a fault.
    pub(super) fn may_hold_outputs(&self) -> Result<(), Refusal> {
        self.may_change_settings()?;
        match self.health.report.fault {
            None => Ok(()),
            Some(_) => Err(Refusal::Blocked(Blockers::FAULT_LATCHED)),
        }
    }

    pub(super) fn is_storing(&self) -> bool {
        self.storing != Storing::Idle
    }

    pub(super) fn set_calibration(&mut self, calibration: &Calibration) {
        self.calibration = Some(*calibration);
        self.source = CalibrationSource::Session;
    }

    /// Begins to wait, in tick `now`, for the press that is needed to store the current
    /// calibration.
    pub(super) fn begin_storing(&mut self, now: u32) -> Result<(), Refusal> {
        self.may_change_settings()?;
        if self.calibration.is_none() {
            return Err(Refusal::NoCalibration);
        }
        if self.is_storing() {
            return Err(Refusal::Busy);
        }
        self.storing = Storing::AwaitingPress(PressWait::new(now, self.ticks_per_ms()));
        Ok(())
    }

    pub(super) fn to_store(&self) -> Option<Calibration> {
        let is_due = self.storing == Storing::Due;
        self.calibration.filter(|_| is_due)
    }

    pub(super) fn stored(&mut self, result: Result<(), Refusal>) {
        if result.is_ok() {
            self.source = CalibrationSource::Stored;
        }
        self.storing = Storing::Idle;
        self.request.stored(result);
    }

    /// Returns the next message to the host, once.
    pub(super) fn next_message(&mut self) -> Option<ToHost> {
        self.check_decision();
        let answer = self.request.take_answer();
        answer.or_else(|| self.guard_changed().map(ToHost::Guard))
    }

    /// Reads the loop's decision on the pending arm command.
    fn check_decision(&mut self) {
        let decision = self.health.report.decision;
        if self.arming.is_none_or(|before| before == decision.count) {
            return;
        }
        self.arming = None;
        self.request.arm_decided(match decision.refused.is_empty() {
            true => Ok(()),
            false => Err(Refusal::Blocked(decision.refused)),
        });
    }

    /// Returns the guard's report without its limits: these change with every touch, and each
    /// sample contains them.
    pub(super) fn report(&self) -> Report {
        Report {
            limits: Limits::empty(),
            ..self.health.report
        }
    }

    fn guard_changed(&mut self) -> Option<Report> {
        let report = self.report();
        (self.reported.replace(report) != Some(report)).then_some(report)
    }
}

/// Cuts a text at the first character that does not fit.
fn cut<const N: usize>(text: &str) -> heapless::String<N> {
    let mut short = heapless::String::new();
    let _ = text.chars().try_for_each(|c| short.push(c));
    short
}
