//! Every promise of the guard in the closed loop: the virtual Phantom in a hand, the device's own
//! application, and injected faults between them.

mod host_leaves;
mod rates;
mod rig;

use hapterra::phantom::Script;
use hapterra_core::guard::{Blockers, Fault, Limits, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::status::{BootReport, ResetCause};
use hapterra_firmware::store::Stored;
use std::cell::RefCell;

use rig::{BEGIN, Bed, MIDDLE_MM, NOTHING, PLANE_MM, PRESSED, Wrong, on_plane, plane, press, rub};

/// Safety: 1.
#[test]
fn arming_needs_the_switch_and_ramps_over_two_seconds() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let bed = Bed::new(&terrain, press(1.0).finish(), NOTHING).run(PRESSED + 500);
    bed.check_bounds();
    let log = bed.log.borrow();
    let pressed = log.iter().position(|(sense, _)| sense.dead_man);
    let on = log.iter().position(|(_, drive)| drive.enabled);
    let (pressed, on) = (pressed.expect("pressed"), on.expect("on"));
    // A hundred ticks of a small force after the press.
    assert_eq!(on, pressed + 100);
    let armed = bed.samples.iter().find(|s| s.mode == Mode::Armed);
    let armed = armed.expect("armed").tick as usize;
    assert!((1_999..=2_002).contains(&(armed - on)), "{armed} {on}");
    let ramping = bed.sample(on as u64 + 1_000);
    assert!(ramping.limits.contains(Limits::RAMPING));
    let modes: Vec<Mode> = bed.reports.iter().map(|report| report.mode).collect();
    assert_eq!(modes.last(), Some(&Mode::Armed), "{modes:?}");
    let granted = (Request::Arm, Ok(()));
    assert!(bed.answers.contains(&granted), "{:?}", bed.answers);
    assert!((bed.sample(PRESSED + 400).force_n.z - 1.0).abs() < 0.1);
}

/// Safety: 2.
#[test]
fn switch_held_from_the_start_never_arms() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let held: Wrong = |_, sense| sense.dead_man = true;
    let bed = Bed::new(&terrain, press(1.0).finish(), held).run(PRESSED);
    assert!(bed.log.borrow().iter().all(|(_, drive)| !drive.enabled));
    let last = bed.reports.last().expect("reported");
    assert_eq!(last.blockers, Blockers::DEAD_MAN_STILL_HELD);
}

/// Safety: 3.
#[test]
fn fault_in_contact_zeroes_output_within_tick_and_latches() {
    type Case = (Wrong, Fault);
    let cases: [Case; 5] = [
        (
            |tick, sense| sense.dead_man &= tick != PRESSED,
            Fault::DeadManReleased,
        ),
        (
            |tick, sense| sense.emergency_stop = tick == PRESSED,
            Fault::EmergencyStop,
        ),
        (
            |tick, sense| sense.hardware_failed = tick == PRESSED,
            Fault::Hardware,
        ),
        (
            |tick, sense| sense.counts[2] += if tick == PRESSED { 400 } else { 0 },
            Fault::EncoderJump,
        ),
        // An encoder that restarts from zero.
        (
            |tick, sense| {
                sense.counts[0] = if tick == PRESSED {
                    9_999
                } else {
                    sense.counts[0]
                }
            },
            Fault::EncoderJump,
        ),
    ];
    let raster = plane();
    let terrain = on_plane(&raster);
    for (wrong, fault) in cases {
        let bed = Bed::new(&terrain, press(1.0).finish(), wrong).run(PRESSED + 800);
        bed.check_bounds();
        assert_eq!(bed.off_at(), PRESSED, "{fault:?}");
        let before = bed.sample(PRESSED - 1);
        assert!(
            before.force_n.length() > 0.5,
            "{fault:?}: no force, no test"
        );
        let end = bed.samples.last().expect("samples");
        assert_eq!((end.fault, end.mode), (Some(fault), Mode::Disarmed));
        let report = bed.reports.last().expect("reported");
        assert!(report.blockers.contains(Blockers::FAULT_LATCHED));
    }
}

