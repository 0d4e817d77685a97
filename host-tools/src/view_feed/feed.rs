//! Messages to a viewer about a session.

use std::io::Write;
use std::process::Child;
use std::time::Duration;

use hapterra_core::scene::TickRecord;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_view_stream::{self as stream, Link, Message, Scene, TickCost};

use super::first_placement::ToFirstPlacement;
use super::program::{Program, ProgramError};
use super::queue::Queue;
use super::scene::{Picture, Prepared, home_cells, tick_cost};
use super::surroundings::Surroundings;
use super::tiles::Tiles;
use crate::link::{Event, LinkStats};
use crate::replay::Record;
use crate::terrain::Terrain;

/// Samples in a message of a live session: the viewer's hand moves once with each message.
const LIVE_BATCH: usize = 33;
/// Samples in a message of a recording.
const RECORDING_BATCH: usize = 1000;
/// Time between two messages on the link, s of the device's time.
const LINK_INTERVAL_S: f64 = 0.5;
/// Max pending bytes of a live session: some ten seconds of samples and the largest layer.
const LIVE_BYTES: usize = 8 << 20;
/// Max pending bytes if nothing is armed: a replay may be faster than a viewer for moments, and a
/// recording waits.
const RECORDING_BYTES: usize = 64 << 20;
/// Time-out of the viewer's pending messages at the end.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of dropped messages, batches of samples included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Messages.
    pub messages: u64,
    /// Samples in them.
    pub samples: u64,
}

/// Sends a session to a viewer without waiting for it.
pub struct ViewFeed<'t> {
    terrain: Terrain<'t>,
    /// The terrain of the first placement, whose tiles keep their detail.
    first: Terrain<'t>,
    /// True if the terrain of the first placement is drawn during the whole session.
    converts_to_first: bool,
    /// The placement in force, if its cells differ from those of the first one.
    to_first: Option<ToFirstPlacement<'t>>,
    /// A placement that has to be sent to the viewer before anything else.
    scene_due: Option<Box<Scene>>,
    tiles: Tiles,
    surroundings: Surroundings,
    queue: Queue,
    /// The viewer.
    child: Option<Child>,
    batch: Vec<stream::Sample>,
    batch_size: usize,
    link_due_s: f64,
    latest: Option<stream::Sample>,
    late: u32,
    has_cost: bool,
    tick: Option<TickCost>,
    dropped: Dropped,
}

impl<'t> ViewFeed<'t> {
    /// Starts a viewer of a session or a recording.
    ///
    /// # Errors
    /// When the viewer does not start.
    pub fn start(
        program: &Program,
        prepared: Prepared<'t>,
        device: Option<&DeviceHello>,
    ) -> Result<Self, ProgramError> {
        let mut child = program.start()?;
        let feed = match child.stdin.take() {
            Some(pipe) => Self::into_pipe(pipe, prepared, device),
            None => Self::into_pipe(std::io::sink(), prepared, device),
        };
        Ok(Self {
            child: Some(child),
            ..feed
        })
    }

    fn into_pipe(
        pipe: impl Write + Send + 'static,
        mut prepared: Prepared<'t>,
        device: Option<&DeviceHello>,
    ) -> Self {
        let (limit, batch_size) = match prepared.scene.is_live {
            true => (LIVE_BYTES, LIVE_BATCH),
            false => (RECORDING_BYTES, RECORDING_BATCH),
        };
        let converts_to_first = !prepared.scene.is_live;
        let (terrain, has_cost) = (prepared.terrain.clone(), device.is_some());
        let tick = device.map(tick_cost);
        prepared.scene.tick.clone_from(&tick);
        let window = device.map_or(1, |device| device.window);
        let surroundings = Surroundings::new(&terrain, home_cells(&prepared.scene));
        let first = prepared.into_messages();
        Self {
            tiles: Tiles::new(window, terrain.parts()),
            first: terrain.clone(),
            terrain,
            converts_to_first,
            to_first: None,
            scene_due: None,
            surroundings,
            tick,
            queue: Queue::start(pipe, first, limit),
            child: None,
            batch: Vec::with_capacity(batch_size),
            batch_size,
            link_due_s: 0.0,
            latest: None,
            late: 0,
            has_cost,
            dropped: Dropped::default(),
        }
    }

    /// Adds a sample and its row.
    pub fn on_sample(&mut self, sample: &TickRecord, record: &Record) {
        self.late = sample.late;
        self.tiles.set_missing(sample.missing_tile);
        // A sample has the cost of the tick before; the first has none.
        let cost = (self.has_cost && sample.tick > 1).then_some(sample.cost);
        self.row(record, cost);
    }

