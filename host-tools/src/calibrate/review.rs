//! Review of a calibration before it is accepted.

use std::fmt;

use hapterra_core::phantom::Calibration;

use super::gravity::GravityFit;
use super::ratios::RatioFit;

/// Results before they are accepted. Displays old and new numbers side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Review {
    /// The record before the calibration.
    pub before: Calibration,
    /// The new record.
    pub after: Calibration,
    /// Encoder counts of the zero pose.
    pub zero: [i32; 3],
    /// The ratios, if they were measured.
    pub ratios: Option<RatioFit>,
    /// The weights, if they were measured.
    pub gravity: Option<GravityFit>,
}

impl fmt::Display for Review {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, after) = (&self.before, &self.after);
        let [a, b, c] = self.zero;
        writeln!(f, "zero pose      {a} {b} {c} counts")?;
        if let Some(fit) = &self.ratios {
            for joint in 0..3 {
                let (was, is) = (before.ratio[joint], after.ratio[joint]);
                let counts = match after.encoder_sign[joint] > 0.0 {
                    true => "rise",
                    false => "fall",
                };
                let number = joint + 1;
                writeln!(
                    f,
                    "joint {number}        {is:.3} motor turns a joint turn (was {was:.3}), counts {counts} with the angle"
                )?;
            }
            writeln!(f, "left over      {:.2} mm a move", fit.residual_mm)?;
        } else {
            writeln!(f, "ratios         not measured: {}", after.ratio)?;
        }
        let (two, three) = (after.gravity_2_nm, after.gravity_3_nm);
        match &self.gravity {
            None => writeln!(f, "gravity        not measured: {two} Nm, {three} Nm"),
            Some(fit) => writeln!(
                f,
                "gravity        {two:.4} Nm (was {:.4}), {three:.4} Nm (was {:.4}), left over {:.4} Nm",
                before.gravity_2_nm, before.gravity_3_nm, fit.residual_nm
            ),
        }
    }
}
