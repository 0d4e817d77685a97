//! The limits of a [`Map`] as a table: a row for each tick rate and friction of the arm.

use std::io::{self, Write};

use hapterra_core::force::Controller;
use hapterra_core::rate::TickRate;

use super::entry::Entry;
use super::grasp::Grasp;
use super::map::Map;
use super::tap::TAP_SPEEDS_M_S;
use super::trial::{Trial, Verdict};

/// Controllers, with their names in the header.
const CONTROLLERS: [(Controller, &str); 2] = [(Controller::Off, "off"), (Controller::On, "on")];
/// Softest surface whose ramps count, N/mm: on a softer one a good press also settles by more than
/// the permitted swing.
const SOFTEST_RAMP_N_PER_MM: f64 = 0.5;
/// Surface and grasp of the taps without the controller, N/mm.
const TAPPED_N_PER_MM: f64 = 1.0;
/// Stiffnesses up to which the largest energy of a tap with the controller is listed, N/mm.
const TAPPED_UP_TO_N_PER_MM: [f64; 2] = [2.0, 6.0];

impl Map {
    /// Writes the limits as CSV, with a header. Stiffnesses in N/mm: up to which a press is still
    /// and up to which it has at most a limit cycle, by controller and grasp; up to which a ramp of
    /// the force is good in a light grasp with the controller, from 0.5 N/mm, after arming and as
    /// the clutch closes. Energies in mJ: of a tap at 1 N/mm in a normal grasp without the controller, by
    /// speed; the largest of all taps up to 2 and 6 N/mm with it.
    ///
    /// # Errors
    /// The error of the writer.
    pub fn write_limits(&self, to: &mut dyn Write) -> io::Result<()> {
        let mut header = vec!["tick_hz".to_owned(), "arm_friction".to_owned()];
        for (_, controller) in CONTROLLERS {
            for grasp in Grasp::ALL.map(Grasp::name) {
                header.push(format!("{controller}_{grasp}"));
                header.push(format!("{controller}_{grasp}_held"));
            }
        }
        header.extend(["on_ramp", "on_clutch"].map(str::to_owned));
        header.extend(TAP_SPEEDS_M_S.map(|speed| format!("tap_{speed}_mj")));
        header.extend(TAPPED_UP_TO_N_PER_MM.map(|limit| format!("on_tap_{limit}_mj")));
        writeln!(to, "{}", header.join(","))?;
        let settings = self.trials.iter().map(|trial| &trial.setting);
        let mut rows: Vec<_> = settings.map(|it| (it.rate, it.arm_friction)).collect();
        rows.dedup();
        rows.sort_by(|a, b| {
            (a.0.hz(), a.1)
                .partial_cmp(&(b.0.hz(), b.1))
                .expect("finite")
        });
        rows.dedup();
        for (rate, friction) in rows {
            let cells = self.limits_of(rate, friction);
            writeln!(to, "{},{friction},{}", rate.hz(), cells.join(","))?;
        }
        Ok(())
    }

    /// Returns the cells of a row after its rate and friction.
    fn limits_of(&self, rate: TickRate, friction: f64) -> Vec<String> {
        let of = |controller: Controller, grasp: Option<Grasp>| {
            self.trials.iter().filter(move |Trial { setting, .. }| {
                (setting.rate, setting.arm_friction) == (rate, friction)
                    && setting.damping.controller == controller
                    && grasp.is_none_or(|grasp| setting.grasp == grasp)
            })
        };
        let count_mm = self.at_tip.count_mm;
        let mut cells = Vec::new();
        for (controller, _) in CONTROLLERS {
            for grasp in Grasp::ALL {
                for worst in [Verdict::Still, Verdict::LimitCycle] {
                    let trials = of(controller, Some(grasp));
                    let is_good = |trial: &Trial| trial.press.verdict(count_mm) <= worst;
                    cells.push(stiffness_while(trials, is_good));
                }
            }
        }
        for entry in [Entry::Ramp, Entry::Clutch] {
            let trials = of(Controller::On, Some(Grasp::Light))
                .filter(|it| it.setting.stiffness_n_per_mm >= SOFTEST_RAMP_N_PER_MM);
            let is_good =
                |trial: &Trial| trial.entries[entry as usize].is_some_and(|it| it.is_good());
            cells.push(stiffness_while(trials, is_good));
        }
        for speed in 0..TAP_SPEEDS_M_S.len() {
            let mut trials = of(Controller::Off, Some(Grasp::Normal));
            let tapped = trials.find(|it| it.setting.stiffness_n_per_mm == TAPPED_N_PER_MM);
            let taps = tapped.and_then(|trial| trial.taps[speed]);
            cells.push(taps.map_or_else(String::new, |taps| format!("{:.6}", taps.gained_mj)));
        }
        for limit in TAPPED_UP_TO_N_PER_MM {
            let trials = of(Controller::On, None);
            let trials = trials.filter(|it| it.setting.stiffness_n_per_mm <= limit);
            let taps = trials.flat_map(|trial| trial.taps.iter().flatten());
            let most_mj = taps.map(|taps| taps.gained_mj).reduce(f64::max);
            cells.push(most_mj.map_or_else(String::new, |mj| format!("{mj:.6}")));
        }
        cells
    }
}

/// Returns the highest stiffness up to which each trial is good; an empty text if the lowest is not.
fn stiffness_while<'t>(
    trials: impl Iterator<Item = &'t Trial>,
    is_good: impl Fn(&Trial) -> bool,
) -> String {
    let last = trials.take_while(|trial| is_good(trial)).last();
    last.map_or_else(String::new, |trial| {
        trial.setting.stiffness_n_per_mm.to_string()
    })
}