    /// Adds a row of a recording, or of a sample.
    pub fn row(&mut self, record: &Record, cost: Option<u32>) {
        let record = &self.converted(record);
        let [x, y, _] = record.hip_mm;
        let row = stream::Sample {
            t_s: record.t_s,
            hip_mm: record.hip_mm,
            proxy_mm: record.proxy_mm,
            force_n: record.force_n.map(|newtons| newtons as f32),
            ground_mm: self.terrain.height_mm(x, y).unwrap_or(f64::NAN),
            contact: record.contact,
            cost,
        };
        self.latest = Some(row);
        self.batch.push(row);
        if self.batch.len() >= self.batch_size {
            self.flush();
        }
    }

    /// Processes an event about the device's window.
    pub fn on_event(&mut self, event: &Event<'_>) {
        self.tiles.on_event(event);
    }

    /// Changes to another placement of the terrain, that of the next sample.
    pub fn change_placement(&mut self, picture: Picture<'_, 't>) {
        self.flush();
        self.to_first = match self.converts_to_first {
            true => ToFirstPlacement::new(&self.first, picture.terrain),
            false => None,
        };
        match self.to_first.take() {
            Some(to_first) => {
                self.send_view(Picture {
                    terrain: to_first.terrain(),
                    home_mm: picture.home_mm.map(|home_mm| to_first.place(home_mm)),
                    ..picture
                });
                self.to_first = Some(to_first);
            }
            None => self.send_view(picture),
        }
    }

    /// Converts a row for the viewer.
    fn converted(&self, record: &Record) -> Record {
        let to_first = self.to_first.as_ref();
        to_first.map_or(*record, |to_first| to_first.record(record))
    }

    fn send_view(&mut self, picture: Picture<'_, 't>) {
        let keeps_cells = picture.terrain.grid().has_samples_of(self.terrain.grid());
        let keeps_tiles = picture.terrain.has_tiles_of(&self.terrain);
        // Combines this placement with one that was not sent to the viewer.
        let before = self.scene_due.as_ref();
        let keeps_all = keeps_tiles && before.is_none_or(|before| before.keeps_tiles);
        self.tiles
            .change_placement(keeps_tiles, picture.terrain.parts());
        self.terrain = picture.terrain.clone();
        let scene = Scene {
            keeps_tiles: keeps_all,
            tick: self.tick.clone(),
            ..picture.scene()
        };
        let home = home_cells(&scene);
        match keeps_cells {
            true => self.surroundings.follow(&self.terrain, home),
            false => self.surroundings.restart(&self.terrain, home),
        }
        self.scene_due = Some(Box::new(scene));
        self.send_scene();
    }

    /// Returns true if the viewer has the placement in force.
    fn send_scene(&mut self) -> bool {
        let Some(scene) = self.scene_due.take() else {
            return true;
        };
        let is_sent = self.queue.offer(Message::Scene(scene.clone()));
        if !is_sent {
            self.scene_due = Some(scene);
        }
        is_sent
    }

    /// Keeps the tile under a row's HIP in full detail: for rows that are not rendered by a device
    /// with a window.
    pub fn keep_detailed(&mut self, record: &Record) {
        let [x, y, _] = self.converted(record).hip_mm;
        let cell_mm = self.terrain.scale_of_level_0().cell_mm();
        self.tiles
            .keep_detailed(&self.first, [x, y].map(|mm| mm / cell_mm));
        self.tiles.send_pending(&self.first, &self.queue);
    }

    /// Sends the due messages on tiles and link; call it after each poll of the line.
    pub fn send_due(&mut self, stats: &LinkStats) {
        if !self.send_scene() {
            return;
        }
        self.tiles.send_pending(&self.terrain, &self.queue);
        self.tiles.send_window(&self.queue);
        self.surroundings.send_pending(&self.terrain, &self.queue);
        let due_s = self.link_due_s;
        if let Some(latest) = self.latest.filter(|latest| latest.t_s >= due_s) {
            self.link_due_s = latest.t_s + LINK_INTERVAL_S;
            let link = Link {
                t_s: latest.t_s,
                tiles: stats.tiles,
                tile_bytes: stats.tile_bytes,
                samples: stats.samples,
                lost: stats.lost + stats.dropped,
                late: self.late,
                dropped: self.dropped.messages,
            };
            self.offer(Message::Link(link));
        }
    }

    /// Waits until the viewer has read most of its messages: only for recordings, which nothing
    /// else waits for. Returns false if the viewer has ended.
    pub fn wait_for_room(&self) -> bool {
        self.queue.wait_for_room(Duration::from_secs(60))
    }

    /// Ends the stream. The viewer keeps its picture; the child is returned, so that the caller can
    /// wait for it.
    #[must_use]
    pub fn finish(mut self) -> (Dropped, Option<Child>) {
        self.flush();
        self.queue.end(END_TIMEOUT);
        (self.dropped, self.child)
    }

