//! Counts the instructions of single ticks on the emulated Cortex-M4F.
//!
//! Not a product, and the only image that needs the host's files; `hapterra` never starts it. It
//! calls the same core, compiled in the same way, in a loop over scenes that the host wrote,
//! between two readings of a timer.
//!
//! ```text
//! qemu-system-arm -M mps2-an386 -nographic -monitor none \
//!     -icount shift=10,sleep=off -semihosting-config enable=on,target=native \
//!     -kernel mps2-an386-counts
//! ```
//!
//! An instruction takes 2¹⁰ ns of emulated time, a count of the 25 MHz timer
//! 40 ns: 25.6 counts for each instruction, so every count of instructions is
//! exact.
//!
//! It reads from its working folder, through semihosting:
//! - `replay.frames`: [`ToDevice`] frames as on the link: a scene, then tiles and points in their
//!   order. In a scene fed by points, each point is one [`Contact::step`] in real time, and another
//!   scene may follow. With materials, each point is one [`Haptics::tick`], and a point without an
//!   answer is repeated.
//! - `counts.frames`, for a scene fed by encoders: [`PlantState`] frames, each one
//!   [`Haptics::tick`], from count to current, after the arm was armed at the first of them. In
//!   `replay.frames` of such a scene a point is a mark: the tiles after it are stored before the
//!   tick with its number.
//!
//! and writes `ticks.bin`: [`RECORD`] little-endian words a tick. For a scene fed by points it also
//! writes `tiles.bin`: as many words for each tile, which count the filling of a buffer.
#![no_std]
#![no_main]

mod ending;
#[path = "../mps2-an386/failure.rs"]
mod failure;
mod files;
#[allow(dead_code)] // This image uses only some of them.
#[path = "../mps2-an386/registers.rs"]
mod registers;
mod stopwatch;

use core::hint::black_box;

use cortex_m_rt::entry;
use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactOutput, ContactSettings, work_per_tick};
use hapterra_core::force::MaterialTable;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::GuardInputs;
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::terrain::{Tile, Window};
use hapterra_core::tick::{Command, Haptics, Outcome};
use hapterra_core::wire::materials::MaterialTile;
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::plant::PlantState;
use hapterra_firmware::link::fill_tile;
use static_cell::ConstStaticCell;

use files::{Frames, Records};
use stopwatch::Stopwatch;

/// Tiles along the side of the window, as in the product's image.
const WINDOW: usize = 16;
/// Words of a record: timer counts, state, a flag for settled, work, three of the displacement or
/// force, three of the proxy's cell, three of its fraction.
pub(crate) const RECORD: usize = 13;

static TILES: ConstStaticCell<[[Tile; WINDOW]; WINDOW]> =
    ConstStaticCell::new([const { [const { Tile::VACANT }; WINDOW] }; WINDOW]);
/// A fallback uses two of them.
static SPARES: ConstStaticCell<[Tile; 3]> = ConstStaticCell::new([const { Tile::VACANT }; 3]);
static SPARE: ConstStaticCell<Tile> = ConstStaticCell::new(Tile::VACANT);

#[entry]
fn main() -> ! {
    let mut frames = Frames::open(c"replay.frames");
    let (scene, table) = match frames.next() {
        Some(ToDevice::Scene(scene)) => (scene, None),
        Some(ToDevice::MaterialScene(both)) => (both.scene, both.table()),
        _ => panic!("the replay does not begin with a scene"),
    };
    let mut records = Records::create(c"ticks.bin");
    match (scene.source, table) {
        (Source::Points, None) => contact(scene, &mut frames, &mut records),
        (Source::Points, Some(table)) => points(&scene, &table, &mut frames, &mut records),
        (Source::Encoders, table) => chain(&scene, table.as_ref(), &mut frames, &mut records),
    }
    semihosting::process::exit(0)
}

