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
use super::oracle::{FADE, RunOracle, SILENCE_S, Violation};
use super::requests::{RequestSequence, RequestStep};
use super::status_queries::StatusQueries;

/// Ticks after which a run counts as hanging: each step has its deadline, and no plan needs more.
const MAX_TICKS: u64 = 60_000;
/// Ticks after the end in which delayed frames still arrive.
const AFTER_TICKS: u64 = 6_500;
/// Samples with the amplifiers on after which the host continues.
const RAMP_SAMPLES: u32 = 60;
/// Times that the host resumes a silent session.
const MAX_RESUMPTIONS: u32 = 4;

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
    /// Number of sessions that the host abandoned to open another.
    pub resumptions: u32,
    /// Status queries that were answered.
    pub answers: u32,
    /// Other requests than arming and disarming: succeeded, refused, and abandoned.
    pub outcomes: [u32; 3],
}

/// Current step of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Opens a session and arms.
    Arming,
    /// Renders for a while.
    Touching,
    /// Disarms, with the tick of the answer if it has arrived.
    Disarming(Option<u64>),
    /// Makes the requests for a disarmed arm.
    Requesting,
    /// Closes the session.
    Closing,
    Ended(End),
}

struct Simulation<'t> {
    terrain: &'t Terrain<'t>,
    scene: Scene,
    client: Client<'t>,
    device: Device<StoppedClock, 2>,
    lines: [LossyLine; 2],
    oracle: RunOracle,
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
    queries_status: bool,
    status_queries: StatusQueries,
    /// Requests while the arm is armed, and afterwards; `None` without requests.
    requests: Option<[RequestSequence; 2]>,
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
/// The first [`Violation`].
pub fn check(plan: &Plan) -> Result<Report, Violation> {
    let raster = Raster::from_fn(33, 33, |_, _| 0.0).expect("raster");
    let scale = Scale::new(1.0, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let home = scale.to_grid([16.3, 16.4, 10.0]).expect("addressable");
    let scene = Scene {
        hold_clock: false,
        materials: None,
        ..terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home)
    };
    Simulation::new(&terrain, scene, plan).play(plan)
}

/// Returns the frames of an undisturbed run, to the device and to the host.
///
/// # Panics
/// If an undisturbed run fails.
#[must_use]
pub fn frames() -> [usize; 2] {
    check(&Plan::default()).expect("nothing goes wrong").frames
}

