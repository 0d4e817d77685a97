//! `hapterra run`: serves a terrain to a device for as long as it is touched.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use clap::ValueHint;
use hapterra_core::wire::message::{DeviceHello, Sample};
use indicatif::ProgressBar;

use super::arming::ArmingDesk;
use super::emulation::explain_link;
use super::feel::Feel;
use super::input::Input;
use super::report::{self, Report};
use super::{Failure, interrupt};
use crate::link::{
    Arming, Event, HostClock, LinkError, Native, Patience, Session, Target, Tcp, Transport, Usb,
    serve_plant,
};
use crate::live::{Figures, Stage, Timeline};
use crate::output::{Output, OutputError};
use crate::phantom::Rig;
use crate::replay::{Record, Recording, state_name};

/// Between two tries to find a device that is gone.
const RETRY: Duration = Duration::from_millis(500);
/// For how long the virtual arm stays after the session has ended.
const LINGER: Duration = Duration::from_secs(2);
/// Between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// Arguments of `hapterra run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain.
    #[command(flatten)]
    pub input: Input,

    /// Device: usb, tcp:HOST:PORT, or native (the application in this program,
    /// with a virtual Phantom in a scripted hand)
    #[arg(long, default_value = "usb")]
    pub device: Target,

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

    /// How it feels.
    #[command(flatten)]
    pub feel: Feel,
}

fn parse_plant(text: &str) -> Result<String, String> {
    match text.parse()? {
        Target::Tcp(address) => Ok(address),
        Target::Usb | Target::Native => Err("the plant's line is tcp:HOST:PORT".into()),
    }
}

/// Serves the terrain until Ctrl-C, the end of the time or of the script.
///
/// # Errors
/// What is wrong with the file, or no device there at the beginning. A device
/// that goes later is waited for.
pub fn run(args: &Args) -> Result<(), Failure> {
    let raster = args.input.open()?;
    let scale = args.feel.scale(&raster)?;
    let terrain = args.feel.terrain(&raster, scale)?;
    let stage = Stage::set(&terrain, args.feel.law()?, args.feel.rule()).map_err(|error| {
        Failure::new(error).hint("choose a smaller --height-mm-per-unit or --cell-mm")
    })?;
    interrupt::listen();
    let Some(address) = &args.plant else {
        return serve(args, &stage);
    };
    let rig = stage.rig().map_err(Failure::new)?;
    let done = OnceLock::new();
    std::thread::scope(|scope| {
        scope.spawn(|| move_arm(address, rig, &done));
        let served = serve(args, &stage);
        // The arm is still there while the board lets its force go out.
        let _ = done.set(Instant::now() + LINGER);
        served
    })
}

/// The virtual Phantom at a board's plant line, which may come and go; until
/// the line ends after the session has, or the time that `done` names.
fn move_arm(address: &str, mut rig: Rig, done: &OnceLock<Instant>) {
    let stop = || done.get().is_some_and(|by| Instant::now() >= *by);
    while done.get().is_none() {
        let ended = Tcp::connect(address)
            .map_err(|error| error.to_string())
            .and_then(|mut line| {
                serve_plant(&mut line, &mut rig, &stop).map_err(|error| error.to_string())
            });
        if let Err(why) = ended {
            tracing::info!("the plant's line at {address}: {why}");
            std::thread::sleep(RETRY);
        }
    }
}

fn serve(args: &Args, stage: &Stage<'_>) -> Result<(), Failure> {
    let transport = connect(args, stage)?;
    // A virtual arm was switched on in its zero pose; where a real one was,
    // its user has to say.
    let scripted = args.plant.is_some() || args.device == Target::Native;
    let arming = match scripted {
        true => Arming::VIRTUAL,
        false => Arming::default(),
    };
    let opened = Session::open_arming(
        stage.terrain(),
        stage.scene(),
        arming,
        transport,
        Patience::REAL_TIME,
    );
    let (mut session, device) = opened.map_err(explain_link)?;
    println!(
        "terrain        {}: {}",
        args.input.name(),
        report::how(stage.terrain())
    );
    println!("device         {}", report::device(&device));
    let mut watch = Watch::new(args, stage, &device)?;
    let mut desk = ArmingDesk::at_the_terminal();
    while !watch.is_over() {
        let polled = session.poll(Duration::from_millis(50), &mut |event| {
            desk.hear(&event);
            watch.take(event);
        });
        let lines = desk.lines();
        // A scripted hand needs no telling.
        for line in lines.iter().filter(|_| !scripted) {
            watch.status.suspend(|| eprintln!("{line}"));
        }
        let polled = polled.and_then(|()| {
            let mut messages = desk.messages().into_iter();
            messages.try_for_each(|message| session.say(&message))
        });
        watch.show(&session);
        match polled {
            Err(error) if error.is_passing() => wait_for(args, stage, &mut session, error)?,
            other => other.map_err(explain_link)?,
        }
    }
    watch.status.finish_and_clear();
    let report = Report {
        ticks: watch.time.ticks(),
        device,
        figures: watch.figures,
        tally: session.tally().clone(),
    };
    // It goes on rendering what it holds; telling it is a courtesy.
    let _ = session.say_goodbye();
    report.print();
    watch.finish(args)
}

