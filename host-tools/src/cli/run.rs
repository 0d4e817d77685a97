//! `hapterra run`: serves a terrain to a device for as long as it is touched.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use clap::ValueHint;
use hapterra_core::scene::Sample;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, SILENCE_S, SessionEnd};
use indicatif::ProgressBar;

use super::bringup::required::brought_up;
use super::failure::{Failure, OrHint};
use super::options::rendering::Rendering;
use super::options::terrain_file::TerrainFile;
use super::session_summary::{self, SessionSummary};
use super::terminal::arming_prompts::ArmingPrompts;
use super::terminal::{interrupt, left_behind};
use crate::link::{
    Arming, DeviceAddress, Event, HostClock, LinkError, Native, Patience, Session, Tcp, Transport,
    serve_plant,
};
use crate::output::{Output, OutputError};
use crate::phantom::HeldPhantom;
use crate::place::PlacedTerrain;
use crate::replay::{Record, Recording, state_name};
use crate::telemetry::SampleLog;

/// Between two tries to find a device that is gone.
const RETRY: Duration = Duration::from_millis(500);
/// For how long the virtual arm stays after the session has ended.
const LINGER: Duration = Duration::from_secs(2);
/// Between two looks at the clock while nothing comes.
const POLL: Duration = Duration::from_millis(50);
/// Between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// Arguments of `hapterra run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Device: usb, usb:SERIAL (`hapterra list` shows it), tcp:HOST:PORT, or native (the
    /// application in this program, with a virtual Phantom in a scripted hand)
    #[arg(long, default_value = "usb")]
    pub device: DeviceAddress,

    /// Where the emulated board's plant line is, for a virtual Phantom in a
    /// scripted hand: tcp:HOST:PORT
    #[arg(long, value_name = "tcp:HOST:PORT", value_parser = parse_plant)]
    pub plant: Option<String>,

    /// Write what was felt to a file, tick by tick, as replay does
    #[arg(long, value_name = "OUT.csv", value_hint = ValueHint::FilePath)]
    pub record: Option<PathBuf>,

    /// End after this many seconds of the device's time
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,

    /// For how many seconds the device lets an armed arm be while it hears nothing from
    /// here; then it lets the force out and disarms
    #[arg(long, value_name = "S", default_value_t = DEFAULT_SILENCE_S,
          value_parser = clap::value_parser!(u16).range(i64::from(SILENCE_S.0)..=i64::from(SILENCE_S.1)))]
    pub silence_s: u16,

    /// Serve a real board although its log of `hapterra bringup` is not complete
    #[arg(long)]
    pub unchecked: bool,

    /// How the terrain feels.
    #[command(flatten)]
    pub rendering: Rendering,
}

impl Args {
    /// The same, and the board that is the only one now for good: one that is plugged in
    /// later is not taken for it.
    #[must_use]
    pub fn pinned(mut self) -> Self {
        self.device = self.device.pinned();
        self
    }
}

fn parse_plant(text: &str) -> Result<String, String> {
    match text.parse()? {
        DeviceAddress::Tcp(address) => Ok(address),
        _ => Err("the plant's line is tcp:HOST:PORT".into()),
    }
}

/// Serves the terrain until Ctrl-C, the end of the time or of the script.
///
/// # Errors
/// What is wrong with the file, or no device there at the beginning. A device
/// that goes later is waited for.
pub fn run(args: &Args) -> Result<(), Failure> {
    left_behind::tell(args.record.as_deref());
    let raster = args.terrain.open()?;
    let grid = args.rendering.grid(&raster);
    let scale = args.rendering.scale(&grid)?;
    let terrain = args.rendering.terrain(grid, scale)?;
    let placed = PlacedTerrain::new(&terrain, args.rendering.law()?, args.rendering.rule())?;
    interrupt::listen();
    let Some(address) = &args.plant else {
        return serve(args, &placed);
    };
    let arm = placed.held_phantom();
    let done = OnceLock::new();
    std::thread::scope(|scope| {
        scope.spawn(|| move_arm(address, arm, &done));
        let served = serve(args, &placed);
        // The arm is still there while the board lets its force go out.
        let _ = done.set(Instant::now() + LINGER);
        served
    })
}

/// Moves the virtual Phantom at a board's plant line, which may come and go;
/// until the line ends after the session has, or the time that `done` names.
fn move_arm(address: &str, mut arm: HeldPhantom, done: &OnceLock<Instant>) {
    let stop = || done.get().is_some_and(|by| Instant::now() >= *by);
    while done.get().is_none() {
        let ended = Tcp::connect(address)
            .and_then(|mut line| serve_plant(&mut line, &mut arm, &stop).map_err(LinkError::Gone));
        if let Err(why) = ended {
            tracing::info!("the plant's line at {address}: {}", described(&why));
            std::thread::sleep(RETRY);
        }
    }
}

