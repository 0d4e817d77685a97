//! Coulomb friction with exact sticking.
//!
//! A smoothed sign (`tanh`) lets a loaded arm creep. Here each step solves for
//! the friction that the velocity step needs: a joint stops and stays if less
//! than the Coulomb torque holds it, and slides against the full torque
//! otherwise (Moreau's time stepping). A held joint's speed is exactly zero.

use glam::{DMat3, DVec3};

/// Max sweeps over the three joints; the coupling of a Phantom's joints is weak, and each sweep
/// improves the result by more than a digit.
const MAX_SWEEPS: usize = 40;

/// Returns the joint rates after friction has acted for `h_s` seconds; `free` are the rates without
/// friction.
///
/// `inverse_mass` is `M⁻¹`; `coulomb_nm` is the max friction torque.
pub(super) fn settle(free: DVec3, inverse_mass: &DMat3, coulomb_nm: DVec3, h_s: f64) -> DVec3 {
    if coulomb_nm == DVec3::ZERO {
        return free;
    }
    let limit = coulomb_nm * h_s;
    let mut impulse = DVec3::ZERO;
    let mut rate = free;
    for _ in 0..MAX_SWEEPS {
        let before = impulse;
        for joint in 0..3 {
            let column = inverse_mass.col(joint);
            let required = impulse[joint] + rate[joint] / column[joint];
            let allowed = required.clamp(-limit[joint], limit[joint]);
            rate -= column * (allowed - impulse[joint]);
            impulse[joint] = allowed;
        }
        if (impulse - before).abs().cmple(limit * 1e-12).all() {
            break;
        }
    }
    // A held joint gets exactly zero: rounding must not let it creep.
    DVec3::select(impulse.abs().cmplt(limit), DVec3::ZERO, rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inverse_mass() -> DMat3 {
        DMat3::from_cols_array_2d(&[[3e-3, 0., 0.], [0., 2.5e-3, 3e-4], [0., 3e-4, 1e-3]]).inverse()
    }

    #[test]
    fn small_push_is_held_exactly() {
        let push = inverse_mass() * DVec3::new(0.009, -0.009, 0.009) * 1e-4;
        let rate = settle(push, &inverse_mass(), DVec3::splat(0.01), 1e-4);
        assert_eq!(rate, DVec3::ZERO);
    }

    #[test]
    fn large_push_slides_against_full_friction() {
        let torque = DVec3::new(0.02, 0.05, -0.04);
        let rate = settle(
            inverse_mass() * torque * 1e-4,
            &inverse_mass(),
            DVec3::splat(0.01),
            1e-4,
        );
        let expected = inverse_mass() * (torque - 0.01 * torque.signum()) * 1e-4;
        assert!((rate - expected).length() < 1e-12);
    }

    #[test]
    fn friction_never_adds_energy() {
        let mass = inverse_mass().inverse();
        for seed in 0..1000 {
            let angle = f64::from(seed);
            let free = DVec3::new(angle.sin(), (2.3 * angle).cos(), (0.7 * angle).sin()) * 1e-3;
            let after = settle(free, &inverse_mass(), DVec3::splat(0.01), 5e-5);
            assert!(after.dot(mass * after) <= free.dot(mass * free));
        }
    }
}