fn connect<'t>(args: &Args, stage: &Stage<'t>) -> Result<Box<dyn Transport + 't>, Failure> {
    Ok(match &args.device {
        Target::Usb => Box::new(Usb::connect().map_err(explain_link)?),
        Target::Tcp(address) => Box::new(Tcp::connect(address).map_err(explain_link)?),
        Target::Native => {
            let rig = stage.rig().map_err(Failure::new)?;
            Box::new(Native::new(HostClock::default(), Some(Box::new(rig))))
        }
    })
}

/// The device is gone: says so, waits for it and resumes.
fn wait_for<'t>(
    args: &Args,
    stage: &Stage<'t>,
    session: &mut Session<'t>,
    why: LinkError,
) -> Result<(), Failure> {
    eprintln!(
        "{}; waiting for {} (Ctrl-C ends)",
        described(&why),
        args.device
    );
    let began = Instant::now();
    while !interrupt::requested() {
        if let Ok(transport) = connect(args, stage) {
            match session.resume(transport) {
                Ok(device) => {
                    let again = match device.epoch == Some(session.scene().epoch) {
                        true => "goes on where it was",
                        false => "was restarted and begins anew",
                    };
                    eprintln!(
                        "the device is back after {:.1?}: it {again}",
                        began.elapsed()
                    );
                    return Ok(());
                }
                Err(error) if error.is_passing() => {}
                Err(error) => return Err(explain_link(error)),
            }
        }
        std::thread::sleep(RETRY);
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
struct Watch<'a, 't> {
    stage: &'a Stage<'t>,
    time: Timeline,
    tick_hz: u32,
    stop_s: f64,
    figures: Figures,
    latest: Option<(Sample, Record)>,
    recording: Option<Recording>,
    failed: Option<OutputError>,
    status: ProgressBar,
    line_due: Instant,
}

impl<'a, 't> Watch<'a, 't> {
    fn new(args: &Args, stage: &'a Stage<'t>, device: &DeviceHello) -> Result<Self, Failure> {
        let columns = ["state", "tick", "work", "cost", "late"];
        let output = args.record.as_deref().map(Output::create).transpose();
        let output =
            output.map_err(|error| Failure::new(error).hint("name another file with --record"))?;
        let scripted = args.plant.is_some() || args.device == Target::Native;
        let script_s = if scripted {
            stage.duration_s()
        } else {
            f64::MAX
        };
        Ok(Self {
            stage,
            time: Timeline::new(device.tick_hz),
            tick_hz: device.tick_hz,
            stop_s: args.seconds.unwrap_or(f64::MAX).min(script_s),
            figures: Figures::default(),
            latest: None,
            recording: output.map(|output| Recording::new(output, &columns)),
            failed: None,
            status: ProgressBar::new_spinner(),
            line_due: Instant::now() + LINE_EVERY,
        })
    }

    fn is_over(&self) -> bool {
        let at_s = self.time.ticks() as f64 / f64::from(self.tick_hz.max(1));
        interrupt::requested() || self.failed.is_some() || at_s >= self.stop_s
    }

    fn take(&mut self, event: Event<'_>) {
        let Event::Sample(sample) = event else {
            return;
        };
        let terrain = self.stage.terrain();
        let mut record = Record::of_tick(sample, self.tick_hz, terrain.scale());
        record.t_s = self.time.at(sample);
        self.figures.take(sample, &record, terrain);
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
        let force = record.force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
        let [x, y, z] = record.hip_mm;
        let tally = session.tally();
        let fault = sample
            .fault
            .map_or(String::new(), |f| format!(", FAULT {f:?}"));
        let line = format!(
            "{:8.3} s  {:8}  hand {x:.1} {y:.1} {z:.1} mm  {force:.2} N  {} tiles  {} lost{fault}",
            record.t_s,
            state_name(sample.state),
            tally.tiles,
            tally.lost + tally.dropped
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
        ended.map_err(|error| Failure::new(error).hint("name another file with --record"))?;
        if let Some(path) = &args.record {
            println!("recording      {}", path.display());
        }
        Ok(())
    }
}
