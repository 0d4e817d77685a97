//! A virtual Phantom on a virtual bench, with the user's wiring, grip and measurements.

use glam::DVec3;
use hapterra_core::guard::{GuardInputs, GuardOutputs};
use hapterra_core::wire::status::UsbClock;

use crate::calibrate::N_PER_GRAM;
use crate::phantom::{HandModel, PhantomModel, Plant, Wiring, kinematics};

/// Speed of a hand that leads the tip, and of one that searches for the surface, m/s.
const GUIDE_M_S: f64 = 0.1;
const APPROACH_M_S: f64 = 0.02;
/// Length of a tick, s.
const TICK_S: f64 = 1e-3;
/// Voltage of an output at full scale, V.
const FULL_V: f64 = 10.0;

/// Fingers that hold the tip firmly and lead it.
const FIRM: HandModel = HandModel {
    mass_kg: 0.15,
    arm_n_per_m: 20_000.0,
    arm_ns_per_m: 100.0,
    grip_n_per_m: 20_000.0,
    grip_ns_per_m: 60.0,
};

/// A hand that holds the tip with a spring scale.
const SCALE: HandModel = HandModel {
    arm_n_per_m: 1_000.0,
    arm_ns_per_m: 10.0,
    ..FIRM
};

/// Grip on the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    /// Fingers that lead the tip.
    Firm,
    /// Two loose fingers.
    Loose,
    /// A spring scale.
    Scale,
}

/// Wiring mistakes between the board and its amplifiers and switches.
#[derive(Clone, Copy, Debug, Default)]
pub struct BenchMistakes {
    /// Error of a command at its amplifier's input, V.
    pub output_offset_v: [f64; 3],
    /// The enable line has no pull-down: it is high unless it is driven low.
    pub enable_floats: bool,
    /// The stop is normally open: its contact closes if it is pressed, and a disconnected wire
    /// looks released.
    pub stop_normally_open: bool,
    /// The stop's second contact does not switch the power stages' supply.
    pub stop_leaves_power: bool,
    /// The amplifier is missing or has no power: no push, no ready signal.
    pub amplifier_missing: [bool; 3],
    /// The ready input is connected to ground instead of its amplifier.
    pub ready_grounded: [bool; 3],
    /// Relative error by which the board's clock is slow.
    pub clock_slow_by: f64,
    /// The board's USB oscillator is not locked to the host's.
    pub usb_clock_unlocked: bool,
}

/// An arm, its wires, and the hand on it.
pub struct VirtualBench {
    plant: Plant,
    wiring: Wiring,
    /// Goal of the hand and its present target, m.
    goal_m: DVec3,
    at_m: DVec3,
    speed_m_s: f64,
    pub(super) dead_man: bool,
    pub(super) stop: bool,
    /// True if the stop's wire is disconnected.
    pub(super) stop_wire_off: bool,
    /// True for each disconnected ready wire.
    pub(super) ready_wire_off: [bool; 3],
    mistakes: BenchMistakes,
    drive: GuardOutputs,
    /// Maximum speed of each joint, rad/s, while the amplifiers are on and for 0.1 s after.
    max_rate_rad_s: [f64; 3],
    ticks_since_on: u32,
}

impl VirtualBench {
    /// Returns a bench whose arm was switched on outside its zero pose and is held firmly.
    #[must_use]
    pub fn new(model: PhantomModel, wiring: Wiring) -> Self {
        let mut plant = Plant::new(model, [0.2, -0.1, 0.3]);
        plant.power_up();
        let at_m = DVec3::from(plant.tip_m());
        Self {
            plant: plant.with_hand(FIRM),
            wiring,
            goal_m: at_m,
            at_m,
            speed_m_s: GUIDE_M_S,
            dead_man: false,
            stop: false,
            stop_wire_off: false,
            ready_wire_off: [false; 3],
            mistakes: BenchMistakes::default(),
            drive: GuardOutputs::default(),
            max_rate_rad_s: [0.0; 3],
            ticks_since_on: u32::MAX,
        }
    }

    /// Returns the same bench with these mistakes.
    #[must_use]
    pub const fn with_mistakes(mut self, mistakes: BenchMistakes) -> Self {
        self.mistakes = mistakes;
        self
    }

