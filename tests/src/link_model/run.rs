//! One run: a host that opens a session, arms, renders, disarms, arms again and leaves; a device; a
//! user who presses the dead-man switch whenever it could arm the device.

use std::time::Duration;

use hapterra::link::{Arming, Client, Event, HostRequest, LinkError, State, Timeouts};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{GuardInputs, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, SceneChange, Source};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;
use heightfield::Raster;

use super::fault_plan::{Interruption, Plan};
use super::forged_frames;
use super::lossy_line::{Direction, LossyLine};
use super::oracle::{FADE, RunOracle, SILENCE_S, Wrong};
use super::requests::{RequestSequence, RequestStep};
use super::status_queries::StatusQueries;

/// Ticks after which a run counts as hanging: each step has its deadline, and no plan needs more.
const MAX: u64 = 60_000;
/// Ticks after the end in which delayed frames still arrive.
const AFTER: u64 = 6_500;
/// Samples with the amplifiers on after which the host continues.
const RAMP_SAMPLES: u32 = 60;
/// Times that the host resumes a silent session.
const RESUMPTIONS: u32 = 4;

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The host has a confirmation that the device is disarmed.
    Agreed,
    /// The host reported to its user that the state is unknown, and why.
    Reported,
}

/// Report of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// Its end.
    pub end: End,
    /// The tick of the end.
    pub ticks: u64,
    /// Frames sent, to the device and to the host.
    pub frames: [usize; 2],
    /// True if the amplifiers were ever on.
    pub driven: bool,
    /// Sessions whose end the host reports as unknown.
    pub uncertain: u64,
    /// Times that the host gave up a session and opened another.
    pub resumptions: u32,
    /// Status queries that were answered.
    pub answers: u32,
    /// Other requests than arming and disarming: succeeded, refused, and given up.
    pub came_of: [u32; 3],
}

/// Current step of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Opens a session and arms.
    Arming,
    /// Renders for a while.
    Feeling,
    /// Disarms, with the tick of the answer if it has arrived.
    Disarming(Option<u64>),
    /// Makes the requests for a disarmed arm.
    Asking,
    /// Closes the session.
    Leaving,
    Over(End),
}

struct World<'t> {
    terrain: &'t Terrain<'t>,
    scene: Scene,
    client: Client<'t>,
    device: Device<StoppedClock, 2>,
    lines: [LossyLine; 2],
    judge: RunOracle,
    /// Sessions in which the present host has sent something.
    sessions: Vec<u32>,
    step: Step,
    ramp_samples: u32,
    resumptions: u32,
    seed: u64,
    now: u64,
    enabled: bool,
    driven: bool,
    /// True if the host leaves without a request to disarm.
    abrupt: bool,
    /// True if the host queries the status without a pause.
    curious: bool,
    questions: StatusQueries,
    /// Requests while the arm is armed, and afterwards; `None` without requests.
    errands: Option<[RequestSequence; 2]>,
    /// Ticks of the device since its start.
    device_ticks: u32,
    /// True if the device reports another version.
    other_device: bool,
    /// True if no host remains.
    host_gone: bool,
}

/// Plays a plan.
///
/// # Errors
/// The first [`Wrong`].
pub fn check(plan: &Plan) -> Result<Report, Wrong> {
    let raster = Raster::from_fn(33, 33, |_, _| 0.0).expect("raster");
    let scale = Scale::new(1.0, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let home = scale.to_grid([16.3, 16.4, 10.0]).expect("addressable");
    let scene = Scene {
        hold_clock: false,
        materials: None,
        ..terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home)
    };
    World::new(&terrain, scene, plan).play(plan)
}

/// Returns the frames of an undisturbed run, to the device and to the host.
///
/// # Panics
/// If an undisturbed run fails.
#[must_use]
pub fn frames() -> [usize; 2] {
    check(&Plan::default()).expect("nothing goes wrong").frames
}

fn errands() -> [RequestSequence; 2] {
    [RequestSequence::armed(), RequestSequence::disarmed()]
}

