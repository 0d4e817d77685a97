//! Theory of a sampled spring, compared with the trials.

use hapterra_core::force::{Controller, Damping, Pattern, Texture};
use hapterra_core::rate::TickRate;
use hapterra_firmware::amplifier::CURRENT_LOOP_US;

use super::bounds::AtTip;
use super::entry::Entry;
use super::grasp::Grasp;
use super::map::Plan;
use super::setting::Setting;
use super::tap::{TAP_SPEEDS_M_S, Taps};
use super::trial::{PressOutcome, Trial, Verdict};
use hapterra::phantom::PhantomModel;
use hapterra::stability::{
    LONG_US, RAMP_UP_N_PER_MM, RAMP_UP_N_PER_MM_LONG, SHORT_US, STABLE_N_PER_MM,
    STABLE_N_PER_MM_LONG, TEXTURE_FACTOR, TEXTURE_FACTOR_LONG,
};

const UNDAMPED: Damping = Damping {
    ns_per_m: 0.0,
    controller: Controller::Off,
};

/// Delay from the encoders to the amplifiers, at the latencies of the trials, s.
const SHORT_S: f64 = 1e-6 * (SHORT_US - CURRENT_LOOP_US) as f64;
const LONG_S: f64 = 1e-6 * (LONG_US - CURRENT_LOOP_US) as f64;

const CONTROLLED: Damping = Damping {
    controller: Controller::On,
    ..UNDAMPED
};

fn run_trial(hz: u32, stiffness_n_per_mm: f64, grasp: Grasp) -> Trial {
    run_damped_trial(hz, stiffness_n_per_mm, grasp, 0.0, UNDAMPED)
}

fn run_damped_trial(
    hz: u32,
    stiffness_n_per_mm: f64,
    grasp: Grasp,
    delay_s: f64,
    damping: Damping,
) -> Trial {
    run_textured_trial(
        Texture::NONE,
        hz,
        stiffness_n_per_mm,
        grasp,
        delay_s,
        damping,
    )
}

fn run_textured_trial(
    texture: Texture,
    hz: u32,
    stiffness_n_per_mm: f64,
    grasp: Grasp,
    delay_s: f64,
    damping: Damping,
) -> Trial {
    let setting = Setting {
        texture,
        ..setting_for(hz, stiffness_n_per_mm, grasp, delay_s, damping)
    };
    setting.run_trial().expect("in reach")
}

fn setting_for(
    hz: u32,
    stiffness_n_per_mm: f64,
    grasp: Grasp,
    delay_s: f64,
    damping: Damping,
) -> Setting {
    Setting {
        rate: TickRate::new(hz).expect("a rate"),
        stiffness_n_per_mm,
        damping,
        texture: Texture::NONE,
        grasp,
        delay_s,
        arm_friction: 1.0,
    }
}

/// Returns the results of taps at a speed.
fn run_taps(setting: Setting, speed_m_s: f64) -> Taps {
    let taps = setting.taps(speed_m_s).expect("in reach");
    taps.expect("it is held")
}

fn verdict(trial: &Trial) -> Verdict {
    let arm = AtTip::new(&PhantomModel::premium_1_5());
    trial.press.verdict(arm.count_mm)
}

#[test]
fn tip_parameters_match_the_data_of_the_arm() {
    let arm = AtTip::new(&PhantomModel::premium_1_5());
    // The upper link of 209.55 mm lifts the tip, geared 11.2 to 1 to 4,096 counts a turn.
    let (lever_m, counts) = (0.209_55, 11.2 * 4096.0);
    let count_mm = 1e3 * lever_m * std::f64::consts::TAU / counts;
    assert!((arm.count_mm - count_mm).abs() < 1e-9, "{arm:?}");
    assert!((arm.coulomb_n - 0.01 / lever_m).abs() < 1e-9, "{arm:?}");
    let damping = 0.0005 / (lever_m * lever_m);
    assert!((arm.damping_ns_per_m - damping).abs() < 1e-9, "{arm:?}");
    let bound = 2.0 * (0.01 / lever_m) / count_mm;
    assert!((arm.by_friction() - bound).abs() < 1e-9);
    let two_khz = TickRate::new(2000).expect("a rate");
    assert!((arm.by_damping(two_khz) - 1e-3 * 2.0 * damping / 0.0005).abs() < 1e-9);
}