    /// Simulates a tick with the amplifiers' commands `drive`; returns the encoders and switches
    /// after it.
    pub fn tick(&mut self, drive: &GuardOutputs) -> GuardInputs {
        self.drive = *drive;
        let left = self.goal_m - self.at_m;
        let step = left.clamp_length_max(self.speed_m_s * TICK_S);
        self.at_m += step;
        self.plant
            .set_target(self.at_m.to_array(), (step / TICK_S).to_array());
        let mut commands_a = match drive.enabled {
            true => drive.currents_a.to_array().map(f64::from),
            false => [0.0; 3],
        };
        for (command_a, missing) in commands_a.iter_mut().zip(self.mistakes.amplifier_missing) {
            *command_a *= f64::from(u8::from(!missing));
        }
        let counts = self.plant.step(self.wiring.currents_a(commands_a), TICK_S);
        self.watch(drive.enabled);
        GuardInputs {
            counts: self.wiring.counts(counts),
            dead_man: self.dead_man,
            emergency_stop: self.stop_reads_pressed(),
            amplifier_not_ready: self.not_ready(),
            ..GuardInputs::default()
        }
    }

    /// Returns true if the board reads the stop as pressed: an open circuit.
    fn stop_reads_pressed(&self) -> bool {
        let closed = self.stop == self.mistakes.stop_normally_open;
        self.stop_wire_off || !closed
    }

    /// Returns true if a ready input is high: only its pull-up acts.
    fn not_ready(&self) -> bool {
        (0..3).any(|axis| {
            let silent = self.mistakes.amplifier_missing[axis] || self.ready_wire_off[axis];
            silent && !self.mistakes.ready_grounded[axis]
        })
    }

    fn watch(&mut self, on: bool) {
        self.ticks_since_on = match on {
            true => 0,
            false => self.ticks_since_on.saturating_add(1),
        };
        if self.ticks_since_on <= 100 {
            let rates = self.plant.rate_rad_s();
            for (fastest, rate) in self.max_rate_rad_s.iter_mut().zip(rates) {
                *fastest = fastest.max(rate.abs());
            }
        }
    }

    /// Returns the maximum speed of each joint, rad/s, while the amplifiers are on and for 0.1 s
    /// after.
    #[must_use]
    pub fn max_rate_rad_s(&self) -> [f64; 3] {
        self.max_rate_rad_s
    }

    /// Returns the true time, s, for a time on the board's clock.
    pub(super) fn time_s(&self, board_ms: f64) -> f64 {
        1e-3 * board_ms / (1.0 - self.mistakes.clock_slow_by)
    }

    /// Returns the state of USB's clock recovery that the board reports.
    pub(super) const fn usb_clock(&self) -> UsbClock {
        match self.mistakes.usb_clock_unlocked {
            true => UsbClock::Unlocked,
            false => UsbClock::Locked,
        }
    }

    /// Returns the position of the tip, m, device frame.
    pub(super) fn tip_m(&self) -> DVec3 {
        DVec3::from(self.plant.tip_m())
    }

    /// Returns the position of the tip in the zero pose, m, device frame.
    pub(super) fn home_m(&self) -> DVec3 {
        DVec3::from(kinematics::tip(self.plant.model(), [0.0; 3]))
    }

    /// Holds the tip with a grip.
    pub(super) fn hold(&mut self, grip: Grip) {
        let hand = match grip {
            Grip::Firm => FIRM,
            Grip::Loose => HandModel::default(),
            Grip::Scale => SCALE,
        };
        self.at_m = self.tip_m();
        self.goal_m = self.at_m;
        self.plant = self.plant.with_hand(hand);
    }

    /// Starts to lead the tip to a point.
    pub(super) fn lead(&mut self, to_m: DVec3) {
        (self.goal_m, self.speed_m_s) = (to_m, GUIDE_M_S);
    }

    /// Starts to move slowly to a point, in search of the surface.
    pub(super) fn approach(&mut self, to_m: DVec3) {
        (self.goal_m, self.speed_m_s) = (to_m, APPROACH_M_S);
    }

    /// Releases the tip.
    pub(super) fn release(&mut self) {
        self.plant = self.plant.without_hand();
    }

    /// Returns the reading of a scale that pulls against a push along `direction`, grams.
    pub(super) fn scale_grams(&self, direction: DVec3) -> f64 {
        -DVec3::from(self.plant.hand_force_n()).dot(direction) / N_PER_GRAM
    }

    /// Returns the voltage of an output, V.
    pub(super) fn output_v(&self, axis: usize) -> f64 {
        FULL_V * f64::from(self.drive.held[axis]) + self.mistakes.output_offset_v[axis]
    }

    /// Returns the voltage of the enable line, V. `driven` is true if the board drives it.
    pub(super) fn enable_v(&self, driven: bool) -> f64 {
        let high = if driven {
            self.drive.enabled
        } else {
            self.mistakes.enable_floats
        };
        if high { 3.3 } else { 0.0 }
    }

    /// Returns true if the power stages have power.
    pub(super) fn has_power(&self) -> bool {
        !self.stop || self.mistakes.stop_leaves_power
    }
}