/// Safety: 5.
#[test]
fn rearming_after_fault_needs_clear_command_and_new_press() {
    let raster = plane();
    let terrain = on_plane(&raster);
    // Released, then held permanently half a second later; pressed again at 6 s.
    let wrong: Wrong = |tick, sense| {
        sense.dead_man &= !(PRESSED..PRESSED + 500).contains(&tick);
        sense.dead_man &= !(5_900..6_000).contains(&tick);
    };
    let script = press(0.1).finish().wait(30.0);
    let mut bed = Bed::new(&terrain, script, wrong).run(PRESSED + 700);
    bed.request(Request::Arm);
    bed = bed.run(PRESSED + 900);
    let refused = Err(Refusal::Blocked(Blockers::FAULT_LATCHED));
    assert_eq!(bed.answers.last().map(|(_, result)| *result), Some(refused));
    let fault = Some(Fault::DeadManReleased);
    bed.request(Request::ClearFault { fault });
    bed.request(Request::Arm);
    bed = bed.run(5_890);
    let report = bed.reports.last().expect("reported");
    assert_eq!(report.blockers, Blockers::DEAD_MAN_STILL_HELD);
    assert!(!bed.log.borrow()[5_880].1.enabled);
    bed = bed.run(8_300);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));
    bed.check_bounds();
}

/// Safety: 8.
#[test]
fn slipping_encoder_trips_the_joint_limits() {
    let raster = plane();
    let terrain = on_plane(&raster);
    // Counts that are lost slowly, without a jump.
    let slip: Wrong = |tick, sense| {
        sense.counts[0] += 15 * tick.saturating_sub(PRESSED) as i32;
    };
    let bed = Bed::new(&terrain, press(1.0).finish(), slip).run(PRESSED + 1_500);
    bed.check_bounds();
    assert_eq!(
        bed.samples.last().and_then(|s| s.fault),
        Some(Fault::JointLimit)
    );
    let slip: Wrong = |tick, sense| {
        sense.counts[1] += 15 * tick.saturating_sub(PRESSED) as i32;
    };
    let bed = Bed::new(&terrain, press(1.0).finish(), slip).run(PRESSED + 1_500);
    assert_eq!(
        bed.samples.last().and_then(|s| s.fault),
        Some(Fault::Linkage)
    );
}

/// Safety: 8, response times.
#[test]
fn dead_encoder_under_load_is_detected() {
    let raster = plane();
    let terrain = on_plane(&raster);
    thread_local! {
        static FROZEN: RefCell<Option<i32>> = const { RefCell::new(None) };
    }
    let freeze: Wrong = |tick, sense| {
        FROZEN.with_borrow_mut(|frozen| {
            if tick < PRESSED {
                *frozen = None;
            } else {
                sense.counts[1] = *frozen.get_or_insert(sense.counts[1]);
            }
        });
    };
    let bed = Bed::new(&terrain, rub(1.2, 6), freeze).run(PRESSED + 14_000);
    bed.check_bounds();
    let found = bed.samples.iter().find(|s| s.fault.is_some());
    let found = found.expect("found");
    eprintln!("found after {} ms", u64::from(found.tick) - PRESSED);
    assert_eq!(found.fault, Some(Fault::NoMotion));
}

#[test]
fn normal_rubbing_and_pressing_trips_no_fault() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let bed = Bed::new(&terrain, rub(1.2, 3), NOTHING).run(PRESSED + 14_000);
    assert!(bed.samples.iter().all(|s| s.fault.is_none()));
    bed.check_bounds();
}

/// Safety: 11.
#[test]
fn motors_that_work_hard_are_derated_and_stay_cool_enough() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let bed = Bed::new(&terrain, rub(5.0, 10), NOTHING).run(PRESSED + 40_000);
    bed.check_bounds();
    let derated = |s: &&TickRecord| s.limits.contains(Limits::THERMAL_DERATED);
    let first = bed.samples.iter().find(derated).expect("derated").tick;
    eprintln!("derated from {first} ms on");
    assert_eq!(bed.samples.last().and_then(|s| s.fault), None);
    // The plant's own, independent thermal model.
    let device = bed.device.borrow();
    let hottest = device.arm().expect("an arm").plant().winding_c();
    assert!(hottest.iter().all(|c| *c < 110.0), "{hottest:?}");
    assert!(hottest.iter().any(|c| *c > 75.0), "{hottest:?}");
}