/// Runs the contact alone, scene after scene: each point is one step.
fn contact(mut scene: Scene, frames: &mut Frames, records: &mut Records) {
    let mut window = Window::new(TILES.take().each_mut().map(|row| row.each_mut()));
    window.reset(scene.level, scene.size, scene.top);
    let mut spare = SPARE.take();
    let mut contact = contact_of(&scene);
    let stopwatch = Stopwatch::start();
    let mut tiles = Records::create(c"tiles.bin");
    while let Some(message) = frames.next() {
        match message {
            ToDevice::Scene(next) => {
                scene = next;
                window.reset(scene.level, scene.size, scene.top);
                contact = contact_of(&scene);
            }
            ToDevice::Tile(tile) => {
                let tile = black_box(tile);
                let (cost, filled) = stopwatch.counted(|| fill_tile(spare, &tile).is_ok());
                let (none, nowhere) = (Vec3::ZERO, GridPoint::default());
                tiles.add([cost, 0, u32::from(filled), 0], none, &nowhere);
                if filled {
                    spare = window.install(spare);
                }
            }
            ToDevice::Hip(point) => {
                let hip = black_box(point.hip);
                // Their addresses are computed before the instructions are counted.
                let (window, contact) = (black_box(&window), black_box(&mut contact));
                let (cost, output) = stopwatch.counted(|| step(window, contact, hip));
                records.add(
                    [
                        cost,
                        output.state as u32,
                        u32::from(output.converged),
                        output.work,
                    ],
                    output.displacement,
                    &output.proxy,
                );
            }
            _ => panic!("a replay has scenes, tiles and points only"),
        }
    }
}

/// Runs points on materials, scene after scene: each point is one tick of the whole loop, in
/// lock-step.
fn points(scene: &Scene, table: &MaterialTable, frames: &mut Frames, records: &mut Records) {
    let tiles = TILES.take().each_mut().map(|row| row.each_mut());
    let mut haptics = Haptics::new(tiles, TickRate::DEFAULT, None);
    let mut count = set_scene(&mut haptics, scene, table);
    let mut spare = Some(SPARE.take());
    let mut outcome = Outcome::default();
    let stopwatch = Stopwatch::start();
    while let Some(message) = frames.next() {
        match message {
            ToDevice::MaterialScene(both) => {
                let table = both.table().expect("the host made it well");
                count = set_scene(&mut haptics, &both.scene, &table);
            }
            ToDevice::MaterialTile(tile) => {
                let buffer = spare.take().expect("every tile returns a buffer");
                fill_material_tile(buffer, &tile, count);
                spare = haptics.accept(Command::Tile(buffer)).ok().flatten();
            }
            ToDevice::Hip(point) => {
                let _ = haptics.accept(Command::Hip(black_box(point)));
                let sense = black_box(GuardInputs::default());
                let (cost, ()) = stopwatch.counted(|| tick(&mut haptics, &sense, &mut outcome));
                let is_answered = u32::from(outcome.answered_seq.is_some());
                let sample = &outcome.sample;
                let first = [cost, sample.state as u32, is_answered, sample.work];
                records.add(first, sample.force_n, &sample.proxy);
            }
            _ => panic!("a replay on materials has scenes, tiles and points only"),
        }
    }
}

/// Begins a scene with its table and returns the number of its materials.
fn set_scene(
    haptics: &mut Haptics<'static, WINDOW>,
    scene: &Scene,
    table: &MaterialTable,
) -> usize {
    haptics.set_materials(table);
    let _ = haptics.accept(Command::Scene(*scene));
    table.materials().len()
}

/// Fills a buffer with a tile and its materials, from a table of `count`.
fn fill_material_tile(buffer: &mut Tile, message: &MaterialTile<'_>, count: usize) {
    fill_tile(buffer, &message.tile).expect("the host made it well");
    let filled = message.materials.fill(buffer, count);
    filled.expect("the host made it well");
}

