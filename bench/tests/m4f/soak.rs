//! Ticks of the stress test's scenes: every kind of terrain, every habit of the HIP, stored tiles
//! and late tiles.

use std::sync::Mutex;
use std::thread;

use hapterra_tests::instruction_counter::CountingBoard;
use hapterra_tests::scene::emulator_scene::EmulatorScene;
use hapterra_tests::scene::run::Surface;
use hapterra_tests::scene::terrain::{KINDS, Kind};

use super::table::{Row, Table, Target, Tick};

/// Seed of the scenes, which start with number 0.
const SEED: u64 = 2026;
/// Scenes, of about 550 ticks each, for the stored table: five minutes on two cores.
pub(crate) const ALL: u64 = 10_000;
/// Scenes of a test run: half a minute. A path has about fifteen of ten habits of the HIP, and
/// there are 14 kinds of terrain, so each habit occurs hundreds of times, each kind at least about
/// fifty.
pub(crate) const PART: u64 = 1000;
/// Scenes that the emulated processor replays in one run.
const BATCH: usize = 20;
/// Least number of scenes of every kind of terrain.
const MIN_SCENES: usize = 30;
/// Most instructions of a tick of the contact on any scene: with the chain around it, a tick at 10
/// kHz then fits a processor of 168 MHz.
const MAX: u32 = 12_000;

/// The settings of a scene, and the costs of its ticks.
struct CountedScene {
    kind: Kind,
    ticks: Vec<Tick>,
}

/// Returns a row over all scenes, and one for each kind of terrain among them.
pub(crate) fn rows(board: &CountingBoard, scenes: u64) -> Vec<Row> {
    let counted = count(board, scenes, Surface::Smooth);
    let target = Target {
        max: Some(MAX),
        ..Target::default()
    };
    let row = |name: &str, requested: &dyn Fn(&CountedScene) -> bool| {
        let own: Vec<&CountedScene> = counted.iter().filter(|scene| requested(scene)).collect();
        assert!(own.len() >= MIN_SCENES, "{name}: {} scenes", own.len());
        let ticks = own.iter().flat_map(|scene| scene.ticks.iter().copied());
        let row = Row::new(name, target, ticks.collect());
        if scenes < ALL { row.of_a_part() } else { row }
    };
    let mut rows = vec![row("soak", &|_| true)];
    rows.extend(KINDS.iter().map(|kind| {
        let name = format!("soak, {kind:?}").to_lowercase();
        row(&name, &|scene| scene.kind == *kind)
    }));
    rows.push(rough_row(board, scenes / 4));
    rows
}

/// Returns rows over the scenes that compare the emulated processor with the host, without
/// materials and on them.
pub(crate) fn compared_rows(board: &CountingBoard) -> Vec<Row> {
    let row = |name: &str, scenes: Vec<(u64, EmulatorScene)>| {
        let counted = count_recorded(board, scenes).into_iter();
        let ticks = counted.flat_map(|scene| scene.ticks).collect();
        Row::new(name, Target::default(), ticks)
    };
    vec![
        row("compared scenes", EmulatorScene::compared()),
        row(
            "compared scenes on materials",
            EmulatorScene::compared_on_materials(),
        ),
    ]
}

/// Returns a row over scenes with friction, a fourth as many.
fn rough_row(board: &CountingBoard, scenes: u64) -> Row {
    let counted = count(board, scenes, Surface::Rough);
    let target = Target {
        max: Some(MAX),
        ..Target::default()
    };
    let ticks = counted.iter().flat_map(|scene| scene.ticks.iter().copied());
    let row = Row::new("soak, rough surfaces", target, ticks.collect());
    if 4 * scenes < ALL {
        row.of_a_part()
    } else {
        row
    }
}

/// Replays the scenes on all cores, and those with the costliest known ticks.
fn count(board: &CountingBoard, scenes: u64, surface: Surface) -> Vec<CountedScene> {
    let [smooth, rough] = Table::recorded_scenes();
    let mut costliest = match surface {
        Surface::Smooth => smooth,
        Surface::Rough => rough,
    };
    costliest.retain(|number| *number >= scenes);
    costliest.sort_unstable();
    costliest.dedup();
    let numbers: Vec<u64> = (0..scenes).chain(costliest).collect();
    let batches = Mutex::new(numbers.chunks(BATCH));
    let counted = Mutex::new(Vec::new());
    let work = || loop {
        let batch = batches.lock().expect("no panic inside").next();
        let Some(batch) = batch else {
            return;
        };
        let batch = count_batch(board, batch, surface);
        counted.lock().expect("no panic inside").extend(batch);
    };
    thread::scope(|scope| {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        for _ in 0..cores {
            scope.spawn(work);
        }
    });
    counted.into_inner().expect("no panic inside")
}

/// Replays scenes in one run of the emulated processor, whose results must equal the host's.
fn count_batch(board: &CountingBoard, numbers: &[u64], surface: Surface) -> Vec<CountedScene> {
    let random = |number: &u64| (*number, EmulatorScene::random(SEED, *number, surface));
    count_recorded(board, numbers.iter().map(random).collect())
}

/// Same as `count_batch` for recorded scenes: all of them on materials, or none.
fn count_recorded(board: &CountingBoard, scenes: Vec<(u64, EmulatorScene)>) -> Vec<CountedScene> {
    let replays: Vec<_> = scenes.iter().map(|(_, scene)| scene.replay()).collect();
    let there = board.contact(&replays);
    let scenes = scenes.iter().zip(&there);
    scenes
        .map(|((number, recorded), there)| {
            let kind = recorded.scene.terrain.kind;
            let differs = recorded.differs(there);
            assert_eq!(differs, None, "scene {number}, {kind:?}: tick");
            let ticks = there.iter().enumerate().map(|(index, tick)| Tick {
                instructions: tick.instructions,
                cycles: tick.cycles,
                units: tick.work,
                scene: Some(*number),
                index,
            });
            let ticks = ticks.collect();
            CountedScene { kind, ticks }
        })
        .collect()
}
