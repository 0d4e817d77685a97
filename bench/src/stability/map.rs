//! Many trials, and their table.

use std::io::{self, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use hapterra_core::force::{Controller, Damping, Pattern, Texture};
use hapterra_core::rate::TickRate;

use super::bounds::AtTip;
use super::entry::EntryOutcome;
use super::grasp::Grasp;
use super::setting::{Column, Setting};
use super::tap::{TAP_SPEEDS_M_S, Taps};
use super::trial::{PressOutcome, Trial, Verdict};
use hapterra::phantom::{OutOfReach, PhantomModel};

/// Trials of every stiffness in every grasp with every damping at every rate.
pub struct Map {
    /// The arm at its tip.
    pub at_tip: AtTip,
    /// By rate, damping, grasp and stiffness, in the requested order.
    pub trials: Vec<Trial>,
}

/// Plan of the trials.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Tick rates.
    pub rates: Vec<TickRate>,
    /// Stiffnesses, N/mm.
    pub stiffness_n_per_mm: Vec<f64>,
    /// Dampings, with the passivity controller on or off.
    pub dampings: Vec<Damping>,
    /// Micro-relief of the surface.
    pub texture: Texture,
    /// Delay from the encoders to the amplifiers, s.
    pub delay_s: f64,
    /// Friction of the arm's joints, as fractions of the model's.
    pub arm_frictions: Vec<f64>,
}

impl Plan {
    /// Returns the settings of all trials.
    fn settings(&self) -> Vec<Setting> {
        let mut settings = Vec::new();
        for (rate, damping, arm_friction) in self.columns() {
            for grasp in Grasp::ALL {
                settings.extend(self.stiffness_n_per_mm.iter().map(|stiffness| Setting {
                    rate,
                    stiffness_n_per_mm: *stiffness,
                    damping,
                    texture: self.texture,
                    grasp,
                    delay_s: self.delay_s,
                    arm_friction,
                }));
            }
        }
        settings
    }

    /// Returns every rate with every damping and every friction of the arm.
    fn columns(&self) -> impl Iterator<Item = Column> {
        let dampings = |rate| self.dampings.iter().map(move |damping| (rate, *damping));
        let columns = self.rates.iter().flat_map(move |rate| dampings(*rate));
        columns.flat_map(|(rate, damping)| {
            let frictions = self.arm_frictions.iter();
            frictions.map(move |part| (rate, damping, *part))
        })
    }

    /// Runs all trials on all processors. `on_trial` receives the total number after each, and
    /// returns true to continue. Returns `None` if it stopped.
    ///
    /// # Errors
    /// [`OutOfReach`] from a trial.
    pub fn map(
        &self,
        on_trial: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Option<Map>, OutOfReach> {
        let settings = self.settings();
        let (next, is_continued) = (AtomicUsize::new(0), Mutex::new(true));
        let work = || {
            let mut done = Vec::new();
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(setting) = settings.get(at) else {
                    return done;
                };
                done.push((at, setting.run_trial()));
                let mut is_continued = is_continued
                    .lock()
                    .unwrap_or_else(|broken| broken.into_inner());
                *is_continued = *is_continued && on_trial(settings.len());
                if !*is_continued {
                    return done;
                }
            }
        };
        let workers = std::thread::available_parallelism().map_or(1, usize::from);
        let mut done = std::thread::scope(|scope| {
            let workers: Vec<_> = (1..workers).map(|_| scope.spawn(work)).collect();
            let mut done = work();
            for worker in workers {
                let of_worker = worker.join();
                done.extend(of_worker.unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
            }
            done
        });
        if done.len() < settings.len() {
            return Ok(None);
        }
        done.sort_by_key(|(at, _)| *at);
        let trials = done.into_iter().map(|(_, trial)| trial);
        Ok(Some(Map {
            at_tip: AtTip::new(&PhantomModel::premium_1_5()),
            trials: trials.collect::<Result<_, _>>()?,
        }))
    }
}

impl Map {
    /// Returns the trials of one rate, damping, friction of the arm and grasp, by stiffness.
    pub fn of(&self, column: Column, grasp: Grasp) -> impl Iterator<Item = &Trial> {
        let trials = self.trials.iter();
        trials.filter(move |Trial { setting, .. }| {
            (setting.column(), setting.grasp) == (column, grasp)
        })
    }

    /// Returns the rates of the trials, each with every damping and every friction of the arm.
    #[must_use]
    pub fn columns(&self) -> Vec<Column> {
        let settings = self.trials.iter().map(|trial| trial.setting);
        let mut columns: Vec<_> = settings.map(Setting::column).collect();
        columns.dedup();
        columns
    }

    /// Returns the rates of the trials.
    #[must_use]
    pub fn rates(&self) -> Vec<TickRate> {
        let mut rates: Vec<_> = self.columns().iter().map(|(rate, ..)| *rate).collect();
        rates.dedup();
        rates
    }

    /// Returns the highest stiffness up to which every press was at least this good, N/mm; `None`
    /// if the lowest was worse.
    #[must_use]
    pub fn max_stiffness(&self, column: Column, grasp: Grasp, verdict: Verdict) -> Option<f64> {
        let count_mm = self.at_tip.count_mm;
        self.last_while(column, grasp, |trial| {
            trial.press.verdict(count_mm) <= verdict
        })
    }

