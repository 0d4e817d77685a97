//! `hapterra run`: serves a terrain to a device for as long as it is touched.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use clap::ValueHint;
use hapterra_core::scene::Sample;
use hapterra_core::wire::hello::DeviceHello;
use indicatif::ProgressBar;

use super::failure::{Failure, OrHint};
use super::options::rendering::Rendering;
use super::options::terrain_file::TerrainFile;
use super::session_summary::{self, SessionSummary};
use super::terminal::arming_prompts::ArmingPrompts;
use super::terminal::interrupt;
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
/// Between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// Arguments of `hapterra run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Device: usb, tcp:HOST:PORT, or native (the application in this program,
    /// with a virtual Phantom in a scripted hand)
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

    /// How the terrain feels.
    #[command(flatten)]
    pub rendering: Rendering,
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
    let raster = args.terrain.open()?;
    let scale = args.rendering.scale(&raster)?;
    let terrain = args.rendering.terrain(&raster, scale)?;
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
    let transport = connect(args, placed)?;
    let scripted = is_scripted(args);
    // A virtual arm was switched on in its zero pose; where a real one was,
    // its user has to say.
    let arming = match scripted {
        true => Arming::VIRTUAL,
        false => Arming::default(),
    };
    let (terrain, scene) = (placed.terrain(), placed.scene());
    let (mut session, device) =
        Session::open(terrain, scene, Some(arming), transport, Patience::REAL_TIME)?;
    let how = session_summary::in_words(terrain);
    println!("terrain        {}: {how}", args.terrain.name());
    println!("device         {}", session_summary::device(&device));
    let mut watch = Watch::new(args, placed, &device)?;
    let mut prompts = ArmingPrompts::at_the_terminal();
    while !watch.is_over() {
        let polled = session.poll(Duration::from_millis(50), &mut |event| {
            prompts.on_event(&event);
            watch.take(event);
        });
        // A scripted hand needs no telling.
        for line in prompts.lines().iter().filter(|_| !scripted) {
            watch.status.suspend(|| eprintln!("{line}"));
        }
        let polled = polled.and_then(|()| {
            let mut messages = prompts.messages().into_iter();
            messages.try_for_each(|message| session.say(&message))
        });
        watch.show(&session);
        match polled {
            Err(error) if error.is_passing() => wait_for(args, placed, &mut session, error)?,
            other => other?,
        }
    }
    watch.status.finish_and_clear();
    let summary = SessionSummary {
        ticks: watch.log.ticks(),
        device,
        figures: watch.log.figures(),
        tally: session.tally().clone(),
    };
    // It goes on rendering what it holds; telling it is a courtesy.
    let _ = session.say_goodbye();
    print!("{}", summary.text());
    watch.finish(args)
}

fn connect<'t>(
    args: &Args,
    placed: &PlacedTerrain<'t>,
) -> Result<Box<dyn Transport + 't>, Failure> {
    let native = || Native::new(HostClock::default(), Some(Box::new(placed.held_phantom())));
    Ok(args.device.connect(native)?)
}

/// The device is gone: says so, waits for it and resumes.
fn wait_for<'t>(
    args: &Args,
    placed: &PlacedTerrain<'t>,
    session: &mut Session<'t>,
    why: LinkError,
) -> Result<(), Failure> {
    let (why, device) = (described(&why), &args.device);
    eprintln!("{why}; waiting for {device} (Ctrl-C ends)");
    let began = Instant::now();
    while !interrupt::requested() {
        match connect(args, placed).map(|transport| session.resume(transport)) {
            Ok(Ok(device)) => {
                let again = match device.epoch == Some(session.scene().epoch) {
                    true => "goes on where it was",
                    false => "was restarted and begins anew",
                };
                let after = began.elapsed();
                eprintln!("the device is back after {after:.1?}: it {again}");
                return Ok(());
            }
            Ok(Err(error)) if !error.is_passing() => return Err(error.into()),
            _ => std::thread::sleep(RETRY),
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
    status: ProgressBar,
    line_due: Instant,
}

/// What to do where the recording cannot be written.
const OTHER_FILE: &str = "name another file with --record";

impl<'t> Watch<'t> {
    fn new(args: &Args, placed: &PlacedTerrain<'t>, device: &DeviceHello) -> Result<Self, Failure> {
        let columns = ["state", "tick", "work", "cost", "late"];
        let output = args.record.as_deref().map(Output::create).transpose();
        let script_s = match is_scripted(args) {
            true => placed.duration_s(),
            false => f64::MAX,
        };
        Ok(Self {
            log: SampleLog::new(placed.terrain(), device),
            stop_s: args.seconds.unwrap_or(f64::MAX).min(script_s),
            latest: None,
            recording: output
                .or_hint(OTHER_FILE)?
                .map(|output| Recording::new(output, &columns)),
            failed: None,
            status: ProgressBar::new_spinner(),
            line_due: Instant::now() + LINE_EVERY,
        })
    }

    fn is_over(&self) -> bool {
        interrupt::requested() || self.failed.is_some() || self.log.t_s() >= self.stop_s
    }

    fn take(&mut self, event: Event<'_>) {
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
