//! Every promise of the guard, in the closed loop: the virtual Phantom with a
//! hand on it, the device's own application, and something that goes wrong
//! between them.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Arming, Event, Native, Patience, Session};
use hapterra::phantom::{HandModel, PhantomModel, Placement, Rig, Script, Touch};
use hapterra::raster::Raster;
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::{Rule, State};
use hapterra_core::force::ForceLaw;
use hapterra_core::guard::{Blockers, Drive, Fault, Limits, Mode, Report, Sense, WORKING_SHARE};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::message::{Sample, Scene, Source, ToDevice};
use hapterra_core::wire::status::{Answer, BootReport, Refusal, Request, ResetCause};
use hapterra_firmware::board::TickClock;
use hapterra_firmware::native::StoppedClock;
use hapterra_firmware::store::Stored;
use hapterra_tests::faulty::Shared;

/// The plane that is felt lies here, mm; the hand starts above its middle.
const PLANE_MM: f64 = 20.0;
const MIDDLE_MM: [f64; 2] = [100.0, 100.0];
/// When the script begins, in ticks, and when a press has settled.
const BEGIN: u64 = (1e3 * Rig::ARMED_S) as u64;
const PRESSED: u64 = BEGIN + 1_500;

/// What goes wrong, by tick.
type Wrong = fn(u64, &mut Sense);
/// What each tick was given and what it drove.
type Log = Rc<RefCell<Vec<(Sense, Drive)>>>;

/// A device with an arm, a session with it, and all that was seen.
struct Bed<'t> {
    terrain: &'t Terrain<'t>,
    scene: Scene,
    device: Rc<RefCell<Native>>,
    session: Option<Session<'t>>,
    log: Log,
    samples: Vec<Sample>,
    reports: Vec<Report>,
    answers: Vec<Answer>,
}

impl<'t> Bed<'t> {
    fn new(terrain: &'t Terrain<'t>, script: Script, wrong: Wrong) -> Self {
        let stored = Stored::Found(Calibration::PREMIUM_1_5);
        Self::started(terrain, script, wrong, (stored, BootReport::default()))
    }

    fn started(
        terrain: &'t Terrain<'t>,
        script: Script,
        wrong: Wrong,
        (stored, boot): (Stored, BootReport),
    ) -> Self {
        let [x, y] = MIDDLE_MM;
        let home_mm = [x, y, PLANE_MM + 4.0];
        let model = PhantomModel::premium_1_5();
        let rig = Rig::new(model, HandModel::default(), Placement { home_mm }, script);
        let rig = rig.expect("in reach").arming();
        let log = Log::default();
        let seen = Rc::clone(&log);
        let device = Native::started(StoppedClock, Some(Box::new(rig)), stored, boot).meddled_with(
            Box::new(move |tick, sense, drive| {
                if let Some(last) = seen.borrow_mut().last_mut() {
                    last.1 = *drive;
                }
                wrong(tick, sense);
                seen.borrow_mut().push((*sense, Drive::default()));
            }),
        );
        let home = terrain.scale().to_grid(home_mm).expect("addressable");
        let law = ForceLaw::PREMIUM;
        Self {
            terrain,
            scene: terrain.scene(law, Rule::Swept, Source::Encoders, home),
            device: Rc::new(RefCell::new(device)),
            session: None,
            log,
            samples: Vec::new(),
            reports: Vec::new(),
            answers: Vec::new(),
        }
    }

    fn open(&mut self, arming: Option<Arming>) {
        let link = Box::new(Shared(Rc::clone(&self.device)));
        let (terrain, scene, patience) = (self.terrain, self.scene, Patience::REAL_TIME);
        let opened = match arming {
            Some(arming) => Session::open_arming(terrain, scene, arming, link, patience),
            None => Session::open(terrain, scene, link, patience),
        };
        self.session = Some(opened.expect("opened").0);
    }

    /// Runs until a tick of the scene.
    fn run(mut self, until: u64) -> Self {
        if self.session.is_none() {
            self.open(Some(Arming::VIRTUAL));
        }
        while (self.samples.last().map_or(0, |last| u64::from(last.tick))) < until {
            self.poll();
        }
        self
    }

