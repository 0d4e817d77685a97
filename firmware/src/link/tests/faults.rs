//! Sessions with injected faults.

use std::collections::HashSet;
use std::vec;
use std::vec::Vec;

use hapterra_core::guard::Mode;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::terrain::RETRY_TICKS;
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL};
use hapterra_core::wire::message::{BATCH, Heights, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::session::{READ_ONLY_SILENCE_S, SessionEnd, SessionNumber};
use hapterra_core::wire::version::VersionCheck;

use super::rig::{FIRST, HELLO, Rig, frame, framed, point, scene, tile, version_query};

/// Returns the forces of a descent's points, without ticks and costs.
fn forces(rendered: &[(u32, TickRecord)]) -> Vec<(u32, hapterra_core::Vec3)> {
    rendered.iter().map(|(seq, s)| (*seq, s.force_n)).collect()
}

fn undisturbed() -> Vec<(u32, hapterra_core::Vec3)> {
    forces(&Rig::in_scene(scene(Source::Points)).descend(40))
}

#[test]
fn other_protocol_is_refused_with_device_protocol_number() {
    let mut rig = Rig::new();
    // A host of protocol 3 sends its open message and continues in its own protocol.
    rig.send(&version_query(3));
    rig.send(&[1, 7, 0, 0]);
    rig.run(3);
    assert_eq!(rig.received, []);
    let refused = VersionCheck::Refused { protocol: PROTOCOL };
    assert_eq!(rig.refused, [refused]);
    // A later host also sends the query, whatever its open message is.
    rig.send(&version_query(PROTOCOL + 1));
    rig.send_message(&ToDevice::Hello(HostHello {
        protocol: PROTOCOL + 1,
        ..HELLO
    }));
    rig.run(1);
    assert_eq!((rig.refused.len(), rig.received.len()), (3, 0));
    rig.send(&version_query(PROTOCOL));
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(1);
    assert!(matches!(rig.received[0], ToHost::Hello(_)));
    assert_eq!(rig.refused.len(), 3, "the hello is the answer");
}

#[test]
fn host_of_another_protocol_does_not_end_a_session() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.send(&version_query(3));
    assert_eq!(forces(&rig.descend(40)), undisturbed());
    assert_eq!(rig.refused.len(), 1);
}

/// Safety: 32.
#[test]
fn messages_of_another_session_are_ignored() {
    let mut rig = Rig::armed();
    let other = SessionNumber::new(rig.session.get() + 1);
    let drop = ToDevice::Request {
        number: 9,
        request: Request::Disarm,
    };
    for message in [
        drop,
        ToDevice::Bye,
        ToDevice::Scene(Scene {
            epoch: 8,
            ..scene(Source::Encoders)
        }),
    ] {
        rig.send(&framed(other, &message));
    }
    rig.run(300);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Armed));
    assert_eq!(rig.status().foreign_frames, 3);
}

#[test]
fn repeated_hello_changes_nothing() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(100);
    for _ in 0..5 {
        rig.send_message(&ToDevice::Hello(HELLO));
        rig.run(33);
    }
    rig.request(Request::Disarm);
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(30);
    let mut next = 0;
    for telemetry in rig.telemetry() {
        assert_eq!((telemetry.first, telemetry.dropped), (next, 0));
        next += telemetry.samples.len() as u32;
    }
    assert!(next > 250, "{next}");
    // The request was done once before the open message and is answered after it.
    rig.number -= 1;
    rig.request(Request::Disarm);
    rig.run(1);
    assert_eq!(rig.answers(|r| matches!(r, Request::Disarm)), [Ok(()); 2]);
}

