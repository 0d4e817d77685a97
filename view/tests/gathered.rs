//! Gathered messages to a page that is drawn by software, a second at a time, and larger pieces for
//! a page that connects later.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use hapterra_view_stream::Message;
use re_chunk::Chunk;

use common::Viewer;
use common::feed::Feed;
use common::scene::{batch, greeting, layer, scene};

/// Ticks of the session, and of each batch, as `hapterra` sends them.
const TICKS: u64 = 10_300;
const BATCH: u64 = 16;

/// Messages to a page: events, and their rows by entity and number.
#[derive(Default)]
struct Reported {
    entries: usize,
    max_ns: u64,
    rows: BTreeMap<(String, String), (i64, String)>,
    /// Static entries, by entity and part.
    standing: BTreeMap<(String, BTreeSet<String>), Vec<String>>,
}

fn reported(feed: Feed) -> Reported {
    let mut reported = Reported::default();
    feed.flatten().for_each(|chunk| reported.add(&chunk));
    reported
}

impl Reported {
    fn add(&mut self, chunk: &Chunk) {
        let entity = chunk.entity_path().to_string();
        let all = chunk.components().list_arrays();
        if chunk.is_static() {
            let parts = chunk.components_identifiers().map(|part| part.to_string());
            let part = (entity, parts.collect());
            let values = all.map(|values| format!("{values:?}"));
            self.standing.insert(part, values.collect());
            return;
        }
        let (_, times) = chunk.timelines().iter().next().expect("a timeline");
        self.entries += 1;
        self.max_ns = self.max_ns.max(times.time_range().abs_length());
        let columns: Vec<_> = all.collect();
        for (i, (row, time)) in chunk.row_ids().zip(times.times_raw()).enumerate() {
            let values = columns
                .iter()
                .map(|column| format!("{:?}", column.value(i)));
            let values = values.collect::<Vec<_>>().concat();
            let before = self
                .rows
                .insert((entity.clone(), row.to_string()), (*time, values));
            assert!(before.is_none(), "a row of {entity} twice");
        }
    }
}

#[test]
fn gathered_feed_has_the_same_rows_in_far_fewer_entries() {
    let mut viewer = Viewer::start("--linger 5s");
    for message in [greeting(), scene(true), layer()] {
        assert!(viewer.send(&message));
    }
    let mut held = Vec::new();
    let mut feed_samples = |viewer: &mut Viewer, from: u64, to: u64| {
        for begin in (from..to).step_by(BATCH as usize) {
            for message in batch(begin, to.min(begin + BATCH), &mut held) {
                assert!(viewer.send(&message), "tick {begin}");
            }
        }
    };
    feed_samples(&mut viewer, 0, 100);
    let port = viewer.port();
    let reading = |path: &'static str| {
        let feed = Feed::open(port, path);
        std::thread::spawn(move || reported(feed))
    };
    let pages = [reading("/feed"), reading("/feed?gathered")];
    feed_samples(&mut viewer, 100, TICKS / 2);
    let amid = reading("/feed");
    feed_samples(&mut viewer, TICKS / 2, TICKS);
    assert!(viewer.send(&Message::End));
    let [fine, gathered] = pages.map(|page| page.join().expect("the stream is read"));
    let amid = amid.join().expect("the stream is read");
    let late = reported(Feed::open(port, "/feed"));
    assert!(viewer.end());

    assert!(fine.rows.len() > 1000, "{}", fine.rows.len());
    for other in [&amid, &gathered, &late] {
        assert!(fine.rows == other.rows, "{} rows", other.rows.len());
        assert!(fine.standing == other.standing);
    }
    for (other, of, most_s) in [(&gathered, &fine, 1.1), (&late, &gathered, 11.0)] {
        let (entries, of) = (other.entries, of.entries);
        assert!(4 * entries < of, "{entries} of {of}");
        assert!((other.max_ns as f64) < most_s * 1e9, "{} ns", other.max_ns);
    }
    assert!(20 * gathered.entries < fine.entries, "{}", gathered.entries);
}
