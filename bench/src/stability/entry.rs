//! A press while the force ramps up: in the ramp after arming, and while the clutch closes.
//!
//! The hand presses with 1 N from the first moment with force, until ten seconds after the end of
//! the ramp. Two figures rate the press, both from the true tip and the true torques:
//!
//! - the *swing*: the return of the tip into the surface while the rising stiffness pushes it out,
//!   and its motion from then on;
//! - the *energy added*: the work of the surface, less that of a spring whose stiffness rises
//!   equally.

use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{Limits, WORKING_SHARE};

use super::contact_loop::{CELL_MM, HOME, LoopTick, PLANE_MM};
use super::setting::Setting;
use hapterra::phantom::{HeldPhantom, OutOfReach, Script};

/// The press, N.
const PRESS_FORCE_N: f64 = 1.0;
/// Speed at which the hand begins to press, mm/s.
const APPROACH_MM_S: f64 = 60.0;
/// Height of the tip above the surface at the start, mm.
const START_HEIGHT_MM: f64 = 0.2;
/// Duration of the ramp, and of the clutch's closing, s.
const RAMP_S: f64 = 2.0;
const CLUTCH_CLOSING_S: f64 = 0.5;
/// Time of observation after that, s.
const OBSERVATION_S: f64 = 10.0;
/// Swings count from this time after the hand has started to press with full force, s.
const SETTLING_S: f64 = 0.25;
/// The guard's clamp, N.
const CLAMP_N: f64 = (WORKING_SHARE * SurfaceParams::PREMIUM.max_force_n) as f64;
/// Window of a swing, s.
const WINDOW_S: f64 = 0.25;

/// Kind of ramp of the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// The ramp after arming.
    Ramp,
    /// The clutch closes.
    Clutch,
}

/// Outcome of a press while the force ramps up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EntryOutcome {
    /// The largest swing from half of the force on, mm.
    pub swing_mm: f64,
    /// The max energy added at any moment, mJ.
    pub gained_mj: f64,
}

impl EntryOutcome {
    /// Largest permitted swing, mm, and energy added, mJ.
    pub const MAX_SWING_MM: f64 = 0.3;
    /// See [`Self::MAX_SWING_MM`].
    pub const MAX_GAINED_MJ: f64 = 0.05;

    /// Returns true if both are within the limits.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.swing_mm <= Self::MAX_SWING_MM && self.gained_mj <= Self::MAX_GAINED_MJ
    }
}

impl Setting {
    /// Presses from the first moment of the ramp on. Returns `None` if the guard switched the force
    /// off.
    ///
    /// # Errors
    /// [`OutOfReach`] if the hand would have to leave the arm's reach.
    pub fn run_entry(self, entry: Entry) -> Result<Option<EntryOutcome>, OutOfReach> {
        let [east, north, _] = HOME.home_mm;
        let wall_mm = PRESS_FORCE_N / self.stiffness_n_per_mm;
        let give_mm = 1e3 * PRESS_FORCE_N * self.grasp.hand().compliance_m_per_n();
        let pressed = PLANE_MM - wall_mm - give_mm;
        let begin = Script::start([east, north, PLANE_MM + START_HEIGHT_MM]);
        let press =
            |script: Script, up_mm: f64| script.line_to([east, north, up_mm], APPROACH_MM_S);
        let (arm, clutch_s, in_s) = match entry {
            Entry::Ramp => {
                let script = press(begin, pressed).wait(RAMP_S + OBSERVATION_S);
                let arm = self.arm(script)?.arming_for(HeldPhantom::RAMPS_S);
                (arm, None, RAMP_S)
            }
            Entry::Clutch => {
                let script = press(begin, pressed).wait(1.0);
                let held_s = script.duration_s();
                let script = press(script.wait(0.5), pressed - give_mm);
                let arm = self.arm(script.wait(CLUTCH_CLOSING_S + OBSERVATION_S))?;
                (arm, Some([held_s, held_s + 0.5]), CLUTCH_CLOSING_S)
            }
        };
        let settled_s = arm.script_s() - OBSERVATION_S - in_s + SETTLING_S;
        let mut observer = EntryObserver::new(&self, entry, settled_s);
        let mut is_tripped = false;
        self.run_with_clutch(arm, clutch_s, &mut |t_s, step| {
            observer.observe(t_s, step);
            is_tripped = step.sample.fault.is_some();
            !is_tripped
        });
        Ok((!is_tripped).then_some(observer.outcome))
    }
}

/// Observes a press.
struct EntryObserver {
    entry: Entry,
    stiffness_n_per_mm: f64,
    tick_s: f64,
    /// Ticks since the ramp began, less the delay of the force.
    ticks: f64,
    /// Share of the force, and height of the surface, mm.
    share: f64,
    plane_mm: f64,
    is_ramping: bool,
    /// Energy added, mJ.
    excess_mj: f64,
    stored_mj: Option<f64>,
    /// Time from which swings count, s.
    settled_s: f64,
    window: SwingWindow,
    outcome: EntryOutcome,
}