/// Creates a contact before its first step.
fn contact_of(scene: &Scene) -> Contact {
    let settings = ContactSettings {
        // The work of a tick at 10 kHz, where the instructions matter.
        work_per_tick: work_per_tick(TickRate::new(10_000).unwrap_or_default()),
        ..ContactSettings::AT_1_KHZ
    };
    Contact::new(settings.with_friction(scene.params.friction))
}

/// Runs a step of the contact in real time. A separate function, so that its caller is compiled the
/// same for every step.
#[inline(never)]
fn step<'c>(
    window: &Window<'_, WINDOW>,
    contact: &'c mut Contact,
    hip: GridPoint,
) -> &'c ContactOutput {
    contact.step(window, &hip)
}

/// Runs the whole tick, from encoder counts to motor currents.
fn chain(scene: &Scene, table: Option<&MaterialTable>, frames: &mut Frames, records: &mut Records) {
    let tiles = TILES.take().each_mut().map(|row| row.each_mut());
    let mut haptics = Haptics::new(tiles, TickRate::DEFAULT, None);
    haptics.configure(Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid"));
    let count = match table {
        Some(table) => set_scene(&mut haptics, scene, table),
        None => {
            let _ = haptics.accept(Command::Scene(*scene));
            0
        }
    };
    let mut spares = SPARES.take().each_mut().map(Some);
    let mut next = store_tiles(&mut haptics, &mut spares, frames, count);
    let mut sensed = Frames::open(c"counts.frames");
    let stopwatch = Stopwatch::start();
    let mut armed = false;
    let mut outcome = Outcome::default();
    while let Some(PlantState { sense, tick: at }) = sensed.next() {
        if !armed {
            arm(&mut haptics, sense, &mut outcome);
            armed = true;
        }
        if next == Some(at) {
            next = store_tiles(&mut haptics, &mut spares, frames, count);
        }
        let sense = black_box(GuardInputs {
            dead_man: true,
            ..sense
        });
        let (cost, ()) = stopwatch.counted(|| tick(&mut haptics, &sense, &mut outcome));
        let sample = &outcome.sample;
        records.add(
            [
                cost,
                sample.state as u32,
                u32::from(outcome.drive.enabled),
                sample.work,
            ],
            sample.force_n,
            &sample.proxy,
        );
    }
}

/// Stores the tiles up to the next point. Returns the number of the tick before which the tiles
/// after that point are stored.
fn store_tiles(
    haptics: &mut Haptics<'static, WINDOW>,
    spares: &mut [Option<&'static mut Tile>],
    frames: &mut Frames,
    count: usize,
) -> Option<u32> {
    while let Some(message) = frames.next() {
        let spare = spares.iter_mut().find(|spare| spare.is_some());
        let spare = spare.expect("a buffer that is not kept is returned");
        let buffer = spare.take().expect("found");
        match message {
            ToDevice::Tile(tile) => fill_tile(buffer, &tile).expect("the host made it well"),
            ToDevice::MaterialTile(tile) => fill_material_tile(buffer, &tile, count),
            ToDevice::Hip(point) => {
                *spare = Some(buffer);
                return Some(point.seq);
            }
            _ => panic!("a replay of counts has tiles and points only"),
        }
        *spare = haptics.accept(Command::Tile(buffer)).ok().flatten();
    }
    None
}

/// Arms as a user does, until the force is fully ramped up.
fn arm(haptics: &mut Haptics<'static, WINDOW>, at: GuardInputs, outcome: &mut Outcome) {
    let _ = haptics.accept(Command::Zero([0; 3]));
    let _ = haptics.accept(Command::Arm);
    for ticks in 0..2_200 {
        let sense = GuardInputs {
            dead_man: ticks > 0,
            ..at
        };
        tick(haptics, &sense, outcome);
    }
}

/// Runs a tick with the watchdog fed. A separate function, like [`step`].
#[inline(never)]
fn tick(haptics: &mut Haptics<'static, WINDOW>, sense: &GuardInputs, outcome: &mut Outcome) {
    haptics.tick_into(sense, true, outcome);
}
