//! Arming, calibration and status, as a host receives them.

use hapterra_core::guard::{Blockers, Fault, Mode};
use hapterra_core::phantom::{Bound, Calibration, CalibrationError, CalibrationField, Model};
use hapterra_core::scene::Source;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::session::{SampleCount, SessionEnd};
use hapterra_core::wire::status::{BootReport, CalibrationSource, Crash, CrashKind, ResetCause};

use super::rig::{Rig, scene};
use crate::link::tx_queue::{MAX_URGENT, TxQueue};
use crate::store::Stored;

fn set(calibration: Calibration) -> Request {
    Request::SetCalibration { calibration }
}

const TO_SET: fn(&Request) -> bool = |r| matches!(r, Request::SetCalibration { .. });
const TO_STORE: fn(&Request) -> bool = |r| matches!(r, Request::StoreCalibration);
const TO_ZERO: fn(&Request) -> bool = |r| matches!(r, Request::Zero { .. });
const TO_ARM: fn(&Request) -> bool = |r| matches!(r, Request::Arm);

#[test]
fn arming_reports_each_mode_from_disarmed_to_armed() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(10);
    let report = rig.report().expect("reported");
    assert_eq!(report.mode, Mode::Disarmed);
    assert!(report.blockers.contains(Blockers::NOT_ZEROED));
    rig.arm();
    assert_eq!(rig.answers(TO_ZERO), [Ok(())]);
    assert_eq!(rig.answers(TO_ARM), [Ok(())]);
    let guard = |m: &ToHost| match m {
        ToHost::Guard(report) => Some(report.mode),
        _ => None,
    };
    let mut modes: std::vec::Vec<Mode> = rig.received.iter().filter_map(guard).collect();
    modes.dedup();
    let modes_seen = [
        Mode::Disarmed,
        Mode::Requested,
        Mode::Confirming,
        Mode::Ramping,
        Mode::Armed,
    ];
    assert_eq!(modes, modes_seen);
    assert_eq!(rig.report().map(|r| r.blockers), Some(Blockers::empty()));
    assert!(rig.device.tick(rig.sense).enabled);
}

#[test]
fn impossible_arm_request_is_refused_with_its_reason() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(10);
    rig.request(Request::Arm);
    rig.run(100);
    let refused = Err(Refusal::Blocked(Blockers::NOT_ZEROED));
    assert_eq!(rig.answers(TO_ARM), [refused]);
    rig.request(Request::DropScene);
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::Arm);
    rig.run(100);
    let refused = Err(Refusal::Blocked(Blockers::NO_SCENE));
    assert_eq!(rig.answers(TO_ARM)[1..], [refused]);
    assert_eq!(rig.answers(|r| matches!(r, Request::DropScene)), [Ok(())]);
}

/// Safety: 5.
#[test]
fn fault_is_latched_reported_and_cleared_on_request() {
    let mut rig = Rig::armed();
    rig.sense.counts = [5000, 0, 0];
    rig.run(20);
    let fault = |rig: &Rig| rig.telemetry().last().unwrap().samples[7].fault;
    assert_eq!(fault(&rig), Some(Fault::EncoderJump));
    assert_eq!(rig.report().and_then(|r| r.fault), Some(Fault::EncoderJump));
    assert!(!rig.device.tick(rig.sense).enabled);
    rig.sense.counts = [0; 3];
    // Another fault, or none, was reported: this one stays.
    for acknowledged in [None, Some(Fault::Hardware)] {
        rig.request(Request::ClearFault {
            fault: acknowledged,
        });
        rig.run(30);
        assert_eq!(fault(&rig), Some(Fault::EncoderJump));
    }
    let acknowledged = Some(Fault::EncoderJump);
    rig.request(Request::ClearFault {
        fault: acknowledged,
    });
    rig.run(30);
    assert_eq!(fault(&rig), None);
    let refused = Err(Refusal::Blocked(Blockers::FAULT_LATCHED));
    let answers = rig.answers(|r| matches!(r, Request::ClearFault { .. }));
    assert_eq!(answers, [refused, refused, Ok(())]);
    assert!(!rig.device.tick(rig.sense).enabled, "but it stays off");
    rig.arm();
}

/// Safety: 33.
#[test]
fn settings_do_not_change_while_armed() {
    let mut rig = Rig::armed();
    rig.request(set(Calibration::PREMIUM_3_0));
    rig.request(Request::StoreCalibration);
    rig.request(Request::Zero { counts: [5; 3] });
    rig.run(5);
    let refused = Err(Refusal::NotWhileArmed);
    assert_eq!(rig.answers(TO_SET), [refused]);
    assert_eq!(rig.answers(TO_STORE), [refused]);
    assert_eq!(rig.answers(TO_ZERO)[1..], [refused]);
    assert!(rig.device.tick(rig.sense).enabled);
    assert_eq!(rig.status().model, Some(Model::Premium15));
}

