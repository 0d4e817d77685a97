//! A virtual Phantom on a virtual bench: wired, held and measured as its user does it.

use glam::DVec3;
use hapterra_core::guard::{GuardInputs, GuardOutputs};
use hapterra_core::wire::status::UsbClock;

use crate::calibrate::N_PER_GRAM;
use crate::phantom::{HandModel, PhantomModel, Plant, Wiring, kinematics};

/// Speed at which a hand leads the tip, m/s; and of a hand that searches for the surface.
const LEAD_M_S: f64 = 0.1;
const SLOW_M_S: f64 = 0.02;
/// Length of a tick, s.
const TICK_S: f64 = 1e-3;
/// The output at full scale, V.
const FULL_V: f64 = 10.0;

/// Fingers that lead the tip and hold it firmly.
const FIRM: HandModel = HandModel {
    mass_kg: 0.15,
    arm_n_per_m: 20_000.0,
    arm_ns_per_m: 100.0,
    grip_n_per_m: 20_000.0,
    grip_ns_per_m: 60.0,
};

/// A hand that holds the tip by a spring scale.
const SCALE: HandModel = HandModel {
    arm_n_per_m: 1_000.0,
    arm_ns_per_m: 10.0,
    ..FIRM
};

/// Grip of the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    /// By fingers that lead it.
    Firm,
    /// Between two fingers.
    Loose,
    /// By a spring scale.
    Scale,
}

/// Mistakes between the board and its amplifiers and switches.
#[derive(Clone, Copy, Debug, Default)]
pub struct BenchMistakes {
    /// A command at its amplifier's input is off by so many volts.
    pub output_off_v: [f64; 3],
    /// The enable line has no pull-down: it is high if it is not driven.
    pub enable_floats: bool,
    /// The stop is a normally open one: pressed it closes its contact, and so does no wire.
    pub stop_normally_open: bool,
    /// The stop's second contact is not in the supply of the power stages.
    pub stop_leaves_power: bool,
    /// The amplifier is not there, or has no power: it pushes nothing, and says nothing.
    pub amplifier_missing: [bool; 3],
    /// The ready input is tied to ground instead of to its amplifier.
    pub ready_grounded: [bool; 3],
    /// The part by which the board's clock is slow.
    pub clock_slow_by: f64,
    /// The oscillator of the board's USB does not follow the host's.
    pub usb_clock_unlocked: bool,
}

/// An arm, its wires, and the hand on it.
pub struct VirtualBench {
    plant: Plant,
    wiring: Wiring,
    /// Goal of the hand, and its present target, m.
    goal_m: DVec3,
    at_m: DVec3,
    speed_m_s: f64,
    pub(super) dead_man: bool,
    pub(super) stop: bool,
    /// True if the stop's wire is off the board.
    pub(super) stop_wire_off: bool,
    /// True if each ready wire is off the board.
    pub(super) ready_wire_off: [bool; 3],
    mistakes: BenchMistakes,
    drive: GuardOutputs,
    /// Fastest that each joint has turned since the amplifiers first came on, while they
    /// were on or had been within a tenth of a second, rad/s.
    fastest_rad_s: [f64; 3],
    since_on_ticks: u32,
}

impl VirtualBench {
    /// An arm that was switched on in some other pose than zero, held firmly.
    #[must_use]
    pub fn new(model: PhantomModel, wiring: Wiring) -> Self {
        let mut plant = Plant::new(model, [0.2, -0.1, 0.3]);
        plant.power_up();
        let at_m = DVec3::from(plant.tip_m());
        Self {
            plant: plant.held_by(FIRM),
            wiring,
            goal_m: at_m,
            at_m,
            speed_m_s: LEAD_M_S,
            dead_man: false,
            stop: false,
            stop_wire_off: false,
            ready_wire_off: [false; 3],
            mistakes: BenchMistakes::default(),
            drive: GuardOutputs::default(),
            fastest_rad_s: [0.0; 3],
            since_on_ticks: u32::MAX,
        }
    }

    /// The same bench with these mistakes.
    #[must_use]
    pub const fn with_mistakes(mut self, mistakes: BenchMistakes) -> Self {
        self.mistakes = mistakes;
        self
    }

    /// One tick: the amplifiers got `drive`; what encoders and switches say after it.
    pub fn tick(&mut self, drive: &GuardOutputs) -> GuardInputs {
        self.drive = *drive;
        let left = self.goal_m - self.at_m;
        let step = left.clamp_length_max(self.speed_m_s * TICK_S);
        self.at_m += step;
        self.plant
            .aim(self.at_m.to_array(), (step / TICK_S).to_array());
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

    /// Returns true if the board reads the stop as pressed: an open contact.
    fn stop_reads_pressed(&self) -> bool {
        let closed = self.stop == self.mistakes.stop_normally_open;
        self.stop_wire_off || !closed
    }

    /// Returns true if a ready input is high: pulled up, and not pulled down from outside.
    fn not_ready(&self) -> bool {
        (0..3).any(|axis| {
            let silent = self.mistakes.amplifier_missing[axis] || self.ready_wire_off[axis];
            silent && !self.mistakes.ready_grounded[axis]
        })
    }

    fn watch(&mut self, on: bool) {
        self.since_on_ticks = match on {
            true => 0,
            false => self.since_on_ticks.saturating_add(1),
        };
        if self.since_on_ticks <= 100 {
            let rates = self.plant.rate_rad_s();
            for (fastest, rate) in self.fastest_rad_s.iter_mut().zip(rates) {
                *fastest = fastest.max(rate.abs());
            }
        }
    }

    /// Fastest that each joint has turned while the amplifiers were on or had been within
    /// a tenth of a second, rad/s.
    #[must_use]
    pub fn fastest_rad_s(&self) -> [f64; 3] {
        self.fastest_rad_s
    }

    /// The time that passes on a right clock while so much passes on the board's, s.
    pub(super) fn time_s(&self, board_ms: f64) -> f64 {
        1e-3 * board_ms / (1.0 - self.mistakes.clock_slow_by)
    }

    /// The state of USB's clock recovery that the board reports.
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

    /// Takes the tip in a hand.
    pub(super) fn hold(&mut self, grip: Grip) {
        let hand = match grip {
            Grip::Firm => FIRM,
            Grip::Loose => HandModel::default(),
            Grip::Scale => SCALE,
        };
        self.at_m = self.tip_m();
        self.goal_m = self.at_m;
        self.plant = self.plant.held_by(hand);
    }

    /// Leads the tip to a point, from now on.
    pub(super) fn lead(&mut self, to_m: DVec3) {
        (self.goal_m, self.speed_m_s) = (to_m, LEAD_M_S);
    }

    /// Feels the way to a point, from now on.
    pub(super) fn step(&mut self, to_m: DVec3) {
        (self.goal_m, self.speed_m_s) = (to_m, SLOW_M_S);
    }

    /// Takes the hand away.
    pub(super) fn let_go(&mut self) {
        self.plant = self.plant.let_go();
    }

    /// Returns the reading of a scale that pulls against a push along `direction`, grams.
    pub(super) fn scale_grams(&self, direction: DVec3) -> f64 {
        -DVec3::from(self.plant.hand_force_n()).dot(direction) / N_PER_GRAM
    }

    /// Returns the voltage of an output, V.
    pub(super) fn output_v(&self, axis: usize) -> f64 {
        FULL_V * f64::from(self.drive.held[axis]) + self.mistakes.output_off_v[axis]
    }

    /// Returns the voltage of the enable line, V, driven by the board or not.
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