#[test]
fn stiff_surface_is_unstable_in_light_grasp_until_rate_rises() {
    for grasp in Grasp::ALL {
        let soft = run_trial(1000, 0.5, grasp);
        assert_eq!(verdict(&soft), Verdict::Still, "{soft:?}");
        // A check for contact: an arm that is not armed is still as well.
        let is_rendered =
            { soft.taps.iter() }.all(|taps| taps.is_some_and(|taps| taps.gained_mj > 0.0));
        assert!(is_rendered, "{soft:?}");
    }
    let shaken = run_trial(1000, 6.0, Grasp::Light);
    assert_eq!(verdict(&shaken), Verdict::Unstable, "{shaken:?}");
    let PressOutcome::Held { swings_hz, .. } = shaken.press else {
        panic!("{shaken:?}")
    };
    assert!((2.0..200.0).contains(&swings_hz), "{swings_hz}");
    let faster = run_trial(4000, 6.0, Grasp::Light);
    assert_eq!(verdict(&faster), Verdict::Still, "{faster:?}");
}

/// The lag of the arm's current loops, s.
const LAG_S: f64 = 0.238e-3 / 2.18;

#[test]
fn tap_touches_the_surface_at_its_nominal_speed() {
    for grasp in Grasp::ALL {
        // The arm's friction at rest reduces the motion of a light grasp by a varying amount.
        let tolerance = match grasp {
            Grasp::Light => 0.05,
            Grasp::Normal | Grasp::Firm => 0.015,
        };
        for (hz, stiffness) in [(1000, 0.5), (1000, 2.0), (10_000, 1.0)] {
            for speed_m_s in TAP_SPEEDS_M_S {
                let setting = setting_for(hz, stiffness, grasp, 80e-6, CONTROLLED);
                let Taps {
                    contact_speed_m_s, ..
                } = run_taps(setting, speed_m_s);
                assert!(
                    contact_speed_m_s
                        .iter()
                        .all(|touched| (touched / speed_m_s - 1.0).abs() < tolerance),
                    "{}, {hz} Hz, {stiffness} N/mm, {speed_m_s} m/s: {contact_speed_m_s:?} m/s",
                    grasp.name()
                );
            }
        }
    }
}

#[test]
fn tap_energy_is_proportional_to_age_of_the_force() {
    // The force of a tick is half a tick old on average, plus the delay to the amplifiers and the
    // lag of the current loops. In proportion to this age it is too small during the entry and too
    // large during the exit.
    let gained = |hz: u32, delay_s| {
        let age_s = 0.5 / f64::from(hz) + delay_s + LAG_S;
        let gained_mj =
            run_taps(setting_for(hz, 1.0, Grasp::Normal, delay_s, UNDAMPED), 0.2).gained_mj;
        assert!(gained_mj > 0.05, "{gained_mj} mJ");
        gained_mj / age_s
    };
    let once = gained(1000, 0.0);
    for (hz, delay_s) in [
        (4000, 0.0),
        (10_000, 0.0),
        (1000, 0.5e-3),
        (4000, 0.5e-3),
        (2000, 0.2e-3),
        (4000, 1e-3),
    ] {
        let share = gained(hz, delay_s) / once;
        assert!((share - 1.0).abs() < 0.15, "{hz} Hz, {delay_s} s: {share}");
    }
}

#[test]
fn passivity_controller_prevents_tap_energy_and_limit_cycle() {
    // The last two of these lines would need more than 1,000 N/s.
    for (hz, stiffness, delay_s, speeds) in [
        (1000, 0.5, 80e-6, &TAP_SPEEDS_M_S[..]),
        (4000, 1.0, 80e-6, &TAP_SPEEDS_M_S[..]),
        (10_000, 0.5, 80e-6, &TAP_SPEEDS_M_S[..]),
        (1000, 1.0, 1e-3, &TAP_SPEEDS_M_S[..]),
        (1000, 4.0, 80e-6, &TAP_SPEEDS_M_S[1..]),
        (4000, 3.0, 80e-6, &TAP_SPEEDS_M_S[2..]),
    ] {
        for grasp in Grasp::ALL {
            for speed_m_s in speeds {
                let setting = setting_for(hz, stiffness, grasp, delay_s, CONTROLLED);
                let gained_mj = run_taps(setting, *speed_m_s).gained_mj;
                assert!(
                    gained_mj < 1e-3,
                    "{}, {hz} Hz, {stiffness} N/mm, {delay_s} s, {speed_m_s} m/s: {gained_mj} mJ",
                    grasp.name()
                );
            }
        }
    }
    let stiff = run_damped_trial(1000, 6.0, Grasp::Light, 80e-6, CONTROLLED);
    assert_eq!(verdict(&stiff), Verdict::Still, "{stiff:?}");
}

