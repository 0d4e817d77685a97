use hapterra_core::Vec3;
use hapterra_core::clutch::ClutchMode;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{ContactMap, Source};
use hapterra_core::wire::frame::{decode, encode};
use hapterra_core::wire::hello::{PROTOCOL, SerialNumber};
use hapterra_core::wire::message::Telemetry;
use hapterra_core::wire::request::Answer;
use hapterra_core::wire::session::{InSession, SampleCount, SessionEnd};
use hapterra_core::wire::version::VersionCheck;

use super::*;
use crate::terrain::Scale;
use heightfield::Raster;

/// Returns the introduction of a device.
pub(crate) fn hello() -> DeviceHello {
    DeviceHello {
        protocol: PROTOCOL,
        number: 1,
        opened_by: 1,
        board: "test".try_into().expect("fits"),
        serial: SerialNumber::NONE,
        version: "1".try_into().expect("fits"),
        window: 4,
        tick_hz: 1000,
        latency_us: 110,
        clock_hz: 1_000_000,
        epoch: None,
        last: LastSession::default(),
    }
}

/// A client, and the messages of its device, written by the test.
struct Bench<'t> {
    client: Client<'t>,
    now: Duration,
    out: Vec<u8>,
    opened: u32,
    unanswered: Vec<HostRequest>,
    /// Reported calibrations.
    reported: Vec<Option<Calibration>>,
    /// Scene changes, and whether they were accepted.
    viewed: Vec<(u8, bool)>,
    /// Number of cancelled scene changes.
    cancelled: u32,
}

const fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn on_bench(arming: Option<Arming>, test: impl FnOnce(&mut Bench<'_>)) {
    let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
    let scale = Scale::new(1.0, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let home = GridPoint::default();
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home);
    let mut bench = Bench {
        client: Client::new(&terrain, scene, arming, Timeouts::REAL_TIME),
        now: ms(10_000),
        out: vec![],
        opened: 0,
        unanswered: vec![],
        reported: vec![],
        viewed: vec![],
        cancelled: 0,
    };
    bench.client.greet(bench.now, &mut bench.out);
    test(&mut bench);
}

impl Bench<'_> {
    fn deliver_in(&mut self, session: SessionNumber, message: &ToHost) -> Result<(), LinkError> {
        let mut frame = [0; MAX_FRAME];
        let bytes = encode(&InSession { session, message }, &mut frame).expect("fits");
        let (opened, reported, viewed) = (&mut self.opened, &mut self.reported, &mut self.viewed);
        let cancelled = &mut self.cancelled;
        let mut on = |event: Event<'_>| match event {
            Event::Opened { .. } => *opened += 1,
            Event::Calibration(calibration) => reported.push(calibration.copied()),
            Event::SceneChangeResult { view, accepted } => viewed.push((view.number, accepted)),
            Event::ChangeCancelled => *cancelled += 1,
            _ => {}
        };
        self.client.receive(self.now, bytes, &mut self.out, &mut on)
    }

    fn deliver(&mut self, message: &ToHost) {
        let session = self.client.session();
        self.deliver_in(session, message).expect("understood");
    }

    fn scene_ack(&self) -> ToHost {
        ToHost::SceneAck {
            epoch: self.client.scene().epoch,
            accepted: true,
        }
    }

    fn heartbeat(&self) -> ToHost {
        ToHost::Heartbeat {
            count: SampleCount::default(),
            epoch: Some(self.client.scene().epoch),
            report: Report::default(),
        }
    }

    fn open(&mut self) {
        self.deliver(&ToHost::Hello(hello()));
        self.deliver(&self.scene_ack());
        assert_eq!(self.client.state(), State::Open);
    }

    /// Sends a scene change and returns the epoch of its scene.
    fn put_view(&mut self, number: u8) -> u32 {
        self.put_change(number, 5_000 + u32::from(number), None)
    }

    /// Sends a scene change in contact, which the device accepts.
    fn accept_change(&mut self, number: u8, epoch: u32) {
        let map = ContactMap {
            from: GridPoint::default(),
            to: GridPoint::default(),
            scale: Vec3::ONE,
        };
        self.put_change(number, epoch, Some(map));
        let accepted = true;
        self.deliver(&ToHost::SceneAck { epoch, accepted });
        assert_eq!(self.client.scene().epoch, epoch);
        self.out.clear();
    }

    /// Sends a scene change in contact, which the device accepts, and requests its cancel.
    fn cancel_change(&mut self, number: u8) {
        let epoch = 5_000 + u32::from(number);
        self.accept_change(number, epoch);
        let cancel = Request::CancelChange { epoch };
        self.client.enqueue(HostRequest::Request(cancel));
        self.advance(ms(10)).expect("in time");
        self.out.clear();
    }

    /// Delivers a heartbeat of a device with this scene.
    fn report_scene(&mut self, epoch: u32) {
        self.deliver(&ToHost::Heartbeat {
            count: SampleCount::default(),
            epoch: Some(epoch),
            report: Report::default(),
        });
    }

    /// Delivers the first sample of a placement.
    fn report_sample(&mut self, view: u8) {
        let sample = TickRecord {
            view,
            ..TickRecord::default()
        };
        let first = u32::from(view);
        self.deliver(&ToHost::Telemetry(Telemetry {
            first,
            dropped: 0,
            samples: std::iter::once(sample).collect(),
        }));
    }

    fn put_change(&mut self, number: u8, epoch: u32, in_contact: Option<ContactMap>) -> u32 {
        let terrain = (*self.client.terrain).clone();
        let scene = Scene {
            epoch,
            ..*self.client.scene()
        };
        let view = SceneChange {
            number,
            scene,
            hip: GridPoint::default(),
            keeps_tiles: true,
            in_contact,
        };
        self.client.put_view(self.now, view, terrain, &mut self.out);
        scene.epoch
    }

    /// Lets time pass; messages stay in `out` meanwhile.
    fn advance(&mut self, time: Duration) -> Result<(), LinkError> {
        let end = self.now + time;
        while self.now < end {
            self.now += ms(10);
            let (unanswered, viewed) = (&mut self.unanswered, &mut self.viewed);
            let mut record = |event: Event<'_>| match event {
                Event::Unanswered(request) => unanswered.push(*request),
                Event::SceneChangeResult { view, accepted } => viewed.push((view.number, accepted)),
                _ => {}
            };
            self.client
                .append_due(self.now, &mut self.out, &mut record)?;
        }
        Ok(())
    }

    /// Returns the lines since the last call.
    fn drain_sent(&mut self) -> Vec<String> {
        let mut reader = FrameReader::<MAX_FRAME>::new();
        let out = std::mem::take(&mut self.out);
        let (mut bytes, mut sent) = (out.as_slice(), vec![]);
        let read = |content: &[u8]| {
            if VersionCheck::is_in(content) {
                return Ok("Version".to_owned());
            }
            decode::<InSession<ToDevice<'_>>>(content).map(|framed| {
                let words = format!("{:?}", framed.message);
                let name = words.split(['(', ' ']).next().unwrap_or_default();
                match framed.message {
                    ToDevice::Request { number, request } => format!("{number} {request:?}"),
                    ToDevice::Status { number } | ToDevice::GetCalibration { number } => {
                        format!("{number} {name}")
                    }
                    _ => name.to_owned(),
                }
            })
        };
        while let Some(Ok(name)) = next_frame(&mut reader, &mut bytes, read) {
            sent.push(name);
        }
        sent
    }
}

fn count_of(sent: &[String], what: &str) -> usize {
    sent.iter().filter(|name| *name == what).count()
}

#[test]
fn repeated_device_messages_open_one_session() {
    on_bench(None, |bench| {
        let hello = ToHost::Hello(hello());
        let ack = bench.scene_ack();
        for message in [&ack, &hello, &hello, &ack, &ack, &hello] {
            bench.deliver(message);
        }
        assert_eq!((bench.opened, bench.client.stats().sessions), (1, 1));
        assert_eq!(bench.client.state(), State::Open);
    });
}

/// Safety: images.
#[test]
fn opening_is_repeated_despite_noise_until_it_times_out() {
    on_bench(None, |bench| {
        let foreign = SessionNumber::new(7);
        let mut noise = 0;
        let error = loop {
            let _ = bench.deliver_in(foreign, &ToHost::Telemetry(Default::default()));
            let mut none = |_: Event<'_>| {};
            let _ = bench
                .client
                .receive(bench.now, &[5, 0, 9], &mut bench.out, &mut none);
            noise += 1;
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
            assert!(noise < 200, "for ever");
        };
        assert!(matches!(error, LinkError::Silent(_)), "{error}");
        let sent = bench.drain_sent();
        assert_eq!(
            (count_of(&sent, "Hello"), count_of(&sent, "Version")),
            (10, 10)
        );
    });
}

