//! Many trials, and the table of them.

use std::io::{self, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use hapterra_core::force::{Controller, Damping, Pattern, Texture};
use hapterra_core::rate::TickRate;

use super::bounds::AtTip;
use super::grasp::Grasp;
use super::tap::{TAP_SPEEDS_M_S, Taps};
use super::trial::{Press, Setting, Trial, Verdict};
use crate::phantom::{OutOfReach, PhantomModel};

/// Trials of every stiffness in every grasp with every damping at every rate.
pub struct Map {
    /// The arm at its tip.
    pub at_tip: AtTip,
    /// By rate, damping, grasp and stiffness, in the order in which they were asked for.
    pub trials: Vec<Trial>,
}

/// What is asked for.
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
    /// From reading the encoders to the amplifiers, s.
    pub delay_s: f64,
}

impl Plan {
    /// All that is tried.
    fn settings(&self) -> Vec<Setting> {
        let mut settings = Vec::new();
        for (rate, damping) in self.columns() {
            for grasp in Grasp::ALL {
                settings.extend(self.stiffness_n_per_mm.iter().map(|stiffness| Setting {
                    rate,
                    stiffness_n_per_mm: *stiffness,
                    damping,
                    texture: self.texture,
                    grasp,
                    delay_s: self.delay_s,
                }));
            }
        }
        settings
    }

    /// Every rate with every damping.
    fn columns(&self) -> impl Iterator<Item = (TickRate, Damping)> {
        let with_each = |rate: &TickRate| {
            let rate = *rate;
            self.dampings.iter().map(move |damping| (rate, *damping))
        };
        self.rates.iter().flat_map(with_each)
    }

    /// Tries all of it on all processors. `on_trial` hears of every one that is done, of how
    /// many, and says whether to go on; none where it did not.
    ///
    /// # Errors
    /// [`OutOfReach`] as a trial.
    pub fn map(
        &self,
        on_trial: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Option<Map>, OutOfReach> {
        let settings = self.settings();
        let (next, goes_on) = (AtomicUsize::new(0), Mutex::new(true));
        let work = || {
            let mut done = Vec::new();
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(setting) = settings.get(at) else {
                    return done;
                };
                done.push((at, setting.tried()));
                let mut goes_on = goes_on.lock().unwrap_or_else(|broken| broken.into_inner());
                *goes_on = *goes_on && on_trial(settings.len());
                if !*goes_on {
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
    /// Trials of one rate, damping and grasp, by stiffness.
    pub fn of(
        &self,
        rate: TickRate,
        damping: Damping,
        grasp: Grasp,
    ) -> impl Iterator<Item = &Trial> {
        let trials = self.trials.iter();
        trials.filter(move |Trial { setting, .. }| {
            (setting.rate, setting.damping, setting.grasp) == (rate, damping, grasp)
        })
    }

    /// Rates that were tried, each with every damping.
    #[must_use]
    pub fn columns(&self) -> Vec<(TickRate, Damping)> {
        let settings = self.trials.iter().map(|trial| trial.setting);
        let mut columns: Vec<_> = settings.map(|tried| (tried.rate, tried.damping)).collect();
        columns.dedup();
        columns
    }

    /// Rates that were tried.
    #[must_use]
    pub fn rates(&self) -> Vec<TickRate> {
        let mut rates: Vec<_> = self.columns().iter().map(|(rate, _)| *rate).collect();
        rates.dedup();
        rates
    }

    /// Highest stiffness up to which every press was as good as this, N/mm; none where the
    /// lowest was not.
    #[must_use]
    pub fn up_to(
        &self,
        rate: TickRate,
        damping: Damping,
        grasp: Grasp,
        verdict: Verdict,
    ) -> Option<f64> {
        let count_mm = self.at_tip.count_mm;
        let good = |trial: &&Trial| trial.press.verdict(count_mm) <= verdict;
        let last = self.of(rate, damping, grasp).take_while(good).last();
        last.map(|trial| trial.setting.stiffness_n_per_mm)
    }

    /// Rows as text, with a header.
    ///
    /// # Errors
    /// Of the writer.
    pub fn write_csv(&self, to: &mut dyn Write) -> io::Result<()> {
        let taps = TAP_SPEEDS_M_S.map(|speed| {
            format!(
                "given_mj_at_{speed}_m_s,slowest_touch_at_{speed}_m_s,fastest_touch_at_{speed}_m_s"
            )
        });
        writeln!(
            to,
            "tick_hz,damping_ns_per_m,controller,grasp,stiffness_n_per_mm,delay_us,texture,amplitude_mm,wavelength_mm,press,swing_mm,swings_hz,fault,{}",
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
            } = trial.setting;
            let verdict = trial.press.verdict(self.at_tip.count_mm).name();
            let press = match trial.press {
                Press::Held {
                    swing_mm,
                    swings_hz,
                } => format!("{swing_mm:.6},{swings_hz:.1},"),
                Press::Tripped(fault) => format!(",,{fault:?}"),
            };
            let taps = trial.taps.map(|taps| {
                let row =
                    |Taps {
                         given_mj,
                         touched_m_s: [slowest, fastest],
                     }| { format!("{given_mj:.6},{slowest:.4},{fastest:.4}") };
                taps.map_or_else(|| ",,".to_owned(), row)
            });
            writeln!(
                to,
                "{},{:.1},{},{},{stiffness_n_per_mm},{:.0},{},{},{},{verdict},{press},{}",
                rate.hz(),
                damping.ns_per_m,
                is_controlled(damping),
                grasp.name(),
                1e6 * delay_s,
                pattern(texture),
                texture.amplitude_mm,
                texture.wavelength_mm,
                taps.join(",")
            )?;
        }
        Ok(())
    }

    /// The limits as a table for a terminal.
    #[must_use]
    pub fn summary(&self) -> String {
        let AtTip { count_mm, .. } = self.at_tip;
        let mut lines = vec![format!(
            "stiffness in N/mm up to which a press of 1 N is still (no swing above one encoder count, {count_mm:.3} mm), and up to which it is held at all:"
        )];
        for (rate, damping) in self.columns() {
            let limits = Grasp::ALL.map(|grasp| {
                let limit = |verdict| {
                    let limit = self.up_to(rate, damping, grasp, verdict);
                    limit.map_or_else(|| "none".to_owned(), |n_per_mm| n_per_mm.to_string())
                };
                let (still, held) = (limit(Verdict::Still), limit(Verdict::Hum));
                format!("{} {still} / {held}", grasp.name())
            });
            lines.push(format!(
                "{:>6} Hz, {:<26} {}",
                rate.hz(),
                name(damping),
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

/// Whether the passivity controller acts.
const fn is_controlled(damping: Damping) -> bool {
    matches!(damping.controller, Controller::On)
}

/// What a texture is called.
const fn pattern(texture: Texture) -> &'static str {
    match texture.pattern {
        Pattern::None => "none",
        Pattern::Grain => "grain",
        Pattern::Grating => "grating",
    }
}

/// What a damping is called.
pub(super) fn name(damping: Damping) -> String {
    let ns_per_m = damping.ns_per_m;
    match (ns_per_m > 0.0, is_controlled(damping)) {
        (false, false) => "no damping:".to_owned(),
        (false, true) => "controller:".to_owned(),
        (true, false) => format!("{ns_per_m} N·s/m:"),
        (true, true) => format!("{ns_per_m} N·s/m, controller:"),
    }
}