/// Safety: 32.
#[test]
fn open_of_previous_session_is_answered_as_replaced() {
    let mut rig = Rig::armed();
    let first = rig.session;
    rig.open_new_session();
    rig.run(20);
    let received = rig.received.len();
    for number in [7, 7, 8] {
        rig.send(&framed(
            first,
            &ToDevice::Hello(HostHello { number, ..HELLO }),
        ));
        // Its other messages are not answered.
        for message in [
            ToDevice::Heartbeat,
            ToDevice::Status { number },
            ToDevice::Detach,
            ToDevice::Bye,
        ] {
            rig.send(&framed(first, &message));
        }
    }
    rig.run(300);
    let end = SessionEnd::Replaced;
    let closed = [7, 7, 8].map(|number| (first, ToHost::SessionClosed { number, end }));
    assert_eq!(rig.received_before, closed);
    let telemetry = |m: &&ToHost| matches!(m, ToHost::Telemetry(_) | ToHost::TileRequest { .. });
    let of_the_present = &rig.received[received..];
    assert!(of_the_present.iter().all(|m| telemetry(&m)));
    assert_eq!(rig.status().foreign_frames, 15);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Armed));
}

/// Safety: 25.
#[test]
fn session_closed_answers_silent_host_but_not_departed_host() {
    let mut rig = Rig::armed();
    let hello = HostHello {
        silence_s: 5,
        ..HELLO
    };
    rig.send_message(&ToDevice::Hello(hello));
    rig.run(5_200);
    let closed = |rig: &mut Rig, number| {
        rig.received_before.clear();
        rig.send_message(&ToDevice::Hello(HostHello { number, ..HELLO }));
        rig.run(1);
        rig.received_before.clone()
    };
    let end = SessionEnd::HostSilent;
    let reported = (rig.session, ToHost::SessionClosed { number: 3, end });
    assert_eq!(closed(&mut rig, 3), [reported]);
    // A leaving host needs only the answer to its close.
    rig.send_message(&ToDevice::Bye);
    assert_eq!(closed(&mut rig, 4), []);
    rig.run(250);
    assert!(matches!(rig.received.last(), Some(ToHost::Goodbye(_))));
    assert_eq!(closed(&mut rig, 5), []);
    rig.send_message(&ToDevice::Close);
    assert_eq!(closed(&mut rig, 6), []);
    let mut rig = Rig::armed();
    rig.send_message(&ToDevice::Detach);
    assert_eq!(closed(&mut rig, 7), []);
}

/// Safety: 32.
#[test]
fn duplicate_request_is_executed_once() {
    let mut rig = Rig::armed();
    rig.request(Request::Disarm);
    let disarm = rig.number;
    rig.run(200);
    rig.arm();
    // A duplicate of an earlier request arrives late.
    let request = Request::Disarm;
    rig.send_message(&ToDevice::Request {
        number: disarm,
        request,
    });
    rig.run(200);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Armed));
    // The last one, whose answer was lost, is answered again and not done again.
    let arms = |rig: &Rig| rig.answers(|r| matches!(r, Request::Arm)).len();
    let before = arms(&rig);
    let (number, request) = (rig.number, Request::Arm);
    rig.send_message(&ToDevice::Request { number, request });
    rig.run(1);
    assert_eq!(arms(&rig), before + 1);
}

#[test]
fn numbers_of_requests_wrap_around() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    for _ in 0..600 {
        rig.request(Request::ClearFault { fault: None });
        rig.run(1);
    }
    let answers = |m: &&ToHost| matches!(m, ToHost::Answer(_));
    assert_eq!(rig.received.iter().filter(answers).count(), 600);
}

/// Safety: 25, response times.
#[test]
fn host_silence_disarms_after_host_time_out() {
    let mut rig = Rig::armed();
    let hello = HostHello {
        silence_s: 7,
        ..HELLO
    };
    rig.send_message(&ToDevice::Hello(hello));
    rig.run(1);
    for _ in 0..6_900 {
        assert!(rig.device.tick(rig.sense).enabled, "rendering continues");
    }
    // A frame of this session restarts the host's time-out.
    rig.send_message(&ToDevice::Heartbeat);
    rig.run(1);
    let on = (0..20_000).take_while(|_| rig.device.tick(rig.sense).enabled);
    let on = on.count();
    assert!(
        (7_000..7_110).contains(&on),
        "{on}: seven seconds, and to fade out"
    );
    rig.received.clear();
    rig.open_new_session();
    rig.run(5);
    let ToHost::Hello(device) = &rig.received[0] else {
        panic!("{:?}", rig.received[0]);
    };
    assert_eq!(device.last.end, SessionEnd::HostSilent);
    assert_eq!(device.epoch, Some(7), "and it stores the scene");
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
}