fn device() -> Device<StoppedClock, 2> {
    // The two halves of the application exchange tile buffers by reference, as long as the program
    // runs.
    Device::new(
        Box::leak(Box::new(TileBuffers::VACANT)),
        Box::leak(Box::new(WorkingMemory::new())),
        StoppedClock,
        Stored::Found(Calibration::PREMIUM_1_5),
        BootReport::default(),
    )
}

impl<'t> World<'t> {
    fn new(terrain: &'t Terrain<'t>, scene: Scene, plan: &Plan) -> Self {
        let line = |direction, salt| {
            let harms = plan.harms.iter().filter(|(way, _, _)| *way == direction);
            let random = plan.random.map(|(seed, share)| (seed ^ salt, share));
            LossyLine::new(harms.map(|(_, at, harm)| (*at, *harm)).collect(), random)
        };
        Self {
            terrain,
            scene,
            client: host(terrain, scene, 1),
            device: device(),
            lines: [line(Direction::ToDevice, 0), line(Direction::ToHost, 1)],
            judge: RunOracle::default(),
            sessions: vec![],
            step: Step::Arming,
            ramp_samples: 0,
            resumptions: 0,
            seed: 1,
            now: 0,
            enabled: false,
            driven: false,
            abrupt: plan.abrupt,
            curious: plan.curious,
            questions: StatusQueries::default(),
            errands: plan.errands.then(errands),
            device_ticks: 0,
            other_device: false,
            host_gone: false,
        }
    }

    fn play(mut self, plan: &Plan) -> Result<Report, Wrong> {
        self.greet();
        let end = loop {
            self.interrupt(plan);
            self.tick()?;
            if let Step::Over(end) = self.step {
                break end;
            }
            // Without a user to report to, only the state of the device counts.
            if self.host_gone && !self.enabled {
                break End::Reported;
            }
            if self.now > MAX {
                return Err(Wrong::Hangs);
            }
        };
        let ticks = self.now;
        if end == End::Agreed {
            self.judge.count(self.client.stats(), &self.sessions)?;
            self.judge.agreed(self.now, self.enabled)?;
        }
        for _ in 0..AFTER {
            self.tick()?;
        }
        Ok(Report {
            end,
            ticks,
            frames: [self.lines[0].count(), self.lines[1].count()],
            driven: self.driven,
            uncertain: self.client.stats().uncertain,
            resumptions: self.resumptions,
            answers: self.questions.answers,
            came_of: self.errands.map_or([0; 3], |[armed, disarmed]| {
                std::array::from_fn(|i| armed.came_of[i] + disarmed.came_of[i])
            }),
        })
    }

    fn interrupt(&mut self, plan: &Plan) {
        let now = self.now;
        let here = plan.interruptions.iter().filter(|(at, _)| *at == now);
        for (_, what) in here {
            match what {
                Interruption::HostKilled => {
                    self.seed += 1;
                    self.client = host(self.terrain, self.scene, self.seed);
                    self.lines[0].break_off();
                    self.sessions.clear();
                    (self.step, self.ramp_samples, self.resumptions) = (Step::Arming, 0, 0);
                    self.questions.forget();
                    self.errands = self.errands.is_some().then(errands);
                    self.judge.another_host();
                    self.greet();
                }
                Interruption::HostGone => {
                    self.lines[0].break_off();
                    self.host_gone = true;
                }
                Interruption::DeviceReset => {
                    self.device = device();
                    self.device_ticks = 0;
                    self.questions.device_restarted();
                    self.lines[1].break_off();
                    self.enabled = false;
                }
                Interruption::Cut(Direction::ToDevice, long) => self.lines[0].cut(now + long),
                Interruption::Cut(Direction::ToHost, long) => self.lines[1].cut(now + long),
                Interruption::Echo(Direction::ToDevice) => self.lines[0].echo(now),
                Interruption::Echo(Direction::ToHost) => self.lines[1].echo(now),
                Interruption::OtherHost => {
                    for frame in forged_frames::greeting() {
                        self.lines[0].slip_in(frame, now);
                    }
                }
                Interruption::Takeover => {
                    for frame in forged_frames::takeover() {
                        self.lines[0].slip_in(frame, now);
                    }
                }
                Interruption::OtherDevice => self.other_device = true,
            }
        }
    }