#[test]
fn scene_without_ack_times_out_after_ten_attempts() {
    on_bench(None, |bench| {
        bench.deliver(&ToHost::Hello(hello()));
        let error = loop {
            bench.deliver(&ToHost::Telemetry(Default::default()));
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
        };
        assert!(matches!(error, LinkError::Silent(_)), "{error}");
        assert_eq!(count_of(&bench.drain_sent(), "Scene"), 10);
    });
}

/// Safety: images.
#[test]
fn telemetry_does_not_count_as_answer() {
    on_bench(None, |bench| {
        bench.open();
        bench.drain_sent();
        let error = loop {
            bench.deliver(&ToHost::Telemetry(Default::default()));
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
        };
        assert!(matches!(error, LinkError::Silent(_)), "{error}");
        let sent = bench.drain_sent();
        assert_eq!(count_of(&sent, "Heartbeat"), 8);
        assert_eq!(count_of(&sent, "Hello"), 9, "from 0.75 s on");
    });
}

/// Safety: images.
#[test]
fn unanswered_arm_is_retried_reported_and_then_disarmed() {
    on_bench(Some(Arming::default()), |bench| {
        bench.open();
        for _ in 0..80 {
            bench.deliver(&bench.heartbeat());
            bench.advance(ms(50)).expect("alive");
        }
        let sent = bench.drain_sent();
        assert_eq!(count_of(&sent, "1 Arm"), 10);
        assert_eq!(bench.unanswered, [HostRequest::Request(Request::Arm)]);
        assert_eq!(bench.client.stats().unanswered, 1);
        assert_eq!(count_of(&sent, "2 Disarm"), 1);
    });
}

#[test]
fn answer_ends_repetition_and_sends_next_request() {
    on_bench(Some(Arming::VIRTUAL), |bench| {
        bench.open();
        assert_eq!(
            bench.drain_sent().last().map(|s| s.starts_with("1 Zero")),
            Some(true)
        );
        for number in [7, 1, 1] {
            let result = Ok(());
            bench.deliver(&ToHost::Answer(hapterra_core::wire::request::Answer {
                number,
                result,
            }));
        }
        assert_eq!(bench.drain_sent(), ["2 Arm"]);
    });
}

#[test]
fn late_answer_to_an_earlier_query_is_ignored() {
    on_bench(None, |bench| {
        bench.open();
        let reported = |number, calibration| ToHost::Calibration {
            number,
            calibration,
        };
        let (old, new) = (Calibration::OMNI, Calibration::PREMIUM_3_0);
        for _ in 0..300 {
            bench.drain_sent();
            bench.client.enqueue(HostRequest::Calibration);
            bench.advance(ms(10)).expect("patient");
            let sent = bench.drain_sent();
            let number = sent
                .iter()
                .find_map(|sent| sent.strip_suffix(" GetCalibration"));
            let number: u8 = number.expect("asked").parse().expect("a number");
            // Repeated after 0.4 s: the second answer is still in transit.
            bench.deliver(&reported(number, Some(old)));
            bench.client.enqueue(HostRequest::Calibration);
            bench.advance(ms(10)).expect("patient");
            bench.reported.clear();
            bench.deliver(&reported(number, Some(old)));
            assert_eq!(bench.reported, [], "question {number}");
            bench.deliver(&reported(number.wrapping_add(1), Some(new)));
            assert_eq!(bench.reported, [Some(new)], "question {number}");
        }
    });
}

#[test]
fn repeated_query_keeps_its_number() {
    on_bench(None, |bench| {
        bench.open();
        bench.drain_sent();
        bench.client.enqueue(HostRequest::Status);
        bench.client.enqueue(HostRequest::Request(Request::Disarm));
        for _ in 0..40 {
            bench.deliver(&bench.heartbeat());
            bench.advance(ms(50)).expect("alive");
        }
        let sent = bench.drain_sent();
        assert_eq!(count_of(&sent, "1 Status"), 5);
        bench.deliver(&ToHost::Answer(hapterra_core::wire::request::Answer {
            number: 1,
            result: Ok(()),
        }));
        bench.advance(ms(300)).expect("alive");
        assert_eq!(
            count_of(&bench.drain_sent(), "1 Status"),
            1,
            "no answer to it"
        );
    });
}

