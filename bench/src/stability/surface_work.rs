//! The energy from a surface to the arm: the work of the motors' real torques.

use hapterra::phantom::{Amplifier, HeldPhantom, MAX_SUBSTEP_S, PhantomModel};

/// The surface's part of the motors' torques. It follows its part of the commands with the lag of
/// the amplifiers' current loops, as the total does.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceWork {
    surface_amplifiers: [Amplifier; 3],
}

impl SurfaceWork {
    /// Creates it for an arm without currents.
    pub(super) fn new(model: &PhantomModel) -> Self {
        Self {
            surface_amplifiers: model.drive.map(Amplifier::new),
        }
    }

    /// Moves the arm for a time with these commands, of which the surface's part is
    /// `surface_currents_a`. Returns the work of that part, mJ.
    ///
    /// The steps are those of the plant's own integration, with the torque in the middle of each,
    /// so the sum is as exact as the motion.
    pub(super) fn step(
        &mut self,
        currents_a: [f64; 3],
        surface_currents_a: [f64; 3],
        duration_s: f64,
        arm: &mut HeldPhantom,
    ) -> f64 {
        for (amplifier, current_a) in self.surface_amplifiers.iter_mut().zip(surface_currents_a) {
            amplifier.command(current_a);
        }
        let steps = (duration_s / MAX_SUBSTEP_S - 1e-9).ceil().max(1.0);
        let step_s = duration_s / steps;
        let mut gained_j = 0.0;
        for _ in 0..steps as u32 {
            let from_rad = arm.plant().q_rad();
            arm.step(currents_a, step_s);
            let to_rad = arm.plant().q_rad();
            for (joint, amplifier) in self.surface_amplifiers.iter_mut().enumerate() {
                amplifier.advance(0.5 * step_s);
                gained_j += amplifier.torque_nm() * (to_rad[joint] - from_rad[joint]);
                amplifier.advance(0.5 * step_s);
            }
        }
        1e3 * gained_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::contact_loop::HOME;
    use hapterra::phantom::{ArmFrame, HandModel, Script};

    #[test]
    fn work_of_a_free_arm_is_its_kinetic_energy() {
        // Without friction and weight, and with a hand that does not hold it.
        let model = PhantomModel {
            gravity_m_s2: 0.0,
            coulomb_nm: [0.0; 3],
            viscous_nms_per_rad: [0.0; 3],
            ..PhantomModel::premium_1_5()
        };
        let hand = HandModel {
            mass_kg: 1.0,
            arm_n_per_m: 0.0,
            arm_ns_per_m: 0.0,
            grip_n_per_m: 0.0,
            grip_ns_per_m: 0.0,
        };
        let ArmFrame { home_mm } = HOME;
        let script = Script::start(home_mm).wait(1.0);
        let mut arm = HeldPhantom::new(model, hand, HOME, script).expect("in reach");
        let mut work = SurfaceWork::new(&model);
        // For all three currents, changed before the current loops have settled.
        let mut gained_mj = 0.0;
        for tick in 0..40 {
            let current_a = if tick % 2 == 0 { 1.0 } else { -0.2 };
            let currents_a = [0.5 * current_a, current_a, -current_a];
            gained_mj += work.step(currents_a, currents_a, 0.3e-3, &mut arm);
        }
        let plant = arm.plant();
        let energy_j = |of: &hapterra::phantom::Plant| {
            hapterra::phantom::Dynamics::new(model).energy_j(of.q_rad(), of.rate_rad_s())
        };
        let kinetic_mj = 1e3 * energy_j(plant);
        assert!(kinetic_mj > 1.0, "{kinetic_mj} mJ");
        assert!(
            (gained_mj / kinetic_mj - 1.0).abs() < 1e-3,
            "{gained_mj} and {kinetic_mj} mJ"
        );
        // Only the surface's part counts.
        let mut other = HeldPhantom::new(model, hand, HOME, Script::start(home_mm).wait(1.0));
        let other = other.as_mut().expect("in reach");
        let none = SurfaceWork::new(&model).step([1.0; 3], [0.0; 3], 5e-3, other);
        assert_eq!(none, 0.0);
        assert!(energy_j(other.plant()) > 1e-4);
    }
}
