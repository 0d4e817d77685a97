//! `hapterra run`: serves a terrain to one or several devices during a session.
//!
//! ```text
//! Args ─ devices ─┐
//!                 ├─ placed ─ session, one for each device ─ together ─ the end
//! TerrainFile ────┘              │
//!                      watch ◀───┘
//! ```
//!
//! There is one [`Raster`](heightfield::Raster), with one reader and one bounded cache, which all
//! devices share. Each device has its own calibration, placement, session, thread, arming and
//! recording. All placements are made before any device is armed, because after that no read may
//! wait.

pub mod devices;
mod placed;
mod session;
mod together;
mod watch;

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueHint;
use hapterra_core::wire::session::SILENCE_S;

use super::failure::{Failure, OrHint};
use super::options::events::{self, EventOptions};
use super::options::placing::Placing;
use super::options::rendering::Rendering;
use super::options::steering::Commands;
use super::options::terrain_file::TerrainFile;
use super::settings::SettingsOption;
use super::terminal::device_console::DeviceConsole;
use super::terminal::shared_keyboard::{self, DeviceKeys};
use super::terminal::writer::notify;
use super::terminal::{interrupt, partial_files};
use super::viewing::{PreparedViewer, Viewing};
use crate::output::check_distinct;
use crate::quantity::TIME;
use crate::steering::keys::KEYS;
use devices::{OneDevice, ServedDevice};
use placed::{InReach, Placed};
use session::{Serving, recording};
use together::serve_each;

/// Maximum stiffness that `hapterra-lab stability` tests by default, N/mm.
const MAX_TESTED_N_PER_MM: f32 = 20.0;

/// Hint for a recording that cannot be written.
const OTHER_FILE: &str = "name another file with -o";

/// Arguments of `hapterra run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Device: usb, usb:SERIAL, tcp:HOST:PORT or native
    ///
    /// May be repeated. usb:SERIAL: `hapterra list` shows it. native: the application in this program, with a virtual
    /// Phantom in a scripted hand. tcp:HOST:PORT+plant:HOST:PORT: an emulated board, whose virtual arm
    /// in a scripted hand is moved over its second line. Several devices render the terrain at once,
    /// each with its own arm.
    #[arg(long, default_value = "usb")]
    pub device: Vec<ServedDevice>,

    /// File for the recording: CSV, or Parquet as FILE.parquet
    ///
    /// A row for each tick. With several devices OUT-1, OUT-2 and so on, in their order.
    #[arg(short, long, value_name = "OUT", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,

    /// End after this time of the device, such as 60s
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub duration: Option<f64>,

    /// Disarm after this time without a message from here
    ///
    /// The device does so by itself; a number alone is in seconds.
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = silence)]
    pub silence: u16,

    /// Serve a real board without a complete log of hapterra bringup
    #[arg(long)]
    pub unchecked: bool,

    /// Place and scale of the terrain.
    #[command(flatten)]
    pub placing: Placing,

    /// Rendering of the terrain.
    #[command(flatten)]
    pub rendering: Rendering,

    /// Source of the settings.
    #[command(flatten)]
    pub settings: SettingsOption,

    /// Commands that change the placement during the session.
    #[command(flatten)]
    pub commands: Commands,

    /// Events to other programs.
    #[command(flatten)]
    pub events: EventOptions,

    /// The viewer.
    #[command(flatten)]
    pub viewing: Viewing,
}

impl Args {
    /// Returns the arguments with the only connected board selected by its serial number, so that
    /// no other board is used later.
    #[must_use]
    pub fn pinned(mut self) -> Self {
        let devices = self.device.into_iter();
        self.device = devices.map(ServedDevice::pinned).collect();
        self
    }
}

/// Parses a duration in seconds.
pub(super) fn duration(text: &str) -> Result<f64, String> {
    TIME.read_within(text, [0.0, 1e9])
}

/// Parses the time without a message after which a device disarms, whole seconds.
fn silence(text: &str) -> Result<u16, String> {
    let [min, max] = [SILENCE_S.0, SILENCE_S.1].map(f64::from);
    let seconds = TIME.read_within(text, [min, max])?;
    match seconds.fract() == 0.0 {
        true => Ok(seconds as u16),
        false => Err("whole seconds, as 10s".to_owned()),
    }
}