#[test]
fn calibration_is_checked_applied_and_stored() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(5);
    assert_eq!(rig.status().calibration, CalibrationSource::Stored);
    let bad = Calibration {
        l1_mm: -1.0,
        ..Calibration::PREMIUM_3_0
    };
    rig.request(set(bad));
    rig.run(5);
    let [Err(Refusal::Calibration(why))] = rig.answers(TO_SET)[..] else {
        panic!("{:?}", rig.answers(TO_SET));
    };
    assert_eq!(why.field, CalibrationField::L1);
    assert_eq!(rig.status().model, Some(Model::Premium15), "as before");

    rig.request(set(Calibration::PREMIUM_3_0));
    rig.run(5);
    let status = rig.status();
    assert_eq!(status.calibration, CalibrationSource::Session);
    assert_eq!(status.model, Some(Model::Premium30));
    let stored = Stored::Found(Calibration::PREMIUM_1_5);
    assert_eq!(*rig.device.memory(), stored);

    rig.request(Request::StoreCalibration);
    rig.press();
    assert_eq!(rig.answers(TO_STORE), [Ok(())]);
    assert_eq!(rig.status().calibration, CalibrationSource::Stored);
    let stored = Stored::Found(Calibration::PREMIUM_3_0);
    assert_eq!(*rig.device.memory(), stored);
    for number in [7, 255, 0] {
        rig.send_message(&ToDevice::GetCalibration { number });
        rig.run(1);
        let got = ToHost::Calibration {
            number,
            calibration: Some(Calibration::PREMIUM_3_0),
        };
        assert!(rig.received.contains(&got), "{:?}", rig.received.last());
    }
}

/// Safety: 18, images.
#[test]
fn calibration_store_times_out_without_deadman_press() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    let before = Stored::Found(Calibration::PREMIUM_1_5);
    rig.request(set(Calibration::PREMIUM_3_0));
    rig.request(Request::StoreCalibration);
    for _ in 0..9 {
        rig.run(1_100);
        rig.send_message(&ToDevice::Heartbeat);
    }
    assert_eq!(rig.answers(TO_STORE), [], "it may be slow");
    rig.run(400);
    let refused = Err(Refusal::NotPressed);
    assert_eq!(rig.answers(TO_STORE), [refused]);
    rig.press();
    assert_eq!(*rig.device.memory(), before);
    assert_eq!(rig.status().calibration, CalibrationSource::Session);
}

#[test]
fn calibration_change_is_refused_while_store_awaits_press() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::StoreCalibration);
    rig.request(set(Calibration::PREMIUM_1_0));
    rig.run(5);
    assert_eq!(rig.answers(TO_SET), [Err(Refusal::Busy)]);
}

/// Safety: 18.
#[test]
fn press_for_another_host_or_to_arm_stores_nothing() {
    let before = Stored::Found(Calibration::PREMIUM_1_5);
    let others: [fn(&mut Rig); 3] = [
        Rig::open_new_session,
        |rig| rig.send_message(&ToDevice::Bye),
        |rig| rig.request(Request::Arm),
    ];
    for (index, other) in others.into_iter().enumerate() {
        let mut rig = Rig::in_scene(scene(Source::Encoders));
        rig.request(Request::Zero { counts: [0; 3] });
        rig.request(set(Calibration::PREMIUM_3_0));
        rig.request(Request::StoreCalibration);
        rig.run(200);
        other(&mut rig);
        rig.run(20);
        rig.press();
        assert_eq!(*rig.device.memory(), before, "{index}");
    }
}

#[test]
fn clock_does_not_stop_while_a_press_is_awaited() {
    let mut rig = Rig::new();
    rig.send_message(&ToDevice::Hello(super::rig::HELLO));
    rig.request(set(Calibration::PREMIUM_3_0));
    rig.request(Request::StoreCalibration);
    rig.run(10);
    assert!(!rig.device.link.may_stop_clock());
    rig.run(10_200);
    assert!(rig.device.link.may_stop_clock());
}

/// A record's limits do not justify its own values: each value is refused by name when the record
/// is set and when it is found at the start.
///
/// Safety: 18.
#[test]
fn record_above_absolute_limit_is_refused_and_raises_fault() {
    type Case = (fn(&mut Calibration), CalibrationField);
    let hostile: [Case; 3] = [
        (
            |c| c.continuous_current_a.x = 5.0,
            CalibrationField::ContinuousCurrent,
        ),
        (
            |c| c.thermal.housing_k_per_w = 0.1,
            CalibrationField::HousingResistance,
        ),
        (|c| c.max_force_n = 40.0, CalibrationField::MaxForce),
    ];
    for (raise, field) in hostile {
        let mut record = Calibration::PREMIUM_1_5;
        raise(&mut record);
        let mut rig = Rig::in_scene(scene(Source::Encoders));
        rig.request(set(record));
        rig.request(Request::StoreCalibration);
        rig.press();
        let [Err(Refusal::Calibration(why))] = rig.answers(TO_SET)[..] else {
            panic!("{:?}", rig.answers(TO_SET));
        };
        assert_eq!(why.field, field);
        assert_eq!(
            *rig.device.memory(),
            Stored::Found(Calibration::PREMIUM_1_5)
        );

        // The same, as an older firmware may have stored it.
        for stored in [Stored::Found(record), Stored::Refused(why)] {
            let mut rig = Rig::started(stored, BootReport::default());
            rig.send_message(&ToDevice::Hello(super::rig::HELLO));
            rig.send_message(&ToDevice::Scene(scene(Source::Encoders)));
            rig.run(5);
            let status = rig.status();
            assert_eq!(status.calibration, CalibrationSource::Refused(why));
            assert_eq!(status.model, None);
            let fault = status.health.report.fault;
            assert_eq!(fault, Some(Fault::CalibrationCorrupt));
        }
    }
}

