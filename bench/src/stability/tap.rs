//! Taps: from rest high above the surface down to it, at a stated speed where the tip touches
//! it, and back.

use super::contact_loop::{HOME, PLANE_MM};
use super::grasp::Grasp;
use super::trial::Setting;
use hapterra::phantom::{OutOfReach, Script};

/// Speeds of the tip where it touches the surface, m/s.
pub const TAP_SPEEDS_M_S: [f64; 3] = [0.1, 0.2, 0.5];

/// A tap begins so far above the surface, mm: a way to speed up on.
const ABOVE_MM: f64 = 80.0;
/// And aims so far below it, mm.
const BELOW_MM: f64 = 25.0;
/// Between two taps the tip is higher above it than this, mm.
const APART_MM: f64 = 10.0;
/// And the hand rests so long up there, s.
const REST_S: f64 = 1.0;
/// Taps of each speed.
const TAPS: usize = 3;

/// Outcome of a few taps of one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taps {
    /// Largest energy that the surface gave to the arm in one tap, mJ. A passive surface gives
    /// nothing.
    pub given_mj: f64,
    /// Slowest and fastest that the tip was when a tap first touched the surface, m/s.
    pub touched_m_s: [f64; 2],
}

impl Grasp {
    /// Returns the speed of a hand's target at which its tip touches the surface at a speed, one of
    /// [`TAP_SPEEDS_M_S`].
    ///
    /// A normal or firm hand moves as it aims, but for the last of the three: it slows down
    /// already, since it comes to rest 25 mm below the surface. A light grasp swings on the way, at
    /// 2 Hz, and is slower or faster than it aims. Found by trials; the tests see that the speed
    /// is met.
    fn aim_m_s(self, speed_m_s: f64) -> f64 {
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
    /// Taps at a speed; none where the guard switches the force off.
    pub(super) fn taps(self, speed_m_s: f64) -> Result<Option<Taps>, OutOfReach> {
        let [east, north, _] = HOME.home_mm;
        let (above, below) = (PLANE_MM + ABOVE_MM, PLANE_MM - BELOW_MM);
        let aim_mm_s = 1e3 * self.grasp.aim_m_s(speed_m_s);
        let mut script = Script::start([east, north, above]);
        for _ in 0..TAPS {
            for up_mm in [below, above] {
                script = script.go([east, north, up_mm], aim_mm_s);
            }
            script = script.wait(REST_S);
        }
        let arm = self.arm(script)?;
        let (mut given_mj, mut most_mj) = (0.0, f64::NEG_INFINITY);
        let mut touched_m_s = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut is_apart, mut is_tripped) = (true, false);
        let tick_s = 1.0 / f64::from(self.rate.hz());
        let mut before_mm = above;
        self.run(arm, &mut |_, step| {
            let up_mm = step.tip_mm[2];
            given_mj += step.given_mj;
            if is_apart && up_mm < PLANE_MM {
                let speed_m_s = 1e-3 * (before_mm - up_mm) / tick_s;
                touched_m_s[0] = speed_m_s.min(touched_m_s[0]);
                touched_m_s[1] = speed_m_s.max(touched_m_s[1]);
                is_apart = false;
            }
            // Whatever is still on its way to the motors belongs to the tap.
            if !is_apart && up_mm > PLANE_MM + APART_MM {
                most_mj = given_mj.max(most_mj);
                given_mj = 0.0;
                is_apart = true;
            }
            before_mm = up_mm;
            is_tripped = step.sample.fault.is_some();
            !is_tripped
        });
        Ok((!is_tripped).then_some(Taps {
            given_mj: most_mj.max(given_mj),
            touched_m_s,
        }))
    }
}