    fn flush(&mut self) {
        if self.batch.is_empty() {
            return;
        }
        let batch = std::mem::replace(&mut self.batch, Vec::with_capacity(self.batch_size));
        let samples = batch.len() as u64;
        let is_sent = match self.send_scene() {
            true => self.offer(Message::Samples(batch)),
            // The viewer would draw them in the placement before.
            false => {
                self.dropped.messages += 1;
                false
            }
        };
        if !is_sent {
            self.dropped.samples += samples;
        }
    }

    fn offer(&mut self, message: Message) -> bool {
        let is_accepted = self.queue.offer(message);
        self.dropped.messages += u64::from(!is_accepted);
        is_accepted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Scale;
    use crate::terrain::in_file::in_file;
    use crate::timeouts::wait_until;
    use crate::view_feed::pipe::Pipe;
    use heightfield::Raster;
    use std::sync::mpsc::sync_channel;

    fn picture<'p, 't>(terrain: &'p Terrain<'t>) -> Picture<'p, 't> {
        Picture {
            terrain,
            title: "plain",
            facts: vec![],
            home_mm: None,
            laid_mm: None,
            is_live: true,
        }
    }

    fn row(feed: &mut ViewFeed<'_>, t_s: f64) {
        let record = Record {
            t_s,
            hip_mm: [1.0; 3],
            contact: false,
            proxy_mm: [1.0; 3],
            force_n: [0.0; 3],
        };
        feed.row(&record, None);
    }

    #[test]
    fn feed_does_not_wait_for_ground_while_an_arm_may_be_armed() {
        let folder = tempfile::tempdir().expect("a folder");
        // Large enough for layers of coarser samples.
        let raster = in_file(folder.path(), [2100, 300], |x, y| (x + y) as f32);
        let terrain = Terrain::new(&raster, Scale::new(0.5, 0.5).expect("scale"), 0);
        let terrain = terrain.expect("terrain");
        let prepared = picture(&terrain).prepare().non_blocking();
        let mut feed = ViewFeed::into_pipe(std::io::sink(), prepared, None);
        let ground = |feed: &mut ViewFeed<'_>| {
            row(feed, 0.0);
            feed.latest.expect("a row").ground_mm
        };
        assert!(ground(&mut feed).is_nan(), "the feed waited");
        wait_until("ground", || !ground(&mut feed).is_nan());
    }

    #[test]
    fn slow_viewer_receives_each_scene_before_its_samples() {
        let raster = Raster::from_fn(70, 70, |x, y| (x + y) as f32).expect("raster");
        let terrain = |mm| Terrain::new(&raster, Scale::new(mm, mm).expect("scale"), 0);
        let [first, second] = [0.5, 1.0].map(|mm| terrain(mm).expect("terrain"));
        let (pipe, out) = sync_channel(0);
        let mut feed = ViewFeed::into_pipe(Pipe(pipe), picture(&first).prepare(), None);
        let mut rows = 0_u64;
        while feed.dropped.samples == 0 {
            row(&mut feed, 0.0);
            rows += 1;
        }
        // No room, not even for a placement.
        while feed.queue.offer(Message::Link(Link::default())) {}
        feed.change_placement(picture(&second));
        for _ in 0..2 * LIVE_BATCH {
            row(&mut feed, 1.0);
        }
        assert!(feed.scene_due.is_some());
        let mut end = Vec::new();
        stream::write(&mut end, &Message::End).expect("memory");
        let reader = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            while !bytes.ends_with(&end) {
                bytes.extend(out.recv().expect("more"));
            }
            bytes
        });
        assert!(feed.wait_for_room());
        for _ in 0..2 * LIVE_BATCH {
            row(&mut feed, 1.0);
        }
        rows += 4 * LIVE_BATCH as u64;
        let (dropped, _) = feed.finish();
        let bytes = reader.join().expect("it reads");
        let (mut rest, mut views, mut reported) = (bytes.as_slice(), 0, 0);
        while let Some(message) = stream::read(&mut rest).expect("whole") {
            match message {
                Message::Scene(scene) => {
                    views += 1;
                    assert_eq!(scene.cell_mm, 0.5 * f64::from(views));
                    assert!(!scene.keeps_tiles || views == 2);
                }
                Message::Samples(samples) => {
                    reported += samples.len() as u64;
                    let of_view = |sample: &stream::Sample| sample.t_s == f64::from(views - 1);
                    assert!(samples.iter().all(of_view), "in view {views}");
                }
                _ => {}
            }
        }
        assert_eq!((views, reported + dropped.samples), (2, rows));
        assert!(dropped.samples >= 2 * LIVE_BATCH as u64);
        // Each dropped sample was in a batch, and nothing else was dropped.
        let batches = dropped.samples / LIVE_BATCH as u64;
        assert_eq!(dropped.messages, batches, "{dropped:?}");
    }
}