#[test]
fn boot_faults_are_reported_and_block_arming() {
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
        ..BootReport::default()
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
        rig.send_message(&ToDevice::Hello(super::rig::HELLO));
        rig.send_message(&ToDevice::Scene(scene(Source::Encoders)));
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
fn close_is_confirmed_after_force_fade_and_scene_drop() {
    let mut rig = Rig::armed();
    rig.send_message(&ToDevice::Bye);
    let answered = |rig: &Rig| rig.received.iter().any(|m| matches!(m, ToHost::Goodbye(_)));
    let (mut ticks, mut on) = (0, 0);
    while !answered(&rig) {
        rig.run(1);
        ticks += 1;
        on += u32::from(rig.report().is_some_and(|r| r.mode.is_driving()));
        assert!(ticks < 400, "time-out of the test");
    }
    assert!((90..=102).contains(&on), "{on}");
    assert!((on..on + 105).contains(&ticks), "{ticks}");
    assert!(!rig.device.tick(rig.sense).enabled);
    assert!(!rig.device.link.has_ended(), "the host may have missed it");
    rig.send_message(&ToDevice::Close);
    rig.run(1);
    assert!(rig.device.link.has_ended());
    rig.received.clear();
    rig.open_new_session();
    rig.run(2);
    let ToHost::Hello(hello) = &rig.received[0] else {
        panic!("{:?}", rig.received[0]);
    };
    assert_eq!(hello.epoch, None, "it no longer stores a scene");
    assert_eq!(hello.last.end, SessionEnd::Goodbye);
}

#[test]
fn clock_keeps_running_while_force_fades_out() {
    let mut rig = Rig::armed();
    rig.request(Request::DropScene);
    let mut ticks = 0;
    loop {
        rig.run(1);
        if rig.device.link.may_stop_clock() {
            break;
        }
        ticks += 1;
        assert!(ticks < 200, "time-out of the test");
    }
    assert!(ticks > 90, "{ticks}");
    rig.run(1);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
}

/// Safety: 39.
#[test]
fn stalled_link_task_disables_output_within_forty_ms() {
    let mut rig = Rig::armed();
    let sense = rig.sense;
    let ticks = (0..1_000).take_while(|_| rig.device.tick_alone(sense).enabled);
    let ticks = ticks.count();
    assert!((38..=41).contains(&ticks), "{ticks}");
    rig.run(3);
    assert_eq!(rig.report().and_then(|r| r.fault), Some(Fault::TaskStalled));
}

#[test]
fn longest_status_fits_its_buffer() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.sense.counts = [i32::MIN; 3];
    rig.run(200);
    let mut status = rig.status();
    let longest = "x".repeat(32);
    status.device.board = longest.as_str().try_into().expect("fits");
    status.device.version = status.device.board.clone();
    status.device.clock_hz = u32::MAX;
    status.device.epoch = Some(u32::MAX);
    status.device.last.session = u32::MAX;
    status.device.last.count = SampleCount {
        sent: u32::MAX,
        dropped: u32::MAX,
    };
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
    status.calibration = CalibrationSource::Refused(CalibrationError {
        field: CalibrationField::MaxSpeed,
        axis: Some(3),
        value: 1.0,
        bound: Bound::Model {
            model: Model::Other,
            min: 1.0,
            max: 1.0,
        },
    });
    status.health.report.blockers = Blockers::all();
    status.health.report.decision.refused = Blockers::all();
    status.ticks.run = u32::MAX;
    status.ticks.cost = u32::MAX;
    status.ticks.worst_cost = u32::MAX;
    status.ticks.late = u32::MAX;
    status.stack.size = u32::MAX;
    status.stack.high_water = u32::MAX;
    status.bad_frames = u32::MAX;
    status.foreign_frames = u32::MAX;
    status.dropped = u32::MAX;
    let number = u8::MAX;
    let calibration = Some(Calibration::PREMIUM_3_0);
    for message in [
        ToHost::Status { number, status },
        ToHost::Calibration {
            number,
            calibration,
        },
    ] {
        let mut queue = TxQueue::new();
        assert!(queue.push(super::rig::FIRST, &message));
        let length = queue.take(&mut [0; 4096]);
        std::eprintln!("{length} bytes");
        assert!(length <= MAX_URGENT, "{length}");
    }
}
