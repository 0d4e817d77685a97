//! Every frame of a session lost, repeated, delayed and overtaken, either end killed at every
//! moment: the end is confirmed or reported, no force acts without a request of a host, every
//! sample is counted once.

use hapterra_tests::link_model::{
    Direction, End, FrameFault, Interruption, Plan, Report, check, frames,
};

/// Damage to a frame.
const HARMS: [FrameFault; 5] = [
    FrameFault::Lose,
    FrameFault::Repeat(3),
    FrameFault::Repeat(900),
    FrameFault::Delay(30),
    FrameFault::Delay(900),
];
/// Ticks between two moments at which an end is killed.
const MOMENTS: usize = 23;

/// Plays a plan whose line is good enough for an agreed end.
fn agree(plan: &Plan) -> Report {
    match check(plan) {
        Ok(report) if report.end == End::Agreed && report.driven => report,
        other => panic!("{other:?} in {plan:?}"),
    }
}

/// Returns every fault of every frame of an undisturbed run, first those to the device.
fn single_harms() -> Vec<(Direction, usize, FrameFault)> {
    let [to_device, to_host] = frames();
    let to_device = (0..to_device).map(|number| (Direction::ToDevice, number));
    let to_host = (0..to_host).map(|number| (Direction::ToHost, number));
    let all = to_device.chain(to_host);
    all.flat_map(|(direction, number)| HARMS.map(|frame_fault| (direction, number, frame_fault)))
        .collect()
}

#[test]
fn undisturbed_session_ends_at_once_without_uncertainty() {
    let report = agree(&Plan::default());
    eprintln!("{report:?}");
    assert!(report.ticks < 2_000 && report.uncertain == 0, "{report:?}");
}

/// Safety: 26.
#[test]
fn session_survives_any_single_lost_repeated_or_late_frame() {
    let frame_faults = single_harms();
    eprintln!("{} runs", frame_faults.len());
    for frame_fault in frame_faults {
        let frame_faults = vec![frame_fault];
        let report = agree(&Plan {
            frame_faults,
            ..Plan::default()
        });
        // Sooner than with a resumed session.
        assert!(report.ticks < 3_000, "{frame_fault:?}: {report:?}");
        assert_eq!(report.uncertain, 0, "{frame_fault:?}");
    }
}

#[test]
fn session_survives_any_two_frame_faults_while_opening() {
    // The first frames in each direction: open, scene, zero, arm, the tile and their answers.
    let opening: Vec<_> = single_harms()
        .into_iter()
        .filter(|(_, number, frame_fault)| {
            *number < 9
                && matches!(
                    frame_fault,
                    FrameFault::Lose | FrameFault::Repeat(900) | FrameFault::Delay(30)
                )
        })
        .collect();
    for (i, first) in opening.iter().enumerate() {
        for second in &opening[i + 1..] {
            let frame_faults = vec![*first, *second];
            agree(&Plan {
                frame_faults,
                ..Plan::default()
            });
        }
    }
}

#[test]
fn session_survives_any_two_frame_faults_while_closing() {
    let [to_device, to_host] = frames();
    let last: Vec<_> = single_harms()
        .into_iter()
        .filter(|(direction, number, frame_fault)| {
            let count = match direction {
                Direction::ToDevice => to_device,
                Direction::ToHost => to_host,
            };
            number + 8 > count
                && matches!(
                    frame_fault,
                    FrameFault::Lose | FrameFault::Repeat(900) | FrameFault::Delay(30)
                )
        })
        .collect();
    for (i, first) in last.iter().enumerate() {
        for second in &last[i + 1..] {
            let frame_faults = vec![*first, *second];
            agree(&Plan {
                frame_faults,
                ..Plan::default()
            });
        }
    }
}

/// Interrupts a run at every moment, alone and with one frame in either direction lost or repeated.
fn interrupted(what: Interruption) {
    let ticks = agree(&Plan::default()).ticks;
    for at in (0..ticks).step_by(MOMENTS) {
        let interruptions = vec![(at, what)];
        let plan = Plan {
            interruptions,
            ..Plan::default()
        };
        let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
        assert_eq!(report.end, End::Agreed, "{plan:?}");
        // The first frames of the run.
        for number in 0..12 {
            for (direction, frame_fault) in [
                (Direction::ToDevice, FrameFault::Lose),
                (Direction::ToHost, FrameFault::Lose),
                (Direction::ToHost, FrameFault::Repeat(900)),
            ] {
                let plan = Plan {
                    frame_faults: vec![(direction, number, frame_fault)],
                    ..plan.clone()
                };
                let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
                assert_eq!(report.end, End::Agreed, "{plan:?}");
            }
        }
    }
}

/// Safety: 26.
#[test]
fn host_may_be_killed_at_any_moment() {
    interrupted(Interruption::HostKilled);
}

#[test]
fn device_may_be_reset_at_any_moment() {
    interrupted(Interruption::DeviceReset);
}

