//! Display and recording of a running session.

use std::io::IsTerminal;
use std::sync::Arc;
use std::time::{Duration, Instant};

use hapterra_core::scene::{SceneChange, TickRecord};
use hapterra_core::wire::hello::DeviceHello;

use super::Args;
use super::placed::Placed;
use crate::cli::options::steering::{self, PlacementControl};
use crate::cli::terminal::arming_prompts::ArmingPrompts;
use crate::cli::terminal::device_console::DeviceConsole;
use crate::cli::terminal::shared_keyboard::DeviceKeys;
use crate::cli::viewing::ViewerSession;
use crate::events::{Event as Reported, Watcher};
use crate::link::{Event, HostRequest, LinkStats};
use crate::output::OutputError;
use crate::place::PlacedSurface;
use crate::replay::settings::PlacementSettings;
use crate::replay::{LoopColumns, Record, Recording, Value, is_below_ground, state_name};
use crate::serving::SessionHandler;
use crate::telemetry::{Figures, SampleLog};
use crate::terrain::Terrain;

/// Time without a tick after which missing terrain is an error. The clock of a virtual arm stops
/// while terrain is missing.
const STALL_TIMEOUT: Duration = Duration::from_secs(60);
/// Interval of status lines without a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(2);

/// Displays and records a running session.
pub(super) struct Watch<'t> {
    log: SampleLog<'t>,
    stop_s: f64,
    /// Time of a virtual arm's last reported tick.
    last_tick: Option<Instant>,
    /// The latest sample and its row.
    latest: Option<(TickRecord, Record)>,
    recording: Option<Recording>,
    failed: Option<OutputError>,
    /// Number of placements in the recording.
    described_view: usize,
    /// The last of them, and the radius of its tip, mm.
    described: (PlacedSurface, f64),
    control: PlacementControl<'t>,
    prompts: ArmingPrompts,
    line_due: Instant,
    viewer: Option<ViewerSession<'t>>,
    events: Option<Watcher>,
    device_console: DeviceConsole,
}

/// Result of a session's display and recording.
pub(super) struct WatchResult<'t> {
    /// Number of ticks since the scene was received.
    pub(super) ticks: u64,
    pub(super) figures: Figures,
    /// True if the virtual arm's clock was stopped at the end.
    pub(super) has_stalled: bool,
    /// Connection to the viewer, if there is one.
    pub(super) viewer: Option<ViewerSession<'t>>,
    /// Result of the recording, if there is one: complete and saved.
    pub(super) recording_result: Result<(), OutputError>,
}

impl<'t> Watch<'t> {
    pub(super) fn new(
        args: &Args,
        (placed, device_console): (&Placed<'t>, &DeviceConsole),
        device: &DeviceHello,
        recording: Option<Recording>,
        (control, device_keys): (PlacementControl<'t>, Option<&Arc<DeviceKeys>>),
    ) -> Self {
        let (script_s, prompts) = match (&placed.tour, device_keys) {
            (Some(tour), _) => (tour.duration_s(), ArmingPrompts::for_script()),
            (None, Some(device_keys)) => (f64::MAX, ArmingPrompts::at(device_keys)),
            (None, None) => (f64::MAX, ArmingPrompts::at_terminal()),
        };
        let placed_surface = PlacedSurface {
            view: placed.view,
            params: placed.scene.params,
        };
        Self {
            log: SampleLog::new(placed.terrain, device),
            stop_s: args.duration.unwrap_or(f64::MAX).min(script_s),
            last_tick: placed.tour.as_ref().map(|_| Instant::now()),
            latest: None,
            recording,
            failed: None,
            described_view: 0,
            described: (placed_surface, placed.terrain.grid().tip_mm()),
            control,
            prompts,
            line_due: Instant::now() + LINE_INTERVAL,
            viewer: None,
            events: None,
            device_console: device_console.clone(),
        }
    }

    /// Returns the same watch, which also sends samples to a viewer.
    pub(super) fn with_viewer(self, viewer: Option<ViewerSession<'t>>) -> Self {
        Self { viewer, ..self }
    }

    /// Returns the same watch, which also sends events.
    pub(super) fn with_events(self, events: Option<Watcher>) -> Self {
        Self { events, ..self }
    }

    /// Reports the end of the session to readers of events.
    pub(super) fn ended(&self, disarmed: bool) {
        if let Some(events) = &self.events {
            events.send_now(&Reported::End { disarmed });
        }
    }

    /// Ends the recording, and removes the status line of the terminal.
    pub(super) fn finish(mut self) -> WatchResult<'t> {
        self.device_console.status(None);
        self.record_marks(true);
        let (ticks, figures) = (self.log.ticks(), self.log.figures());
        let has_stalled = self.is_stalled();
        let recording_result = match (self.failed, self.recording) {
            (Some(error), _) => Err(error),
            (None, Some(recording)) => recording.finish(),
            (None, None) => Ok(()),
        };
        WatchResult {
            viewer: self.viewer,
            ticks,
            figures,
            has_stalled,
            recording_result,
        }
    }

    fn is_stalled(&self) -> bool {
        self.last_tick
            .is_some_and(|last_tick| last_tick.elapsed() >= STALL_TIMEOUT)
    }

    /// Records new marks; at the end also those without a reply.
    fn record_marks(&mut self, is_over: bool) {
        for mark in self.control.marks(&self.log, is_over) {
            self.device_console.notify(steering::mark_text(&mark));
            if let Some(events) = &self.events {
                events.mark(&mark);
            }
            if let Some(recording) = &mut self.recording {
                recording.mark(&mark);
            }
        }
    }

    fn record(&mut self, sample: &TickRecord) -> Record {
        let record = self.log.add(sample);
        let (view, placement) = self.log.view();
        if let Some(viewer) = &mut self.viewer {
            viewer.on_sample(sample, &record, (view, placement));
        }
        if let Some(events) = &mut self.events {
            events.on_sample(sample, &record, (view, &placement.terrain));
        }
        if view > self.described_view
            && let Some(placed_surface) = &placement.placed_surface
        {
            self.described_view = view;
            let described = (*placed_surface, placement.terrain.grid().tip_mm());
            let before = std::mem::replace(&mut self.described, described);
            if !has_other_level_alone(&before, &described) {
                self.device_console.notify(steering::placement_text(
                    view,
                    placed_surface,
                    &placement.terrain,
                ));
            }
            if let Some(recording) = &mut self.recording {
                let number = u32::try_from(view).unwrap_or(u32::MAX);
                let settings = PlacementSettings::new(number, &placement.terrain, placed_surface);
                let failed = recording.view(&settings).err();
                self.failed = self.failed.take().or(failed);
            }
        }
        if let Some(recording) = &mut self.recording {
            let of_loop = LoopColumns::of(sample, view);
            let [state, mode, limits, view] = of_loop.values();
            let counts = [sample.tick, sample.work, sample.cost, sample.late];
            let [tick, work, cost, late] = counts.map(Value::Count);
            let more = [state, tick, work, cost, late, mode, limits, view];
            self.failed = self.failed.take().or(recording.write(&record, &more).err());
        }
        record
    }
}

impl<'t> SessionHandler<'t> for Watch<'t> {
    fn on_event(&mut self, event: Event<'_>) {
        self.prompts.on_event(&event);
        self.control.on_event(&event);
        self.log.views().on_event(&event);
        if let Some(viewer) = &mut self.viewer {
            viewer.on_event(&event);
        }
        if let Event::Sample(sample) = event {
            // Ticks during the final disarm must not reset the time of a stopped clock.
            if !self.is_stalled() {
                self.last_tick = self.last_tick.map(|_| Instant::now());
            }
            self.latest = Some((*sample, self.record(sample)));
        }
    }