/// Serves the terrain until Ctrl-C, the end of the time or of the script; with several devices,
/// until each has ended.
///
/// # Errors
/// A fault of the file, or a missing device at the start. If a device disappears later, the program
/// waits for it. With several devices, a failure is reported at once, the others continue, and the
/// final error names each that failed.
pub fn run(args: &Args) -> Result<(), Failure> {
    let devices = devices::of(args)?;
    let outputs: Vec<_> = devices.iter().filter_map(|d| d.record.clone()).collect();
    let mut inputs = args.terrain.inputs();
    inputs.extend(args.commands.file());
    inputs.extend(args.rendering.surface.inputs());
    inputs.extend(args.settings.file());
    check_distinct(&outputs, &inputs).or_hint(OTHER_FILE)?;
    partial_files::report(outputs.iter().map(PathBuf::as_path));
    let events = args.events.listen()?;
    let viewer = args.viewing.program()?;
    let raster = args.terrain.open()?;
    let name = args.terrain.name();
    let (options, reading) = (&args.rendering.surface, &args.terrain.reading);
    let surface = options.load()?;
    let params = surface.params;
    check_stiffness(params.stiffness_n_per_mm)?;
    let materials = surface.materials(options, (&name, &raster), reading)?;
    args.rendering.warn_if_level_is_kept(materials.is_some());
    let cells = reading.cells();
    let mut request = args.placing.of((&args.rendering, cells), &raster)?;
    request.grid = request.grid.with_materials(materials.as_ref());
    request.grid = request.grid.with_tip(args.rendering.tip_of_hand_mm());
    // Errors of recordings are found before any device is armed.
    let recordings = of_each(&devices, recording)?;
    let commands = args.commands.open_for(devices.len())?;
    interrupt::listen();
    let (arms, calibration_read): (Vec<_>, Vec<_>) =
        devices.iter().map(OneDevice::read_calibration).unzip();
    let placed_surface = of_each(devices.iter().zip(arms), |(device, arm)| {
        InReach::of(&request, arm).map_err(|failure| failure.about(device.device_console.name()))
    })?;
    let placed = of_each(
        devices.iter().zip(&placed_surface),
        |(device, placed_surface)| {
            Placed::new(device, (&name, placed_surface), params)
                .map_err(|failure| failure.about(device.device_console.name()))
        },
    )?;
    // The coarse levels are read before any device is armed. A viewer shows one device.
    let viewer = viewer
        .zip(placed.first())
        .map(|(program, of)| PreparedViewer::new(program, of.terrain, &of.view, &name));
    raster.check_complete()?;
    materials
        .as_ref()
        .map_or(Ok(()), |it| it.classes().check_complete())?;
    // No read of terrain may wait while an arm may be armed.
    let mut viewer = viewer.map(PreparedViewer::non_blocking);
    let terrains: Vec<_> = placed.iter().map(|of| of.terrain.non_blocking()).collect();
    let placed: Vec<_> = (placed.into_iter().zip(&terrains))
        .map(|(placed, terrain)| Placed { terrain, ..placed })
        .collect();
    let mut device_keys = share_keyboard(args, &devices).into_iter();
    let each = devices.iter().zip(&placed).zip(calibration_read);
    let servings = each.zip(recordings.into_iter().zip(commands));
    let watchers = (1..).map(|number| {
        let server = events.as_ref();
        server.map(|server| args.events.watcher(server, number))
    });
    let servings = servings.zip(watchers);
    let servings = servings.map(
        |((((device, placed), calibration_read), (recording, commands)), events)| Serving {
            args,
            device,
            placed,
            calibration_read,
            recording,
            commands,
            device_keys: device_keys.next(),
            viewer: viewer.take(),
            events,
        },
    );
    let ended = serve_each(servings.collect());
    events.into_iter().for_each(events::end);
    ended
}

/// Checks that a stiffness is plausible for an arm.
fn check_stiffness(n_per_mm: f32) -> Result<(), Failure> {
    if n_per_mm <= MAX_TESTED_N_PER_MM {
        return Ok(());
    }
    Err(Failure::new(format!(
        "a stiffness of {n_per_mm} N/mm: no arm renders more than {MAX_TESTED_N_PER_MM} N/mm"
    ))
    .hint("0.4 to 0.8 N/mm are usual: hapterra-lab stability computes the stiffnesses at which an arm is stable"))
}

/// Converts each item, or returns the error of the first that fails.
fn of_each<T, U>(
    each: impl IntoIterator<Item = T>,
    make: impl FnMut(T) -> Result<U, Failure>,
) -> Result<Vec<U>, Failure> {
    each.into_iter().map(make).collect()
}

/// Returns the devices' shares of the keyboard; none for one device or without a keyboard.
fn share_keyboard(args: &Args, devices: &[OneDevice]) -> Vec<Arc<DeviceKeys>> {
    if devices.len() == 1 || args.commands.are_typed() || !io::stdin().is_terminal() {
        return vec![];
    }
    let consoles: Vec<DeviceConsole> = devices.iter().map(|d| d.device_console.clone()).collect();
    let device_keys = shared_keyboard::share(&consoles);
    let last = devices.len();
    match device_keys
        .first()
        .is_some_and(|device_keys| device_keys.has_keys())
    {
        true => notify(format!(
            "keys           1 to {last} select the device that receives the keys, also directly before each Enter: {KEYS}"
        )),
        false => notify(format!(
            "Enter          is for the device whose number, 1 to {last}, is typed directly before it"
        )),
    }
    device_keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Timeouts;

    #[test]
    fn default_silence_is_that_of_the_session() {
        assert_eq!(silence("30s"), Ok(Timeouts::REAL_SILENCE_S));
    }
}
