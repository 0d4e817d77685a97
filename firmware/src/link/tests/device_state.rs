//! Arming, calibration and status, as a host sees them.

use hapterra_core::guard::{Blockers, Fault, Mode};
use hapterra_core::phantom::{Calibration, CalibrationField, Model};
use hapterra_core::scene::Source;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::status::{
    BootReport, CalibrationSource, Crash, CrashKind, Refusal, Request, ResetCause,
};

use super::rig::{Rig, scene};
use crate::link::tx_queue::{LONGEST_URGENT, TxQueue};
use crate::store::Stored;

fn set(calibration: Calibration, store: bool) -> ToDevice<'static> {
    ToDevice::SetCalibration { calibration, store }
}

#[test]
fn armed_step_by_step_and_told_of_each() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(10);
    let report = rig.report().expect("told");
    assert_eq!(report.mode, Mode::Disarmed);
    assert!(report.blockers.contains(Blockers::NOT_ZEROED));
    rig.arm();
    assert_eq!(rig.answers(Request::Zero), [Ok(())]);
    assert_eq!(rig.answers(Request::Arm), [Ok(())]);
    let guard = |m: &ToHost| match m {
        ToHost::Guard(report) => Some(report.mode),
        _ => None,
    };
    let mut modes: std::vec::Vec<Mode> = rig.heard.iter().filter_map(guard).collect();
    modes.dedup();
    let way = [
        Mode::Disarmed,
        Mode::Requested,
        Mode::Confirming,
        Mode::Ramping,
        Mode::Armed,
    ];
    assert_eq!(modes, way);
    assert_eq!(rig.report().map(|r| r.blockers), Some(Blockers::empty()));
    assert!(rig.device.tick(rig.sense).enabled);
}

#[test]
fn an_arm_command_that_cannot_be_obeyed_is_refused_by_name() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(10);
    rig.say(&ToDevice::Arm);
    rig.run(100);
    let refused = Err(Refusal::Blocked(Blockers::NOT_ZEROED));
    assert_eq!(rig.answers(Request::Arm), [refused]);
    rig.say(&ToDevice::DropScene);
    rig.say(&ToDevice::Zero { counts: [0; 3] });
    rig.say(&ToDevice::Arm);
    rig.run(100);
    let refused = Err(Refusal::Blocked(Blockers::NO_SCENE));
    assert_eq!(rig.answers(Request::Arm)[1..], [refused]);
    assert_eq!(rig.answers(Request::DropScene), [Ok(())]);
}

#[test]
fn a_fault_is_latched_reported_and_cleared_on_request() {
    let mut rig = Rig::armed();
    rig.sense.counts = [5000, 0, 0];
    rig.run(20);
    let fault = |rig: &Rig| rig.telemetry().last().unwrap().samples[7].fault;
    assert_eq!(fault(&rig), Some(Fault::EncoderJump));
    assert_eq!(rig.report().and_then(|r| r.fault), Some(Fault::EncoderJump));
    assert!(!rig.device.tick(rig.sense).enabled);
    rig.sense.counts = [0; 3];
    rig.say(&ToDevice::ClearFault);
    rig.run(30);
    assert_eq!(fault(&rig), None);
    assert_eq!(rig.answers(Request::ClearFault), [Ok(())]);
    assert!(!rig.device.tick(rig.sense).enabled, "but it stays off");
    rig.arm();
}

#[test]
fn settings_do_not_change_while_armed() {
    let mut rig = Rig::armed();
    rig.say(&set(Calibration::PREMIUM_3_0, true));
    rig.say(&ToDevice::Zero { counts: [5; 3] });
    rig.run(5);
    let refused = Err(Refusal::NotWhileArmed);
    assert_eq!(rig.answers(Request::SetCalibration), [refused]);
    assert_eq!(rig.answers(Request::Zero)[1..], [refused]);
    assert!(rig.device.tick(rig.sense).enabled);
    assert_eq!(rig.status().model, Some(Model::Premium15));
}

#[test]
fn a_calibration_is_checked_put_in_force_and_stored() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(5);
    assert_eq!(rig.status().calibration, CalibrationSource::Stored);
    let bad = Calibration {
        l1_mm: -1.0,
        ..Calibration::PREMIUM_3_0
    };
    rig.say(&set(bad, true));
    rig.run(5);
    let [Err(Refusal::Calibration(why))] = rig.answers(Request::SetCalibration)[..] else {
        panic!("{:?}", rig.answers(Request::SetCalibration));
    };
    assert_eq!(why.field, CalibrationField::L1);
    assert_eq!(rig.status().model, Some(Model::Premium15), "as before");

    rig.say(&set(Calibration::PREMIUM_3_0, false));
    rig.run(5);
    let status = rig.status();
    assert_eq!(status.calibration, CalibrationSource::Session);
    assert_eq!(status.model, Some(Model::Premium30));
    let stored = Stored::Found(Calibration::PREMIUM_1_5);
    assert_eq!(*rig.device.memory(), stored);

    rig.say(&set(Calibration::PREMIUM_3_0, true));
    rig.run(5);
    assert_eq!(rig.answers(Request::StoreCalibration), [Ok(())]);
    assert_eq!(rig.status().calibration, CalibrationSource::Stored);
    let stored = Stored::Found(Calibration::PREMIUM_3_0);
    assert_eq!(*rig.device.memory(), stored);
    rig.say(&ToDevice::GetCalibration);
    rig.run(1);
    let got = ToHost::Calibration(Some(Calibration::PREMIUM_3_0));
    assert!(rig.heard.contains(&got));
}

