//! The emulated Cortex-M4F as a counter of instructions: scenes are the input, the cost and result
//! of each tick are the output.
//!
//! The image is `firmware/boards/mps2-an386-counts`. `cargo xtask test` and `cargo xtask counts`
//! build it and set its variable.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use hapterra_core::Vec3;
use hapterra_core::grid::{Cell, GridPoint};
use hapterra_core::guard::GuardInputs;
use hapterra_core::scene::{HipCommand, Scene};
use hapterra_core::terrain::{CoarseTile, FieldSize, TILE_SAMPLES, TileKey};
use hapterra_core::wire::frame::{MAX_FRAME, encode};
use hapterra_core::wire::materials::{
    MAX_TABLE_BYTES, MAX_TILE_BYTES, MaterialScene, MaterialTile, TileMaterials, table_bytes,
};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice};
use hapterra_core::wire::plant::PlantState;
use serde::Serialize;

use crate::cycles::Cycles;
use crate::emulation::{named, qemu};
use crate::scene::materials::Materials;

/// Environment variable that names the image.
pub const IMAGE_VARIABLE: &str = "HAPTERRA_MPS2_COUNTS_ELF";
/// Tiles along the side of its window.
pub const WINDOW: usize = 16;

/// `-icount shift`: an instruction takes 2¹⁰ ns, a count of the timer 40 ns.
const SHIFT: u32 = 10;
/// Upper bound of the instructions for the call and return of a counted tick.
const CALL: u32 = 16;
/// Words of a record; see the image.
const RECORD: usize = 13;

/// QEMU and the image that counts.
#[derive(Clone, Debug)]
pub struct CountingBoard {
    qemu: PathBuf,
    image: PathBuf,
    /// Function that follows the image's instructions in its folder, for the cycles of each tick.
    follow: Option<Follow>,
}

/// Runs an image in a folder to its end. Returns the cycles of each tick.
pub type Follow = fn(image: &Path, folder: &Path) -> Vec<Cycles>;

/// Event of a replay.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A tile arrives.
    Tile(TileKey),
    /// A tile of the fallback arrives.
    Coarse(CoarseTile),
    /// A tick with the HIP at this point.
    Hip(GridPoint),
    /// For encoder counts: the events after this one precede the tick of this number.
    Before(u32),
}

/// A field from which the host cuts tiles.
pub trait Samples {
    /// Returns the height of a sample of the field in cells, by column and row; NaN is no-data.
    fn sample(&self, column: i32, row: i32) -> f32;

    /// Returns the fallback's height at a sample.
    fn under(&self, column: i32, row: i32) -> f32 {
        self.sample(column, row)
    }
}

/// Tiles and HIPs in order, for the contact alone or for the loop on materials.
#[derive(Clone, Copy)]
pub struct Replay<'a> {
    /// The scene as the device receives it.
    pub scene: &'a Scene,
    /// Source of the tiles.
    pub field: &'a dyn Samples,
    /// Its events.
    pub events: &'a [Event],
    /// Materials of the ground: if present, each HIP is a tick of the whole loop.
    pub materials: Option<&'a Materials>,
}

/// Cost and result of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// Instructions, with the call and the return.
    pub instructions: u32,
    /// Cycles on the boards' chips if the board is [followed](CountingBoard::following), else 0.
    pub cycles: Cycles,
    /// The number of its [`hapterra_core::contact::ContactState`].
    pub state: u32,
    /// For the contact: true if all work was done. On materials: true if the point is answered. For
    /// encoder counts: true if the amplifiers are on.
    pub converged: bool,
    /// Work units.
    pub work: u32,
    /// Displacement in cells; for encoder counts or on materials, force in newtons.
    pub vector: Vec3,
    /// The proxy.
    pub proxy: GridPoint,
}

