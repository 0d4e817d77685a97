//! The session with one device, from open to close.

use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use hapterra_core::wire::hello::DeviceHello;

use super::devices::OneDevice;
use super::placed::Placed;
use super::watch::Watch;
use super::{Args, OTHER_FILE};
use crate::cli::bringup::required::{check_brought_up, check_drives_no_arm};
use crate::cli::failure::{Failure, OrHint};
use crate::cli::options::placing;
use crate::cli::options::steering::PlacementControl;
use crate::cli::session_summary::{self, SessionSummary};
use crate::cli::terminal::interrupt;
use crate::cli::terminal::shared_keyboard::DeviceKeys;
use crate::cli::viewing::PreparedViewer;
use crate::cli::worker_pipe::{self, WorkerMessage};
use crate::events::Watcher;
use crate::link::{
    Arming, DeviceAddress, HostClock, LinkError, Native, Tcp, Timeouts, Transport, serve_plant,
};
use crate::materials::Materials;
use crate::output::{Output, folder_of};
use crate::phantom::{HeldPhantom, PlacedTerrain};
use crate::place::PlacedSurface;
use crate::replay::settings::Device;
use crate::replay::{Column, LoopColumns, Recording, Rule, Settings, TICK_COLUMNS};
use crate::serving::{Service, last_end_remark};
use crate::stability;
use crate::steering::CommandQueue;
use heightfield::without_key;

/// Interval between attempts to find a missing device.
const RETRY: Duration = Duration::from_millis(500);
/// Time for which the virtual arm remains after the session.
const LINGER: Duration = Duration::from_secs(2);

/// Remark at the end of a virtual arm's session without contact.
const UNTOUCHED: &str = "the virtual hand never touched the ground: choose another place with --at, or a longer --duration";

/// Size limit of a recording on any disk: a day of CSV at 1 kHz.
const MAX_RECORDED_BYTES: u64 = 16 << 30;

/// A device to serve, with its inputs and outputs.
pub(super) struct Serving<'p, 't> {
    pub(super) args: &'p Args,
    pub(super) device: &'p OneDevice,
    pub(super) placed: &'p Placed<'t>,
    /// Result of the query for the calibration. After a failure the session is closed, because the
    /// arm may already be armed.
    pub(super) calibration_read: Result<(), Failure>,
    pub(super) recording: Option<Recording>,
    pub(super) commands: CommandQueue,
    /// The device's share of a common keyboard.
    pub(super) device_keys: Option<Arc<DeviceKeys>>,
    pub(super) viewer: Option<PreparedViewer<'t>>,
    pub(super) events: Option<Watcher>,
}