#[test]
fn tile_requests_wait_for_the_answer_to_zero() {
    on_bench(Some(Arming::VIRTUAL), |bench| {
        bench.open();
        let (epoch, key) = (bench.client.scene().epoch, TileKey::new(0, 0, 0));
        bench.drain_sent();
        for _ in 0..3 {
            bench.deliver(&ToHost::TileRequest { epoch, key });
        }
        assert_eq!(bench.drain_sent(), Vec::<String>::new());
        let (number, result) = (1, Ok(()));
        bench.deliver(&ToHost::Answer(hapterra_core::wire::request::Answer {
            number,
            result,
        }));
        assert_eq!(bench.drain_sent(), ["2 Arm", "Tile"]);
    });
}

/// Safety: images.
#[test]
fn late_or_same_protocol_version_refusal_is_ignored() {
    on_bench(None, |bench| {
        let refuse = |bench: &mut Bench<'_>, protocol| {
            let mut frame = [0; 16];
            let refused = VersionCheck::Refused { protocol };
            let bytes = encode(&refused, &mut frame).expect("fits");
            bench
                .client
                .receive(bench.now, bytes, &mut bench.out, &mut |_| {})
        };
        assert!(refuse(bench, PROTOCOL).is_ok());
        let refused = refuse(bench, 3);
        assert!(
            matches!(refused, Err(LinkError::Version { theirs: 3, .. })),
            "{refused:?}"
        );
        bench.open();
        assert!(refuse(bench, PROTOCOL).is_ok() && refuse(bench, 3).is_ok());
        assert_eq!(bench.client.state(), State::Open);
    });
}

#[test]
fn restarted_device_gets_the_scene_again() {
    on_bench(None, |bench| {
        bench.open();
        bench.advance(ms(800)).expect("patient");
        assert_eq!(
            count_of(&bench.drain_sent(), "Hello"),
            2,
            "the first, and after silence"
        );
        let again = DeviceHello {
            number: 2,
            opened_by: 2,
            ..hello()
        };
        // The late answer to the first open message reports an old state.
        bench.deliver(&ToHost::Hello(hello()));
        assert_eq!(bench.client.state(), State::Open);
        bench.deliver(&ToHost::Hello(again.clone()));
        assert_eq!(bench.client.state(), State::SceneSent);
        bench.deliver(&bench.scene_ack());
        bench.deliver(&ToHost::Hello(again));
        assert_eq!((bench.opened, bench.client.state()), (2, State::Open));
        assert_eq!(bench.client.stats().uncertain, 1);
    });
}

/// Safety: 32, images.
#[test]
fn frames_of_another_host_end_the_session() {
    on_bench(None, |bench| {
        bench.open();
        let other = SessionNumber::new(7);
        let error = loop {
            bench
                .deliver_in(other, &ToHost::Telemetry(Default::default()))
                .expect("passed over");
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
        };
        assert!(matches!(error, LinkError::Taken), "{error}");
        assert_eq!(bench.client.stats().samples, 0, "none of it is recorded");
        // While the device answers this session, frames of other sessions are ignored.
    });
    on_bench(None, |bench| {
        bench.open();
        for _ in 0..200 {
            let other = SessionNumber::new(7);
            bench
                .deliver_in(other, &ToHost::Telemetry(Default::default()))
                .expect("passed over");
            bench.deliver(&bench.heartbeat());
            bench.advance(ms(50)).expect("it is ours");
        }
    });
}

/// Returns the answer to the open message `number` of a session that is over.
const fn over(number: u8, end: SessionEnd) -> ToHost {
    ToHost::SessionClosed { number, end }
}

#[test]
fn session_closed_by_device_ends_client_with_its_reason() {
    for (end, is_transient) in [
        (SessionEnd::Replaced, false),
        (SessionEnd::HostSilent, true),
    ] {
        // Received while greeting, with a scene sent, and open after silence.
        for steps in 0..3 {
            on_bench(None, |bench| {
                let session = bench.client.session();
                if steps > 0 {
                    bench.deliver(&ToHost::Hello(hello()));
                }
                if steps > 1 {
                    bench.deliver(&bench.scene_ack());
                }
                if steps > 0 {
                    bench.advance(ms(800)).expect("patient");
                    assert!(count_of(&bench.drain_sent(), "Hello") > 1);
                }
                let number = if steps > 0 { 2 } else { 1 };
                let reported = bench.deliver_in(session, &over(number, end));
                let error = reported.expect_err("over");
                let is_taken = matches!(error, LinkError::Taken);
                assert!(is_taken != is_transient, "{error}");
                assert_eq!(error.is_transient(), is_transient, "{error}");
                // The next session has another number.
                bench.client.greet(bench.now, &mut bench.out);
                assert_ne!(bench.client.session(), session);
            });
        }
    }
}