    fn greet(&mut self) {
        let mut out = vec![];
        self.client.greet(time(self.now), &mut out);
        self.sessions.push(self.client.session().get());
        self.sessions.dedup();
        self.judge.wished();
        self.say(&out);
    }

    /// Sends the bytes of the host.
    fn say(&mut self, out: &[u8]) {
        self.judge.host_says(out);
        self.lines[0].send(out, self.now);
    }

    fn tick(&mut self) -> Result<(), Wrong> {
        self.now += 1;
        for frame in self.lines[0].arrived(self.now) {
            self.judge.frame_came(self.now);
            let mut rest = frame.as_slice();
            // Bytes without room now have room after a poll.
            for _ in 0..100 {
                let taken = self.device.receive(rest);
                rest = &rest[taken..];
                self.listen();
            }
        }
        // The user presses the switch until the amplifiers are on, and holds it.
        let dead_man = self.enabled || self.now % 300 > 60;
        let sense = GuardInputs {
            dead_man,
            ..GuardInputs::default()
        };
        self.enabled = self.device.tick(sense).enabled;
        self.device_ticks += 1;
        self.driven |= self.enabled;
        let session = self.client.session().get();
        self.judge.look(self.now, self.enabled, session)?;
        self.listen();
        match self.host_gone {
            true => Ok(()),
            false => self.host(),
        }
    }

    /// Sends the bytes of the device.
    fn listen(&mut self) {
        let mut chunk = [0; 2048];
        loop {
            let stated = self.device.link.transmit(&mut chunk);
            if stated == 0 {
                return;
            }
            self.judge.device_says(&chunk[..stated]);
            self.lines[1].send(&chunk[..stated], self.now);
        }
    }

