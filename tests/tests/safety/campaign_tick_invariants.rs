//! The campaign's tick checks report each violation and nothing else: every violation is forged.

use hapterra::phantom::{Encoder, PhantomModel, kinematics};
use hapterra_core::Vec3;
use hapterra_core::guard::{Fault, GuardInputs, GuardOutputs, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::TickRecord;
use hapterra_tests::campaign::hostile_calibrations;
use hapterra_tests::campaign::maxima::OFF_COUNTS;
use hapterra_tests::campaign::tick_invariants::{TickChecks, Truth};
use hapterra_tests::random::Random;

const ZERO: [i32; 3] = [100, -200, 300];
/// A pose in the middle of the workspace, rad.
const POSE: [f64; 3] = [0.0, 0.2, 0.3];

/// A valid tick: each change by a test must be reported.
#[derive(Clone)]
struct Tick {
    drive: GuardOutputs,
    sense: GuardInputs,
    truth: Truth,
}

impl Tick {
    /// Returns a tick in which the motors make this force with the true levers of `POSE`.
    fn pushing(force_n: [f64; 3]) -> Self {
        let model = PhantomModel::premium_1_5();
        let counts = counts(&model, POSE);
        Self {
            drive: GuardOutputs {
                currents_a: currents(&model, force_n),
                enabled: true,
                held: Vec3::ZERO,
            },
            sense: GuardInputs {
                counts: std::array::from_fn(|i| counts[i] + ZERO[i]),
                dead_man: true,
                ..GuardInputs::default()
            },
            truth: Truth {
                q_rad: POSE,
                counts,
                winding_c: [30.0; 3],
            },
        }
    }

    fn check(&self) -> (TickChecks, Result<(), String>) {
        let mut watch = TickChecks::new(Calibration::PREMIUM_1_5, PhantomModel::premium_1_5());
        let verdict = watch.check_outputs(&self.drive, &self.sense, ZERO, &self.truth);
        (watch, verdict)
    }

    fn verdict(&self) -> String {
        self.check().1.expect_err("a violation")
    }
}

fn counts(model: &PhantomModel, q: [f64; 3]) -> [i32; 3] {
    std::array::from_fn(|i| Encoder::new(&model.drive[i]).counts(q[i]))
}

fn currents(model: &PhantomModel, force_n: [f64; 3]) -> Vec3 {
    let jacobian = kinematics::jacobian(model, POSE);
    let current = |joint: usize| {
        let torque: f64 = (0..3)
            .map(|axis| jacobian[axis][joint] * force_n[axis])
            .sum();
        let drive = &model.drive[joint];
        (drive.sign * torque / (drive.ratio * drive.motor.kt_nm_per_a)) as f32
    };
    Vec3::new(current(0), current(1), current(2))
}

/// Up and outwards, so that the arm's weight explains none of it, and no motor is at its peak.
const fn up(newtons: f64) -> [f64; 3] {
    [0.6 * newtons, 0.0, 0.8 * newtons]
}

#[test]
fn correct_tick_passes_and_is_measured() {
    let (watch, verdict) = Tick::pushing(up(7.6)).check();
    assert_eq!(verdict, Ok(()));
    let seen = watch.extremes;
    // The reported pose is in whole counts.
    assert!((seen.read_force_n - 7.6).abs() < 0.01, "{seen:?}");
    assert!((seen.tip_force_n - 7.6).abs() < 1e-6, "{seen:?}");
    assert_eq!((seen.misled_ticks, seen.singular_ticks), (0, 0));
}

#[test]
fn each_wrong_current_is_reported() {
    let mut tick = Tick::pushing(up(1.0));
    tick.drive.currents_a.y = f32::NAN;
    assert!(tick.verdict().contains("not a number"));
    let mut tick = Tick::pushing(up(1.0));
    tick.drive.enabled = false;
    assert!(tick.verdict().contains("amplifiers off"));
    let mut tick = Tick::pushing(up(1.0));
    tick.drive.currents_a.z = 5.51;
    assert!(tick.verdict().contains("peak current"));
}

#[test]
fn enabled_amplifiers_with_blocking_input_are_reported() {
    let forge: [fn(&mut GuardInputs); 4] = [
        |sense| sense.dead_man = false,
        |sense| sense.emergency_stop = true,
        |sense| sense.hardware_failed = true,
        |sense| sense.outputs_not_as_set = true,
    ];
    for forge in forge {
        let mut tick = Tick::pushing(up(1.0));
        forge(&mut tick.sense);
        assert!(tick.verdict().contains("amplifiers on with"));
    }
}

#[test]
fn held_outputs_require_permission_and_disabled_amplifiers() {
    let held = |enabled, held, may_hold| {
        let mut tick = Tick::pushing(up(0.0));
        tick.drive = GuardOutputs {
            currents_a: Vec3::ZERO,
            enabled,
            held,
        };
        let mut watch = TickChecks::new(Calibration::PREMIUM_1_5, PhantomModel::premium_1_5());
        watch.may_hold = may_hold;
        watch.check_outputs(&tick.drive, &tick.sense, ZERO, &tick.truth)
    };
    let half = Vec3::splat(0.5);
    assert_eq!(held(false, half, true), Ok(()));
    assert!(held(false, half, false).is_err());
    assert!(held(true, half, true).is_err());
    assert!(held(false, 3.0 * half, true).is_err());
    assert!(held(false, Vec3::splat(f32::NAN), true).is_err());
}

#[test]
fn hot_winding_is_reported() {
    let mut tick = Tick::pushing(up(1.0));
    tick.truth.winding_c[1] = 112.1;
    assert!(tick.verdict().contains("112.1 °C"));
}

#[test]
fn force_above_clamp_at_encoder_pose_is_reported() {
    for off in [0, 100_000] {
        let mut tick = Tick::pushing(up(7.67));
        tick.truth.counts[2] += off;
        assert!(tick.verdict().contains("by the encoders"));
    }
}

#[test]
fn excess_tip_force_is_reported_unless_an_encoder_is_far_off() {
    let mut tick = Tick::pushing(up(7.6));
    let record = Calibration::PREMIUM_1_5;
    // Nearer to the axis than the device computes: the same torque is more force.
    tick.truth.q_rad = [0.0, 0.9, 0.3];
    tick.truth.counts[1] += OFF_COUNTS as i32;
    assert!(tick.verdict().contains("at the tip"));
    tick.truth.counts[1] += 1;
    let (watch, verdict) = tick.check();
    assert_eq!(verdict, Ok(()));
    let seen = watch.extremes;
    assert!(
        seen.misled.force_n > f64::from(record.max_force_n),
        "{seen:?}"
    );
    assert_eq!(seen.misled.off_counts, OFF_COUNTS + 1);
    assert_eq!((seen.misled_ticks, seen.tip_force_n), (1, 0.0));
}

#[test]
fn singular_pose_is_counted_but_not_checked() {
    let mut tick = Tick::pushing(up(7.6));
    tick.truth.q_rad = [0.0, 1.4, 0.2];
    let (watch, verdict) = tick.check();
    assert_eq!(verdict, Ok(()));
    assert_eq!(watch.extremes.singular_ticks, 1);
}

/// While the core is halted no tick reads switches or encoders, but outputs and the true pose
/// count.
#[test]
fn held_command_is_checked_against_the_true_pose() {
    let held = |tick: &Tick| {
        let mut watch = TickChecks::new(Calibration::PREMIUM_1_5, PhantomModel::premium_1_5());
        watch.check_held(&tick.drive, &tick.truth)
    };
    let mut tick = Tick::pushing(up(7.6));
    tick.sense.dead_man = false;
    assert_eq!(held(&tick), Ok(()));
    tick.truth.q_rad = [0.0, 0.9, 0.3];
    assert!(held(&tick).expect_err("much").contains("at the tip"));
    let mut tick = Tick::pushing(up(1.0));
    tick.drive.currents_a.z = 5.51;
    assert!(held(&tick).expect_err("much").contains("peak current"));
    let mut tick = Tick::pushing(up(1.0));
    tick.truth.winding_c[0] = 112.1;
    assert!(held(&tick).expect_err("hot").contains("112.1 °C"));
}

#[test]
fn underestimated_winding_temperature_is_reported() {
    let watch = TickChecks::new(Calibration::PREMIUM_1_5, PhantomModel::premium_1_5());
    let mut tick = Tick::pushing(up(1.0));
    let reported = |believed_c: f32, tick: &Tick| {
        watch.check_temperature(Vec3::new(90.0, 90.0, believed_c), &tick.truth)
    };
    tick.truth.winding_c = [90.0, 30.0, 80.0];
    assert_eq!(reported(100.0, &tick), Ok(()));
    assert_eq!(reported(79.5, &tick), Ok(()));
    // A reset clears it.
    assert!(
        reported(25.0, &tick)
            .expect_err("cold")
            .contains("winding 3")
    );
    assert!(reported(f32::NAN, &tick).is_err());
}

#[test]
fn hostile_calibrations_are_refused_and_most_exceed_limits() {
    assert_eq!(hostile_calibrations::harmless().validate(), Ok(()));
    assert_eq!(
        hostile_calibrations::check_limits(&hostile_calibrations::harmless()),
        Ok(())
    );
    assert_eq!(
        hostile_calibrations::check_limits(&Calibration::PREMIUM_1_5),
        Ok(())
    );
    let mut random = Random::new(7);
    let mut above = 0;
    for _ in 0..2_000 {
        let record = hostile_calibrations::calibration(&mut random);
        assert!(record.validate().is_err(), "{record:?}");
        above += u32::from(hostile_calibrations::check_limits(&record).is_err());
    }
    // Only the device detects the others: a length that is NaN.
    assert!(above > 1_600, "{above}");
}

fn sample(tick: u32, force_n: Vec3) -> TickRecord {
    TickRecord {
        tick,
        mode: Mode::Armed,
        force_n,
        ..TickRecord::default()
    }
}

/// Returns the result for the last of these samples; the others pass.
fn reported(samples: &[TickRecord]) -> Result<(), String> {
    let mut watch = TickChecks::new(Calibration::PREMIUM_1_5, PhantomModel::premium_1_5());
    let (last, before) = samples.split_last().expect("one");
    for sample in before {
        assert_eq!(watch.check_sample(sample, 8.5), Ok(()));
    }
    watch.check_sample(last, 8.5)
}

#[test]
fn each_wrong_force_in_telemetry_is_reported() {
    let push = |newtons: f32| Vec3::Z * newtons;
    assert_eq!(
        reported(&[sample(1, push(7.65)), sample(2, push(6.65))]),
        Ok(())
    );
    // The tick between them was not received.
    assert_eq!(
        reported(&[sample(1, push(7.65)), sample(3, push(1.0))]),
        Ok(())
    );
    let nan = reported(&[sample(1, push(f32::NAN))]).expect_err("no number");
    assert!(nan.contains("not a number"));
    let much = reported(&[sample(1, push(7.66))]).expect_err("much");
    assert!(much.contains("above the clamp"));
    let step = reported(&[sample(1, push(2.0)), sample(2, push(3.01))]).expect_err("a step");
    assert!(step.contains("changed by"));
    let mut disarmed = sample(1, push(0.1));
    disarmed.mode = Mode::Disarmed;
    assert!(
        reported(&[disarmed])
            .expect_err("disarmed")
            .contains("amplifiers off")
    );
    let mut faulted = sample(1, push(0.1));
    faulted.fault = Some(Fault::EncoderJump);
    assert!(
        reported(&[faulted])
            .expect_err("a fault")
            .contains("amplifiers off")
    );
}