/// Safety: 32.
#[test]
fn late_session_closed_message_ends_no_other_session() {
    let ends = [SessionEnd::Replaced, SessionEnd::HostSilent];
    on_bench(None, |bench| {
        let first = bench.client.session();
        bench.open();
        bench.client.greet(bench.now, &mut bench.out);
        let second = bench.client.session();
        bench.deliver(&ToHost::Hello(DeviceHello {
            number: 2,
            ..hello()
        }));
        bench.deliver(&bench.scene_ack());
        let other = SessionNumber::new(7);
        // For earlier sessions, for others, and in answer to an open message that was already
        // answered or replaced by a later one.
        for end in ends {
            for (session, number) in [(first, 1), (first, 2), (other, 2), (second, 1), (second, 2)]
            {
                let received = bench.deliver_in(session, &over(number, end));
                received.expect("passed over");
            }
        }
        // The device has no other host, so it is silent.
        let error = loop {
            for session in [first, other] {
                let received = bench.deliver_in(session, &over(2, SessionEnd::Replaced));
                received.expect("passed over");
            }
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
        };
        assert!(matches!(error, LinkError::Silent(_)), "{error}");
    });
}

#[test]
fn leaving_client_fails_only_if_session_was_replaced() {
    let leaving = |test: fn(&mut Bench<'_>)| {
        on_bench(None, |bench| {
            bench.open();
            bench.client.leave(bench.now, &mut bench.out);
            test(bench);
        });
    };
    leaving(|bench| {
        let session = bench.client.session();
        let error = bench.deliver_in(session, &over(2, SessionEnd::Replaced));
        assert!(matches!(error, Err(LinkError::Taken)), "{error:?}");
    });
    leaving(|bench| {
        bench.deliver(&over(2, SessionEnd::HostSilent));
        assert_eq!(bench.client.state(), State::Leaving);
        bench.deliver(&ToHost::Goodbye(SampleCount::default()));
        assert_eq!(bench.client.state(), State::Closed);
    });
}

/// Safety: images.
#[test]
fn close_request_is_retried_until_confirmed_or_times_out() {
    on_bench(None, |bench| {
        bench.open();
        bench.drain_sent();
        bench.client.leave(bench.now, &mut bench.out);
        bench.advance(ms(1_000)).expect("patient");
        assert_eq!(count_of(&bench.drain_sent(), "Bye"), 3);
        let count = SampleCount {
            sent: 9,
            dropped: 2,
        };
        bench.deliver(&ToHost::Goodbye(count));
        assert_eq!(bench.client.state(), State::Closed);
        assert_eq!(bench.drain_sent(), ["Close"]);
        let stats = bench.client.stats();
        assert_eq!((stats.lost, stats.dropped), (9, 2));
    });
    on_bench(None, |bench| {
        bench.open();
        bench.client.leave(bench.now, &mut bench.out);
        let error = loop {
            bench.deliver(&bench.heartbeat());
            if let Err(error) = bench.advance(ms(50)) {
                break error;
            }
        };
        assert!(matches!(error, LinkError::NotConfirmed), "{error}");
    });
}

#[test]
fn new_line_begins_a_new_session_number() {
    on_bench(None, |bench| {
        let first = bench.client.session();
        bench.client.greet(bench.now, &mut bench.out);
        assert_eq!(bench.client.session(), first);
        bench.deliver(&ToHost::Hello(DeviceHello {
            number: 2,
            ..hello()
        }));
        bench.client.greet(bench.now, &mut bench.out);
        assert_ne!(bench.client.session(), first);
        // The device reports how the last session ended.
        let last = LastSession {
            session: first.get(),
            opened_by: 1,
            count: SampleCount {
                sent: 5,
                dropped: 1,
            },
            ..LastSession::default()
        };
        bench.deliver(&ToHost::Hello(DeviceHello {
            number: 3,
            last,
            ..hello()
        }));
        let stats = bench.client.stats();
        assert_eq!((stats.lost, stats.dropped, stats.uncertain), (5, 1, 0));
    });
}