#[test]
fn what_was_found_at_boot_is_told_and_blocks() {
    let crash = Crash {
        kind: CrashKind::Panic,
        pc: 0,
        lr: 0,
        status: 0,
        line: 42,
        tick: 1_000,
        file: "session.rs".try_into().expect("fits"),
    };
    let boot = BootReport {
        cause: ResetCause::Watchdog,
        crash: Some(crash),
    };
    let found = [
        (
            Stored::Found(Calibration::PREMIUM_1_5),
            boot.clone(),
            Fault::Panicked,
        ),
        (
            Stored::Damaged,
            BootReport::default(),
            Fault::CalibrationCorrupt,
        ),
    ];
    for (stored, boot, fault) in found {
        let mut rig = Rig::started(stored, boot.clone());
        rig.say(&ToDevice::Hello(super::rig::HELLO));
        rig.say(&ToDevice::Scene(scene(Source::Encoders)));
        rig.run(5);
        let status = rig.status();
        assert_eq!(status.boot, boot);
        assert_eq!(status.health.report.fault, Some(fault));
        assert!(
            status
                .health
                .report
                .blockers
                .contains(Blockers::FAULT_LATCHED)
        );
        let calibrated = stored != Stored::Damaged;
        assert_eq!(status.calibration == CalibrationSource::Stored, calibrated);
    }
}

#[test]
fn goodbye_lets_the_force_go_out_and_drops_the_scene() {
    let mut rig = Rig::armed();
    rig.say(&ToDevice::Bye);
    rig.run(1);
    assert!(!rig.device.link.has_ended(), "force is going out");
    let mut ticks = 0;
    while rig.device.tick(rig.sense).enabled {
        ticks += 1;
    }
    assert!((90..=101).contains(&ticks), "{ticks}");
    rig.run(20);
    assert!(rig.device.link.has_ended());
    rig.say(&ToDevice::Hello(super::rig::HELLO));
    rig.heard.clear();
    rig.run(2);
    let ToHost::Hello(hello) = &rig.heard[0] else {
        panic!("{:?}", rig.heard[0]);
    };
    assert_eq!(hello.epoch, None, "it holds nothing any more");
}

#[test]
fn while_force_goes_out_time_does_not_stand_still() {
    let mut rig = Rig::armed();
    rig.say(&ToDevice::DropScene);
    let mut ticks = 0;
    loop {
        rig.run(1);
        if rig.device.link.may_stand_still() {
            break;
        }
        ticks += 1;
        assert!(ticks < 200, "for ever");
    }
    assert!(ticks > 90, "{ticks}");
    rig.run(1);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
}

#[test]
fn a_link_that_hangs_is_seen_by_the_tick_within_forty_milliseconds() {
    let mut rig = Rig::armed();
    let sense = rig.sense;
    let ticks = (0..1_000).take_while(|_| rig.device.tick_alone(sense).enabled);
    let ticks = ticks.count();
    assert!((38..=41).contains(&ticks), "{ticks}");
    rig.run(3);
    assert_eq!(rig.report().and_then(|r| r.fault), Some(Fault::TaskStalled));
}

#[test]
fn the_status_at_its_longest_fits_its_place() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.sense.counts = [i32::MIN; 3];
    rig.run(200);
    let mut status = rig.status();
    let longest = "x".repeat(32);
    status.device.board = longest.as_str().try_into().expect("fits");
    status.device.version = status.device.board.clone();
    status.device.clock_hz = u32::MAX;
    status.device.epoch = Some(u32::MAX);
    status.boot.crash = Some(Crash {
        kind: CrashKind::HardFault,
        pc: u32::MAX,
        lr: u32::MAX,
        status: u32::MAX,
        line: u32::MAX,
        tick: u32::MAX,
        file: "x".repeat(24).as_str().try_into().expect("fits"),
    });
    status.health.zero = Some([i32::MIN; 3]);
    status.health.report.blockers = Blockers::all();
    status.health.report.decision.refused = Blockers::all();
    status.ticks.run = u32::MAX;
    status.ticks.cost = u32::MAX;
    status.ticks.worst_cost = u32::MAX;
    status.ticks.late = u32::MAX;
    status.stack.size = u32::MAX;
    status.stack.high_water = u32::MAX;
    status.bad_frames = u32::MAX;
    status.dropped = u32::MAX;
    for message in [
        ToHost::Status(status),
        ToHost::Calibration(Some(Calibration::PREMIUM_3_0)),
    ] {
        let mut queue = TxQueue::new();
        assert!(queue.push(&message));
        let length = queue.take(&mut [0; 4096]);
        std::eprintln!("{length} bytes");
        assert!(length <= LONGEST_URGENT, "{length}");
    }
}
