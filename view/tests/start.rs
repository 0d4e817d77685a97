//! First messages to a page: the whole terrain at its coarsest level.

mod common;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use hapterra_view_stream::{Layer, Message};

use common::feed::Feed;
use common::scene::{batch, greeting, layer, scene};
use common::{Running, Viewer, folder, hapterra};

/// Entities in the order in which a page receives them, true for static ones, and the time at which
/// the coarsest level was complete.
struct Reported {
    entities: Vec<(String, bool)>,
    whole: Option<(usize, Duration)>,
}

/// Reads a page's stream up to the first event.
fn reported(port: u16) -> Reported {
    let began = Instant::now();
    let mut reported = Reported {
        entities: vec![],
        whole: None,
    };
    for chunk in Feed::open(port, "/feed").flatten() {
        let entity = chunk.entity_path().to_string();
        if entity.starts_with("/terrain/layer0/") {
            reported.whole = Some((reported.entities.len(), began.elapsed()));
        }
        reported.entities.push((entity, chunk.is_static()));
        if !chunk.is_static() {
            break;
        }
    }
    reported
}

/// Checks that no finer layer and no event precedes the complete coarse level.
fn check(reported: &Reported, finer: &[&str]) -> Duration {
    let (last, after) = reported.whole.expect("the coarsest level");
    let first = |begin: &str| {
        let mut entities = reported.entities.iter();
        entities.position(|(entity, _)| entity.starts_with(begin))
    };
    for finer in finer {
        let first = first(finer).unwrap_or_else(|| panic!("{finer} of {:?}", reported.entities));
        assert!(last < first, "{finer}: {:?}", reported.entities);
    }
    let happened = reported.entities.iter().position(|(_, stands)| !stands);
    assert!(last < happened.expect("something happened"));
    after
}

#[test]
fn page_receives_the_coarse_layer_before_finer_ones() {
    let mut viewer = Viewer::start("");
    let Message::Layer(whole) = layer() else {
        unreachable!()
    };
    let finer = Message::Layer(Layer {
        number: 1,
        columns: 33,
        rows: 33,
        heights: vec![100.0; 33 * 33],
        ..whole.clone()
    });
    // Finer layers that were sent earlier, to a page that connects later.
    let mut messages = vec![greeting(), scene(true), Message::Layer(whole), finer];
    messages.extend(batch(0, 300, &mut vec![]));
    for message in &messages {
        assert!(viewer.send(message));
    }
    let reported = reported(viewer.port());
    check(&reported, &["/terrain/layer1/", "/terrain/tiles/"]);
    let blocks: BTreeSet<_> = { reported.entities.iter() }
        .filter(|(entity, _)| entity.starts_with("/terrain/layer0/"))
        .collect();
    // 160 cells in blocks of 32.
    assert_eq!(blocks.len(), 25);
}

/// Measures it with a file: `TERRAIN=FILE cargo test --release --test start -- --nocapture`.
#[test]
fn demo_page_receives_the_coarse_layer_first() {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let folder = folder("start");
    demo.args(["demo", "--device", "native", "--duration", "4s", "--view"])
        .args(std::env::var_os("TERRAIN").map(PathBuf::from))
        .arg("--out")
        .arg(&folder);
    let began = Instant::now();
    let mut demo = Running::start_with_viewer(&mut demo, "");
    // This line begins the session with the device.
    demo.wait_for_line("device ");
    let (read, session) = (began.elapsed(), Instant::now());
    let port = demo.port();
    let elapsed = session.elapsed();
    let after = check(&reported(port), &[]);
    println!(
        "terrain read after {read:?}; then the page's address after {elapsed:?}, and the coarse whole {after:?} after its request"
    );
    assert!(demo.end());
    std::fs::remove_dir_all(folder).expect("it is removed");
}