impl<'t> Serving<'_, 't> {
    /// Serves the device until its end. Also moves a virtual arm at the plant line of an emulated
    /// board.
    ///
    /// # Errors
    /// The cause of the end, or a device that did not confirm that it is disarmed.
    pub(super) fn serve(self) -> Result<(), Failure> {
        let (Some(address), Some(tour)) = (&self.device.plant, &self.placed.tour) else {
            return self.session();
        };
        let arm = tour.held_phantom();
        let done = OnceLock::new();
        std::thread::scope(|scope| {
            scope.spawn(|| move_arm(address, arm, &done));
            // Also if the session panics; otherwise the line would be served for ever.
            let _ended = OnDrop(|| {
                let _ = done.set(Instant::now() + LINGER);
            });
            // The arm must run until the board has reduced its force to zero.
            self.session()
        })
    }

    fn session(self) -> Result<(), Failure> {
        let (args, placed, device) = (self.args, self.placed, self.device);
        let device_console = &device.device_console;
        let name = device_console.name().unwrap_or_default();
        let notify = |line: &str| device_console.notify(line);
        let service = service(args, (device, placed), &notify);
        let may_be_armed = |may| interrupt::device_may_be_armed(name, &device.address, may);
        may_be_armed(true);
        let calibration_read = self.calibration_read;
        let opened =
            service.open(|line| calibration_read.and_then(|()| check_servable(args, device, line)));
        // Pending messages are shown even if the session cannot be opened.
        let (served, hello) = opened.inspect_err(|_| may_be_armed(false))?;
        let how = session_summary::in_words(placed.terrain);
        device_console.print_line(format!("terrain        {}: {how}", args.terrain.name()));
        device_console.show(placing::describe(&placed.view, placed.terrain));
        if let Some(line) = session_summary::materials(placed.terrain) {
            device_console.print_line(line);
        }
        device_console.print_line(format!(
            "device         {}",
            session_summary::device(&hello)
        ));
        if let Some(line) = last_end_remark(&hello) {
            device_console.notify(line);
        }
        let materials = placed.terrain.grid().materials();
        let table = materials.map(Materials::table);
        stability::warn_for_materials(&placed.scene.params, table, &hello);
        let recording = with_settings(self.recording, args, placed, &hello);
        let placed_surface = PlacedSurface {
            view: placed.view,
            params: placed.scene.params,
        };
        let mut control = PlacementControl::new(
            (placed.terrain, placed_surface),
            (&placed.arm, args.rendering.fixed_level()),
            self.commands,
        );
        if args.rendering.is_level_by_speed() {
            control.follow_speed(hello.tick_hz);
        }
        // Before anything else reads the keyboard.
        match &self.device_keys {
            Some(device_keys) => control.use_keys(device_keys),
            None if device_console.name().is_some() => {}
            None => {
                if let Some(line) = control.listen(&args.commands) {
                    device_console.notify(line);
                }
            }
        }
        // If the viewer does not start, the session continues.
        let viewer = (self.viewer)
            .and_then(|viewer| viewer.start(&hello, |line| device_console.notify(line)));
        let control = (control, self.device_keys.as_ref());
        let watch = Watch::new(args, (placed, device_console), &hello, recording, control);
        let mut watch = watch.with_viewer(viewer).with_events(self.events);
        let end = served.serve(&mut watch);
        let is_others = matches!(end.result, Err(LinkError::Taken));
        watch.ended(end.disarmed.is_ok() && !is_others);
        // The recording is saved first, regardless of the cause of the end.
        let log = watch.finish();
        let recording_result = log.recording_result.or_hint(OTHER_FILE);
        let ended = session_result(end.result, end.disarmed, &notify)
            .and(check_terrain_arrived(log.has_stalled));
        may_be_armed(false);
        let summary = SessionSummary {
            ticks: log.ticks,
            device: hello,
            figures: log.figures,
            stats: end.stats,
        };
        device_console.show(summary.text());
        if placed.tour.is_some() && summary.figures.force_n.count() == 0 {
            device_console.notify(UNTOUCHED);
        }
        if let (Ok(()), Some(path)) = (&recording_result, &device.record) {
            device_console.print_line(format!("recording      {}", path.display()));
        }
        if let Some(viewer) = log.viewer {
            viewer.end(|line| device_console.print_line(line));
        }
        ended.and(recording_result)
    }
}

/// Returns an error if missing terrain ended a virtual arm's session. A real arm uses the stored
/// tiles.
fn check_terrain_arrived(has_stalled: bool) -> Result<(), Failure> {
    match has_stalled {
        false => Ok(()),
        true => Err("the virtual arm has waited a minute for terrain that did not arrive")
            .or_hint("try again when its server answers; the file's error is printed above"),
    }
}

/// Calls a function when it is dropped.
struct OnDrop<F: FnMut()>(F);

impl<F: FnMut()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// Moves the virtual Phantom at a board's plant line, which may be reconnected. Ends when the line
/// closes after the session, or at the time in `done`.
fn move_arm(address: &str, mut arm: HeldPhantom, done: &OnceLock<Instant>) {
    let stop = || done.get().is_some_and(|by| Instant::now() >= *by);
    while done.get().is_none() {
        let ended = Tcp::connect(address).and_then(|mut line| {
            serve_plant(&mut line, &mut arm, &stop).map_err(LinkError::Disconnected)
        });
        if let Err(why) = ended {
            tracing::info!("the plant's line at {address}: {why:?}");
            std::thread::sleep(RETRY);
        }
    }
}

