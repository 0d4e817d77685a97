//! One stiffness in one hand at one tick rate: a press, and [taps](super::tap).

use hapterra_core::guard::Fault;

use super::contact_loop::{HOME, PLANE_MM};
use super::entry::{Entry, EntryOutcome};
use super::setting::Setting;
use super::tap::{TAP_SPEEDS_M_S, Taps};
use hapterra::phantom::{OutOfReach, Touch};

/// The press, N, and its duration; only its last second counts.
const PRESS_FORCE_N: f64 = 1.0;
const PRESS_S: f64 = 2.5;
const OBSERVED_S: f64 = 1.0;
/// Swing of the tip from which it counts as unstable, mm.
const UNSTABLE_MM: f64 = 1.0;

/// Outcome of a press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PressOutcome {
    /// Swing of the tip in the last second, along the axis with the largest: eastward, northward or
    /// up.
    Held {
        /// From end to end, mm.
        swing_mm: f64,
        /// Swings a second.
        swings_hz: f64,
    },
    /// The guard switched the force off.
    Tripped(Fault),
}

/// Outcome of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Its setting.
    pub setting: Setting,
    /// The press.
    pub press: PressOutcome,
    /// Taps at each of [`TAP_SPEEDS_M_S`]; `None` if the guard switched the force off.
    pub taps: [Option<Taps>; 3],
    /// A press from the start of the ramp, and one from the closing of the clutch; `None` if the
    /// guard switched the force off.
    pub entries: [Option<EntryOutcome>; 2],
}

/// Verdict on a press.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The tip swings by no more than an encoder count.
    Still,
    /// It swings: a limit cycle.
    LimitCycle,
    /// It swings by more than a millimetre, or the guard switched the force off.
    Unstable,
}

impl Verdict {
    /// Returns its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::LimitCycle => "limit cycle",
            Self::Unstable => "unstable",
        }
    }
}

impl PressOutcome {
    /// Returns the verdict; an encoder count is `count_mm` of the tip's path.
    #[must_use]
    pub fn verdict(&self, count_mm: f64) -> Verdict {
        match *self {
            Self::Held { swing_mm, .. } if swing_mm <= count_mm => Verdict::Still,
            Self::Held { swing_mm, .. } if swing_mm <= UNSTABLE_MM => Verdict::LimitCycle,
            Self::Held { .. } | Self::Tripped(_) => Verdict::Unstable,
        }
    }
}

impl Setting {
    /// Runs the presses and taps.
    ///
    /// # Errors
    /// [`OutOfReach`] if the hand would have to leave the arm's reach.
    pub fn run_trial(self) -> Result<Trial, OutOfReach> {
        let press = self.press()?;
        let mut taps = [None; 3];
        for (taps, speed_m_s) in taps.iter_mut().zip(TAP_SPEEDS_M_S) {
            *taps = self.taps(speed_m_s)?;
        }
        Ok(Trial {
            setting: self,
            press,
            taps,
            entries: [self.run_entry(Entry::Ramp)?, self.run_entry(Entry::Clutch)?],
        })
    }

    pub(super) fn press(self) -> Result<PressOutcome, OutOfReach> {
        let (hand, wall) = (self.grasp.hand(), self.stiffness_n_per_mm);
        let [east, north, _] = HOME.home_mm;
        let above = Touch::start(&|_, _| Some(PLANE_MM), &hand, wall, [east, north], 10.0);
        let arm = self.arm(above.press(PRESS_FORCE_N, PRESS_S).finish())?;
        let from_s = arm.script_s() - OBSERVED_S;
        let (mut places, mut fault) = (Vec::new(), None);
        self.run(arm, &mut |t_s, step| {
            fault = step.sample.fault;
            if t_s >= from_s {
                places.push(step.tip_mm);
            }
            fault.is_none()
        });
        Ok(match fault {
            Some(fault) => PressOutcome::Tripped(fault),
            None => swings(&places),
        })
    }
}

/// Returns the amplitude and frequency of the positions of a second along the axis of the largest
/// swing.
fn swings(places_mm: &[[f64; 3]]) -> PressOutcome {
    let along = |axis: usize| {
        let coordinates = places_mm.iter().map(move |place| place[axis]);
        let low = coordinates.clone().fold(f64::INFINITY, f64::min);
        let high = coordinates.clone().fold(f64::NEG_INFINITY, f64::max);
        let middle = 0.5 * (low + high);
        // A swing crosses the middle twice.
        let sides = coordinates.map(|coordinate| coordinate > middle);
        let crossings = sides.clone().zip(sides.skip(1)).filter(|(a, b)| a != b);
        (high - low, crossings.count())
    };
    let widest = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 { b } else { a };
    let (swing_mm, crossings) = [along(0), along(1)].into_iter().fold(along(2), widest);
    PressOutcome::Held {
        swing_mm,
        swings_hz: 0.5 * crossings as f64 / OBSERVED_S,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tip_swing_is_measured_along_the_widest_axis() {
        for axis in 0..3 {
            let places: Vec<_> = (0..1000)
                .map(|tick| {
                    let mut place = [1.0, 2.0, 3.0];
                    // A swing of 20 ticks up to 0.5 mm, and less in another axis.
                    place[axis] += if tick % 20 < 10 { 0.25 } else { -0.25 };
                    place[(axis + 1) % 3] += if tick % 4 < 2 { 0.01 } else { -0.01 };
                    place
                })
                .collect();
            let PressOutcome::Held {
                swing_mm,
                swings_hz,
            } = swings(&places)
            else {
                panic!("it is held")
            };
            assert!((swing_mm - 0.5).abs() < 1e-12, "axis {axis}: {swing_mm} mm");
            assert!(
                (swings_hz - 49.5).abs() < 1.0,
                "axis {axis}: {swings_hz} Hz"
            );
        }
    }
}