#[test]
fn close_of_an_armed_session_is_confirmed_once_disarmed() {
    let abrupt = || Plan {
        abrupt: true,
        ..Plan::default()
    };
    let (ticks, frames) = (agree(&abrupt()).ticks, agree(&abrupt()).frames);
    for frame_fault in HARMS {
        // The last frames in each direction: the close, its confirmation, and others around them.
        for (direction, count) in [Direction::ToDevice, Direction::ToHost]
            .into_iter()
            .zip(frames)
        {
            for number in count.saturating_sub(12)..count {
                agree(&Plan {
                    frame_faults: vec![(direction, number, frame_fault)],
                    ..abrupt()
                });
            }
        }
    }
    // An earlier host had received its confirmation, and all its frames are repeated.
    let killed = (ticks - 2, Interruption::HostKilled);
    let again = Plan {
        interruptions: vec![killed],
        ..abrupt()
    };
    let leaves = agree(&again).ticks - 150;
    for at in leaves..leaves + 150 {
        for direction in [Direction::ToDevice, Direction::ToHost] {
            agree(&Plan {
                interruptions: vec![killed, (at, Interruption::Echo(direction))],
                ..abrupt()
            });
        }
    }
}

/// Returns histories before a moment, with the frames that may be repeated after it.
fn histories() -> Vec<Vec<(u64, Interruption)>> {
    let ticks = agree(&Plan::default()).ticks;
    // During the opening, in contact, and when everything but the last answer was sent.
    let killed = [60, ticks / 2, ticks - 2].map(|at| vec![(at, Interruption::HostKilled)]);
    [vec![]].into_iter().chain(killed).collect()
}

/// Plays each history with one more interruption at its end and at every moment after it. The end,
/// its time, the number of sessions and the uncertain ends must be the same as without.
fn at_every_moment_after(histories: &[Vec<(u64, Interruption)>], what: Interruption) {
    for history in histories {
        let plan = |interruptions| Plan {
            interruptions,
            ..Plan::default()
        };
        let alone = agree(&plan(history.clone()));
        let begin = history.last().map_or(0, |(at, _)| *at);
        for at in (begin..alone.ticks).step_by(MOMENTS) {
            let plan = plan([history.as_slice(), &[(at, what)]].concat());
            let report = agree(&plan);
            let (ends, sessions) = (report.uncertain, report.resumptions);
            assert_eq!((ends, sessions), (alone.uncertain, 0), "{plan:?}");
            assert!(report.ticks < alone.ticks + 900, "{report:?} in {plan:?}");
        }
    }
}

/// Safety: 32.
#[test]
fn replay_of_earlier_frames_does_not_change_the_outcome() {
    for direction in [Direction::ToDevice, Direction::ToHost] {
        at_every_moment_after(&histories(), Interruption::Echo(direction));
    }
}

#[test]
fn frames_from_before_a_reset_do_not_change_the_outcome() {
    let ticks = agree(&Plan::default()).ticks;
    let reset = [60, ticks / 2].map(|at| vec![(at, Interruption::DeviceReset)]);
    at_every_moment_after(&reset, Interruption::Echo(Direction::ToHost));
}

#[test]
fn host_of_another_version_may_connect_at_any_moment() {
    at_every_moment_after(&histories(), Interruption::OtherHost);
}

/// Safety: 32.
#[test]
fn replaced_host_reports_takeover_promptly() {
    let ticks = agree(&Plan::default()).ticks;
    let mut reported = 0;
    // Once alone, and once with its notification lost.
    for (at, late) in (0..ticks)
        .step_by(MOMENTS)
        .flat_map(|at| [(at, 0), (at, 900)])
    {
        let interruptions = vec![
            (at, Interruption::Takeover),
            (at, Interruption::Cut(Direction::ToHost, late)),
        ];
        let plan = Plan {
            interruptions,
            ..Plan::default()
        };
        let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
        // Silence for 0.75 s, then an open every 0.4 s.
        assert!(report.ticks < at + late + 1_300, "{report:?} in {plan:?}");
        // Its own open comes after the other host's, or its close before.
        let is_its_own = at == 0 || at + 200 > ticks;
        assert!(report.end == End::Reported || is_its_own, "{plan:?}");
        reported += u32::from(report.end == End::Reported);
    }
    assert!(reported > 40, "{reported}");
}

/// Safety: 32.
#[test]
fn late_answer_is_never_matched_to_a_later_query() {
    let mut answers = 0;
    for seed in 0..60 {
        let plan = Plan {
            queries_status: true,
            ..Plan::random(seed)
        };
        let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
        answers += report.answers;
    }
    assert!(answers > 3_000, "{answers}");
}

/// Returns the plan of a host that changes the placement while it renders, reads the calibration,
/// then requests held outputs, the storing of the record and a jog.
fn with_errands(frame_faults: Vec<(Direction, usize, FrameFault)>) -> Plan {
    Plan {
        frame_faults,
        requests: true,
        ..Plan::default()
    }
}

