//! What is known of a spring that is felt in ticks, beside what the trials say.

use hapterra_core::force::{Controller, Damping, Pattern, Texture};
use hapterra_core::rate::TickRate;

use super::bounds::AtTip;
use super::grasp::Grasp;
use super::limits::{LEFT_WITH_TEXTURE, STILL_N_PER_MM};
use super::map::Plan;
use super::trial::{Press, Setting, Trial, Verdict};
use crate::phantom::PhantomModel;

const UNDAMPED: Damping = Damping {
    ns_per_m: 0.0,
    controller: Controller::Off,
};

fn tried(hz: u32, stiffness_n_per_mm: f64, grasp: Grasp) -> Trial {
    tried_late(hz, stiffness_n_per_mm, grasp, 0.0)
}

fn tried_late(hz: u32, stiffness_n_per_mm: f64, grasp: Grasp, delay_s: f64) -> Trial {
    tried_damped(hz, stiffness_n_per_mm, grasp, delay_s, UNDAMPED)
}

fn tried_damped(
    hz: u32,
    stiffness_n_per_mm: f64,
    grasp: Grasp,
    delay_s: f64,
    damping: Damping,
) -> Trial {
    tried_on(
        Texture::NONE,
        hz,
        stiffness_n_per_mm,
        grasp,
        delay_s,
        damping,
    )
}

fn tried_on(
    texture: Texture,
    hz: u32,
    stiffness_n_per_mm: f64,
    grasp: Grasp,
    delay_s: f64,
    damping: Damping,
) -> Trial {
    let setting = Setting {
        rate: TickRate::new(hz).expect("a rate"),
        stiffness_n_per_mm,
        damping,
        texture,
        grasp,
        delay_s,
    };
    setting.tried().expect("in reach")
}

fn verdict(trial: &Trial) -> Verdict {
    let arm = AtTip::new(&PhantomModel::premium_1_5());
    trial.press.verdict(arm.count_mm)
}