    fn poll(&mut self) {
        let session = self.session.as_mut().expect("open");
        let (samples, reports) = (&mut self.samples, &mut self.reports);
        let answers = &mut self.answers;
        let polled = session.poll(Duration::ZERO, &mut |event| match event {
            Event::Sample(sample) => samples.push(*sample),
            Event::Guard(report) => reports.push(*report),
            Event::Answer(answer) => answers.push(*answer),
            _ => {}
        });
        polled.expect("goes on");
    }

    fn say(&mut self, message: &ToDevice<'_>) {
        let session = self.session.as_mut().expect("open");
        session.say(message).expect("said");
    }

    fn sample(&self, tick: u64) -> &Sample {
        let index = usize::try_from(tick).expect("small") - 1;
        &self.samples[index]
    }

    /// The first tick that was given something and the amplifiers off, after
    /// they had been on.
    fn off_at(&self) -> u64 {
        let log = self.log.borrow();
        let on = log.iter().position(|(_, drive)| drive.enabled);
        let on = on.expect("it was on");
        let off = log[on..].iter().position(|(_, drive)| !drive.enabled);
        (on + off.expect("it went off")) as u64
    }

    /// Never a force above the clamp, a current above the peak, or a current
    /// while off.
    fn check_bounds(&self) {
        for (tick, (_, drive)) in self.log.borrow().iter().enumerate() {
            let most = drive.currents_a.abs().max_element();
            assert!(most <= 5.5, "{most} A at {tick}");
            assert!(drive.enabled || most == 0.0, "{most} A while off at {tick}");
        }
        for sample in &self.samples {
            assert!(sample.force_n.length() <= 8.5 * WORKING_SHARE);
            let driven = sample.mode.drives();
            assert!(driven || sample.force_n.length() == 0.0, "{}", sample.tick);
        }
    }
}

fn plane() -> Raster {
    Raster::from_fn(101, 101, |_, _| PLANE_MM as f32).expect("raster")
}

fn on_plane(raster: &Raster) -> Terrain<'_> {
    Terrain::new(raster, Scale::new(2.0, 1.0).expect("scale"), 0).expect("terrain")
}

/// Comes down and presses for so many seconds.
fn press_for(newtons: f64, seconds: f64) -> Touch<'static> {
    let wall = f64::from(ForceLaw::PREMIUM.stiffness_n_per_mm);
    let hand = HandModel::default();
    Touch::start(&|_, _| Some(PLANE_MM), &hand, wall, MIDDLE_MM, 10.0).press(newtons, seconds)
}

/// The same, for a long while.
fn press(newtons: f64) -> Touch<'static> {
    press_for(newtons, 3.0)
}

/// To and fro, pressing.
fn rub(newtons: f64, times: u32) -> Script {
    let [x, y] = MIDDLE_MM;
    let line: Vec<[f64; 2]> = (0..times)
        .flat_map(|_| [[x + 40.0, y + 10.0], [x - 40.0, y - 10.0]])
        .collect();
    press_for(newtons, 1.0).slide(&line, newtons, 40.0).finish()
}

const NOTHING: Wrong = |_, _| {};

#[test]
fn armed_only_after_the_switch_was_pressed_and_force_comes_in_over_two_seconds() {
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
    let granted = Answer {
        request: Request::Arm,
        result: Ok(()),
    };
    assert!(bed.answers.contains(&granted), "{:?}", bed.answers);
    assert!((bed.sample(PRESSED + 400).force_n.z - 1.0).abs() < 0.1);
}

#[test]
fn a_switch_held_from_the_beginning_never_arms() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let held: Wrong = |_, sense| sense.dead_man = true;
    let bed = Bed::new(&terrain, press(1.0).finish(), held).run(PRESSED);
    assert!(bed.log.borrow().iter().all(|(_, drive)| !drive.enabled));
    let last = bed.reports.last().expect("told");
    assert_eq!(last.blockers, Blockers::DEAD_MAN_STILL_HELD);
}