    /// Runs the host's program.
    fn host(&mut self) -> Result<(), Wrong> {
        let (mut out, now) = (vec![], time(self.now));
        let (step, ramp_samples) = (&mut self.step, &mut self.ramp_samples);
        let at = self.now;
        let (mut opened, mut samples) = (None, vec![]);
        let (questions, errands) = (&mut self.questions, &mut self.errands);
        let mut on = |event: Event<'_>| {
            for list in errands.iter_mut().flatten() {
                list.take(&event);
            }
            match event {
                Event::Opened { device, .. } => opened = Some(device.clone()),
                Event::Sample(sample) => {
                    *ramp_samples += u32::from(sample.mode == Mode::Ramping);
                    samples.push(sample.tick);
                }
                Event::Answered {
                    request: Request::Disarm,
                    ..
                } => {
                    if let Step::Disarming(answered) = step {
                        answered.get_or_insert(at);
                    }
                }
                event => questions.take(&event),
            }
        };
        let mut received = Ok(());
        for mut frame in self.lines[1].arrived(self.now) {
            if self.other_device {
                frame = forged_frames::of_another_version(frame);
            }
            received = received.and_then(|()| self.client.receive(now, &frame, &mut out, &mut on));
        }
        let received = received.and_then(|()| self.client.append_due(now, &mut out, &mut on));
        self.say(&out);
        let session = self.client.session().get();
        self.judge.reported(session, opened.as_ref(), &samples)?;
        self.questions.judge()?;
        match received {
            Ok(()) => self.go_on(),
            Err(error) => return self.on_error(error),
        }
        Ok(())
    }

    /// Queries the status, if the last query was answered.
    fn wonder(&mut self) {
        let is_at_leisure = matches!(self.step, Step::Feeling | Step::Disarming(_));
        if self.curious
            && is_at_leisure
            && let Some(ask) = self.questions.ask(self.device_ticks)
        {
            self.client.enqueue(ask);
        }
    }

    /// Starts the next step, if the last one is done.
    fn go_on(&mut self) {
        self.wonder();
        let is_closed = self.client.state() == State::Closed;
        match self.step {
            Step::Arming if self.ramp_samples > 0 => self.step = Step::Feeling,
            Step::Feeling if self.ramp_samples >= RAMP_SAMPLES && self.abrupt => self.leave(),
            Step::Feeling if self.ramp_samples >= RAMP_SAMPLES && self.has_errands(0) => {
                self.run_errands(0);
            }
            Step::Feeling if self.ramp_samples >= RAMP_SAMPLES => {
                self.client.enqueue(HostRequest::Request(Request::Disarm));
                self.step = Step::Disarming(None);
            }
            Step::Disarming(Some(answered)) => {
                self.judge.unwished_from(answered + FADE);
                if self.now > answered + 2 * FADE && self.errands.is_some() {
                    self.step = Step::Asking;
                } else if self.now > answered + 2 * FADE {
                    self.leave();
                }
            }
            Step::Asking if self.has_errands(1) => self.run_errands(1),
            Step::Asking => self.leave(),
            Step::Leaving if is_closed => self.step = Step::Over(End::Agreed),
            // A user who waits too long gives up and closes the session.
            _ if self.now.is_multiple_of(40_000) && self.step != Step::Leaving => self.leave(),
            _ => {}
        }
    }

    /// Returns true if a list has steps left or in progress.
    fn has_errands(&self, list: usize) -> bool {
        let lists = self.errands.as_ref();
        lists.is_some_and(|lists| !lists[list].are_done())
    }

    /// Starts the next step of a list, if the last one has ended.
    fn run_errands(&mut self, list: usize) {
        let lists = self.errands.as_mut();
        let Some(errand) = lists.and_then(|lists| lists[list].next(self.now)) else {
            return;
        };
        match errand {
            RequestStep::HostRequest(ask) => {
                match ask {
                    HostRequest::Request(Request::Jog(_)) => self.judge.wished(),
                    // Two deadlines, because the request may be repeated once.
                    HostRequest::Request(Request::Disarm) => {
                        self.judge.unwished_from(self.now + 9_000);
                    }
                    _ => {}
                }
                self.client.enqueue(ask);
            }
            RequestStep::View(number) => self.put_view(number),
            // A remaining force has faded.
            RequestStep::Wait(_) => {}
        }
    }

    fn put_view(&mut self, number: u8) {
        let scene = Scene {
            epoch: 5_000 + u32::from(number),
            ..*self.client.scene()
        };
        let view = SceneChange {
            number,
            scene,
            hip: scene.home,
            keeps_tiles: true,
        };
        let mut out = vec![];
        let terrain = self.terrain.clone();
        self.client
            .put_view(time(self.now), view, terrain, &mut out);
        self.say(&out);
    }

    fn leave(&mut self) {
        if matches!(self.step, Step::Over(_)) {
            return;
        }
        let mut out = vec![];
        self.client.leave(time(self.now), &mut out);
        self.say(&out);
        self.step = Step::Leaving;
    }

    fn on_error(&mut self, error: LinkError) -> Result<(), Wrong> {
        match (error, self.step) {
            (_, Step::Over(_)) => {}
            // To the device, late frames of an earlier host look like another host's.
            (LinkError::NotConfirmed | LinkError::Taken, _) => {
                self.step = Step::Over(End::Reported);
            }
            (LinkError::Version { .. }, _) if self.other_device => {
                self.step = Step::Over(End::Reported);
            }
            (LinkError::Silent(_) | LinkError::HostSilent, _) if self.resumptions < RESUMPTIONS => {
                self.resumptions += 1;
                if let Step::Disarming(_) | Step::Asking = self.step {
                    self.leave();
                } else {
                    self.greet();
                }
            }
            (LinkError::Silent(_) | LinkError::HostSilent, _) => self.leave(),
            (error, _) => return Err(Wrong::Error(error.to_string())),
        }
        Ok(())
    }
}

fn host<'t>(terrain: &'t Terrain<'t>, scene: Scene, seed: u64) -> Client<'t> {
    let timeout = Timeouts {
        silence_s: SILENCE_S,
        ..Timeouts::REAL_TIME
    };
    let arming = Some(Arming::VIRTUAL);
    Client::numbered(terrain, scene, arming, timeout, seed)
}

/// A tick is a millisecond; the clock starts before the program.
const fn time(now: u64) -> Duration {
    Duration::from_millis(1_000_000 + now)
}