#[test]
fn the_arm_at_its_tip_is_what_its_data_say() {
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
fn a_soft_surface_is_still_in_every_hand_and_a_stiff_one_shakes_a_limp_one_until_it_ticks_faster() {
    for grasp in Grasp::ALL {
        let soft = tried(1000, 0.5, grasp);
        assert_eq!(verdict(&soft), Verdict::Still, "{soft:?}");
        // It was touched: an arm that is not armed is still, too.
        let is_felt = { soft.given_mj.iter() }.all(|mj| mj.is_some_and(|mj| mj > 0.0));
        assert!(is_felt, "{soft:?}");
    }
    let shaken = tried(1000, 6.0, Grasp::Limp);
    assert_eq!(verdict(&shaken), Verdict::Unstable, "{shaken:?}");
    let Press::Held { swings_hz, .. } = shaken.press else {
        panic!("{shaken:?}")
    };
    assert!((2.0..200.0).contains(&swings_hz), "{swings_hz}");
    let faster = tried(4000, 6.0, Grasp::Limp);
    assert_eq!(verdict(&faster), Verdict::Still, "{faster:?}");
}

#[test]
fn what_a_tap_gives_falls_as_the_ticks_get_shorter() {
    // The force of a tick is that of its beginning: too little on the way in, too much on the
    // way out, both in proportion to the tick.
    let given = |hz| tried(hz, 1.0, Grasp::Normal).given_mj[1].expect("it is held");
    let (slow, fast) = (given(1000), given(4000));
    assert!(slow > 0.1, "{slow} mJ");
    assert!((3.4..4.6).contains(&(slow / fast)), "{slow} and {fast} mJ");
}

#[test]
fn a_force_that_comes_late_gives_as_much_as_longer_ticks() {
    // The force of a tick is half a tick old on average, and as much older as it comes late.
    let given = |hz, delay_s| {
        let trial = tried_late(hz, 1.0, Grasp::Normal, delay_s);
        trial.given_mj[1].expect("it is held")
    };
    for (hz, delay_s) in [(1000, 0.5e-3), (4000, 0.5e-3), (2000, 0.2e-3)] {
        let tick_s = 1.0 / f64::from(hz);
        let wanted = (0.5 * tick_s + delay_s) / (0.5 * tick_s);
        let found = given(hz, delay_s) / given(hz, 0.0);
        assert!(
            (found / wanted - 1.0).abs() < 0.15,
            "{hz} Hz: {found}, {wanted} wanted"
        );
    }
}

#[test]
fn with_the_controller_a_tap_gives_nothing_and_a_stiffer_surface_is_still() {
    let controlled = Damping {
        controller: Controller::On,
        ..UNDAMPED
    };
    for (hz, grasp) in [
        (1000, Grasp::Limp),
        (1000, Grasp::Firm),
        (4000, Grasp::Normal),
    ] {
        let without = tried_late(hz, 1.0, grasp, 80e-6).given_mj;
        let with = tried_damped(hz, 1.0, grasp, 80e-6, controlled).given_mj;
        for (with, without) in with.into_iter().zip(without) {
            let [with, without] = [with, without].map(|given| given.expect("it is held"));
            assert!(without > 0.02, "{without} mJ");
            assert!(with < 0.02 * without, "{with} and {without} mJ");
        }
    }
    let stiff = tried_damped(1000, 6.0, Grasp::Limp, 80e-6, controlled);
    assert_eq!(verdict(&stiff), Verdict::Still, "{stiff:?}");
}

#[test]
fn what_is_said_before_a_surface_is_felt_is_what_the_trials_show() {
    let with_controller = Damping {
        controller: Controller::On,
        ..UNDAMPED
    };
    // The next stiffness of the command's own list is held still no more.
    let next = |still: f32| match still {
        3.0 => 4.0,
        4.0 => 6.0,
        6.0 => 8.0,
        _ => 12.0,
    };
    for (hz, without, with) in STILL_N_PER_MM {
        for (still, damping) in [(without, UNDAMPED), (with, with_controller)] {
            let at = |stiffness| verdict(&tried_damped(hz, stiffness, Grasp::Limp, 80e-6, damping));
            assert_eq!(at(still.into()), Verdict::Still, "{hz} Hz, {still} N/mm");
            assert_ne!(
                at(next(still)),
                Verdict::Still,
                "{hz} Hz, above {still} N/mm"
            );
        }
    }
}

/// The highest and steepest grain there is, on which a limp hand is rocked most of all that
/// were tried.
#[test]
fn a_texture_is_held_still_up_to_half_the_stiffness() {
    let texture = Texture {
        pattern: Pattern::Grain,
        amplitude_mm: Texture::MOST_AMPLITUDE_MM,
        wavelength_mm: Texture::MOST_AMPLITUDE_MM / Texture::STEEPEST,
        ..Texture::NONE
    };
    assert!(texture.is_valid());
    let controlled = Damping {
        controller: Controller::On,
        ..UNDAMPED
    };
    let at = |hz, stiffness, damping| {
        let trial = tried_on(texture, hz, stiffness, Grasp::Limp, 80e-6, damping);
        verdict(&trial)
    };
    for (hz, without, with) in STILL_N_PER_MM {
        for (still, damping) in [(without, UNDAMPED), (with, controlled)] {
            let half = f64::from(LEFT_WITH_TEXTURE * still);
            assert_eq!(
                at(hz, half, damping),
                Verdict::Still,
                "{hz} Hz, {half} N/mm"
            );
        }
    }
    // What an even surface bears is too much here: a hand that slides sideways is rocked.
    let (hz, without, _) = STILL_N_PER_MM[0];
    assert_eq!(at(hz, without.into(), UNDAMPED), Verdict::Unstable);
}

#[test]
fn damping_takes_from_what_a_tap_gives() {
    let damped = Damping {
        ns_per_m: 2.0,
        ..UNDAMPED
    };
    let with = tried_damped(1000, 1.0, Grasp::Normal, 80e-6, damped).given_mj[1];
    let without = tried_late(1000, 1.0, Grasp::Normal, 80e-6).given_mj[1];
    assert!(with < without, "{with:?} and {without:?} mJ");
}

#[test]
fn a_table_has_every_trial_once_and_its_limits_are_the_last_that_held() {
    let plan = Plan {
        rates: vec![TickRate::DEFAULT],
        stiffness_n_per_mm: vec![0.5, 6.0],
        dampings: vec![UNDAMPED],
        texture: Texture::NONE,
        delay_s: 80e-6,
    };
    let map = plan.map(&|of| of == 6).expect("in reach").expect("whole");
    let mut csv = Vec::new();
    map.write_csv(&mut csv).expect("written");
    let csv = String::from_utf8(csv).expect("text");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 6);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let begins: Vec<_> = rows[1..].iter().map(|row| row[..5].join(",")).collect();
    let wanted = Grasp::ALL.map(|grasp| {
        ["0.5", "6"].map(|stiffness| format!("1000,0.0,false,{},{stiffness}", grasp.name()))
    });
    assert_eq!(begins, wanted.concat());
    let limit = |grasp| map.up_to(TickRate::DEFAULT, UNDAMPED, grasp, Verdict::Hum);
    assert_eq!(
        (limit(Grasp::Limp), limit(Grasp::Firm)),
        (Some(0.5), Some(6.0))
    );
    let none = plan.map(&|_| false).expect("in reach");
    assert!(none.is_none(), "interrupted");
}