fn requests() -> [RequestSequence; 2] {
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

impl<'t> Simulation<'t> {
    fn new(terrain: &'t Terrain<'t>, scene: Scene, plan: &Plan) -> Self {
        let line = |direction, salt| {
            let frame_faults = plan
                .frame_faults
                .iter()
                .filter(|(fault_direction, _, _)| *fault_direction == direction);
            let random = plan.random.map(|(seed, share)| (seed ^ salt, share));
            LossyLine::new(
                frame_faults
                    .map(|(_, at, frame_fault)| (*at, *frame_fault))
                    .collect(),
                random,
            )
        };
        Self {
            terrain,
            scene,
            client: host(terrain, scene, 1),
            device: device(),
            lines: [line(Direction::ToDevice, 0), line(Direction::ToHost, 1)],
            oracle: RunOracle::default(),
            sessions: vec![],
            step: Step::Arming,
            ramp_samples: 0,
            resumptions: 0,
            seed: 1,
            now: 0,
            enabled: false,
            driven: false,
            abrupt: plan.abrupt,
            queries_status: plan.queries_status,
            status_queries: StatusQueries::default(),
            requests: plan.requests.then(requests),
            device_ticks: 0,
            other_device: false,
            host_gone: false,
        }
    }

    fn play(mut self, plan: &Plan) -> Result<Report, Violation> {
        self.greet();
        let end = loop {
            self.interrupt(plan);
            self.tick()?;
            if let Step::Ended(end) = self.step {
                break end;
            }
            // Without a user to report to, only the state of the device counts.
            if self.host_gone && !self.enabled {
                break End::Reported;
            }
            if self.now > MAX_TICKS {
                return Err(Violation::Hangs);
            }
        };
        let ticks = self.now;
        if end == End::Agreed {
            self.oracle.count(self.client.stats(), &self.sessions)?;
            self.oracle.check_agreed_end(self.now, self.enabled)?;
        }
        for _ in 0..AFTER_TICKS {
            self.tick()?;
        }
        Ok(Report {
            end,
            ticks,
            frames: [self.lines[0].count(), self.lines[1].count()],
            driven: self.driven,
            uncertain: self.client.stats().uncertain,
            resumptions: self.resumptions,
            answers: self.status_queries.answers,
            outcomes: self.requests.map_or([0; 3], |[armed, disarmed]| {
                std::array::from_fn(|i| armed.outcomes[i] + disarmed.outcomes[i])
            }),
        })
    }

    fn interrupt(&mut self, plan: &Plan) {
        let now = self.now;
        let due = plan.interruptions.iter().filter(|(at, _)| *at == now);
        for (_, what) in due {
            match what {
                Interruption::HostKilled => {
                    self.seed += 1;
                    self.client = host(self.terrain, self.scene, self.seed);
                    self.lines[0].drop_partial();
                    self.sessions.clear();
                    (self.step, self.ramp_samples, self.resumptions) = (Step::Arming, 0, 0);
                    self.status_queries.reset();
                    self.requests = self.requests.is_some().then(requests);
                    self.oracle.on_host_restart();
                    self.greet();
                }
                Interruption::HostGone => {
                    self.lines[0].drop_partial();
                    self.host_gone = true;
                }
                Interruption::DeviceReset => {
                    self.device = device();
                    self.device_ticks = 0;
                    self.status_queries.device_restarted();
                    self.lines[1].drop_partial();
                    self.enabled = false;
                }
                Interruption::Cut(Direction::ToDevice, long) => self.lines[0].cut(now + long),
                Interruption::Cut(Direction::ToHost, long) => self.lines[1].cut(now + long),
                Interruption::Echo(Direction::ToDevice) => self.lines[0].echo(now),
                Interruption::Echo(Direction::ToHost) => self.lines[1].echo(now),
                Interruption::OtherHost => {
                    for frame in forged_frames::greeting() {
                        self.lines[0].inject(frame, now);
                    }
                }
                Interruption::Takeover => {
                    for frame in forged_frames::takeover() {
                        self.lines[0].inject(frame, now);
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
        self.oracle.request_force();
        self.send(&out);
    }

    /// Sends the bytes of the host.
    fn send(&mut self, out: &[u8]) {
        self.oracle.on_host_bytes(out);
        self.lines[0].send(out, self.now);
    }

    fn tick(&mut self) -> Result<(), Violation> {
        self.now += 1;
        for frame in self.lines[0].take_arrived(self.now) {
            self.oracle.on_frame(self.now);
            let mut rest = frame.as_slice();
            // Bytes without room now have room after a poll.
            for _ in 0..100 {
                let consumed = self.device.receive(rest);
                rest = &rest[consumed..];
                self.poll_device();
            }
        }
        // The user presses the switch until the amplifiers are on, and holds it.
        let dead_man = self.enabled || self.now % 300 > 60;
        let inputs = GuardInputs {
            dead_man,
            ..GuardInputs::default()
        };
        self.enabled = self.device.tick(inputs).enabled;
        self.device_ticks += 1;
        self.driven |= self.enabled;
        let session = self.client.session().get();
        self.oracle.check(self.now, self.enabled, session)?;
        self.poll_device();
        match self.host_gone {
            true => Ok(()),
            false => self.host(),
        }
    }

    /// Sends the bytes of the device.
    fn poll_device(&mut self) {
        let mut chunk = [0; 2048];
        loop {
            let sent = self.device.link.transmit(&mut chunk);
            if sent == 0 {
                return;
            }
            self.oracle.on_device_bytes(&chunk[..sent]);
            self.lines[1].send(&chunk[..sent], self.now);
        }
    }

    /// Runs the host's program.
    fn host(&mut self) -> Result<(), Violation> {
        let (mut out, now) = (vec![], time(self.now));
        let (step, ramp_samples) = (&mut self.step, &mut self.ramp_samples);
        let at = self.now;
        let (mut opened, mut samples) = (None, vec![]);
        let (status_queries, requests) = (&mut self.status_queries, &mut self.requests);
        let mut on = |event: Event<'_>| {
            for list in requests.iter_mut().flatten() {
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
                event => status_queries.take(&event),
            }
        };
        let mut received = Ok(());
        for mut frame in self.lines[1].take_arrived(self.now) {
            if self.other_device {
                frame = forged_frames::of_another_version(frame);
            }
            received = received.and_then(|()| self.client.receive(now, &frame, &mut out, &mut on));
        }
        let received = received.and_then(|()| self.client.append_due(now, &mut out, &mut on));
        self.send(&out);
        let session = self.client.session().get();
        self.oracle.reported(session, opened.as_ref(), &samples)?;
        self.status_queries.check()?;
        match received {
            Ok(()) => self.advance(),
            Err(error) => return self.on_error(error),
        }
        Ok(())
    }

    /// Queries the status, if the last query was answered.
    fn query_status(&mut self) {
        let is_idle = matches!(self.step, Step::Touching | Step::Disarming(_));
        if self.queries_status
            && is_idle
            && let Some(ask) = self.status_queries.query(self.device_ticks)
        {
            self.client.enqueue(ask);
        }
    }

    /// Starts the next step, if the last one is done.
    fn advance(&mut self) {
        self.query_status();
        let is_closed = self.client.state() == State::Closed;
        match self.step {
            Step::Arming if self.ramp_samples > 0 => self.step = Step::Touching,
            Step::Touching if self.ramp_samples >= RAMP_SAMPLES && self.abrupt => self.close(),
            Step::Touching if self.ramp_samples >= RAMP_SAMPLES && self.has_requests(0) => {
                self.run_requests(0);
            }
            Step::Touching if self.ramp_samples >= RAMP_SAMPLES => {
                self.client.enqueue(HostRequest::Request(Request::Disarm));
                self.step = Step::Disarming(None);
            }
            Step::Disarming(Some(answered)) => {
                self.oracle.forbid_force_from(answered + FADE);
                if self.now > answered + 2 * FADE && self.requests.is_some() {
                    self.step = Step::Requesting;
                } else if self.now > answered + 2 * FADE {
                    self.close();
                }
            }
            Step::Requesting if self.has_requests(1) => self.run_requests(1),
            Step::Requesting => self.close(),
            Step::Closing if is_closed => self.step = Step::Ended(End::Agreed),
            // After its time-out, a user closes the session.
            _ if self.now.is_multiple_of(40_000) && self.step != Step::Closing => self.close(),
            _ => {}
        }
    }

    /// Returns true if a list has steps left or in progress.
    fn has_requests(&self, list: usize) -> bool {
        let lists = self.requests.as_ref();
        lists.is_some_and(|lists| !lists[list].are_done())
    }

    /// Starts the next step of a list, if the last one has ended.
    fn run_requests(&mut self, list: usize) {
        let lists = self.requests.as_mut();
        let Some(request) = lists.and_then(|lists| lists[list].next(self.now)) else {
            return;
        };
        match request {
            RequestStep::HostRequest(ask) => {
                match ask {
                    HostRequest::Request(Request::Jog(_)) => self.oracle.request_force(),
                    // Two deadlines, because the request may be repeated once.
                    HostRequest::Request(Request::Disarm) => {
                        self.oracle.forbid_force_from(self.now + 9_000);
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
            in_contact: None,
        };
        let mut out = vec![];
        let terrain = self.terrain.clone();
        self.client
            .put_view(time(self.now), view, terrain, &mut out);
        self.send(&out);
    }

    fn close(&mut self) {
        if matches!(self.step, Step::Ended(_)) {
            return;
        }
        let mut out = vec![];
        self.client.leave(time(self.now), &mut out);
        self.send(&out);
        self.step = Step::Closing;
    }

    fn on_error(&mut self, error: LinkError) -> Result<(), Violation> {
        match (error, self.step) {
            (_, Step::Ended(_)) => {}
            // To the device, late frames of an earlier host look like another host's.
            (LinkError::NotConfirmed | LinkError::Taken, _) => {
                self.step = Step::Ended(End::Reported);
            }
            (LinkError::Version { .. }, _) if self.other_device => {
                self.step = Step::Ended(End::Reported);
            }
            (LinkError::Silent(_) | LinkError::HostSilent, _)
                if self.resumptions < MAX_RESUMPTIONS =>
            {
                self.resumptions += 1;
                if let Step::Disarming(_) | Step::Requesting = self.step {
                    self.close();
                } else {
                    self.greet();
                }
            }
            (LinkError::Silent(_) | LinkError::HostSilent, _) => self.close(),
            (error, _) => return Err(Violation::Error(error.to_string())),
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
