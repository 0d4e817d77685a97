//! Stiffness that is passive by theory, for every hand.

use hapterra_core::rate::TickRate;

use super::contact_loop::HOME;
use hapterra::phantom::kinematics::jacobian;
use hapterra::phantom::{ArmFrame, PhantomModel};

/// Properties of the arm at the tip, vertically, in the home pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtTip {
    /// Viscous friction, N·s/m.
    pub damping_ns_per_m: f64,
    /// Coulomb friction, N.
    pub coulomb_n: f64,
    /// Displacement of the tip for one count of the encoder that moves it most, mm.
    pub count_mm: f64,
}

impl AtTip {
    /// Computes them for a model.
    #[must_use]
    pub fn new(model: &PhantomModel) -> Self {
        let ArmFrame { home_mm } = HOME;
        let joints = HOME.joints_at(model, home_mm).unwrap_or_default();
        let up = jacobian(model, joints)[2];
        // The joint that moves the tip vertically; the others hardly do in this pose.
        let strongest = (0..3).max_by(|a, b| up[*a].abs().total_cmp(&up[*b].abs()));
        let joint = strongest.unwrap_or_default();
        let lever_m = up[joint].abs();
        let drive = &model.drive[joint];
        let count_rad = std::f64::consts::TAU / (drive.ratio * drive.counts_per_rev);
        Self {
            damping_ns_per_m: model.viscous_nms_per_rad[joint] / (lever_m * lever_m),
            coulomb_n: model.coulomb_nm[joint] / lever_m,
            count_mm: 1e3 * lever_m * count_rad,
        }
    }

    /// Returns the bound of Colgate and Schenkel 1997, N/mm: a virtual wall is passive up to 2b/T
    /// with only the arm's own damping.
    #[must_use]
    pub fn by_damping(&self, rate: TickRate) -> f64 {
        1e-3 * 2.0 * self.damping_ns_per_m * f64::from(rate.hz())
    }

    /// Returns the bound of Abbott and Okamura 2005, N/mm: friction dissipates the energy from an
    /// encoder's counts up to 2·fc/Δ; with it the wall is passive up to the smaller of both bounds.
    #[must_use]
    pub fn by_friction(&self) -> f64 {
        2.0 * self.coulomb_n / self.count_mm
    }
}
