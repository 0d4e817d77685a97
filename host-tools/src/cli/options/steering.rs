//! Options and input for placements that change during a session, shared by `run` and `demo`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use hapterra_core::force::SurfaceParams;
use hapterra_core::phantom::Calibration;

use super::placing::{self, scale_in_words, short};
use crate::cli::failure::{Failure, OrHint};
use crate::cli::terminal::interrupt;
use crate::cli::terminal::keyboard::keyboard;
use crate::cli::terminal::raw_mode::RawMode;
use crate::cli::terminal::shared_keyboard::DeviceKeys;
use crate::link::{Event, HostRequest};
use crate::place::{Bounds, PlacedSurface, Reach};
use crate::replay::Mark;
use crate::steering::keys::{KEYS, Key, Keys};
use crate::steering::{
    Action, CommandQueue, Marks, Origin, PlacementUpdate, Steer, Steering, UserMark,
};
use crate::telemetry::{Placements, SampleLog};
use crate::terrain::Terrain;

/// Commands that change placement and surface during a session.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "While it is touched")]
pub struct Commands {
    /// File with commands, a line each, or - for standard input
    ///
    /// Commands: `at 2.5s zoom 2`, `pan 5mm 0mm`, `pan 100m 0m`, `exaggerate 1.5`, `surface sand`, `stiffness 0.5`,
    /// `friction 0.4`, `damping 2Ns/m`, `tip 3mm`, `shading smooth`, `texture grain 0.1mm 1mm`, `clutch on`,
    /// `clutch off`, `reset`, `mark TEXT`.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    pub commands: Option<Origin>,

    /// With --commands -: end, as after Ctrl-C, when standard input is closed
    #[arg(long, hide_short_help = true)]
    pub end_with_input: bool,
}

impl Commands {
    /// Returns the file of commands, if any.
    pub(in crate::cli) fn file(&self) -> Option<PathBuf> {
        match &self.commands {
            Some(Origin::File(path)) => Some(path.clone()),
            _ => None,
        }
    }

    /// Starts to read commands.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub(in crate::cli) fn open(&self) -> Result<CommandQueue, Failure> {
        if self.end_with_input {
            return self
                .open_for(1)
                .map(|queues| queues.into_iter().next().unwrap_or_default());
        }
        let queue = self.commands.as_ref().map(CommandQueue::of);
        self.with_hint(queue.transpose())
            .map(Option::unwrap_or_default)
    }

    /// The same for several devices, with a queue for each.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub(in crate::cli) fn open_for(&self, devices: usize) -> Result<Vec<CommandQueue>, Failure> {
        if devices == 1 && !self.end_with_input {
            return self.open().map(|queue| vec![queue]);
        }
        if self.end_with_input && !self.are_typed() {
            return Err("--end-with-input is for commands from standard input")
                .or_hint("add --commands -");
        }
        let ends = self.end_with_input;
        let at_end = move || {
            if ends {
                interrupt::input_ended();
            }
        };
        let several = |origin| CommandQueue::of_several(origin, devices, at_end);
        let queues = self.commands.as_ref().map(several);
        let none = || (0..devices).map(|_| CommandQueue::default()).collect();
        self.with_hint(queues.transpose())
            .map(|queues| queues.unwrap_or_else(none))
    }

    fn with_hint<T>(&self, opened: std::io::Result<T>) -> Result<T, Failure> {
        let from = match self.file() {
            Some(path) => format!(" from {}", path.display()),
            None => String::new(),
        };
        opened
            .map_err(|error| format!("commands cannot be read{from}: {error}"))
            .or_hint("name another file with --commands, or `-` for standard input")
    }

    /// Returns true if commands come from standard input.
    pub(in crate::cli) fn are_typed(&self) -> bool {
        self.commands == Some(Origin::StandardInput)
    }
}

