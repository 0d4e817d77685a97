//! A user made of formulas, with a Phantom whose true numbers are its own.

use std::cell::Cell;
use std::rc::Rc;

use super::{Attendant, Direction, Review, Stopped};
use crate::phantom::{HandModel, PhantomModel, Plant, kinematics};

/// How long a pose is held until everything is still, s.
const SETTLE_S: f64 = 4.0;
/// Where the weight is measured: from the zero pose, mm, device frame.
const POSES_MM: [[f64; 3]; 4] = [
    [30.0, 0.0, 40.0],
    [60.0, 0.0, 0.0],
    [40.0, 0.0, -40.0],
    [70.0, 0.0, 60.0],
];

/// Moves a virtual Phantom, and reads ruler and scale off the truth.
pub struct VirtualUser {
    plant: Plant,
    /// What the encoders read, for whoever feeds the device.
    counts: Rc<Cell<[i32; 3]>>,
    /// How much every reading of the ruler is off, mm.
    pub ruler_off_mm: f64,
}

impl VirtualUser {
    /// A user of an arm that was switched on in some other pose than zero.
    #[must_use]
    pub fn new(model: PhantomModel) -> Self {
        let mut plant = Plant::new(model, [0.2, -0.1, 0.3]);
        plant.power_up();
        let counts = Rc::new(Cell::new(plant.counts()));
        Self {
            plant: plant.held_by(HandModel::default()),
            counts,
            ruler_off_mm: 0.0,
        }
    }

    /// A Premium 1.5 that is not quite as its preset says: two ratios some per
    /// cent off, one encoder the other way round, a stylus of 40 g.
    #[must_use]
    pub fn with_a_stylus() -> Self {
        let mut model = PhantomModel::premium_1_5();
        model.drive[0].ratio *= 1.03;
        model.drive[1].ratio *= 0.97;
        model.drive[2].sign = -1.0;
        model.lumped.g2 += 0.04 * model.l1_m;
        model.lumped.g3 += 0.04 * model.l2_m;
        Self::new(model)
    }

    /// What the encoders read, also later.
    #[must_use]
    pub fn counts(&self) -> Rc<Cell<[i32; 3]>> {
        Rc::clone(&self.counts)
    }

    /// The arm as it truly is.
    #[must_use]
    pub fn model(&self) -> &PhantomModel {
        self.plant.model()
    }

    /// Leads the tip to a point by hand and holds it there.
    fn lead(&mut self, to_m: [f64; 3]) {
        let from = self.plant.tip_m();
        let ticks = (SETTLE_S * 1e3) as u32;
        for tick in 0..ticks {
            // There in the first quarter of the time, then only held.
            let share = f64::min(1.0, 4.0 * f64::from(tick) / f64::from(ticks));
            let at = std::array::from_fn(|i| from[i] + share * (to_m[i] - from[i]));
            self.plant.aim(at, [0.0; 3]);
            self.plant.step([0.0; 3], 1e-3);
        }
        self.counts.set(self.plant.counts());
    }

    fn home_m(&self) -> [f64; 3] {
        kinematics::tip(self.plant.model(), [0.0; 3])
    }
}

impl Attendant for VirtualUser {
    fn hear(&mut self, line: &str) {
        tracing::info!("{line}");
    }

    fn zero_pose(&mut self) -> Result<(), Stopped> {
        // In its rest, exactly: no hand is as precise.
        self.plant.put([0.0; 3]);
        self.counts.set(self.plant.counts());
        Ok(())
    }

    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped> {
        let before = self.plant.tip_m();
        let unit = direction.unit();
        self.lead(std::array::from_fn(|i| {
            before[i] + 1e-3 * about_mm * unit[i]
        }));
        let after = self.plant.tip_m();
        let moved = (0..3)
            .map(|i| unit[i] * (after[i] - before[i]))
            .sum::<f64>();
        Ok(1e3 * moved + self.ruler_off_mm)
    }

    fn hold_still(&mut self, number: usize) -> Result<Option<[f64; 2]>, Stopped> {
        let Some(from_home) = POSES_MM.get(number - 1) else {
            return Ok(None);
        };
        let home = self.home_m();
        self.lead(std::array::from_fn(|i| home[i] + 1e-3 * from_home[i]));
        let [towards, _, up] = self.plant.hand_force_n();
        Ok(Some([up, towards]))
    }

    fn agrees(&mut self, _: &Review) -> Result<bool, Stopped> {
        Ok(true)
    }
}