/// Safety: 32.
#[test]
fn read_only_host_opens_no_session_and_keeps_none_armed() {
    let mut rig = Rig::armed();
    rig.send_message(&ToDevice::Hello(HostHello {
        silence_s: 5,
        ..HELLO
    }));
    rig.run(1);
    let read_only_session = SessionNumber::new(99 << 8);
    (rig.read_only_session, rig.answers_tiles) = (Some(read_only_session), false);
    let read_only_hello = HostHello {
        silence_s: READ_ONLY_SILENCE_S,
        ..HELLO
    };
    for second in 0..6 {
        rig.send(&framed(
            read_only_session,
            &ToDevice::Hello(read_only_hello),
        ));
        for message in [
            ToDevice::Status { number: 0 },
            ToDevice::GetCalibration { number: 0 },
            ToDevice::Heartbeat,
        ] {
            rig.send(&framed(read_only_session, &message));
        }
        rig.run(999);
        let on = rig.device.tick(rig.sense).enabled;
        assert_eq!(on, second < 5, "second {second}");
    }
    let answers = rig.read_only_answers.iter().map(|message| match message {
        ToHost::Hello(_) => 'h',
        ToHost::Status { .. } => 's',
        ToHost::Calibration { .. } => 'c',
        _ => '?',
    });
    assert_eq!(answers.collect::<std::string::String>(), "hsc".repeat(6));
    // It requests nothing, and the session before is the one that was left.
    rig.send(&framed(read_only_session, &ToDevice::Bye));
    rig.received.clear();
    rig.open_new_session();
    rig.run(5);
    let ToHost::Hello(device) = &rig.received[0] else {
        panic!("{:?}", rig.received[0]);
    };
    assert_eq!(device.last.session, FIRST.get());
    assert_eq!(device.last.end, SessionEnd::HostSilent);
}

#[test]
fn host_silence_time_is_clamped() {
    for (named, min, max) in [(0, 5_000, 5_110), (1, 5_000, 5_110)] {
        let mut rig = Rig::armed();
        rig.send_message(&ToDevice::Hello(HostHello {
            silence_s: named,
            ..HELLO
        }));
        rig.run(1);
        let on = (0..20_000).take_while(|_| rig.device.tick(rig.sense).enabled);
        let on = on.count();
        assert!((min..max).contains(&on), "{on}");
    }
}

#[test]
fn heartbeats_keep_session_armed() {
    let mut rig = Rig::armed();
    rig.send_message(&ToDevice::Hello(HostHello {
        silence_s: 5,
        ..HELLO
    }));
    for _ in 0..40 {
        rig.send_message(&ToDevice::Heartbeat);
        rig.run(500);
    }
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Armed));
}

/// Returns the answer that a new host receives to its open message.
fn opened_by_new_host(rig: &mut Rig) -> DeviceHello {
    rig.received.clear();
    rig.open_new_session();
    rig.run(5);
    match &rig.received[0] {
        ToHost::Hello(device) => device.clone(),
        other => panic!("{other:?}"),
    }
}

/// Opens and detaches a session without any request.
fn open_and_detach(rig: &mut Rig, silence_s: u16) {
    rig.open_new_session();
    rig.send_message(&ToDevice::Hello(HostHello { silence_s, ..HELLO }));
    rig.run(1);
    for _ in 0..2 {
        rig.received.clear();
        rig.send_message(&ToDevice::Detach);
        rig.run(1);
        assert!(
            rig.received.contains(&ToHost::Detached),
            "{:?}",
            rig.received
        );
    }
}

