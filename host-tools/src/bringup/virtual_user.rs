//! A simulated user at a virtual bench.

use std::cell::RefCell;
use std::rc::Rc;

use glam::DVec3;

use super::attendant::{Attendant, BoardState, Question, Reading, Stopped, Task};
use super::virtual_bench::{Grip, VirtualBench};
use crate::calibrate::Direction;
use crate::link::Native;
use crate::phantom::{PhantomModel, Wiring};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::native::StoppedClock;
use hapterra_firmware::store::Stored;

/// Depth below the tip to which the hand pushes into the soft plane, m.
const PUSH_M: f64 = 0.035;
/// Upward force from which the user notices a push, N.
const MIN_NOTICED_N: f64 = 0.1;
/// Interval at which the virtual device returns to its host, ms.
const HOST_INTERVAL_MS: u32 = 25;

/// Follows the instructions at a virtual bench, and reads the exact values.
pub struct VirtualUser {
    bench: Rc<RefCell<VirtualBench>>,
    /// Position of the tip before its last move along the ruler, m.
    before_m: DVec3,
    /// The scale's direction, and its reading at the requested moment, grams.
    scale: (DVec3, f64),
    /// Maximum upward force while the tip was lowered, N.
    force_n: f64,
    /// Receives the output, a line at a time.
    pub print: fn(&str),
}

impl VirtualUser {
    /// Returns a user of a Premium 1.5 with this wiring.
    #[must_use]
    pub fn new(wiring: Wiring) -> Self {
        Self::at(VirtualBench::new(PhantomModel::premium_1_5(), wiring))
    }

    /// Returns a user at this bench.
    #[must_use]
    pub fn at(bench: VirtualBench) -> Self {
        Self {
            before_m: bench.tip_m(),
            bench: Rc::new(RefCell::new(bench)),
            scale: (DVec3::ZERO, 0.0),
            force_n: 0.0,
            print: |line| tracing::info!("{line}"),
        }
    }

    /// Returns the bench.
    #[must_use]
    pub fn bench(&self) -> Rc<RefCell<VirtualBench>> {
        Rc::clone(&self.bench)
    }

    /// Returns an in-memory device that was just switched on, with this record and the bench's
    /// wiring.
    #[must_use]
    pub fn device(&self, record: Calibration) -> Native<StoppedClock> {
        let bench = self.bench();
        let stored = Stored::Found(record);
        Native::started(StoppedClock, None, stored, BootReport::default())
            .with_fault_injector(Box::new(move |_, sense, drive| {
                *sense = bench.borrow_mut().tick(drive);
            }))
            .free_running()
            .with_ticks_per_call(HOST_INTERVAL_MS)
            .with_usb_clock(self.bench.borrow().usb_clock())
    }

    fn act(&mut self, task: Task) {
        let mut bench = self.bench.borrow_mut();
        let home_m = bench.home_m();
        match task {
            Task::Wire(_) => {}
            Task::PressStop => bench.stop = true,
            Task::ReleaseStop => bench.stop = false,
            Task::PullStopWire => bench.stop_wire_off = true,
            Task::ConnectStopWire => bench.stop_wire_off = false,
            Task::PullReadyWire(axis) => bench.ready_wire_off[axis] = true,
            Task::ConnectReadyWire(axis) => bench.ready_wire_off[axis] = false,
            Task::PressDeadMan => bench.dead_man = true,
            Task::ReleaseDeadMan => bench.dead_man = false,
            Task::ZeroPose => {
                bench.hold(Grip::Firm);
                bench.lead(home_m);
            }
            Task::MoveAlong(direction, mm) => {
                self.before_m = bench.tip_m();
                bench.lead(self.before_m + 1e-3 * f64::from(mm) * direction.unit());
            }
            Task::HoldLoosely | Task::HoldTip => bench.hold(Grip::Loose),
            Task::HoldWithScale(axis) => {
                bench.hold(Grip::Scale);
                self.scale.0 = push_direction(axis);
            }
            Task::ReadScale => self.scale.1 = bench.scale_grams(self.scale.0),
            Task::ReleaseTip => bench.release(),
            Task::LowerTip => {
                let tip_m = bench.tip_m();
                self.before_m = tip_m;
                bench.approach(tip_m - PUSH_M * DVec3::Z);
            }
            Task::LiftTip => {
                // The hand balances the floor's push, so the floor's force is its reaction.
                self.force_n = bench.scale_grams(DVec3::Z) * crate::calibrate::N_PER_GRAM;
                bench.approach(self.before_m);
            }
        }
    }

    fn measure(&self, reading: Reading) -> f64 {
        let bench = self.bench.borrow();
        match reading {
            Reading::EnableVolts(is) => bench.enable_v(is == BoardState::Running),
            Reading::Output { axis, .. } => bench.output_v(axis),
            Reading::MovedMm(direction, _) => {
                1e3 * direction.unit().dot(bench.tip_m() - self.before_m)
            }
            Reading::ScaleGrams { pushed: false } => bench.scale_grams(self.scale.0),
            Reading::ScaleGrams { pushed: true } => self.scale.1,
        }
    }
}

/// Returns the direction in which an axis pushes the tip in the zero pose as its angle grows.
fn push_direction(axis: usize) -> DVec3 {
    let direction = Direction::ALL.get(axis).copied();
    direction.unwrap_or(Direction::Up).unit()
}

impl Attendant for VirtualUser {
    fn notify(&mut self, line: &str) {
        (self.print)(line);
    }

    fn begin(&mut self, task: Task) {
        (self.print)(&format!("  > {task}"));
        self.act(task);
    }

    fn finish(&mut self, task: Task) -> Result<(), Stopped> {
        self.begin(task);
        Ok(())
    }

    fn read(&mut self, reading: Reading) -> Result<f64, Stopped> {
        // Round to the meter's digit; `+ 0.0` removes a negative zero.
        let value = (self.measure(reading) * 10.0).round() / 10.0 + 0.0;
        (self.print)(&format!("  ? {reading} {value:.1}"));
        Ok(value)
    }

    fn confirm(&mut self, question: Question) -> Result<bool, Stopped> {
        let yes = match question {
            Question::ReadyIsWired => true,
            Question::StopCutsPower => !self.bench.borrow().has_power(),
            Question::PushedBack => self.force_n > MIN_NOTICED_N,
        };
        (self.print)(&format!(
            "  ? {question} {}",
            if yes { "yes" } else { "no" }
        ));
        Ok(yes)
    }

    fn time_s(&self, board_ms: f64) -> f64 {
        self.bench.borrow().time_s(board_ms)
    }
}