    /// Returns the highest stiffness up to which every ramp of the force was good, N/mm.
    #[must_use]
    pub fn max_entry_stiffness(&self, column: Column, grasp: Grasp) -> Option<f64> {
        let is_good =
            |entered: &Option<EntryOutcome>| entered.is_some_and(|entered| entered.is_good());
        self.last_while(column, grasp, |trial| trial.entries.iter().all(is_good))
    }

    fn last_while(
        &self,
        column: Column,
        grasp: Grasp,
        is_good: impl Fn(&Trial) -> bool,
    ) -> Option<f64> {
        let last = self
            .of(column, grasp)
            .take_while(|trial| is_good(trial))
            .last();
        last.map(|trial| trial.setting.stiffness_n_per_mm)
    }

    /// Writes the rows as text, with a header.
    ///
    /// # Errors
    /// The error of the writer.
    pub fn write_csv(&self, to: &mut dyn Write) -> io::Result<()> {
        let taps = TAP_SPEEDS_M_S.map(|speed| {
            format!(
                "given_mj_at_{speed}_m_s,slowest_touch_at_{speed}_m_s,fastest_touch_at_{speed}_m_s"
            )
        });
        writeln!(
            to,
            "tick_hz,damping_ns_per_m,controller,grasp,stiffness_n_per_mm,delay_us,arm_friction,texture,amplitude_mm,wavelength_mm,press,swing_mm,swings_hz,fault,{},ramp_swing_mm,ramp_given_mj,clutch_swing_mm,clutch_given_mj",
            taps.join(",")
        )?;
        for trial in &self.trials {
            let Setting {
                rate,
                stiffness_n_per_mm,
                damping,
                texture,
                grasp,
                delay_s,
                arm_friction,
            } = trial.setting;
            let verdict = trial.press.verdict(self.at_tip.count_mm).name();
            let press = match trial.press {
                PressOutcome::Held {
                    swing_mm,
                    swings_hz,
                } => format!("{swing_mm:.6},{swings_hz:.1},"),
                PressOutcome::Tripped(fault) => format!(",,{fault:?}"),
            };
            let taps = trial.taps.map(|taps| {
                let row =
                    |Taps {
                         gained_mj,
                         contact_speed_m_s: [slowest, fastest],
                     }| { format!("{gained_mj:.6},{slowest:.4},{fastest:.4}") };
                taps.map_or_else(|| ",,".to_owned(), row)
            });
            let entries = trial.entries.map(|entered| {
                let row = |EntryOutcome {
                               swing_mm,
                               gained_mj,
                           }| format!("{swing_mm:.6},{gained_mj:.6}");
                entered.map_or_else(|| ",".to_owned(), row)
            });
            writeln!(
                to,
                "{},{:.1},{},{},{stiffness_n_per_mm},{:.0},{arm_friction},{},{},{},{verdict},{press},{},{}",
                rate.hz(),
                damping.ns_per_m,
                is_controlled(damping),
                grasp.name(),
                1e6 * delay_s,
                pattern(texture),
                texture.amplitude_mm,
                texture.wavelength_mm,
                taps.join(","),
                entries.join(",")
            )?;
        }
        Ok(())
    }

    /// Returns the limits as a table for a terminal.
    #[must_use]
    pub fn summary(&self) -> String {
        let AtTip { count_mm, .. } = self.at_tip;
        let mut lines = vec![format!(
            "stiffness in N/mm up to which a press of 1 N is still (no swing above one encoder count, {count_mm:.3} mm), up to which it is not unstable, and up to which swing and added energy are small (0.3 mm, 0.05 mJ) in the ramp and while the clutch closes:"
        )];
        let reported = |limit: Option<f64>| {
            limit.map_or_else(|| "none".to_owned(), |n_per_mm| n_per_mm.to_string())
        };
        for column @ (rate, damping, part) in self.columns() {
            let limits = Grasp::ALL.map(|grasp| {
                let limit = |verdict| reported(self.max_stiffness(column, grasp, verdict));
                let (still, held) = (limit(Verdict::Still), limit(Verdict::LimitCycle));
                let entry_limit = reported(self.max_entry_stiffness(column, grasp));
                format!("{} {still} / {held} / {entry_limit}", grasp.name())
            });
            lines.push(format!(
                "{:>6} Hz, {:<26} {} of the arm's friction: {}",
                rate.hz(),
                name(damping),
                part,
                limits.join(", ")
            ));
        }
        lines.push(format!(
            "theory for the arm alone: {} N/mm by its damping (Colgate & Schenkel), {:.2} N/mm by its friction (Abbott & Okamura)",
            self.rates().iter().map(|rate| format!("{:.3}", self.at_tip.by_damping(*rate))).collect::<Vec<_>>().join(", "),
            self.at_tip.by_friction()
        ));
        lines.join("\n") + "\n"
    }
}

/// Returns true if the passivity controller is on.
const fn is_controlled(damping: Damping) -> bool {
    matches!(damping.controller, Controller::On)
}

/// Returns the name of a texture.
const fn pattern(texture: Texture) -> &'static str {
    match texture.pattern {
        Pattern::None => "none",
        Pattern::Grain => "grain",
        Pattern::Grating => "grating",
    }
}

/// Returns the name of a damping.
pub(super) fn name(damping: Damping) -> String {
    let ns_per_m = damping.ns_per_m;
    match (ns_per_m > 0.0, is_controlled(damping)) {
        (false, false) => "no damping:".to_owned(),
        (false, true) => "controller:".to_owned(),
        (true, false) => format!("{ns_per_m} N·s/m:"),
        (true, true) => format!("{ns_per_m} N·s/m, controller:"),
    }
}