/// Safety: 25.
#[test]
fn detached_sessions_keep_arm_armed_and_last_report_intact() {
    let mut rig = Rig::armed();
    let first = rig.session;
    open_and_detach(&mut rig, 60);
    let second = rig.session;
    open_and_detach(&mut rig, 60);
    rig.run(500);
    assert!(rig.device.tick(rig.sense).enabled, "rendering continues");
    // Its own late open message does not open it again, and neither does that of the previous
    // session, which is answered.
    rig.received.clear();
    for session in [second, rig.session] {
        rig.send(&framed(session, &ToDevice::Hello(HELLO)));
    }
    rig.run(5);
    assert_eq!(rig.received, []);
    let (number, end) = (HELLO.number, SessionEnd::Replaced);
    assert_eq!(
        rig.received_before,
        [(second, ToHost::SessionClosed { number, end })]
    );
    let device = opened_by_new_host(&mut rig);
    let (session, end) = (device.last.session, device.last.end);
    assert_eq!((session, end), (first.get(), SessionEnd::Replaced));
    assert!(device.last.count.sent > 2_000, "{:?}", device.last);
    assert_eq!(device.epoch, Some(7), "and it stores the scene");
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Armed));
}

/// Safety: 25.
#[test]
fn silence_after_detach_disarms_after_time_out() {
    let mut rig = Rig::armed();
    open_and_detach(&mut rig, 7);
    let on = (0..20_000).take_while(|_| rig.device.tick(rig.sense).enabled);
    let on = on.count();
    assert!((6_990..7_110).contains(&on), "{on}");
    assert_eq!(
        opened_by_new_host(&mut rig).last.end,
        SessionEnd::HostSilent
    );
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
}

#[test]
fn detached_host_arms_nothing_and_later_close_disarms() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::Arm);
    rig.run(10);
    rig.send_message(&ToDevice::Detach);
    rig.run(10);
    rig.sense.dead_man = true;
    for _ in 0..3_000 {
        assert!(!rig.device.tick(rig.sense).enabled);
    }
    let mut rig = Rig::armed();
    rig.send_message(&ToDevice::Detach);
    rig.run(10);
    rig.send_message(&ToDevice::Bye);
    rig.run(250);
    assert!(matches!(rig.received.last(), Some(ToHost::Goodbye(_))));
    assert!(!rig.device.tick(rig.sense).enabled);
    assert_eq!(opened_by_new_host(&mut rig).last.end, SessionEnd::Goodbye);
}

/// Safety: 32.
#[test]
fn pending_arm_request_ends_with_its_session() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::Arm);
    rig.run(10);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Requested));
    rig.open_new_session();
    rig.send_message(&ToDevice::Scene(scene(Source::Encoders)));
    rig.run(5);
    rig.sense.dead_man = true;
    rig.run(3_000);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
}

#[test]
fn heartbeat_answer_counts_samples_sent_before() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(100);
    for ticks in 1..40 {
        rig.run(ticks % 7);
        rig.send_message(&ToDevice::Heartbeat);
    }
    rig.run(20);
    let (mut sent, mut answers) = (0, 0);
    for message in &rig.received {
        match message {
            ToHost::Telemetry(telemetry) => sent += telemetry.samples.len() as u32,
            ToHost::Heartbeat { count, report, .. } => {
                answers += 1;
                assert_eq!((count.sent, count.dropped), (sent, 0));
                assert_eq!(report.mode, Mode::Disarmed);
            }
            _ => {}
        }
    }
    assert_eq!(answers, 39);
}

#[test]
fn repeated_close_gets_same_answer_and_ends_requests() {
    let mut rig = Rig::armed();
    for _ in 0..3 {
        rig.send_message(&ToDevice::Bye);
        rig.run(250);
    }
    let goodbyes: Vec<_> = rig
        .received
        .iter()
        .filter(|m| matches!(m, ToHost::Goodbye(_)))
        .collect();
    assert_eq!(goodbyes.len(), 3);
    assert!(goodbyes.windows(2).all(|pair| pair[0] == pair[1]));
    // After that, no message of the session is handled.
    rig.request(Request::Arm);
    rig.run(100);
    assert_eq!(rig.answers(|r| matches!(r, Request::Arm)).len(), 1);
}

/// Safety: images.
#[test]
fn damaged_frames_trigger_no_repeated_tile_requests() {
    let mut rig = Rig::with_unanswered_tiles(scene(Source::Encoders));
    rig.run(5);
    let requested = rig.tile_requests().len();
    assert!(requested > 0);
    for _ in 0..50 {
        rig.send(&[5, 5, 5, 0]);
        rig.run(1);
    }
    assert_eq!(rig.tile_requests().len(), requested);
    assert_eq!(rig.status().bad_frames, 50);
}

