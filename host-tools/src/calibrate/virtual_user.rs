//! A simulated user with a Phantom of known parameters.

use std::cell::Cell;
use std::rc::Rc;

use glam::DVec3;

use super::gravity::N_PER_GRAM;
use super::procedure::{Attendant, Stopped};
use super::ratios::Direction;
use super::review::Review;
use crate::link::FaultInjector;
use crate::phantom::{HandModel, PhantomModel, Plant, kinematics};

/// Time to hold a pose until the arm is at rest, s.
const SETTLE_S: f64 = 4.0;
/// Positions for the measurement of the weight, from the zero pose, mm, device frame.
const POSES_MM: [[f64; 3]; 4] = [
    [30.0, 0.0, 40.0],
    [60.0, 0.0, 0.0],
    [40.0, 0.0, -40.0],
    [70.0, 0.0, 60.0],
];

/// Moves a virtual Phantom, and reads the exact values of ruler and scale.
pub struct VirtualUser {
    plant: Plant,
    /// Encoder counts, shared with the device's driver.
    counts: Rc<Cell<[i32; 3]>>,
    /// Error of each ruler reading, mm.
    pub ruler_error_mm: f64,
    /// Receives the user's output, a line at a time.
    pub print: fn(&str),
}

impl VirtualUser {
    /// Returns the user of an arm that was switched on outside its zero pose.
    #[must_use]
    pub fn new(model: PhantomModel) -> Self {
        let mut plant = Plant::new(model, [0.2, -0.1, 0.3]);
        plant.power_up();
        let counts = Rc::new(Cell::new(plant.counts()));
        Self {
            plant: plant.with_hand(HandModel::default()),
            counts,
            ruler_error_mm: 0.0,
            print: |line| tracing::info!("{line}"),
        }
    }

    /// Returns the user of a Premium 1.5 that differs from its preset: two ratios by a few per
    /// cent, one encoder's direction, a stylus of 40 g.
    #[must_use]
    pub fn with_stylus() -> Self {
        let mut model = PhantomModel::premium_1_5();
        model.drive[0].ratio *= 1.03;
        model.drive[1].ratio *= 0.97;
        model.drive[2].sign = -1.0;
        model.lumped.g2 += 0.04 * model.l1_m;
        model.lumped.g3 += 0.04 * model.l2_m;
        Self::new(model)
    }

    /// Returns the cell with the encoder counts, which follow the arm.
    #[must_use]
    pub fn counts(&self) -> Rc<Cell<[i32; 3]>> {
        Rc::clone(&self.counts)
    }

    /// Returns the hands' effect on a device's encoders and switches. The encoders follow the arm.
    /// The dead-man switch is pressed for half of every second, so that each wait for a press ends.
    #[must_use]
    pub fn hands(&self) -> FaultInjector {
        let counts = self.counts();
        Box::new(move |tick, sense, _| {
            sense.counts = counts.get();
            sense.dead_man = tick % 1_000 >= 500;
        })
    }

    /// Returns the arm with its true ratios, signs and weights.
    #[must_use]
    pub fn model(&self) -> &PhantomModel {
        self.plant.model()
    }

    /// Leads the tip to a point by hand and holds it there.
    fn lead(&mut self, to_m: [f64; 3]) {
        let from = DVec3::from(self.plant.tip_m());
        let ticks = (SETTLE_S * 1e3) as u32;
        for tick in 0..ticks {
            // The motion ends after a quarter of the time; then the tip is held.
            let share = f64::min(1.0, 4.0 * f64::from(tick) / f64::from(ticks));
            let at = from.lerp(DVec3::from(to_m), share);
            self.plant.set_target(at.to_array(), [0.0; 3]);
            self.plant.step([0.0; 3], 1e-3);
        }
        self.counts.set(self.plant.counts());
    }
}

impl Attendant for VirtualUser {
    fn notify(&mut self, line: &str) {
        (self.print)(&format!("  {line}"));
    }

    fn zero_pose(&mut self) -> Result<(), Stopped> {
        (self.print)("into the zero pose");
        // Exactly the zero pose; no hand is as precise.
        self.plant.put([0.0; 3]);
        self.counts.set(self.plant.counts());
        Ok(())
    }

    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped> {
        let (before, unit) = (DVec3::from(self.plant.tip_m()), direction.unit());
        self.lead((before + 1e-3 * about_mm * unit).to_array());
        let moved = unit.dot(DVec3::from(self.plant.tip_m()) - before);
        let read_mm = 1e3 * moved + self.ruler_error_mm;
        (self.print)(&format!("{read_mm:.1} mm {}", direction.words()));
        Ok(read_mm)
    }

    fn hold_still(&mut self, number: usize) -> Result<Option<[f64; 2]>, Stopped> {
        let Some(from_home) = POSES_MM.get(number - 1) else {
            return Ok(None);
        };
        let home = DVec3::from(kinematics::tip(self.plant.model(), [0.0; 3]));
        self.lead((home + 1e-3 * DVec3::from(*from_home)).to_array());
        let [towards, _, up] = self.plant.hand_force_n();
        let grams = [up, towards].map(|newtons| newtons / N_PER_GRAM);
        (self.print)(&format!(
            "pose {number}: {:.1} g upwards, {:.1} g towards the user",
            grams[0], grams[1]
        ));
        Ok(Some([up, towards]))
    }

    fn confirm_record(&mut self, review: &Review) -> Result<bool, Stopped> {
        (self.print)(review.to_string().trim_end());
        Ok(true)
    }
}