impl CountingBoard {
    /// Returns the board, or `None` after a visible message: the caller then returns.
    #[must_use]
    pub fn found() -> Option<Self> {
        let Some(image) = named(IMAGE_VARIABLE) else {
            eprintln!("skipped: no counting image: {IMAGE_VARIABLE} is not set");
            return None;
        };
        let qemu = qemu()?;
        Some(Self {
            qemu,
            image,
            follow: None,
        })
    }

    /// Returns the board with cycles for each tick, computed by `follow`.
    #[must_use]
    pub fn following(self, follow: Follow) -> Self {
        Self {
            follow: Some(follow),
            ..self
        }
    }

    /// Runs the contact in real time through each replay in turn. Returns the ticks of each. Either
    /// all replays have materials, or none.
    ///
    /// # Panics
    /// If the emulated program fails.
    #[must_use]
    pub fn contact(&self, replays: &[Replay<'_>]) -> Vec<Vec<Counted>> {
        let folder = tempfile::tempdir().expect("a folder");
        write_replays(folder.path(), replays);
        let mut ticks = self.run(folder.path()).into_iter();
        if replays.iter().all(|replay| replay.materials.is_none()) {
            let tiles = records(folder.path(), "tiles.bin");
            assert!(tiles.iter().all(|tile| tile.converged), "a tile is refused");
        }
        let is_tick = |event: &&Event| matches!(event, Event::Hip(_));
        let lengths = replays
            .iter()
            .map(|replay| replay.events.iter().filter(is_tick).count());
        let each: Vec<Vec<Counted>> = lengths
            .map(|length| {
                let own: Vec<Counted> = ticks.by_ref().take(length).collect();
                assert_eq!(own.len(), length, "a record of every tick");
                own
            })
            .collect();
        assert_eq!(ticks.next(), None, "no record of more ticks");
        each
    }

    /// Runs whole ticks from counts to currents. All tiles are stored before the first, and the arm
    /// is armed.
    ///
    /// # Panics
    /// If the emulated program fails.
    #[must_use]
    pub fn chain(
        &self,
        scene: &Scene,
        (field, materials): (&dyn Samples, Option<&Materials>),
        counts: &[[i32; 3]],
    ) -> Vec<Counted> {
        let events: Vec<Event> = tiles(scene.size).map(Event::Tile).collect();
        self.ticks_of(scene, (field, materials), (&events, counts))
    }

    /// Same as `chain`, but the scene's fallback is stored before the first tick, and the tiles
    /// arrive before the tick of a number, or never with `None`.
    ///
    /// # Panics
    /// If the emulated program fails or the scene has no fallback.
    #[must_use]
    pub fn chain_over_fallback(
        &self,
        scene: &Scene,
        field: &dyn Samples,
        (late, counts): (Option<u32>, &[[i32; 3]]),
    ) -> Vec<Counted> {
        let fallback = scene.fallback.expect("a fallback");
        let mut events: Vec<Event> = [Some(fallback.wide), fallback.near]
            .into_iter()
            .flatten()
            .map(Event::Coarse)
            .collect();
        if let Some(late) = late {
            events.push(Event::Before(late));
            events.extend(tiles(scene.size).map(Event::Tile));
        }
        self.ticks_of(scene, (field, None), (&events, counts))
    }

    /// Runs whole ticks at these counts, with events before some of them.
    fn ticks_of(
        &self,
        scene: &Scene,
        (field, materials): (&dyn Samples, Option<&Materials>),
        (events, counts): (&[Event], &[[i32; 3]]),
    ) -> Vec<Counted> {
        let folder = tempfile::tempdir().expect("a folder");
        let held = Replay {
            scene,
            field,
            events,
            materials,
        };
        write_replays(folder.path(), &[held]);
        let mut frames = Frames::create(&folder.path().join("counts.frames"));
        for (tick, counts) in (0..).zip(counts) {
            let sense = GuardInputs {
                counts: *counts,
                ..GuardInputs::default()
            };
            frames.add(&PlantState { tick, sense });
        }
        frames.close();
        self.run(folder.path())
    }

    /// Fills a buffer with each tile in turn. Returns the cost of each; `converged` is true if it
    /// was a valid tile.
    ///
    /// # Panics
    /// If the emulated program fails.
    #[must_use]
    pub fn tiles(&self, scene: &Scene, tiles: &[Heights<'_>]) -> Vec<Counted> {
        let folder = tempfile::tempdir().expect("a folder");
        let mut frames = Frames::create(&folder.path().join("replay.frames"));
        frames.add(&ToDevice::Scene(*scene));
        for heights in tiles {
            frames.add(&ToDevice::Tile(TileMessage {
                epoch: scene.epoch,
                key: TileKey::new(0, 0, 0),
                heights: *heights,
            }));
        }
        frames.close();
        self.run(folder.path());
        let counted = records(folder.path(), "tiles.bin");
        assert_eq!(counted.len(), tiles.len(), "a record of every tile");
        counted
    }

    fn run(&self, folder: &Path) -> Vec<Counted> {
        let ran = self
            .emulation(folder)
            .args(["-icount", &format!("shift={SHIFT},sleep=off")])
            .output()
            .expect("QEMU starts");
        let stderr = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success(), "{}: {stderr}", ran.status);
        let mut counted = records(folder, "ticks.bin");
        if let Some(follow) = self.follow {
            add_cycles(&mut counted, &follow(&self.image, folder));
        }
        counted
    }

    fn emulation(&self, folder: &Path) -> Command {
        let mut command = Command::new(&self.qemu);
        command
            .current_dir(folder)
            .args(["-M", "mps2-an386", "-nographic", "-monitor", "none"])
            .args(["-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&self.image)
            .stdin(Stdio::null());
        command
    }
}

/// Adds the cycles of each tick. The first ticks, in which the arm is armed, have no record.
///
/// # Panics
/// If the followed instructions differ from the counted ones by more than a tick's call and return.
fn add_cycles(counted: &mut [Counted], followed: &[Cycles]) {
    let unrecorded = followed.len().checked_sub(counted.len());
    let followed = &followed[unrecorded.expect("each record's tick")..];
    let mut calls = vec![];
    for (tick, cycles) in counted.iter_mut().zip(followed) {
        calls.extend(tick.instructions.checked_sub(cycles.instructions));
        let is_same = calls.last() == calls.first() && calls.last() < Some(&CALL);
        assert!(is_same, "tick {}: {tick:?}, {cycles:?}", calls.len());
        (tick.cycles, tick.instructions) = (*cycles, cycles.instructions);
    }
}

/// Returns the records that the image wrote.
fn records(folder: &Path, name: &str) -> Vec<Counted> {
    let bytes = std::fs::read(folder.join(name)).expect("the image left its records");
    let words = bytes.as_chunks::<4>().0.iter();
    let words: Vec<u32> = words.map(|le| u32::from_le_bytes(*le)).collect();
    words.chunks_exact(RECORD).map(counted).collect()
}

/// Returns the keys of all tiles of a field.
pub fn tiles(size: FieldSize) -> impl Iterator<Item = TileKey> {
    let last = size.last_tile();
    (0..=last.row).flat_map(move |row| (0..=last.col).map(move |col| TileKey::new(0, col, row)))
}

fn counted(words: &[u32]) -> Counted {
    let vector = |at: usize| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(words[at + i])));
    let cell = [0, 1, 2].map(|i| words[7 + i].cast_signed());
    // 40 ns a count, 2^SHIFT ns an instruction.
    let nanoseconds = u64::from(words[0]) * 40;
    Counted {
        instructions: (nanoseconds as f64 / f64::from(1 << SHIFT)).round() as u32,
        cycles: Cycles::default(),
        state: words[1],
        converged: words[2] != 0,
        work: words[3],
        vector: vector(4),
        proxy: GridPoint::new(cell, vector(10)),
    }
}

fn write_replays(folder: &Path, replays: &[Replay<'_>]) {
    let mut frames = Frames::create(&folder.join("replay.frames"));
    for replay in replays {
        frames.add_scene(replay.scene, replay.materials);
        for (seq, event) in (0..).zip(replay.events) {
            match event {
                Event::Hip(hip) => frames.add(&ToDevice::Hip(HipCommand { seq, hip: *hip })),
                Event::Before(seq) => frames.add(&ToDevice::Hip(HipCommand {
                    seq: *seq,
                    hip: GridPoint::default(),
                })),
                Event::Tile(key) => {
                    let bytes = tile_bytes(replay.scene.size, *key, replay.field);
                    frames.add_tile(tile(replay.scene, *key, &bytes), replay.materials);
                }
                Event::Coarse(place) => {
                    let bytes = coarse_bytes(replay.scene.size, *place, replay.field);
                    let key = place.key(replay.scene.level);
                    frames.add_tile(tile(replay.scene, key, &bytes), replay.materials);
                }
            }
        }
    }
    frames.close();
}

fn tile<'b>(scene: &Scene, key: TileKey, bytes: &'b [u8]) -> TileMessage<'b> {
    TileMessage {
        epoch: scene.epoch,
        key,
        heights: Heights::Samples { base: 0, bytes },
    }
}