/// Connects keys and commands with a session.
pub(in crate::cli) struct PlacementControl<'t> {
    steering: Steering<'t>,
    marks: Marks,
    commands: CommandQueue,
    keys: Keys,
    typing: Typing,
    began: Instant,
    /// The question answered since the last call.
    entered: Option<u32>,
}

/// Source of keys.
enum Typing {
    /// No keyboard, or standard input is read by lines.
    None,
    /// The terminal, in raw mode until the value is dropped.
    Terminal(RawMode),
    /// The shared terminal of several devices.
    DeviceKeys(Arc<DeviceKeys>),
}

impl Typing {
    /// Returns the keys pressed since the last call; `None` without a keyboard.
    fn keys(&self) -> Option<Vec<Key>> {
        match self {
            Self::None => None,
            Self::Terminal(_) => Some(keyboard().keys()),
            Self::DeviceKeys(device_keys) => device_keys.has_keys().then(|| device_keys.keys()),
        }
    }
}

impl<'t> PlacementControl<'t> {
    /// Starts with the first placement served.
    pub(in crate::cli) fn new(
        (terrain, placed_surface): (&Terrain<'t>, PlacedSurface),
        (arm, level): (&Calibration, Option<u8>),
        commands: CommandQueue,
    ) -> Self {
        let bounds = Bounds {
            first: placed_surface,
            resolution_mm: Reach::of(arm).resolution_mm(),
            level,
            tip_mm: terrain.grid().tip_mm(),
            coarser: 0,
        };
        Self {
            steering: Steering::new(bounds, terrain.clone()),
            marks: Marks::default(),
            commands,
            keys: Keys::default(),
            typing: Typing::None,
            began: Instant::now(),
            entered: None,
        }
    }

    /// Changes the level by the hand's speed from now on, on a device with this tick rate.
    pub(in crate::cli) fn follow_speed(&mut self, tick_hz: u32) {
        self.steering.follow_speed(tick_hz);
    }

    /// Returns the number of the question that a command answered since the last call.
    pub(in crate::cli) fn entered(&mut self) -> Option<u32> {
        self.entered.take()
    }

    /// Reads keys from the terminal until the value is dropped, unless commands are read there.
    /// Returns a line with the keys.
    pub(in crate::cli) fn listen(&mut self, options: &Commands) -> Option<String> {
        if options.are_typed() {
            return None;
        }
        self.typing = Typing::Terminal(RawMode::enter()?);
        Some(format!("keys           {KEYS}"))
    }

    /// Reads the keys for one of several devices.
    pub(in crate::cli) fn use_keys(&mut self, device_keys: &Arc<DeviceKeys>) {
        self.typing = Typing::DeviceKeys(Arc::clone(device_keys));
    }

    /// Processes an event of the device.
    pub(in crate::cli) fn on_event(&mut self, event: &Event<'_>) {
        self.steering.on_event(event);
        self.marks.on_event(event);
    }

    /// Processes keys and commands at a time of the device, s. Reports their errors with `notify`.
    pub(in crate::cli) fn update(&mut self, t_s: f64, notify: &mut dyn FnMut(String)) {
        let now = self.began.elapsed();
        if let Some(keys) = self.typing.keys() {
            for key in keys {
                let steer = self.keys.press(key, now);
                self.apply(steer);
            }
            let released = self.keys.released(now);
            self.apply(released);
        }
        let is_free = self.steering.is_settled();
        match self.commands.due(t_s, is_free, notify) {
            Some(Action::Steer(steer)) => self.apply(Some(steer)),
            Some(Action::Mark(text)) => self.marks.mark(text).into_iter().for_each(&mut *notify),
            Some(Action::Enter(number)) => self.entered = Some(number),
            None => {}
        }
        self.steering.lines().into_iter().for_each(notify);
    }

    fn apply(&mut self, steer: Option<Steer>) {
        if let Some(steer) = steer {
            self.steering.steer(steer);
        }
    }

    /// Returns the present requests to the device.
    pub(in crate::cli) fn requests(&mut self) -> Vec<HostRequest> {
        let mut requests = self.steering.requests();
        requests.extend(self.marks.requests());
        requests
    }

    /// Returns the marks made since the last call, for a recording. `is_over` is true at the end,
    /// when the device no longer replies.
    pub(in crate::cli) fn marks(&mut self, log: &SampleLog<'_>, is_over: bool) -> Vec<Mark> {
        let made = match is_over {
            true => self.marks.take_all(),
            false => self.marks.take_marks(),
        };
        let mark = |made: UserMark| {
            let t_s = made.tick.map_or(log.t_s(), |tick| log.t_s_of(tick));
            Mark::new(made, t_s)
        };
        made.into_iter().map(mark).collect()
    }

    /// Returns the placement to activate now; samples may use it from now on.
    pub(in crate::cli) fn take_update(
        &mut self,
        views: &mut Placements<'t>,
    ) -> Option<PlacementUpdate<'t>> {
        let update = self.steering.take_update()?;
        views.add(
            update.view.number,
            update.terrain.clone(),
            update.placed_surface,
        );
        Some(update)
    }