/// Whether the arm is virtual, held by a hand that follows a script.
fn is_scripted(args: &Args) -> bool {
    args.plant.is_some() || args.device == DeviceAddress::Native
}

fn serve(args: &Args, placed: &PlacedTerrain<'_>) -> Result<(), Failure> {
    // What cannot be recorded is known before anything is armed.
    let recording = recording(args)?;
    let mut transport = connect(args, placed)?;
    let scripted = is_scripted(args);
    if !scripted && !args.unchecked {
        brought_up(&mut *transport)?;
    }
    // A virtual arm was switched on in its zero pose; where a real one was,
    // its user has to say.
    let arming = match scripted {
        true => Arming::VIRTUAL,
        false => Arming::default(),
    };
    let patience = Patience {
        silence_s: args.silence_s,
        ..Patience::REAL_TIME
    };
    let (terrain, scene) = (placed.terrain(), placed.scene());
    interrupt::board_may_be_armed(true);
    let (mut session, device) = Session::open(terrain, scene, Some(arming), transport, patience)?;
    let how = session_summary::in_words(terrain);
    println!("terrain        {}: {how}", args.terrain.name());
    println!("device         {}", session_summary::device(&device));
    tell_last_end(&device);
    let mut watch = Watch::new(args, placed, &device, recording);
    let served = watch.serve(args, placed, &mut session);
    let ended = leave(&mut session, &mut watch, served);
    interrupt::board_may_be_armed(false);
    watch.status.finish_and_clear();
    let summary = SessionSummary {
        ticks: watch.log.ticks(),
        device,
        figures: watch.log.figures(),
        tally: session.tally().clone(),
    };
    print!("{}", summary.text());
    // What was recorded is kept, however it ended.
    let kept = watch.finish(args);
    ended.and(kept)
}

/// Ends the session, whatever ended the serving: the board is known to be disarmed, or
/// the user is told that it may not be.
fn leave(
    session: &mut Session<'_>,
    watch: &mut Watch<'_>,
    served: Result<(), LinkError>,
) -> Result<(), Failure> {
    // Another host has the arm now; it is not this one's to disarm.
    if let Err(LinkError::Taken) = served {
        return Ok(served?);
    }
    let left = session.say_goodbye(&mut |event| watch.take(event));
    match (served, left) {
        (Err(error), Err(not_confirmed)) => {
            watch.status.suspend(|| eprintln!("{not_confirmed}"));
            Err(error.into())
        }
        (served, left) => Ok(served.and(left)?),
    }
}

/// Says what became of the arm where its host before was silent for too long.
fn tell_last_end(device: &DeviceHello) {
    if device.last.end == SessionEnd::HostSilent {
        eprintln!(
            "before this the device had heard nothing from its host for too long: it let the force out and disarmed the arm"
        );
    }
}

fn recording(args: &Args) -> Result<Option<Recording>, Failure> {
    let columns = ["state", "tick", "work", "cost", "late"];
    let output = args.record.as_deref().map(Output::create).transpose();
    let output = output.or_hint(OTHER_FILE)?;
    Ok(output.map(|output| Recording::new(output, &columns)))
}

fn connect<'t>(
    args: &Args,
    placed: &PlacedTerrain<'t>,
) -> Result<Box<dyn Transport + 't>, LinkError> {
    let native = || Native::new(HostClock::default(), Some(Box::new(placed.held_phantom())));
    args.device.connect(native)
}

/// The device is gone: says so, waits for it and resumes.
fn wait_for<'t>(
    args: &Args,
    placed: &PlacedTerrain<'t>,
    session: &mut Session<'t>,
    on: &mut dyn FnMut(Event<'_>),
    why: LinkError,
) -> Result<(), LinkError> {
    let (why, device) = (described(&why), &args.device);
    eprintln!("{why}; waiting for {device} (Ctrl-C ends)");
    let began = Instant::now();
    let go_on = || !interrupt::requested();
    while go_on() {
        let connected = connect(args, placed);
        match connected.and_then(|transport| session.resume(transport, &go_on, on)) {
            Ok(device) => {
                let again = match device.epoch == Some(session.scene().epoch) {
                    true => "goes on where it was",
                    false => "was restarted and begins anew",
                };
                let after = began.elapsed();
                eprintln!("the device is back after {after:.1?}: it {again}");
                tell_last_end(&device);
                return Ok(());
            }
            Err(LinkError::Interrupted) => return Ok(()),
            Err(error) if !error.is_passing() => return Err(error),
            Err(_) => std::thread::sleep(RETRY),
        }
    }
    Ok(())
}