fn tile_bytes(size: FieldSize, key: TileKey, field: &dyn Samples) -> Vec<u8> {
    bytes_of(size, key.index.first_cell(), 1, |x, y| field.sample(x, y))
}

fn coarse_bytes(size: FieldSize, place: CoarseTile, field: &dyn Samples) -> Vec<u8> {
    bytes_of(size, place.first, place.spacing(), |x, y| field.under(x, y))
}

/// Returns the samples of a tile by its first sample and their distance in cells.
fn bytes_of(
    size: FieldSize,
    first: Cell,
    spacing: i32,
    height: impl Fn(i32, i32) -> f32,
) -> Vec<u8> {
    let post = |i: usize| {
        let [x, y] = [
            first.x + (i % TILE_SAMPLES) as i32 * spacing,
            first.y + (i / TILE_SAMPLES) as i32 * spacing,
        ];
        match size.columns < x || size.rows < y || x < 0 || y < 0 {
            true => f32::NAN,
            false => height(x, y),
        }
    };
    let posts = (0..TILE_SAMPLES * TILE_SAMPLES).map(post);
    posts.flat_map(f32::to_le_bytes).collect()
}

/// A file of frames.
struct Frames {
    file: BufWriter<File>,
}

impl Frames {
    fn create(path: &Path) -> Self {
        let file = File::create(path).expect("the folder can be written to");
        Self {
            file: BufWriter::new(file),
        }
    }

