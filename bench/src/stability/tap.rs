//! Taps: from rest high above the surface down to it, with a stated speed at contact, and back.

use super::contact_loop::{HOME, PLANE_MM};
use super::grasp::Grasp;
use super::setting::Setting;
use hapterra::phantom::{OutOfReach, Script};

/// Speeds of the tip at contact, m/s.
pub const TAP_SPEEDS_M_S: [f64; 3] = [0.1, 0.2, 0.5];

/// Height above the surface at the start of a tap, mm: room to accelerate.
const START_HEIGHT_MM: f64 = 80.0;
/// Depth of the tap's target below the surface, mm.
const TARGET_DEPTH_MM: f64 = 25.0;
/// Height of the tip between two taps above which they count as separate, mm.
const SEPARATE_HEIGHT_MM: f64 = 10.0;
/// Rest of the hand between two taps, s.
const PAUSE_S: f64 = 1.0;
/// Taps of each speed.
const TAPS: usize = 3;

/// Outcome of a few taps of one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taps {
    /// Most energy from the surface to the arm in one tap, mJ; zero for a passive surface.
    pub gained_mj: f64,
    /// Slowest and fastest speed of the tip at the first contact of a tap, m/s.
    pub contact_speed_m_s: [f64; 2],
}

impl Grasp {
    /// Returns the speed of a hand's target at which its tip reaches the surface with a speed, one
    /// of [`TAP_SPEEDS_M_S`].
    ///
    /// A normal or firm grasp moves at its target's speed, except at the last of the three: it
    /// already slows down, since it stops 25 mm below the surface. A light grasp swings at 2 Hz
    /// during the motion, and is slower or faster than its target. Found by trials; the tests check
    /// that the speed is met.
    fn target_speed_m_s(self, speed_m_s: f64) -> f64 {
        let factors = match self {
            Self::Light => [1.095, 1.172, 0.664],
            Self::Normal => [1.0, 1.0, 1.033],
            Self::Firm => [1.0, 1.0, 1.055],
        };
        let mut known = TAP_SPEEDS_M_S.iter().zip(factors);
        let factor = known.find(|(speed, _)| **speed == speed_m_s);
        speed_m_s * factor.map_or(1.0, |(_, factor)| factor)
    }
}

impl Setting {
    /// Runs taps at a speed. Returns `None` if the guard switches the force off.
    pub(super) fn taps(self, speed_m_s: f64) -> Result<Option<Taps>, OutOfReach> {
        let [east, north, _] = HOME.home_mm;
        let (above, below) = (PLANE_MM + START_HEIGHT_MM, PLANE_MM - TARGET_DEPTH_MM);
        let target_mm_s = 1e3 * self.grasp.target_speed_m_s(speed_m_s);
        let mut script = Script::start([east, north, above]);
        for _ in 0..TAPS {
            for up_mm in [below, above] {
                script = script.line_to([east, north, up_mm], target_mm_s);
            }
            script = script.wait(PAUSE_S);
        }
        let arm = self.arm(script)?;
        let (mut gained_mj, mut max_mj) = (0.0, f64::NEG_INFINITY);
        let mut contact_speed_m_s = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut is_separate, mut is_tripped) = (true, false);
        let tick_s = 1.0 / f64::from(self.rate.hz());
        let mut before_mm = above;
        self.run(arm, &mut |_, step| {
            let up_mm = step.tip_mm[2];
            gained_mj += step.gained_mj;
            if is_separate && up_mm < PLANE_MM {
                let speed_m_s = 1e-3 * (before_mm - up_mm) / tick_s;
                contact_speed_m_s[0] = speed_m_s.min(contact_speed_m_s[0]);
                contact_speed_m_s[1] = speed_m_s.max(contact_speed_m_s[1]);
                is_separate = false;
            }
            // Commands in transit to the motors still belong to the tap.
            if !is_separate && up_mm > PLANE_MM + SEPARATE_HEIGHT_MM {
                max_mj = gained_mj.max(max_mj);
                gained_mj = 0.0;
                is_separate = true;
            }
            before_mm = up_mm;
            is_tripped = step.sample.fault.is_some();
            !is_tripped
        });
        Ok((!is_tripped).then_some(Taps {
            gained_mj: max_mj.max(gained_mj),
            contact_speed_m_s,
        }))
    }
}