impl EntryObserver {
    fn new(setting: &Setting, entry: Entry, settled_s: f64) -> Self {
        Self {
            entry,
            stiffness_n_per_mm: setting.stiffness_n_per_mm,
            tick_s: 1.0 / f64::from(setting.rate.hz()),
            ticks: -setting.force_delay_s() * f64::from(setting.rate.hz()),
            share: 0.0,
            plane_mm: PLANE_MM,
            is_ramping: false,
            excess_mj: 0.0,
            stored_mj: None,
            settled_s,
            window: SwingWindow::EMPTY,
            outcome: EntryOutcome {
                swing_mm: 0.0,
                gained_mj: 0.0,
            },
        }
    }

    fn observe(&mut self, t_s: f64, step: &LoopTick) {
        self.update_share(step);
        if !self.is_ramping {
            return;
        }
        let depth_mm = (self.plane_mm - step.tip_mm[2]).max(0.0);
        let unclamped_n = self.stiffness_n_per_mm * depth_mm;
        // The guard clamps after the clutch's share, but before the ramp's.
        let max_n = match self.entry {
            Entry::Ramp => CLAMP_N,
            Entry::Clutch => {
                f64::from(SurfaceParams::PREMIUM.max_force_n).min(CLAMP_N / self.share)
            }
        };
        let spring_n = unclamped_n.min(max_n);
        // Beyond the clamp the force is constant.
        let stored_mj = spring_n * (unclamped_n - 0.5 * spring_n) / self.stiffness_n_per_mm;
        // The additional energy of a stiffer spring at the same depth is intended.
        let stiffening_mj = self.stored_mj.map_or(0.0, |before| stored_mj - before);
        self.stored_mj = Some(stored_mj);
        self.excess_mj += step.gained_mj + self.share * stiffening_mj;
        self.outcome.gained_mj = self.outcome.gained_mj.max(self.excess_mj);
        if self.share > 0.5 && t_s > self.settled_s {
            let swing_mm = self.window.swing_mm(step.tip_mm, self.share < 1.0);
            self.outcome.swing_mm = self.outcome.swing_mm.max(swing_mm);
            if f64::from(self.window.ticks) * self.tick_s >= WINDOW_S {
                self.window = SwingWindow::EMPTY;
            }
        }
    }

    /// Updates the share and the surface.
    fn update_share(&mut self, step: &LoopTick) {
        let sample = &step.sample;
        let ramp_s = match self.entry {
            Entry::Ramp => {
                if sample.limits.contains(Limits::RAMPING) && !self.is_ramping {
                    // The first tick's force has the first step of the share.
                    (self.is_ramping, self.ticks) = (true, self.ticks + 1.0);
                }
                RAMP_S
            }
            Entry::Clutch => {
                if sample.limits.contains(Limits::CLUTCH_OPEN) {
                    // The surface moves with the tip.
                    let hip_mm = f64::from(sample.hip.cell()[2]) + f64::from(sample.hip.frac().z);
                    self.plane_mm = PLANE_MM + step.encoder_height_mm - CELL_MM * hip_mm;
                    self.is_ramping = true;
                    return;
                }
                CLUTCH_CLOSING_S
            }
        };
        if self.is_ramping {
            self.share = (self.ticks * self.tick_s / ramp_s).clamp(0.0, 1.0);
            self.ticks += 1.0;
        }
    }
}

/// The range of the tip in a quarter of a second.
struct SwingWindow {
    ticks: u32,
    low_mm: [f64; 3],
    high_mm: [f64; 3],
    /// Largest downward motion after a high point.
    drop_mm: f64,
}

impl SwingWindow {
    const EMPTY: Self = Self {
        ticks: 0,
        low_mm: [f64::INFINITY; 3],
        high_mm: [f64::NEG_INFINITY; 3],
        drop_mm: 0.0,
    };

    /// Adds a position. Returns the swing up to now; with a rising stiffness, outward motion does
    /// not count.
    fn swing_mm(&mut self, tip_mm: [f64; 3], is_stiffening: bool) -> f64 {
        self.ticks += 1;
        let bounds = self.low_mm.iter_mut().zip(&mut self.high_mm);
        for ((low, high), at) in bounds.zip(tip_mm) {
            (*low, *high) = (low.min(at), high.max(at));
        }
        self.drop_mm = self.drop_mm.max(self.high_mm[2] - tip_mm[2]);
        let [east, north, up] = [0, 1, 2].map(|axis| self.high_mm[axis] - self.low_mm[axis]);
        let up = if is_stiffening { self.drop_mm } else { up };
        east.max(north).max(up)
    }
}
