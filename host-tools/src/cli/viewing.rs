//! The viewer, for several commands.

use std::time::Duration;

use hapterra_core::scene::TickRecord;
use hapterra_core::wire::hello::DeviceHello;

use super::failure::{Failure, Hint};
use super::options::placing;
use super::terminal::interrupt;
use crate::link::{Event, LinkStats};
use crate::place::Placement;
use crate::replay::Record;
use crate::telemetry::SessionPlacement;
use crate::terrain::Terrain;
use crate::view_feed::{Picture, Prepared, Program, ProgramError, VARIABLE, ViewFeed};

/// Interval of checks whether the viewer has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The viewer.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "While it is touched")]
pub struct Viewing {
    /// Show terrain, hand and plots in a browser
    ///
    /// Needs the program hapterra-view beside this one or on the PATH. Its options go
    /// into HAPTERRA_VIEW_OPTIONS; `hapterra-view --help` lists them.
    #[arg(long)]
    pub view: bool,
}

impl Viewing {
    /// Returns the viewer, if requested. It is searched for before any device is armed.
    ///
    /// # Errors
    /// The viewer is missing.
    pub(in crate::cli) fn program(&self) -> Result<Option<Program>, Failure> {
        Ok(self.view.then(Program::find).transpose()?)
    }
}

impl Hint for ProgramError {
    fn hint(&self) -> String {
        match self {
            Self::Absent => format!(
                "in hapterra's sources type: cargo xtask view; then put the program that it names beside hapterra, or name it in {VARIABLE}"
            ),
            Self::NotStarted { .. } => {
                format!("rebuild it with: cargo xtask view; {VARIABLE} may name another")
            }
        }
    }
}

/// Returns the viewer's picture of a terrain in front of an arm.
fn picture<'p, 't>(terrain: &'p Terrain<'t>, view: &Placement, title: &'p str) -> Picture<'p, 't> {
    let file = terrain.raster().georeference();
    Picture {
        terrain,
        title,
        facts: placing::picture_lines(view, &file),
        home_mm: Some(view.home_mm),
        laid_mm: Some(view.extent_mm),
        is_live: true,
    }
}

/// A viewer that starts once there is something to show.
pub(in crate::cli) struct PreparedViewer<'t> {
    program: Program,
    prepared: Prepared<'t>,
    title: String,
}

impl<'t> PreparedViewer<'t> {
    /// Reads the coarse levels of a terrain in front of an arm.
    pub(in crate::cli) fn new(
        program: Program,
        terrain: &Terrain<'t>,
        view: &Placement,
        title: &str,
    ) -> Self {
        Self {
            program,
            prepared: picture(terrain, view, title).prepare(),
            title: title.to_owned(),
        }
    }

    /// Returns the same, with further reads of the terrain that do not wait.
    pub(in crate::cli) fn non_blocking(self) -> Self {
        Self {
            prepared: self.prepared.non_blocking(),
            ..self
        }
    }

    /// Starts the viewer. If it does not start, this is reported and the session continues.
    pub(in crate::cli) fn start(
        self,
        device: &DeviceHello,
        notify: impl FnOnce(String),
    ) -> Option<ViewerSession<'t>> {
        match ViewFeed::start(&self.program, self.prepared, Some(device)) {
            Ok(feed) => Some(ViewerSession {
                feed,
                title: self.title,
                view: 0,
            }),
            Err(why) => {
                notify(format!("not shown: {why}"));
                None
            }
        }
    }
}

/// Sends a session to a viewer.
pub(in crate::cli) struct ViewerSession<'t> {
    feed: ViewFeed<'t>,
    title: String,
    /// Placement of the latest sample.
    view: usize,
}

impl<'t> ViewerSession<'t> {
    /// Processes an event of the session.
    pub(in crate::cli) fn on_event(&mut self, event: &Event<'_>) {
        self.feed.on_event(event);
    }

    /// Processes a sample with its row and its placement.
    pub(in crate::cli) fn on_sample(
        &mut self,
        sample: &TickRecord,
        record: &Record,
        (view, placement): (usize, &SessionPlacement<'t>),
    ) {
        if view != self.view {
            self.view = view;
            if let Some(placed_surface) = &placement.placed_surface {
                let picture = picture(&placement.terrain, &placed_surface.view, &self.title);
                self.feed.change_placement(picture);
            }
        }
        self.feed.on_sample(sample, record);
    }

    /// As [`ViewFeed::send_due`].
    pub(in crate::cli) fn send_due(&mut self, stats: &LinkStats) {
        self.feed.send_due(stats);
    }

    /// As [`end`].
    pub(in crate::cli) fn end(self, print_line: impl Fn(String)) {
        end(self.feed, print_line);
    }
}

/// Ends the stream, reports what was not sent to the viewer, and waits until no page is open or the
/// user interrupts.
pub(in crate::cli) fn end(feed: ViewFeed<'_>, print_line: impl Fn(String)) {
    let (dropped, viewer) = feed.finish();
    if dropped.messages > 0 {
        print_line(format!(
            "view           {} messages with {} samples were not shown: the viewer was slow, or had ended",
            dropped.messages, dropped.samples
        ));
    }
    let Some(mut viewer) = viewer else {
        return;
    };
    while !interrupt::requested() && matches!(viewer.try_wait(), Ok(None)) {
        std::thread::sleep(POLL_INTERVAL);
    }
}