/// Checks that a device may be served: a real board must be brought up, and a board with a virtual
/// arm must not drive a real one.
fn check_servable(
    args: &Args,
    device: &OneDevice,
    line: &mut dyn Transport,
) -> Result<(), Failure> {
    match (&device.plant, &device.address) {
        (_, DeviceAddress::Native) => Ok(()),
        // Even with `--unchecked`: a virtual arm's zero pose and lines would be assumed for a real
        // arm.
        (Some(_), _) => check_drives_no_arm(line),
        (None, _) if args.unchecked => Ok(()),
        (None, _) => check_brought_up(line),
    }
}

/// Returns the service that sends a terrain to a device.
fn service<'s, 't: 's>(
    args: &'s Args,
    (device, placed): (&'s OneDevice, &'s Placed<'t>),
    notify: &'s dyn Fn(&str),
) -> Service<'s, 't> {
    Service {
        terrain: placed.terrain,
        scene: placed.scene,
        // A virtual arm starts in its zero pose; the pose of a real one must be confirmed by the
        // user.
        arming: match device.is_scripted() {
            true => Arming::VIRTUAL,
            false => Arming::default(),
        },
        timeouts: Timeouts {
            silence_s: args.silence,
            ..Timeouts::REAL_TIME
        },
        connect: Box::new(move || connect(args, device, placed)),
        device: device.address.to_string(),
        retry: RETRY,
        should_continue: &|| !interrupt::requested(),
        notify,
    }
}

/// Returns the failure of the session; if there are two, prints the first.
fn session_result(
    why: Result<(), LinkError>,
    disarmed: Result<(), LinkError>,
    notify: &dyn Fn(&str),
) -> Result<(), Failure> {
    match (why, disarmed) {
        (Err(error), Err(not_confirmed)) => {
            notify(&not_confirmed.to_string());
            Err(error.into())
        }
        (why, disarmed) => Ok(why.and(disarmed)?),
    }
}

/// Returns the recording of a device, if requested.
///
/// # Errors
/// The file cannot be written.
pub(super) fn recording(device: &OneDevice) -> Result<Option<Recording>, Failure> {
    let [state, mode, limits, view] = LoopColumns::COLUMNS;
    let [tick, work, cost, late] = TICK_COLUMNS.map(Column::Count);
    let columns = [state, tick, work, cost, late, mode, limits, view];
    let recording = device.record.as_deref().map(|path| {
        let output = Output::create(path)?.for_recording(max_recorded_bytes(path));
        if let Some(partial) = output.partial() {
            worker_pipe::report(&WorkerMessage::Recording(partial.to_owned()));
        }
        Recording::new(output, &columns)
    });
    recording.transpose().or_hint(OTHER_FILE)
}

/// Returns the size limit of a recording: half of the free space at its start, so that no device
/// can fill the disk at any rate of samples.
fn max_recorded_bytes(path: &Path) -> u64 {
    let free = fs4::available_space(folder_of(path));
    free.map_or(MAX_RECORDED_BYTES, |free| MAX_RECORDED_BYTES.min(free / 2))
}

/// Adds the settings of the terrain and surface to the recording.
fn with_settings(
    mut recording: Option<Recording>,
    args: &Args,
    placed: &Placed<'_>,
    device: &DeviceHello,
) -> Option<Recording> {
    if let Some(recording) = &mut recording {
        let (file, device) = (without_key(&args.terrain.file), Device::of(device));
        let params = (placed.scene.params, Rule::Swept);
        let home_mm = Some(placed.view.home_mm);
        let settings = Settings::new(&file, placed.terrain, params, home_mm, device);
        recording.describe(&settings);
    }
    recording
}

fn connect<'t>(
    args: &Args,
    device: &OneDevice,
    placed: &Placed<'t>,
) -> Result<Box<dyn Transport + 't>, LinkError> {
    let native = || {
        let arm = placed.tour.as_ref().map(PlacedTerrain::held_phantom);
        let device = Native::new(HostClock::default(), arm.map(|arm| Box::new(arm) as _));
        match args.viewing.view || args.events.events.is_some() {
            true => device.in_real_time(),
            false => device,
        }
    };
    device.address.connect(native)
}