#[test]
fn what_goes_wrong_under_a_press_is_zero_in_the_same_tick_and_latched() {
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
        // An encoder that starts anew from nothing.
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
        let report = bed.reports.last().expect("told");
        assert!(report.blockers.contains(Blockers::FAULT_LATCHED));
    }
}

#[test]
fn after_a_fault_it_takes_a_clearing_a_command_and_a_new_press() {
    let raster = plane();
    let terrain = on_plane(&raster);
    // Let go, and held again for good half a second later; pressed anew at 6 s.
    let wrong: Wrong = |tick, sense| {
        sense.dead_man &= !(PRESSED..PRESSED + 500).contains(&tick);
        sense.dead_man &= !(5_900..6_000).contains(&tick);
    };
    let script = press(0.1).finish().wait(30.0);
    let mut bed = Bed::new(&terrain, script, wrong).run(PRESSED + 700);
    bed.say(&ToDevice::Arm);
    bed = bed.run(PRESSED + 900);
    let refused = Err(Refusal::Blocked(Blockers::FAULT_LATCHED));
    assert_eq!(bed.answers.last().map(|a| a.result), Some(refused));
    bed.say(&ToDevice::ClearFault);
    bed.say(&ToDevice::Arm);
    bed = bed.run(5_890);
    let report = bed.reports.last().expect("told");
    assert_eq!(report.blockers, Blockers::DEAD_MAN_STILL_HELD);
    assert!(!bed.log.borrow()[5_880].1.enabled);
    bed = bed.run(8_300);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));
    bed.check_bounds();
}

#[test]
fn an_encoder_that_slips_away_runs_into_the_joint_limits() {
    let raster = plane();
    let terrain = on_plane(&raster);
    // Counts that are lost by and by: no jump.
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

#[test]
fn a_dead_encoder_under_load_is_found() {
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
fn rubbed_and_pressed_without_harm_nothing_trips() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let bed = Bed::new(&terrain, rub(1.2, 3), NOTHING).run(PRESSED + 14_000);
    assert!(bed.samples.iter().all(|s| s.fault.is_none()));
    bed.check_bounds();
}

#[test]
fn motors_that_work_hard_are_derated_and_stay_cool_enough() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let bed = Bed::new(&terrain, rub(5.0, 10), NOTHING).run(PRESSED + 40_000);
    bed.check_bounds();
    let derated = |s: &&Sample| s.limits.contains(Limits::THERMAL_DERATED);
    let first = bed.samples.iter().find(derated).expect("derated").tick;
    eprintln!("derated from {first} ms on");
    assert_eq!(bed.samples.last().and_then(|s| s.fault), None);
    // The plant's own, independent thermal model.
    let device = bed.device.borrow();
    let hottest = device.rig().expect("a rig").plant().winding_c();
    assert!(hottest.iter().all(|c| *c < 110.0), "{hottest:?}");
    assert!(hottest.iter().any(|c| *c > 75.0), "{hottest:?}");
}

#[test]
fn a_hurried_hand_gets_less_force_and_a_thrown_arm_none() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let [x, y] = MIDDLE_MM;
    let sweep = |speed: f64| {
        let far = [x + 130.0, y, PLANE_MM + 20.0];
        let near = [x - 130.0, y, PLANE_MM + 20.0];
        Script::start([x, y, PLANE_MM + 20.0])
            .go(near, 100.0)
            .go(far, speed)
            .go(near, speed)
    };
    let bed = Bed::new(&terrain, sweep(1_300.0), NOTHING).run(BEGIN + 3_000);
    bed.check_bounds();
    let limited = |s: &&Sample| s.limits.contains(Limits::SPEED_LIMITED);
    assert!(bed.samples.iter().filter(limited).count() > 20);
    assert_eq!(bed.samples.last().and_then(|s| s.fault), None);
    // An encoder that runs away evenly looks like an arm that was thrown.
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

/// The largest change of the currents from one tick to the next, A.
fn largest_step(log: &[(Sense, Drive)]) -> f32 {
    let steps = log.windows(2).map(|pair| {
        let change = pair[1].1.currents_a - pair[0].1.currents_a;
        change.abs().max_element()
    });
    steps.fold(0.0, f32::max)
}