fn described(error: &LinkError) -> String {
    match error {
        LinkError::Gone(why) => format!("{error}: {why}"),
        _ => error.to_string(),
    }
}

/// What is seen and recorded of a session while it goes on.
struct Watch<'t> {
    log: SampleLog<'t>,
    stop_s: f64,
    /// The latest sample and its row.
    latest: Option<(Sample, Record)>,
    recording: Option<Recording>,
    failed: Option<OutputError>,
    prompts: ArmingPrompts,
    status: ProgressBar,
    line_due: Instant,
}

/// What to do where the recording cannot be written.
const OTHER_FILE: &str = "name another file with --record";

impl<'t> Watch<'t> {
    fn new(
        args: &Args,
        placed: &PlacedTerrain<'t>,
        device: &DeviceHello,
        recording: Option<Recording>,
    ) -> Self {
        let (script_s, prompts) = match is_scripted(args) {
            true => (placed.duration_s(), ArmingPrompts::for_a_script()),
            false => (f64::MAX, ArmingPrompts::at_the_terminal()),
        };
        Self {
            log: SampleLog::new(placed.terrain(), device),
            stop_s: args.seconds.unwrap_or(f64::MAX).min(script_s),
            latest: None,
            recording,
            failed: None,
            prompts,
            status: ProgressBar::new_spinner(),
            line_due: Instant::now() + LINE_EVERY,
        }
    }

    /// Serves until the end of the time or of the script, an end that was asked for, or
    /// an error that waiting does not mend.
    fn serve(
        &mut self,
        args: &Args,
        placed: &PlacedTerrain<'t>,
        session: &mut Session<'t>,
    ) -> Result<(), LinkError> {
        while !self.is_over() {
            let polled = session.poll(POLL, &mut |event| self.take(event));
            for line in self.prompts.lines() {
                self.status.suspend(|| eprintln!("{line}"));
            }
            for ask in self.prompts.messages() {
                session.ask(ask);
            }
            self.show(session);
            match polled {
                Err(error) if error.is_passing() => {
                    let on = &mut |event: Event<'_>| self.take(event);
                    wait_for(args, placed, session, on, error)?;
                }
                other => other?,
            }
        }
        Ok(())
    }

    fn is_over(&self) -> bool {
        interrupt::requested() || self.failed.is_some() || self.log.t_s() >= self.stop_s
    }

    fn take(&mut self, event: Event<'_>) {
        self.prompts.on_event(&event);
        let Event::Sample(sample) = event else {
            return;
        };
        let record = self.log.take(sample);
        if let Some(recording) = &mut self.recording {
            let state = state_name(sample.state);
            let more: [&dyn std::fmt::Display; 5] = [
                &state,
                &sample.tick,
                &sample.work,
                &sample.cost,
                &sample.late,
            ];
            self.failed = self.failed.take().or(recording.write(&record, &more).err());
        }
        self.latest = Some((*sample, record));
    }

    /// One line that is written over, or a line now and then.
    fn show(&mut self, session: &Session<'_>) {
        let Some((sample, record)) = &self.latest else {
            return;
        };
        let force = glam::DVec3::from(record.force_n).length();
        let ([x, y, z], t_s, state) = (record.hip_mm, record.t_s, state_name(sample.state));
        let (tally, fault) = (session.tally(), sample.fault);
        let (tiles, lost) = (tally.tiles, tally.lost + tally.dropped);
        let fault = fault.map_or(String::new(), |f| format!(", FAULT {f:?}"));
        let line = format!(
            "{t_s:8.3} s  {state:8}  HIP {x:.1} {y:.1} {z:.1} mm  {force:.2} N  {tiles} tiles  {lost} lost{fault}"
        );
        if std::io::stderr().is_terminal() {
            self.status.set_message(line);
            self.status.tick();
        } else if Instant::now() >= self.line_due {
            self.line_due = Instant::now() + LINE_EVERY;
            eprintln!("{line}");
        }
    }

    fn finish(self, args: &Args) -> Result<(), Failure> {
        let ended = match (self.failed, self.recording) {
            (Some(error), _) => Err(error),
            (None, Some(recording)) => recording.finish(),
            (None, None) => Ok(()),
        };
        ended.or_hint(OTHER_FILE)?;
        if let Some(path) = &args.record {
            println!("recording      {}", path.display());
        }
        Ok(())
    }
}