    fn notify(&mut self, line: &str) {
        self.device_console.notify(line);
    }

    fn requests(&mut self) -> Vec<HostRequest> {
        let lines = self.prompts.lines();
        lines
            .iter()
            .for_each(|line| self.device_console.notify(line));
        if let Some(events) = &mut self.events {
            events.arming(lines, self.prompts.open_question());
        }
        let (device_console, events) = (&self.device_console, &self.events);
        let refuse = |text: String| {
            if let Some(events) = events {
                events.send_now(&Reported::Refused { text: &text });
            }
            device_console.notify(text);
        };
        self.control
            .update(self.log.t_s(), &mut |text| refuse(text));
        if let Some(number) = self.control.entered()
            && !self.prompts.answer(number)
        {
            refuse(format!(
                "question {number} is not open: answer the last one"
            ));
        }
        self.record_marks(false);
        let mut requests = self.prompts.requests();
        requests.extend(self.control.requests());
        requests
    }

    fn scene_change(&mut self) -> Option<(SceneChange, Terrain<'t>)> {
        let update = self.control.take_update(self.log.views())?;
        Some((update.view, update.terrain))
    }

    /// Updates the status line, or prints one at intervals.
    fn show(&mut self, stats: &LinkStats) {
        if let Some(viewer) = &mut self.viewer {
            viewer.send_due(stats);
        }
        let Some((sample, record)) = &self.latest else {
            return;
        };
        let (_, placement) = self.log.view();
        let mut line = in_words(sample, record, &placement.terrain, stats);
        if self.log.views().count() > 1 {
            line += &format!("  [{}]", self.control.in_words());
        }
        if std::io::stderr().is_terminal() {
            self.device_console.status(Some(line));
        } else if Instant::now() >= self.line_due {
            self.line_due = Instant::now() + LINE_INTERVAL;
            self.device_console.notify(line);
        }
    }

    fn is_over(&self) -> bool {
        self.failed.is_some() || self.log.t_s() >= self.stop_s || self.is_stalled()
    }
}

/// Returns true if two placements, with the radius of the tip, differ only in place and level. The
/// hand's speed makes such a change often, and the status line shows the level.
fn has_other_level_alone(
    (before, tip_before_mm): &(PlacedSurface, f64),
    (after, tip_mm): &(PlacedSurface, f64),
) -> bool {
    before.view.level != after.view.level
        && before.view.scale == after.view.scale
        && before.params == after.params
        && tip_before_mm == tip_mm
}

fn in_words(
    sample: &TickRecord,
    record: &Record,
    terrain: &Terrain<'_>,
    stats: &LinkStats,
) -> String {
    let force = glam::DVec3::from(record.force_n).length();
    let ([x, y, z], t_s) = (record.hip_mm, record.t_s);
    let state = match is_below_ground(sample, record, terrain) {
        true => "below ground: raise the tip above the surface to touch it",
        false => state_name(sample.state),
    };
    let (tiles, lost) = (stats.tiles, stats.lost + stats.dropped);
    let fault = sample.fault;
    let fault = fault.map_or(String::new(), |f| format!(", FAULT {f:?}"));
    format!(
        "{t_s:8.3} s  {state:8}  HIP {x:.1} {y:.1} {z:.1} mm  {force:.2} N  {tiles} tiles  {lost} lost{fault}"
    )
}