#[test]
fn warning_before_a_surface_agrees_with_the_trials() {
    // At the next stiffness in the command's own list it is no longer still.
    let next = |still: f32| match still {
        1.0 => 1.5,
        1.5 => 2.0,
        2.0 => 2.5,
        2.5 => 3.0,
        3.0 => 4.0,
        4.0 => 6.0,
        6.0 => 8.0,
        _ => 12.0,
    };
    let count_mm = AtTip::new(&PhantomModel::premium_1_5()).count_mm;
    for (table, delay_s) in [(STABLE_N_PER_MM, SHORT_S), (STABLE_N_PER_MM_LONG, LONG_S)] {
        for (hz, without, with) in table {
            for (still, damping) in [(without, UNDAMPED), (with, CONTROLLED)] {
                let at = |stiffness| {
                    let press = setting_for(hz, stiffness, Grasp::Light, delay_s, damping).press();
                    press.expect("in reach").verdict(count_mm)
                };
                let name = format!("{hz} Hz, {delay_s} s, {still} N/mm");
                assert_eq!(at(still.into()), Verdict::Still, "{name}");
                assert_ne!(at(next(still)), Verdict::Still, "above {name}");
            }
        }
    }
}

/// The highest and steepest grain there is, which moves a light grasp more than any other in the
/// trials.
#[test]
fn textured_surface_is_still_up_to_a_share_of_the_stiffness() {
    let texture = Texture {
        pattern: Pattern::Grain,
        amplitude_mm: Texture::MAX_AMPLITUDE_MM,
        wavelength_mm: Texture::MAX_AMPLITUDE_MM / Texture::STEEPEST,
        ..Texture::NONE
    };
    assert!(texture.is_valid());
    let at = |hz, stiffness, delay_s, damping| {
        let trial = run_textured_trial(texture, hz, stiffness, Grasp::Light, delay_s, damping);
        verdict(&trial)
    };
    for (table, share_left, delay_s) in [
        (STABLE_N_PER_MM, TEXTURE_FACTOR, SHORT_S),
        (STABLE_N_PER_MM_LONG, TEXTURE_FACTOR_LONG, LONG_S),
    ] {
        for (hz, without, with) in table {
            for (still, damping) in [(without, UNDAMPED), (with, CONTROLLED)] {
                let share = f64::from(share_left * still);
                assert_eq!(
                    at(hz, share, delay_s, damping),
                    Verdict::Still,
                    "{hz} Hz, {delay_s} s, {share} N/mm"
                );
            }
        }
    }
    // The limit of an even surface is too much here: the texture rocks a hand that slides.
    let (hz, without, _) = STABLE_N_PER_MM[0];
    let whole = at(hz, without.into(), SHORT_S, UNDAMPED);
    assert_eq!(whole, Verdict::Unstable);
}

#[test]
fn damping_reduces_the_energy_gained_in_a_tap() {
    let damped = Damping {
        ns_per_m: 2.0,
        ..UNDAMPED
    };
    let gained =
        |damping| run_taps(setting_for(1000, 1.0, Grasp::Normal, 80e-6, damping), 0.2).gained_mj;
    let (with, without) = (gained(damped), gained(UNDAMPED));
    assert!(with < without, "{with} and {without} mJ");
}

#[test]
fn map_lists_each_trial_once_and_limits_are_last_good_stiffness() {
    let plan = Plan {
        rates: vec![TickRate::DEFAULT],
        stiffness_n_per_mm: vec![0.5, 6.0],
        dampings: vec![UNDAMPED],
        texture: Texture::NONE,
        delay_s: 80e-6,
        arm_frictions: vec![1.0],
    };
    let map = plan.map(&|of| of == 6).expect("in reach").expect("whole");
    let mut csv = Vec::new();
    map.write_csv(&mut csv).expect("written");
    let csv = String::from_utf8(csv).expect("text");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 6);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let begins: Vec<_> = rows[1..].iter().map(|row| row[..5].join(",")).collect();
    let expected = Grasp::ALL.map(|grasp| {
        ["0.5", "6"].map(|stiffness| format!("1000,0.0,false,{},{stiffness}", grasp.name()))
    });
    assert_eq!(begins, expected.concat());
    let mut limits = Vec::new();
    map.write_limits(&mut limits).expect("written");
    let limits = String::from_utf8(limits).expect("text");
    let [header, row] = ["tick_hz", "1000,1,"].map(|start| {
        let line = limits.lines().find(|line| line.starts_with(start));
        line.expect("a line").split(',').collect::<Vec<_>>()
    });
    let cell = |name| row[header.iter().position(|it| *it == name).expect("a column")];
    let found = ["off_light_held", "off_firm_held", "on_firm_held"].map(cell);
    assert_eq!(found, ["0.5", "6", ""], "{limits}");
    let limit = |grasp| {
        map.max_stiffness(
            (TickRate::DEFAULT, UNDAMPED, 1.0),
            grasp,
            Verdict::LimitCycle,
        )
    };
    assert_eq!(
        (limit(Grasp::Light), limit(Grasp::Firm)),
        (Some(0.5), Some(6.0))
    );
    let none = plan.map(&|_| false).expect("in reach");
    assert!(none.is_none(), "interrupted");
}

