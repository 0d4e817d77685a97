//! The whole outside world of a device in one object: a Phantom, a hand that
//! follows a script, and where the terrain lies in front of them.

use hapterra_core::guard::Sense;

use super::{HandModel, PhantomModel, Placement, Plant, Script, kinematics};

/// When a hand that waits for the arm to be armed presses the dead-man switch,
/// s.
const PRESS_S: f64 = 0.5;
/// When its script begins: after the device has confirmed and force has come
/// in, s.
const ARMED_S: f64 = 3.0;

/// A scripted hand on a virtual Phantom over a placed terrain.
#[derive(Clone, Debug)]
pub struct Rig {
    plant: Plant,
    placement: Placement,
    script: Script,
    /// When the script begins, s.
    begin_s: f64,
    t_s: f64,
}

/// The script asks for a point that the arm cannot get to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the arm cannot reach ({:.1}, {:.1}, {:.1}) mm of the terrain, with ({:.1}, {:.1}, {:.1}) mm at its home",
    .at_mm[0], .at_mm[1], .at_mm[2], .home_mm[0], .home_mm[1], .home_mm[2]
)]
pub struct OutOfReach {
    /// The point, mm, terrain frame.
    pub at_mm: [f64; 3],
    /// The terrain point at the arm's home, mm.
    pub home_mm: [f64; 3],
}

impl Rig {
    /// Puts the tip, and the hand on it, at the script's first point.
    ///
    /// # Errors
    /// [`OutOfReach`] names the first corner of the script that lies beyond
    /// the links or the stops.
    pub fn new(
        model: PhantomModel,
        hand: HandModel,
        placement: Placement,
        script: Script,
    ) -> Result<Self, OutOfReach> {
        let reaches = |at: &[f64; 3]| placement.reaches(&model, *at);
        let unreachable = |at_mm| OutOfReach {
            at_mm,
            home_mm: placement.home_mm,
        };
        if let Some(at_mm) = script.corners_mm().find(|at| !reaches(at)) {
            return Err(unreachable(at_mm));
        }
        let start = script.target(0.0).position_mm;
        let q = kinematics::inverse(&model, placement.to_device_m(&model, start))
            .ok_or(unreachable(start))?;
        Ok(Self {
            plant: Plant::new(model, q).held_by(hand),
            placement,
            script,
            begin_s: 0.0,
            t_s: 0.0,
        })
    }

    /// The same hand, first letting the device arm: it rests at the script's
    /// first point, presses the dead-man switch after half a second, holds it
    /// from then on, and begins its script [`Self::begin_s`] after the start.
    #[must_use]
    pub fn arming(mut self) -> Self {
        self.begin_s = ARMED_S;
        self
    }

    /// When the script begins, s.
    #[must_use]
    pub fn begin_s(&self) -> f64 {
        self.begin_s
    }

    /// When a script begins whose hand lets the device arm first, s.
    pub const ARMED_S: f64 = ARMED_S;

    /// What encoders and switches say now.
    #[must_use]
    pub fn sense(&self) -> Sense {
        Sense {
            counts: self.plant.counts(),
            dead_man: self.begin_s > 0.0 && self.t_s >= PRESS_S,
            emergency_stop: false,
            hardware_failed: false,
        }
    }

    /// Applies current commands (A) for `dt_s` seconds while the hand follows
    /// its script, and reads the encoders at the end.
    pub fn step(&mut self, currents_a: [f64; 3], dt_s: f64) -> [i32; 3] {
        let target = self.script.target(self.t_s - self.begin_s);
        let at_m = self
            .placement
            .to_device_m(self.plant.model(), target.position_mm);
        let speed_m_s = Placement::turn_to_device(target.speed_mm_s).map(|v| v * 1e-3);
        self.plant.aim(at_m, speed_m_s);
        self.t_s += dt_s;
        self.plant.step(currents_a, dt_s)
    }

    /// What the encoders read now.
    #[must_use]
    pub fn counts(&self) -> [i32; 3] {
        self.plant.counts()
    }

    /// Time since the start, s.
    #[must_use]
    pub fn t_s(&self) -> f64 {
        self.t_s
    }

    /// Whether the script has come to its end.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.t_s >= self.begin_s + self.script.duration_s()
    }

    /// True tip position, mm, terrain frame.
    #[must_use]
    pub fn tip_mm(&self) -> [f64; 3] {
        self.placement
            .to_terrain_mm(self.plant.model(), self.plant.tip_m())
    }

    /// True force of the motors at the tip, N, terrain frame.
    #[must_use]
    pub fn motor_force_n(&self) -> [f64; 3] {
        Placement::turn_to_terrain(self.plant.motor_force_n())
    }

    /// True force of the hand on the tip, N, terrain frame.
    #[must_use]
    pub fn hand_force_n(&self) -> [f64; 3] {
        Placement::turn_to_terrain(self.plant.hand_force_n())
    }

    /// The arm and its hand.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Where the terrain lies.
    #[must_use]
    pub fn placement(&self) -> Placement {
        self.placement
    }

    /// The hand's plan.
    #[must_use]
    pub fn script(&self) -> &Script {
        &self.script
    }
}

#[cfg(test)]
#[path = "rig_tests.rs"]
mod tests;