#[test]
fn lost_frames_leave_every_request_executed_once_or_refused() {
    let whole = agree(&with_errands(vec![]));
    eprintln!("{whole:?}");
    assert_eq!(whole.outcomes, [10, 0, 0], "all are done");
    let directions = [Direction::ToDevice, Direction::ToHost];
    for (direction, count) in directions.into_iter().zip(whole.frames) {
        for number in 0..count {
            for frame_fault in [
                FrameFault::Lose,
                FrameFault::Repeat(900),
                FrameFault::Delay(900),
            ] {
                let plan = with_errands(vec![(direction, number, frame_fault)]);
                let report = agree(&plan);
                assert_eq!(report.outcomes, whole.outcomes, "{plan:?}");
                assert_eq!(report.uncertain, 0, "{plan:?}");
            }
        }
    }
}

#[test]
fn interruption_between_requests_ends_in_confirmed_disarm() {
    let ticks = agree(&with_errands(vec![])).ticks;
    for what in [
        Interruption::HostKilled,
        Interruption::DeviceReset,
        Interruption::Echo(Direction::ToHost),
        Interruption::Cut(Direction::ToDevice, 1_500),
        Interruption::Cut(Direction::ToHost, 1_500),
    ] {
        for at in (0..ticks).step_by(4 * MOMENTS) {
            let plan = Plan {
                interruptions: vec![(at, what)],
                ..with_errands(vec![])
            };
            let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
            assert_eq!(report.end, End::Agreed, "{plan:?}");
        }
    }
}

#[test]
fn device_of_another_version_is_reported_and_never_driven() {
    let ticks = agree(&Plan::default()).ticks;
    let other = (0, Interruption::OtherDevice);
    let report = check(&Plan {
        interruptions: vec![other],
        ..Plan::default()
    });
    let report = report.expect("nothing wrong");
    assert!(report.end == End::Reported && !report.driven && report.ticks < 100);
    // A device that received other firmware in between reports it after its reset.
    for at in (0..ticks).step_by(MOMENTS) {
        let other = Interruption::OtherDevice;
        let interruptions = vec![(at, Interruption::DeviceReset), (at, other)];
        let plan = Plan {
            interruptions,
            ..Plan::default()
        };
        let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
        let is_late = at + 100 > ticks;
        assert!(
            report.end == End::Reported || is_late,
            "{report:?} in {plan:?}"
        );
        assert!(report.ticks < at + 3_000, "{report:?} in {plan:?}");
    }
}

#[test]
fn arm_is_disarmed_in_time_after_its_host_disappears() {
    let ticks = agree(&Plan::default()).ticks;
    for at in (0..ticks).step_by(MOMENTS) {
        let plan = Plan {
            interruptions: vec![(at, Interruption::HostGone)],
            ..Plan::default()
        };
        check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
    }
}

#[test]
fn cut_in_one_direction_ends_in_confirmed_disarm_or_report() {
    let ticks = agree(&Plan::default()).ticks;
    for long in [300, 1_500, 5_000] {
        for direction in [Direction::ToDevice, Direction::ToHost] {
            for at in (0..ticks).step_by(2 * MOMENTS) {
                let interruptions = vec![(at, Interruption::Cut(direction, long))];
                let plan = Plan {
                    interruptions,
                    ..Plan::default()
                };
                let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
                // A cut longer than the time-out of the close is reported to the user.
                assert!(report.end == End::Agreed || long > 3_000, "{plan:?}");
            }
        }
    }
}

/// Safety: 26.
#[test]
fn random_faults_end_in_confirmed_disarm_or_a_report() {
    let (mut agreed, mut reported) = (0, 0);
    for seed in 0..400 {
        let plan = Plan::random(seed);
        match check(&plan) {
            Ok(report) if report.end == End::Agreed => agreed += 1,
            Ok(_) => reported += 1,
            Err(wrong) => panic!("{wrong:?} in {plan:?}"),
        }
    }
    eprintln!("{agreed} agreed, {reported} reported");
    assert!(agreed > 200, "hardly ever agreed: {agreed}");
}

#[test]
fn dead_line_is_reported_without_a_hang() {
    for direction in [Direction::ToDevice, Direction::ToHost] {
        for at in [0, 200, 400] {
            let interruptions = vec![(at, Interruption::Cut(direction, u64::MAX / 2))];
            let plan = Plan {
                interruptions,
                ..Plan::default()
            };
            let report = check(&plan).unwrap_or_else(|wrong| panic!("{wrong:?} in {plan:?}"));
            assert_eq!(report.end, End::Reported, "{plan:?}");
            // Four seconds, five times; three for the close.
            assert!(report.ticks < 30_000, "{report:?} in {plan:?}");
        }
    }
}