#[test]
fn nonexistent_tile_requests_are_counted_and_rarely_logged() {
    on_bench(None, |bench| {
        bench.open();
        let (epoch, key) = (bench.client.scene().epoch, TileKey::new(0, 77, 0));
        bench.drain_sent();
        for _ in 0..1_000 {
            bench.deliver(&ToHost::TileRequest { epoch, key });
        }
        assert_eq!(bench.client.stats().no_tiles, 1_000);
        assert_eq!(bench.client.logged_at, Some(bench.now));
        assert_eq!(bench.drain_sent(), Vec::<String>::new());
    });
}

/// Safety: 6.
#[test]
fn reconnected_physical_arm_is_not_rearmed_automatically() {
    for (arming, again) in [(Arming::default(), 0), (Arming::VIRTUAL, 1)] {
        on_bench(Some(arming), |bench| {
            let arms = |bench: &mut Bench<'_>| {
                let sent = bench.drain_sent();
                let arm = |sent: &&String| sent.contains("Zero") || sent.ends_with("Arm");
                usize::from(sent.iter().any(|s| arm(&s)))
            };
            bench.open();
            assert_eq!(arms(bench), 1);
            // The device disarmed the arm because its host was silent.
            bench.client.greet(bench.now, &mut bench.out);
            bench.deliver(&ToHost::Hello(DeviceHello {
                number: 2,
                ..hello()
            }));
            let ack = bench.scene_ack();
            bench.deliver(&ack);
            assert_eq!(bench.opened, 2);
            assert_eq!(arms(bench), again, "{arming:?}");
            bench.client.enqueue(HostRequest::Request(Request::Arm));
            bench.advance(ms(50)).expect("answered");
            assert_eq!(arms(bench), 1 - again, "{arming:?}");
        });
    }
}

#[test]
fn repeated_tile_requests_in_one_read_get_one_tile() {
    on_bench(None, |bench| {
        bench.open();
        bench.drain_sent();
        let session = bench.client.session();
        let epoch = bench.client.scene().epoch;
        let mut bytes = vec![];
        let mut frame = [0; MAX_FRAME];
        for _ in 0..200 {
            let key = TileKey::new(0, 0, 0);
            let message = ToHost::TileRequest { epoch, key };
            let framed = InSession { session, message };
            bytes.extend(encode(&framed, &mut frame).expect("fits"));
        }
        let received = bench
            .client
            .receive(bench.now, &bytes, &mut bench.out, &mut |_| {});
        received.expect("understood");
        assert_eq!(count_of(&bench.drain_sent(), "Tile"), 1);
        // The next reception may request it again.
        let received = bench
            .client
            .receive(bench.now, &bytes, &mut bench.out, &mut |_| {});
        received.expect("understood");
        assert_eq!(count_of(&bench.drain_sent(), "Tile"), 1);
    });
}

#[test]
fn placement_is_resent_until_acknowledged_then_applied() {
    on_bench(None, |bench| {
        bench.open();
        let (before, epoch) = (bench.client.scene().epoch, bench.put_view(1));
        // A device that already has the scene, and whose answer was lost, gets no scene again.
        bench.out.clear();
        bench.deliver(&ToHost::Heartbeat {
            count: SampleCount::default(),
            epoch: Some(epoch),
            report: Report::default(),
        });
        bench.advance(ms(500)).expect("in time");
        let sent = bench.drain_sent();
        assert_eq!(
            (count_of(&sent, "SceneChange"), count_of(&sent, "Scene")),
            (1, 0),
            "{sent:?}"
        );
        assert_eq!(bench.client.scene().epoch, before);
        for _ in 0..2 {
            bench.deliver(&ToHost::SceneAck {
                epoch,
                accepted: true,
            });
        }
        assert_eq!(bench.viewed, [(1, true)]);
        assert_eq!(bench.client.scene().epoch, epoch);
        bench.out.clear();
        bench.deliver(&bench.heartbeat());
        bench.advance(ms(600)).expect("in time");
        let sent = bench.drain_sent();
        assert_eq!(
            (count_of(&sent, "SceneChange"), count_of(&sent, "Scene")),
            (0, 0),
            "{sent:?}"
        );
    });
}

#[test]
fn refused_or_unanswered_placement_keeps_the_scene() {
    on_bench(None, |bench| {
        bench.open();
        let (before, epoch) = (bench.client.scene().epoch, bench.put_view(1));
        let accepted = false;
        bench.deliver(&ToHost::SceneAck { epoch, accepted });
        assert_eq!(bench.viewed, [(1, false)]);
        bench.put_view(2);
        for _ in 0..9 {
            bench.advance(ms(500)).expect("in time");
            bench.deliver(&bench.heartbeat());
        }
        assert_eq!(bench.viewed, [(1, false), (2, false)]);
        assert_eq!(bench.client.scene().epoch, before);
        assert_eq!(bench.client.state(), State::Open);
    });
}