/// Safety: 9.
#[test]
fn force_drops_for_a_fast_hand_and_ends_for_a_thrown_arm() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let [x, y] = MIDDLE_MM;
    let sweep = |speed: f64| {
        let far = [x + 130.0, y, PLANE_MM + 20.0];
        let near = [x - 130.0, y, PLANE_MM + 20.0];
        Script::start([x, y, PLANE_MM + 20.0])
            .line_to(near, 100.0)
            .line_to(far, speed)
            .line_to(near, speed)
    };
    let bed = Bed::new(&terrain, sweep(1_300.0), NOTHING).run(BEGIN + 3_000);
    bed.check_bounds();
    let limited = |s: &&TickRecord| s.limits.contains(Limits::SPEED_LIMITED);
    assert!(bed.samples.iter().filter(limited).count() > 20);
    assert_eq!(bed.samples.last().and_then(|s| s.fault), None);
    // An encoder that runs away evenly looks like a thrown arm.
    let thrown: Wrong = |tick, sense| {
        sense.counts[0] += 90 * tick.saturating_sub(PRESSED) as i32;
    };
    let bed = Bed::new(&terrain, press(0.5).finish(), thrown).run(PRESSED + 100);
    bed.check_bounds();
    assert_eq!(
        bed.samples.last().and_then(|s| s.fault),
        Some(Fault::TooFast)
    );
    assert!(
        (PRESSED..PRESSED + 30).contains(&bed.off_at()),
        "{}",
        bed.off_at()
    );
}

/// Safety: 40.
#[test]
fn boot_fault_must_be_cleared_before_arming() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let starved = BootReport {
        cause: ResetCause::Watchdog,
        ..BootReport::default()
    };
    let good = Stored::Found(Calibration::PREMIUM_1_5);
    let script = || press(0.1).finish().wait(30.0);
    let held_late: Wrong = |tick, sense| sense.dead_man &= tick > 1_000;
    let mut bed = Bed::started(&terrain, script(), held_late, (good, starved)).run(500);
    let refused = Err(Refusal::Blocked(Blockers::FAULT_LATCHED));
    assert_eq!(bed.answers.last().map(|(_, result)| *result), Some(refused));
    let fault = bed.reports.last().and_then(|r| r.fault);
    assert_eq!(fault, Some(Fault::WatchdogReset));
    let fault = Some(Fault::WatchdogReset);
    bed.request(Request::ClearFault { fault });
    bed.request(Request::Arm);
    bed = bed.run(3_300);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));

    let damaged = (Stored::Damaged, BootReport::default());
    // Pressed once to store the calibration, then again to arm.
    let pressed_twice: Wrong =
        |tick, sense| sense.dead_man &= (1_000..1_300).contains(&tick) || tick > 1_800;
    let mut bed = Bed::started(&terrain, script(), pressed_twice, damaged).run(500);
    let fault = bed.reports.last().and_then(|r| r.fault);
    assert_eq!(fault, Some(Fault::CalibrationCorrupt));
    let fault = Some(Fault::CalibrationCorrupt);
    bed.request(Request::ClearFault { fault });
    bed.request(Request::Arm);
    bed = bed.run(700);
    let refused = Err(Refusal::Blocked(Blockers::NO_CALIBRATION));
    assert_eq!(bed.answers.last().map(|(_, result)| *result), Some(refused));
    bed.request(Request::SetCalibration {
        calibration: Calibration::PREMIUM_1_5,
    });
    bed.request(Request::StoreCalibration);
    bed = bed.run(1_500);
    bed.request(Request::Arm);
    bed = bed.run(4_200);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));
    assert_eq!(*bed.device.borrow().memory(), good);
}