    /// Describes the active placement briefly, with the keys.
    pub(in crate::cli) fn in_words(&self) -> String {
        let PlacedSurface { view, params } = self.steering.now();
        let scale = match view.ground_m_per_mm() {
            Some(metres) => format!("{} m/mm", short(metres)),
            None => format!("{} mm a cell", short(view.haptic_cell_mm())),
        };
        let times = view.exaggeration.unwrap_or(1.0);
        let stiffness = short(f64::from(params.stiffness_n_per_mm));
        format!(
            "{scale}, level {}, heights × {}, {stiffness} N/mm",
            view.level,
            short(times)
        )
    }
}

/// Describes a surface by its effects.
fn surface_in_words(params: &SurfaceParams) -> String {
    let number = |number: f32| placing::short(f64::from(number));
    let (friction, texture) = (&params.friction, &params.texture);
    let mut words = vec![format!("{} N/mm", number(params.stiffness_n_per_mm))];
    if friction.static_mu > 0.0 {
        let [sliding, at_rest] = [friction.dynamic_mu, friction.static_mu].map(number);
        words.push(format!("friction {sliding}, {at_rest} at rest"));
    }
    if friction.viscous_s > 0.0 {
        words.push(format!("viscous friction {} s", number(friction.viscous_s)));
    }
    if params.damping.ns_per_m > 0.0 {
        words.push(format!("damping {} N·s/m", number(params.damping.ns_per_m)));
    }
    if !params.shading.is_none() {
        words.push("shading".to_owned());
    }
    if !texture.is_none() {
        let [amplitude, wavelength] = [texture.amplitude_mm, texture.wavelength_mm].map(number);
        words.push(format!("texture of {amplitude} mm every {wavelength} mm"));
    }
    words.join(", ")
}

/// Describes a mark in one line.
pub(in crate::cli) fn mark_text(mark: &Mark) -> String {
    let Mark { text, t_s, .. } = mark;
    match mark.tick {
        Some(tick) => format!("mark           `{text}` at tick {tick}, {t_s:.3} s"),
        None => format!(
            "mark           `{text}` at about {t_s:.3} s: the device has not reported its tick, and may not have raised its pin"
        ),
    }
}

/// Describes a new placement in one line.
pub(in crate::cli) fn placement_text(
    number: usize,
    placed_surface: &PlacedSurface,
    terrain: &Terrain<'_>,
) -> String {
    let file = terrain.raster().georeference();
    format!(
        "view {number}: {}; {}; {}; {} under the home position",
        scale_in_words(&placed_surface.view),
        surface_in_words(&placed_surface.params),
        match terrain.grid().tip_mm() {
            0.0 => "a point".to_owned(),
            mm => format!("a ball of {} mm", short(mm)),
        },
        crate::place::place_in_words(&file, placed_surface.view.home_ground)
    )
}