#[test]
fn without_its_host_it_goes_on_and_fades_at_the_edge_of_what_it_holds() {
    // Cells of a quarter of a millimetre: a tile is 8 mm, and the hand leaves
    // those that are held.
    let raster = Raster::from_fn(801, 801, |_, _| PLANE_MM as f32).expect("raster");
    let scale = Scale::new(0.25, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let [x, y] = MIDDLE_MM;
    let hand = HandModel::default();
    let surface = |_: f64, _: f64| Some(PLANE_MM);
    let script = Touch::start(&surface, &hand, 0.5, MIDDLE_MM, 10.0)
        .press(1.0, 1.0)
        .slide(&[[x + 60.0, y]], 1.0, 40.0)
        .finish();
    let mut bed = Bed::new(&terrain, script, NOTHING).run(PRESSED);
    assert!(bed.sample(PRESSED).force_n.z > 0.8);
    bed.session = None;
    let passed = 4_000;
    bed.device.borrow_mut().pass(passed);
    {
        let log = bed.log.borrow();
        let alone = &log[PRESSED as usize..];
        assert!(
            alone
                .iter()
                .all(|(_, d)| d.enabled || d == &alone[alone.len() - 1].1)
        );
        let weight = alone[alone.len() - 2].1.currents_a;
        let step = largest_step(&alone[..alone.len() - 1]);
        eprintln!("largest step {step:.3} A, at the end {weight} A");
        assert!(step < 0.06, "{step} A");
        // Only the arm's weight is left: −0.062 A on axis 2, as much on 3.
        assert!(weight.abs().max_element() < 0.3, "{weight}");
    }
    // Back again, force comes in as gently.
    bed.open(None);
    let before = bed.log.borrow().len() - 1;
    bed = bed.run(PRESSED + u64::from(passed) + 600);
    let log = bed.log.borrow();
    let step = largest_step(&log[before..log.len() - 1]);
    eprintln!("largest step after the return {step:.3} A");
    assert!(step < 0.06, "{step} A");
    let last = bed.samples.last().expect("samples");
    // Let go at the edge, the surface is felt again once the hand has been
    // above it.
    assert_eq!((last.mode, last.fault), (Mode::Armed, None));
    assert_eq!((last.state, last.held_up_by), (State::Waiting, None));
    // And while the host was away the device knew why there was less force.
    let reasons = bed.samples.iter().map(|s| s.limits);
    let why = reasons.fold(Limits::empty(), |all, limits| all | limits);
    eprintln!("limits: {why:?}");
}

#[test]
fn goodbye_lets_the_force_out_gently_and_switches_off() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let mut bed = Bed::new(&terrain, press(2.0).finish(), NOTHING).run(PRESSED);
    bed.say(&ToDevice::Bye);
    bed.device.borrow_mut().pass(300);
    let log = bed.log.borrow();
    let off = bed.off_at() as usize;
    assert!((90..130).contains(&(off - PRESSED as usize)), "{off}");
    let going = &log[PRESSED as usize - 10..off];
    let before = going[0].1.currents_a.abs().max_element();
    let step = largest_step(going);
    assert!(before > 1.0 && step < 0.02 * before, "{before} A, {step} A");
    assert!(log[off..].iter().all(|(_, drive)| !drive.enabled));
}