#[test]
fn messages_before_open_are_ignored() {
    let mut rig = Rig::new();
    rig.send(&frame(&ToDevice::Scene(scene(Source::Points))));
    rig.send(&point(0, 0.0, 0.0));
    rig.run(3);
    assert_eq!(rig.received, []);
}

#[test]
fn damaged_tile_is_requested_again_and_forces_are_unchanged() {
    // One damaged bit in each rig; all bits would be 35,000 rigs.
    for bit in (0..8 * 4370).step_by(997) {
        let mut rig = Rig::with_unanswered_tiles(scene(Source::Points));
        let mut bytes = tile(7, rig.tile_requests()[0]);
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
        rig.send(&bytes);
        rig.answers_tiles = true;
        let rendered = rig.descend(40);
        assert_eq!(forces(&rendered), undisturbed(), "bit {bit}");
        assert!(rendered.last().unwrap().1.tick > RETRY_TICKS, "bit {bit}");
    }
}

#[test]
fn dropped_byte_costs_one_retry() {
    for at in [0, 1, 5, 100, 4000, 4369] {
        let mut rig = Rig::with_unanswered_tiles(scene(Source::Points));
        let mut bytes = tile(7, rig.tile_requests()[0]);
        bytes.remove(at);
        rig.send(&bytes);
        rig.answers_tiles = true;
        let rendered = rig.descend(40);
        assert_eq!(forces(&rendered), undisturbed(), "byte {at}");
        assert!(rendered.last().unwrap().1.tick > RETRY_TICKS, "byte {at}");
    }
}

#[test]
fn duplicated_frames_change_nothing() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.damage = |bytes| bytes.extend_from_within(..);
    for seq in 0..40 {
        let bytes = point(seq, seq as f32 * 0.9, 4.0 - seq as f32 * 0.1);
        rig.send(&[&*bytes, &*bytes].concat());
        rig.run(600);
    }
    let mut rendered = rig.rendered();
    // The second of each pair is also answered, with the same content.
    assert!(rendered.len() >= 40);
    rendered.dedup();
    assert_eq!(forces(&rendered), undisturbed());
}

#[test]
fn lost_answer_is_repeated_without_another_step() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let first = rig.descend(3)[2];
    rig.send(&point(2, 1.8, 3.8));
    rig.run(2);
    assert_eq!(rig.rendered()[3..], [first]);
}

#[test]
fn point_repeated_before_its_answer_is_rendered_once() {
    let mut rig = Rig::with_unanswered_tiles(scene(Source::Points));
    for _ in 0..3 {
        rig.send(&point(0, 0.0, 2.0));
        rig.run(5);
    }
    assert_eq!(rig.rendered(), [], "its tile has not arrived yet");
    rig.send(&tile(7, rig.tile_requests()[0]));
    rig.answers_tiles = true;
    rig.run(1000);
    assert_eq!(rig.rendered().len(), 1);
}

#[test]
fn late_duplicate_does_not_replace_a_received_tile() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.descend(1);
    for key in rig.tile_requests() {
        let heights = Heights::Flat {
            base: 2,
            height: 0.9,
        };
        let epoch = 7;
        rig.send(&frame(&ToDevice::Tile(TileMessage {
            epoch,
            key,
            heights,
        })));
    }
    // The first point is answered twice.
    let rendered = rig.descend(40);
    let requested = rig.tile_requests();
    let unique: HashSet<_> = requested
        .iter()
        .map(|key| (key.index.col, key.index.row))
        .collect();
    assert_eq!(requested.len(), unique.len(), "nothing was requested twice");
    assert_eq!(forces(&rendered[1..]), undisturbed());
}

#[test]
fn session_opens_in_the_middle_of_a_frame() {
    for cut in [1, 2, 100, 4000] {
        let mut rig = Rig::new();
        let key = hapterra_core::terrain::TileKey::new(0, 0, 0);
        rig.send(&tile(7, key)[cut..]);
        rig.send_message(&ToDevice::Hello(HELLO));
        rig.run(1);
        assert!(matches!(rig.received[0], ToHost::Hello(_)), "cut {cut}");
    }
}