    fn add<T: Serialize>(&mut self, message: &T) {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(message, &mut buffer).expect("fits a frame");
        self.file.write_all(frame).expect("written");
    }

    fn add_scene(&mut self, scene: &Scene, materials: Option<&Materials>) {
        let Some(materials) = materials else {
            return self.add(&ToDevice::Scene(*scene));
        };
        let mut room = [0; MAX_TABLE_BYTES];
        self.add(&ToDevice::MaterialScene(MaterialScene {
            scene: *scene,
            table: table_bytes(&materials.reported(), &mut room),
        }));
    }

    fn add_tile(&mut self, tile: TileMessage<'_>, materials: Option<&Materials>) {
        let Some(materials) = materials else {
            return self.add(&ToDevice::Tile(tile));
        };
        let first = tile.key.index.first_cell();
        let class = |i: usize| {
            let (col, row) = (i % TILE_SAMPLES, i / TILE_SAMPLES);
            materials.class(first.x + col as i32, first.y + row as i32)
        };
        let mut room = [0; MAX_TILE_BYTES];
        let materials = TileMaterials::pack(&std::array::from_fn(class), &mut room);
        self.add(&ToDevice::MaterialTile(MaterialTile { tile, materials }));
    }

    fn close(mut self) {
        self.file.flush().expect("written");
    }
}
