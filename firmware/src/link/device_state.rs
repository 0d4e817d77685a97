//! What the link knows of the device (its arm, calibration and last start), and
//! what of it the host has yet to be told.

use hapterra_core::guard::{Limits, Mode, Report};
use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::scene::Health;
use hapterra_core::scene::Scene;
use hapterra_core::wire::hello::{DeviceHello, PROTOCOL};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::status::{Answer, BootReport, CalibrationSource, Refusal, Request};

use crate::board::TickClock;

/// Where storing a calibration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Storing {
    No,
    /// The calibration waits for the board.
    Wanted,
    /// The board has answered; the host has not been told yet.
    Done(Result<(), Refusal>),
}

/// What the link knows of the device.
pub(crate) struct DeviceState {
    hello: DeviceHello,
    pub(super) boot: BootReport,
    pub(super) calibration: Option<Calibration>,
    /// Where the calibration comes from.
    pub(super) source: CalibrationSource,
    /// The loop's latest report.
    pub(super) health: Health,
    /// The guard's report that the host was last told.
    told: Option<Report>,
    /// While an arm command is open: the guard's count of decisions before it.
    pub(super) arming: Option<u8>,
    storing: Storing,
}

impl DeviceState {
    /// Takes the board's name, cut to what the message holds, how the board
    /// started, and the arm that it knows. The window has `D × D` tiles.
    pub(crate) fn new<C: TickClock, const D: usize>(
        board: &str,
        boot: BootReport,
        mechanism: Option<&Mechanism>,
    ) -> Self {
        Self {
            hello: DeviceHello {
                protocol: PROTOCOL,
                board: cut(board),
                version: cut(env!("CARGO_PKG_VERSION")),
                window: u8::try_from(D).unwrap_or(u8::MAX),
                tick_hz: C::RATE.hz(),
                clock_hz: C::HZ,
                epoch: None,
            },
            boot,
            calibration: mechanism.map(|mechanism| *mechanism.calibration()),
            source: match mechanism {
                Some(_) => CalibrationSource::Stored,
                None => CalibrationSource::None,
            },
            health: Health::default(),
            told: None,
            arming: None,
            storing: Storing::No,
        }
    }

    /// A session begins: its host has been told nothing.
    pub(super) fn session_opened(&mut self) {
        self.told = None;
        self.arming = None;
    }

    /// Introduces the device to a host that may come back to `scene`.
    pub(super) fn hello(&self, scene: Option<Scene>) -> DeviceHello {
        DeviceHello {
            epoch: scene.map(|scene| scene.epoch),
            ..self.hello.clone()
        }
    }

    pub(super) fn ticks_per_ms(&self) -> u32 {
        (self.hello.tick_hz / 1000).max(1)
    }

    /// Whether the amplifiers are on.
    pub(super) const fn drives(&self) -> bool {
        self.health.report.mode.drives()
    }

    /// Whether nothing is driven and no arm command waits for the loop.
    pub(super) fn is_at_rest(&self) -> bool {
        !self.drives() && self.arming.is_none()
    }

    /// Settings change only while the arm is disarmed.
    pub(super) fn may_change_settings(&self) -> Result<(), Refusal> {
        match self.health.report.mode {
            Mode::Disarmed => Ok(()),
            _ => Err(Refusal::NotWhileArmed),
        }
    }

    pub(super) fn is_storing(&self) -> bool {
        self.storing != Storing::No
    }

    pub(super) fn set_calibration(&mut self, calibration: &Calibration, store: bool) {
        self.calibration = Some(*calibration);
        self.source = CalibrationSource::Session;
        if store {
            self.storing = Storing::Wanted;
        }
    }

    pub(super) fn to_store(&self) -> Option<Calibration> {
        let wanted = self.storing == Storing::Wanted;
        self.calibration.filter(|_| wanted)
    }

    pub(super) fn stored(&mut self, result: Result<(), Refusal>) {
        if result.is_ok() {
            self.source = CalibrationSource::Stored;
        }
        self.storing = Storing::Done(result);
    }

    /// What the host should be told next, once.
    pub(super) fn next_message(&mut self) -> Option<ToHost> {
        self.arm_decided()
            .or_else(|| self.storing_done())
            .map(|(request, result)| ToHost::Answer(Answer { request, result }))
            .or_else(|| self.guard_changed().map(ToHost::Guard))
    }

    fn arm_decided(&mut self) -> Option<(Request, Result<(), Refusal>)> {
        let decision = self.health.report.decision;
        self.arming.filter(|before| *before != decision.count)?;
        self.arming = None;
        let result = match decision.refused.is_empty() {
            true => Ok(()),
            false => Err(Refusal::Blocked(decision.refused)),
        };
        Some((Request::Arm, result))
    }

    fn storing_done(&mut self) -> Option<(Request, Result<(), Refusal>)> {
        let Storing::Done(result) = self.storing else {
            return None;
        };
        self.storing = Storing::No;
        Some((Request::StoreCalibration, result))
    }

    /// The guard's report without its limits: they come and go with every touch, and
    /// each sample has them.
    fn guard_changed(&mut self) -> Option<Report> {
        let report = Report {
            limits: Limits::empty(),
            ..self.health.report
        };
        (self.told.replace(report) != Some(report)).then_some(report)
    }
}

/// Cuts a text at the first character that does not fit.
fn cut<const N: usize>(text: &str) -> heapless::String<N> {
    let mut short = heapless::String::new();
    let _ = text.chars().try_for_each(|c| short.push(c));
    short
}