#[test]
fn zero_byte_before_hello_ends_an_unfinished_frame() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.run(3);
    rig.received.clear();
    rig.send(&point(0, 0.0, 2.0)[..4]);
    rig.send(&[0]);
    rig.open_new_session();
    rig.run(1);
    assert!(matches!(rig.received[0], ToHost::Hello(_)));
}

/// Safety: 33.
#[test]
fn session_continues_after_garbage() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let mut noise = 1u32;
    let storm: Vec<u8> = (0..200_000)
        .map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        })
        .collect();
    rig.send(&storm);
    rig.send(&[0]);
    rig.run(2);
    assert!(rig.in_transit.is_empty(), "all was sent");
    assert_eq!(forces(&rig.descend(40)), undisturbed());
}

#[test]
fn force_stays_when_the_host_dies_and_the_session_resumes() {
    let mut rig = Rig::armed();
    let requested = rig.tile_requests().len();
    // The host has left: nothing is read, nothing is sent.
    rig.writer = 0;
    for _ in 0..1000 {
        assert!(rig.device.tick(rig.sense).enabled, "rendering continues");
    }
    rig.device.link.interrupted();
    rig.writer = usize::MAX;
    rig.received.clear();
    rig.open_new_session();
    rig.send_message(&ToDevice::Scene(scene(Source::Encoders)));
    rig.run(300);
    let ToHost::Hello(device) = &rig.received[0] else {
        panic!("{:?}", rig.received[0]);
    };
    assert_eq!(device.epoch, Some(7), "it reports the stored scene");
    assert!(
        requested > 0 && rig.tile_requests().is_empty(),
        "and requests none of its tiles"
    );
    let first = &rig.telemetry()[0];
    assert_eq!(first.first, 0, "a session counts its samples from zero");
    assert!(first.samples[0].tick > 1000, "but the scene continued");
}

#[test]
fn host_with_another_scene_requests_all_tiles_again() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.descend(5);
    rig.received.clear();
    rig.open_new_session();
    let other = Scene {
        epoch: 8,
        ..scene(Source::Points)
    };
    rig.send_message(&ToDevice::Scene(other));
    rig.run(5);
    assert!(
        !rig.tile_requests().is_empty(),
        "its stored tiles are of another scene"
    );
    assert_eq!(forces(&rig.descend(40)), undisturbed());
}

#[test]
fn tiles_of_another_scene_or_unrequested_tiles_are_dropped() {
    let mut rig = Rig::with_unanswered_tiles(scene(Source::Points));
    let requested = rig.tile_requests()[0];
    let unrequested = hapterra_core::terrain::TileKey::new(requested.level, 9, requested.index.row);
    rig.send(&tile(6, requested));
    rig.send(&tile(7, unrequested));
    rig.send(&point(0, 0.0, 2.0));
    rig.run(20);
    assert_eq!(rig.rendered(), [], "the point still waits for its tile");
    rig.send(&tile(7, requested));
    rig.answers_tiles = true;
    rig.run(20);
    assert_eq!(rig.rendered().len(), 1);
}

#[test]
fn slow_link_drops_and_counts_only_telemetry() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    // A sample takes about 60 bytes a tick.
    rig.writer = 20;
    rig.run(3000);
    let dropped = rig.telemetry().last().unwrap().dropped;
    assert!(dropped > 1000, "{dropped}");
    let tile_requests = rig.tile_requests();
    // Caught up, every sample was either delivered or counted.
    rig.writer = usize::MAX;
    rig.run(100);
    let mut next = 0;
    for telemetry in rig.telemetry() {
        assert_eq!(telemetry.first, next, "no gap on the link itself");
        next += telemetry.samples.len() as u32;
    }
    let last = rig.telemetry().last().unwrap().clone();
    assert_eq!(next + last.dropped, last.samples[BATCH - 1].tick);
    let fast = {
        let mut rig = Rig::in_scene(scene(Source::Encoders));
        rig.run(3000);
        rig.tile_requests()
    };
    assert_eq!(tile_requests, fast, "every tile was requested once");
}

