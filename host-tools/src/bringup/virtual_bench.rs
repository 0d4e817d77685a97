//! A virtual Phantom on a virtual bench: wired, held and measured as its user does it.

use glam::DVec3;
use hapterra_core::guard::{Drive, Sense};

use crate::calibrate::N_PER_GRAM;
use crate::phantom::{HandModel, PhantomModel, Plant, Wiring, kinematics};

/// How fast a hand leads the tip, m/s, and how fast it feels its way.
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

/// How the tip is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    /// By fingers that lead it.
    Firm,
    /// Between two fingers.
    Loose,
    /// By a spring scale.
    Scale,
}

/// An arm, its wires, and the hand on it.
pub struct VirtualBench {
    plant: Plant,
    wiring: Wiring,
    /// Where the hand is led to, and where it is led now, m.
    goal_m: DVec3,
    at_m: DVec3,
    speed_m_s: f64,
    pub(super) dead_man: bool,
    pub(super) stop: bool,
    drive: Drive,
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
            drive: Drive::default(),
            fastest_rad_s: [0.0; 3],
            since_on_ticks: u32::MAX,
        }
    }

    /// One tick: the amplifiers got `drive`; what encoders and switches say after it.
    pub fn tick(&mut self, drive: &Drive) -> Sense {
        self.drive = *drive;
        let left = self.goal_m - self.at_m;
        let step = left.clamp_length_max(self.speed_m_s * TICK_S);
        self.at_m += step;
        self.plant
            .aim(self.at_m.to_array(), (step / TICK_S).to_array());
        let commands_a = match drive.enabled {
            true => drive.currents_a.to_array().map(f64::from),
            false => [0.0; 3],
        };
        let counts = self.plant.step(self.wiring.currents_a(commands_a), TICK_S);
        self.watch(drive.enabled);
        Sense {
            counts: self.wiring.counts(counts),
            dead_man: self.dead_man,
            emergency_stop: self.stop,
            ..Sense::default()
        }
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

    /// Where the tip is, m, device frame.
    pub(super) fn tip_m(&self) -> DVec3 {
        DVec3::from(self.plant.tip_m())
    }

    /// Where the tip is in the zero pose, m, device frame.
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
    pub(super) fn feel(&mut self, to_m: DVec3) {
        (self.goal_m, self.speed_m_s) = (to_m, SLOW_M_S);
    }

    /// Takes the hand away.
    pub(super) fn let_go(&mut self) {
        self.plant = self.plant.let_go();
    }

    /// What a scale reads that pulls against a push along `direction`, grams.
    pub(super) fn scale_grams(&self, direction: DVec3) -> f64 {
        -DVec3::from(self.plant.hand_force_n()).dot(direction) / N_PER_GRAM
    }

    /// What a meter shows at an output, V.
    pub(super) fn output_v(&self, axis: usize) -> f64 {
        FULL_V * f64::from(self.drive.held[axis])
    }

    /// What a meter shows at the enable line, V.
    pub(super) fn enable_v(&self) -> f64 {
        if self.drive.enabled { 3.3 } else { 0.0 }
    }
}