#[test]
fn epoch_after_reconnect_resolves_pending_placement() {
    for took in [true, false] {
        on_bench(None, |bench| {
            bench.open();
            let before = bench.client.scene().epoch;
            let epoch = bench.put_view(1);
            bench.client.greet(bench.now, &mut bench.out);
            let held = if took { epoch } else { before };
            bench.deliver(&ToHost::Hello(DeviceHello {
                number: 2,
                epoch: Some(held),
                ..hello()
            }));
            assert_eq!(bench.viewed, [(1, took)]);
            assert_eq!(bench.client.scene().epoch, held);
        });
    }
}

/// The device reports the scene before the change in an answer, a heartbeat or after a reconnection.
#[test]
fn cancelled_placement_restores_the_scene_before() {
    for reported_by in 0..3 {
        on_bench(None, |bench| {
            bench.open();
            let before = bench.client.scene().epoch;
            bench.cancel_change(1);
            let (number, result) = (1, Ok(()));
            let epoch = Some(before);
            match reported_by {
                0 => bench.deliver(&ToHost::Answer(Answer { number, result })),
                1 => bench.report_scene(before),
                _ => {
                    bench.client.greet(bench.now, &mut bench.out);
                    bench.deliver(&ToHost::Hello(DeviceHello {
                        number: 2,
                        epoch,
                        ..hello()
                    }));
                    bench.deliver(&ToHost::SceneAck {
                        epoch: before,
                        accepted: true,
                    });
                }
            }
            assert_eq!((bench.cancelled, bench.client.scene().epoch), (1, before));
            assert_eq!(bench.client.state(), State::Open);
            bench.out.clear();
            // The device gets no scene again, and the tiles of the one before.
            bench.deliver(&bench.heartbeat());
            bench.deliver(&ToHost::TileRequest {
                epoch: before,
                key: TileKey::new(0, 0, 0),
            });
            bench.advance(ms(600)).expect("in time");
            let sent = bench.drain_sent();
            let counts = ["Scene", "Tile"].map(|what| count_of(&sent, what));
            assert_eq!(counts, [0, 1], "{sent:?}");
            assert_eq!(bench.cancelled, 1);
        });
    }
}

#[test]
fn refused_cancel_keeps_the_placement() {
    on_bench(None, |bench| {
        bench.open();
        bench.cancel_change(1);
        let epoch = bench.client.scene().epoch;
        let (number, result) = (1, Err(Refusal::NoSuchChange));
        bench.deliver(&ToHost::Answer(Answer { number, result }));
        bench.deliver(&bench.heartbeat());
        assert_eq!((bench.cancelled, bench.client.scene().epoch), (0, epoch));
    });
}

/// The answer to the first cancel was lost, and a heartbeat has reported the cancel.
#[test]
fn late_answer_to_a_cancel_keeps_the_next_change() {
    for is_sent_again in [false, true] {
        on_bench(None, |bench| {
            bench.open();
            let before = bench.client.scene().epoch;
            bench.cancel_change(1);
            bench.report_scene(before);
            assert_eq!(bench.cancelled, 1);
            // The next change has the same number.
            bench.accept_change(1, 6_001);
            if is_sent_again {
                let cancel = Request::CancelChange { epoch: 5_001 };
                bench.client.enqueue(HostRequest::Request(cancel));
            }
            bench.advance(ms(500)).expect("in time");
            let sent = bench.drain_sent();
            let cancels = sent.iter().filter(|sent| sent.contains("CancelChange"));
            assert_eq!(cancels.count() > 0, is_sent_again, "{sent:?}");
            for number in [1, 2] {
                let result = Ok(());
                bench.deliver(&ToHost::Answer(Answer { number, result }));
                assert_eq!(bench.client.scene().epoch, 6_001, "answer {number}");
            }
            bench.report_scene(6_001);
            bench.advance(ms(100)).expect("in time");
            assert_eq!(count_of(&bench.drain_sent(), "Scene"), 0);
            assert_eq!((bench.cancelled, bench.client.state()), (1, State::Open));
        });
    }
}