/// Stiffnesses of the trials with a ramp of the force, N/mm.
const ENTRY_STIFFNESS_N_PER_MM: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 4.0];

/// Checks a table of the tick rate and the stiffnesses up to which the force ramps up well, after
/// arming and as the clutch closes, N/mm.
fn check_entry_limits(arm_friction: f64, delay_s: f64, table: [(u32, f64, f64); 4]) {
    for (hz, ramp, clutch) in table {
        for stiffness in ENTRY_STIFFNESS_N_PER_MM {
            for (entry, max_stiffness) in [(Entry::Ramp, ramp), (Entry::Clutch, clutch)] {
                let setting = Setting {
                    arm_friction,
                    ..setting_for(hz, stiffness, Grasp::Light, delay_s, CONTROLLED)
                };
                let entered = setting
                    .run_entry(entry)
                    .expect("in reach")
                    .expect("no fault");
                assert_eq!(
                    entered.is_good(),
                    stiffness <= max_stiffness,
                    "{hz} Hz, {delay_s} s, {stiffness} N/mm, {entry:?}: {entered:?}"
                );
            }
        }
    }
}

/// Safety: 14.
#[test]
fn force_ramps_up_without_swing_or_energy_gain() {
    let all = |hz| (hz, 4.0, 4.0);
    check_entry_limits(1.0, SHORT_S, [1000, 2000, 4000, 10_000].map(all));
}

#[test]
fn force_ramps_up_cleanly_with_one_millisecond_delay() {
    let all = |hz| (hz, 4.0, 4.0);
    check_entry_limits(1.0, LONG_S, [1000, 2000, 4000, 10_000].map(all));
}

/// Safety: 14.
#[test]
fn ramp_up_limits_at_a_tenth_of_arm_friction_match_tables() {
    let little = [
        (1000, 2.0, 1.0),
        (2000, 2.0, 2.0),
        (4000, 3.0, 2.0),
        (10_000, 3.0, 2.0),
    ];
    check_entry_limits(0.1, SHORT_S, little);
    let late = [
        (1000, 1.0, 1.0),
        (2000, 1.0, 1.0),
        (4000, 1.0, 1.0),
        (10_000, 1.0, 0.5),
    ];
    check_entry_limits(0.1, LONG_S, late);
    for (table, expected) in [(little, RAMP_UP_N_PER_MM), (late, RAMP_UP_N_PER_MM_LONG)] {
        for ((hz, ramp, clutch), (of_hz, n_per_mm)) in table.into_iter().zip(expected) {
            assert_eq!((hz, ramp.min(clutch)), (of_hz, f64::from(n_per_mm)));
        }
    }
}

/// Beyond the limits in energy, no swing exceeds 0.3 mm on a board with converters.
#[test]
fn swings_are_small_with_little_arm_friction() {
    for hz in [1000, 10_000] {
        for entry in [Entry::Ramp, Entry::Clutch] {
            let setting = Setting {
                arm_friction: 0.1,
                ..setting_for(hz, 4.0, Grasp::Light, SHORT_S, CONTROLLED)
            };
            let entered = setting
                .run_entry(entry)
                .expect("in reach")
                .expect("no fault");
            assert!(entered.swing_mm < 0.16, "{hz} Hz, {entry:?}: {entered:?}");
        }
    }
}

#[test]
fn tip_swings_during_ramp_up_without_passivity_controller() {
    let setting = Setting {
        arm_friction: 0.1,
        ..setting_for(1000, 3.0, Grasp::Light, 0.1e-3, UNDAMPED)
    };
    for entry in [Entry::Ramp, Entry::Clutch] {
        let entered = setting
            .run_entry(entry)
            .expect("in reach")
            .expect("no fault");
        assert!(
            entered.swing_mm > 3.0 && entered.gained_mj > 100.0,
            "{entered:?}"
        );
    }
}