#[test]
fn missing_tile_is_requested_again_every_retry_period() {
    let mut rig = Rig::with_unanswered_tiles(scene(Source::Encoders));
    let first = rig.tile_requests()[0];
    rig.run(4 * RETRY_TICKS + 1);
    let again = rig.tile_requests();
    assert_eq!(again.iter().filter(|key| **key == first).count(), 5);
}

#[test]
fn missing_tile_is_requested_again_after_two_heartbeats() {
    let held = Scene {
        hold_clock: true,
        ..scene(Source::Encoders)
    };
    let mut rig = Rig::with_unanswered_tiles(held);
    assert!(rig.device.link.may_stop_clock());
    let requested = rig.tile_requests().len();
    let mut bytes = tile(7, rig.tile_requests()[0]);
    bytes[9] ^= 1;
    rig.send(&bytes);
    rig.run(20);
    assert_eq!(
        rig.tile_requests().len(),
        requested,
        "damage alone causes no new request"
    );
    rig.send_message(&ToDevice::Heartbeat);
    rig.run(20);
    assert_eq!(rig.tile_requests().len(), requested, "it may be in transit");
    rig.answers_tiles = true;
    rig.send_message(&ToDevice::Heartbeat);
    rig.run(20);
    assert!(!rig.device.link.may_stop_clock(), "time continues");
}

/// Safety: 33.
#[test]
fn flooding_host_is_throttled_without_loss() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(100);
    rig.writer = 0;
    let same = frame(&ToDevice::Scene(scene(Source::Encoders)));
    rig.send(&vec![&*same; 500].concat());
    rig.run(50);
    assert!(!rig.in_transit.is_empty(), "answers cannot be sent");
    rig.writer = usize::MAX;
    rig.run(600);
    assert!(rig.in_transit.is_empty());
    let accepted = |m: &&ToHost| matches!(m, ToHost::SceneAck { accepted: true, .. });
    assert_eq!(rig.received.iter().filter(accepted).count(), 501);
}

/// Safety: 25.
#[test]
fn dead_man_press_without_live_host_neither_arms_nor_stores() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::Arm);
    rig.run(3_000);
    rig.sense.dead_man = true;
    for _ in 0..3_000 {
        assert!(!rig.device.tick(rig.sense).enabled);
    }
    rig.sense.dead_man = false;
    rig.request(Request::StoreCalibration);
    rig.run(3_000);
    rig.press();
    assert_eq!(rig.device.link.to_store(), None);
    // A host that is present may be slow.
    rig.request(Request::Arm);
    for _ in 0..10 {
        rig.run(1_000);
        rig.send_message(&ToDevice::Heartbeat);
    }
    rig.sense.dead_man = true;
    rig.run(300);
    assert!(rig.device.tick(rig.sense).enabled);
}

#[test]
fn opens_of_recent_sessions_do_not_reopen_them() {
    let mut rig = Rig::new();
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(1);
    let sessions: Vec<_> = (0..8)
        .map(|_| {
            let of = rig.session;
            rig.open_new_session();
            rig.run(1);
            of
        })
        .collect();
    let foreign = rig.status().foreign_frames;
    for session in &sessions {
        rig.send(&framed(*session, &ToDevice::Hello(HELLO)));
        rig.run(1);
    }
    assert_eq!(rig.status().foreign_frames, foreign + 8);
    let reported: Vec<_> = rig.received_before.iter().map(|(of, _)| *of).collect();
    assert_eq!(reported, sessions);
}

#[test]
fn arm_is_refused_as_busy_during_calibration_store() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::StoreCalibration);
    rig.run(150);
    rig.sense.dead_man = true;
    // The loop reports the press, and the board has not stored the calibration yet.
    (0..100).for_each(|_| _ = rig.device.tick_alone(rig.sense));
    rig.device.link.poll();
    assert!(rig.device.link.to_store().is_some());
    rig.number += 1;
    let (number, request) = (rig.number, Request::Arm);
    rig.device
        .link
        .receive(&frame(&ToDevice::Request { number, request }));
    rig.device.link.stored(Ok(()));
    rig.run(10);
    let last = rig.received.iter().rev().find_map(|message| match message {
        ToHost::Answer(answer) if answer.number == number => Some(answer.result),
        _ => None,
    });
    assert_eq!(last, Some(Err(Refusal::Busy)));
}