#[test]
fn changes_between_two_scenes_are_not_cancelled() {
    for is_rendered in [false, true] {
        on_bench(None, |bench| {
            bench.open();
            let first = bench.client.scene().epoch;
            for (number, epoch) in [(1, 6_001), (2, first), (3, 6_001), (4, first)] {
                bench.accept_change(number, epoch);
                if is_rendered {
                    bench.report_sample(number);
                }
                bench.report_scene(epoch);
                assert_eq!(bench.client.scene().epoch, epoch, "change {number}");
            }
            assert_eq!(bench.viewed, [1, 2, 3, 4].map(|number| (number, true)));
            assert_eq!((bench.cancelled, bench.client.state()), (0, State::Open));
        });
    }
}

/// The device has lost the change; only its cancel restores the scene before.
#[test]
fn change_without_cancel_is_sent_again() {
    on_bench(None, |bench| {
        bench.open();
        let before = bench.client.scene().epoch;
        bench.accept_change(1, 6_001);
        let cancel = Request::CancelChange { epoch: 5_001 };
        bench.client.enqueue(HostRequest::Request(cancel));
        bench.report_scene(before);
        assert_eq!((bench.cancelled, bench.client.scene().epoch), (0, 6_001));
        assert_eq!(count_of(&bench.drain_sent(), "Scene"), 1);
    });
}

/// A device that reports the scene before has lost the one that it has rendered.
#[test]
fn rendered_change_is_not_cancelled() {
    on_bench(None, |bench| {
        bench.open();
        let first = bench.client.scene().epoch;
        bench.accept_change(1, 6_001);
        bench.report_sample(1);
        bench.report_scene(first);
        assert_eq!((bench.cancelled, bench.client.scene().epoch), (0, 6_001));
        assert_eq!(count_of(&bench.drain_sent(), "Scene"), 1);
    });
}

/// The device answers the newer request; its heartbeat reports the cancel.
#[test]
fn request_of_the_user_does_not_wait_for_a_cancel() {
    on_bench(None, |bench| {
        bench.open();
        let before = bench.client.scene().epoch;
        bench.cancel_change(1);
        let clutch = Request::Clutch {
            hold: ClutchMode::WithHand,
        };
        bench.client.enqueue(HostRequest::Request(clutch));
        bench.advance(ms(10)).expect("in time");
        let sent = bench.drain_sent();
        assert!(
            sent.iter().any(|sent| sent.starts_with("2 Clutch")),
            "{sent:?}"
        );
        let (number, result) = (1, Ok(()));
        bench.deliver(&ToHost::Answer(Answer { number, result }));
        assert_eq!(bench.cancelled, 0);
        bench.report_scene(before);
        assert_eq!((bench.cancelled, bench.client.scene().epoch), (1, before));
        bench.advance(ms(500)).expect("in time");
        let sent = bench.drain_sent();
        assert!(
            !sent.iter().any(|sent| sent.contains("CancelChange")),
            "{sent:?}"
        );
        assert_eq!(bench.unanswered, []);
    });
}

/// A request of the user has replaced the cancel in the queue.
#[test]
fn tile_request_of_the_scene_before_reports_its_cancel() {
    for is_cancelled in [true, false] {
        on_bench(None, |bench| {
            bench.open();
            let (before, key) = (bench.client.scene().epoch, TileKey::new(0, 0, 0));
            match is_cancelled {
                true => bench.cancel_change(1),
                false => bench.accept_change(1, 5_001),
            }
            let hold = ClutchMode::WithHand;
            let clutch = HostRequest::Request(Request::Clutch { hold });
            bench.client.enqueue(clutch);
            bench.advance(ms(10)).expect("in time");
            bench.out.clear();
            bench.deliver(&ToHost::TileRequest { epoch: before, key });
            let epoch = if is_cancelled { before } else { 5_001 };
            let cancelled = usize::from(is_cancelled);
            assert_eq!(bench.cancelled, u32::from(is_cancelled));
            assert_eq!(bench.client.scene().epoch, epoch);
            assert_eq!(count_of(&bench.drain_sent(), "Tile"), cancelled);
        });
    }
}

#[test]
fn withheld_tiles_of_another_scene_are_not_sent() {
    on_bench(Some(Arming::VIRTUAL), |bench| {
        bench.open();
        let (epoch, key) = (bench.client.scene().epoch, TileKey::new(0, 0, 0));
        bench.deliver(&ToHost::TileRequest { epoch, key });
        bench.accept_change(1, 6_001);
        let (number, result) = (1, Ok(()));
        bench.deliver(&ToHost::Answer(Answer { number, result }));
        assert_eq!(bench.drain_sent(), ["2 Arm"]);
    });
}
