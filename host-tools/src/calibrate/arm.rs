//! The arm's geometry in f64, with the lengths of a record.

use hapterra_core::phantom::Calibration;

/// The linkage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Upper link, mm.
    pub l1_mm: f64,
    /// Fore link, mm.
    pub l2_mm: f64,
    /// Joint angles of the zero pose, rad.
    pub zero_rad: [f64; 3],
}

impl Arm {
    /// With a record's lengths and zero pose.
    #[must_use]
    pub fn of(record: &Calibration) -> Self {
        Self {
            l1_mm: record.l1_mm.into(),
            l2_mm: record.l2_mm.into(),
            zero_rad: record.zero_rad.to_array().map(f64::from),
        }
    }

    /// Joint angles after the encoders turned by `counts` from the zero pose, rad.
    #[must_use]
    pub fn angles(&self, rad_per_count: [f64; 3], counts: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.zero_rad[i] + f64::from(counts[i]) * rad_per_count[i])
    }

    /// The tip, device frame, mm: x towards the user, y to the right, z up.
    #[must_use]
    pub fn tip_mm(&self, q: [f64; 3]) -> [f64; 3] {
        let reach = self.reach_mm(q);
        let up = self.l1_mm * libm::sin(q[1]) - self.l2_mm * libm::cos(q[2]);
        [libm::cos(q[0]) * reach, libm::sin(q[0]) * reach, up]
    }

    /// Joint torques that a force at the tip (N, device frame) makes, Nm.
    #[must_use]
    pub fn torques_nm(&self, q: [f64; 3], force: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = force;
        let (s, c) = (libm::sin, libm::cos);
        let radial = c(q[0]) * x + s(q[0]) * y;
        let sideways = c(q[0]) * y - s(q[0]) * x;
        [
            1e-3 * self.reach_mm(q) * sideways,
            1e-3 * self.l1_mm * (c(q[1]) * z - s(q[1]) * radial),
            1e-3 * self.l2_mm * (c(q[2]) * radial + s(q[2]) * z),
        ]
    }

    fn reach_mm(&self, q: [f64; 3]) -> f64 {
        self.l1_mm * libm::cos(q[1]) + self.l2_mm * libm::sin(q[2])
    }
}