#[test]
fn what_was_found_at_boot_has_to_be_cleared_first() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let starved = BootReport {
        cause: ResetCause::Watchdog,
        crash: None,
    };
    let good = Stored::Found(Calibration::PREMIUM_1_5);
    let script = || press(0.1).finish().wait(30.0);
    let held_late: Wrong = |tick, sense| sense.dead_man &= tick > 1_000;
    let mut bed = Bed::started(&terrain, script(), held_late, (good, starved)).run(500);
    let refused = Err(Refusal::Blocked(Blockers::FAULT_LATCHED));
    assert_eq!(bed.answers.last().map(|a| a.result), Some(refused));
    let fault = bed.reports.last().and_then(|r| r.fault);
    assert_eq!(fault, Some(Fault::WatchdogReset));
    bed.say(&ToDevice::ClearFault);
    bed.say(&ToDevice::Arm);
    bed = bed.run(3_300);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));

    let damaged = (Stored::Damaged, BootReport::default());
    let mut bed = Bed::started(&terrain, script(), held_late, damaged).run(500);
    let fault = bed.reports.last().and_then(|r| r.fault);
    assert_eq!(fault, Some(Fault::CalibrationCorrupt));
    bed.say(&ToDevice::ClearFault);
    bed.say(&ToDevice::Arm);
    bed = bed.run(700);
    let refused = Err(Refusal::Blocked(Blockers::NO_CALIBRATION));
    assert_eq!(bed.answers.last().map(|a| a.result), Some(refused));
    bed.say(&ToDevice::SetCalibration {
        calibration: Calibration::PREMIUM_1_5,
        store: true,
    });
    bed.say(&ToDevice::Arm);
    bed = bed.run(3_400);
    assert_eq!(bed.samples.last().map(|s| s.mode), Some(Mode::Armed));
    assert_eq!(*bed.device.borrow().memory(), good);
}

/// Ten thousand ticks a second.
struct TenKilohertz;

impl TickClock for TenKilohertz {
    const HZ: u32 = 10_000_000;
    const PERIOD: u32 = 1_000;

    fn now(&self) -> u32 {
        0
    }

    fn since_due(&self) -> u32 {
        0
    }

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        false
    }
}

#[test]
fn at_ten_kilohertz_all_of_it_takes_as_long_and_feels_the_same() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let [x, y] = MIDDLE_MM;
    let home_mm = [x, y, PLANE_MM + 4.0];
    let model = PhantomModel::premium_1_5();
    let (hand, place) = (HandModel::default(), Placement { home_mm });
    let rig = Rig::new(model, hand, place, press(1.0).finish()).expect("in reach");
    let off = Rc::new(RefCell::new(None));
    let seen = Rc::clone(&off);
    let released = 10 * PRESSED;
    let device = Native::new(TenKilohertz, Some(Box::new(rig.arming()))).meddled_with(Box::new(
        move |tick, sense, drive| {
            if tick > released && !drive.enabled {
                seen.borrow_mut().get_or_insert(tick - 1);
            }
            sense.dead_man &= tick < released;
        },
    ));
    let home = terrain.scale().to_grid(home_mm).expect("addressable");
    let scene = terrain.scene(ForceLaw::PREMIUM, Rule::Swept, Source::Encoders, home);
    let (arming, link) = (Arming::VIRTUAL, Box::new(device));
    let opened = Session::open_arming(&terrain, scene, arming, link, Patience::REAL_TIME);
    let (mut session, hello) = opened.expect("opened");
    assert_eq!(hello.tick_hz, 10_000);
    let mut samples: Vec<Sample> = Vec::new();
    while samples.last().map_or(0, |last| u64::from(last.tick)) < released + 1_000 {
        let polled = session.poll(Duration::ZERO, &mut |event| {
            if let Event::Sample(sample) = event {
                samples.push(*sample);
            }
        });
        polled.expect("goes on");
    }
    let tally = session.tally();
    assert_eq!(
        (tally.lost, tally.dropped),
        (0, 0),
        "a thousand samples a second"
    );
    assert!(
        samples
            .windows(2)
            .all(|pair| pair[1].tick - pair[0].tick == 10)
    );
    let at = |mode| {
        samples
            .iter()
            .find(|s| s.mode == mode)
            .expect("reached")
            .tick
    };
    assert!((19_990..=20_010).contains(&(at(Mode::Armed) - at(Mode::Ramping))));
    let before = samples.iter().rev().find(|s| u64::from(s.tick) < released);
    let force = before.expect("samples").force_n;
    assert!((force.z - 1.0).abs() < 0.1, "{force}");
    assert_eq!(*off.borrow(), Some(released));
    let fault = samples.last().and_then(|sample| sample.fault);
    assert_eq!(fault, Some(Fault::DeadManReleased));
}
