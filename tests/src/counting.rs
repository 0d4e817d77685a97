//! The emulated Cortex-M4F as a counter of instructions: a walk goes in, and
//! what each tick cost and felt comes out.
//!
//! The image is `firmware/boards/mps2-an386-counts`. `cargo xtask test` and
//! `cargo xtask counts` build it and name it.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use hapterra_core::Vec3;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Sense;
use hapterra_core::terrain::{POSTS, TILE_CELLS, TileKey};
use hapterra_core::wire::frame::{MAX_FRAME, encode};
use hapterra_core::wire::message::{Heights, Point, Scene, TileMessage, ToDevice};
use hapterra_core::wire::plant::Sensed;
use serde::Serialize;

use crate::emulation::{named, qemu};

/// Environment variable that names the image.
pub const IMAGE_VARIABLE: &str = "HAPTERRA_MPS2_COUNTS_ELF";
/// Tiles along the side of its window.
pub const WINDOW: usize = 16;

/// `-icount shift`: an instruction takes 2¹⁰ ns, a count of the timer 40 ns.
const SHIFT: u32 = 10;
/// Words of a record; see the image.
const RECORD: usize = 13;

/// QEMU and the counting image.
#[derive(Clone, Debug)]
pub struct CountingBoard {
    qemu: PathBuf,
    image: PathBuf,
}

/// What happens on a walk.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A tile arrives.
    Tile(TileKey),
    /// A tick with the hand here.
    Hand(GridPoint),
}

/// What one tick cost and felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// Instructions, the call and the return included.
    pub instructions: u32,
    /// The number of its [`hapterra_core::contact::State`].
    pub state: u32,
    /// Whether all there was to do was done; fed by encoders, whether the
    /// amplifiers are on.
    pub settled: bool,
    /// Units of work.
    pub work: u32,
    /// Stretch in cells; fed by encoders, force in newtons.
    pub vector: Vec3,
    /// The proxy.
    pub proxy: GridPoint,
}

impl CountingBoard {
    /// The board, or `None` with a visible line: the caller then returns.
    #[must_use]
    pub fn found() -> Option<Self> {
        let Some(image) = named(IMAGE_VARIABLE) else {
            eprintln!("skipped: no counting image: {IMAGE_VARIABLE} is not set");
            return None;
        };
        let qemu = qemu()?;
        Some(Self { qemu, image })
    }

    /// Steps of the contact alone over a field whose samples are `height` cells
    /// above `base`; NaN is a hole.
    ///
    /// # Panics
    /// When the emulated program fails.
    #[must_use]
    pub fn contact(
        &self,
        scene: &Scene,
        base: i32,
        height: &dyn Fn(i32, i32) -> f32,
        events: &[Event],
    ) -> Vec<Counted> {
        let folder = tempfile::tempdir().expect("a folder");
        write_walk(folder.path(), scene, base, height, events);
        self.run(folder.path())
    }

    /// Whole ticks, count to current; every tile is held before the first, and
    /// the arm is armed.
    ///
    /// # Panics
    /// When the emulated program fails.
    #[must_use]
    pub fn chain(
        &self,
        scene: &Scene,
        height: &dyn Fn(i32, i32) -> f32,
        counts: &[[i32; 3]],
    ) -> Vec<Counted> {
        let folder = tempfile::tempdir().expect("a folder");
        let tiles: Vec<Event> = tiles(scene.size).map(Event::Tile).collect();
        write_walk(folder.path(), scene, 0, height, &tiles);
        let mut frames = Frames::create(&folder.path().join("counts.frames"));
        for (tick, counts) in (0..).zip(counts) {
            let sense = Sense {
                counts: *counts,
                ..Sense::default()
            };
            frames.add(&Sensed { tick, sense });
        }
        frames.close();
        self.run(folder.path())
    }

    fn run(&self, folder: &Path) -> Vec<Counted> {
        let ran = Command::new(&self.qemu)
            .current_dir(folder)
            .args(["-M", "mps2-an386", "-nographic", "-monitor", "none"])
            .args(["-serial", "none"])
            .args(["-icount", &format!("shift={SHIFT},sleep=off")])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&self.image)
            .stdin(Stdio::null())
            .output()
            .expect("QEMU starts");
        let said = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success(), "{}: {said}", ran.status);
        let bytes = std::fs::read(folder.join("ticks.bin")).expect("the image left its records");
        let words = bytes.chunks_exact(4).map(|le| match le {
            [a, b, c, d] => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => unreachable!("chunks of four"),
        });
        let words: Vec<u32> = words.collect();
        words.chunks_exact(RECORD).map(counted).collect()
    }
}

/// The keys of all tiles of a field.
pub fn tiles([columns, rows]: [i32; 2]) -> impl Iterator<Item = TileKey> {
    let last = |patches: i32| (patches - 1) / TILE_CELLS as i32;
    (0..=last(rows))
        .flat_map(move |row| (0..=last(columns)).map(move |col| TileKey { level: 0, col, row }))
}

fn counted(words: &[u32]) -> Counted {
    let vector = |at: usize| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(words[at + i])));
    let cell = [0, 1, 2].map(|i| words[7 + i].cast_signed());
    // 40 ns a count, 2^SHIFT ns an instruction.
    let nanoseconds = u64::from(words[0]) * 40;
    Counted {
        instructions: (nanoseconds as f64 / f64::from(1 << SHIFT)).round() as u32,
        state: words[1],
        settled: words[2] != 0,
        work: words[3],
        vector: vector(4),
        proxy: GridPoint::new(cell, vector(10)),
    }
}

fn write_walk(
    folder: &Path,
    scene: &Scene,
    base: i32,
    height: &dyn Fn(i32, i32) -> f32,
    events: &[Event],
) {
    let mut frames = Frames::create(&folder.join("walk.frames"));
    frames.add(&ToDevice::Scene(*scene));
    for (seq, event) in (0..).zip(events) {
        match event {
            Event::Hand(hip) => frames.add(&ToDevice::Point(Point { seq, hip: *hip })),
            Event::Tile(key) => {
                let bytes = tile_bytes(scene.size, *key, height);
                let bytes = &bytes[..];
                frames.add(&ToDevice::Tile(TileMessage {
                    epoch: scene.epoch,
                    key: *key,
                    heights: Heights::Samples { base, bytes },
                }));
            }
        }
    }
    frames.close();
}

fn tile_bytes(size: [i32; 2], key: TileKey, height: &dyn Fn(i32, i32) -> f32) -> Vec<u8> {
    let side = TILE_CELLS as i32;
    let post = |i: usize| {
        let (x, y) = (
            key.col * side + (i % POSTS) as i32,
            key.row * side + (i / POSTS) as i32,
        );
        if x > size[0] || y > size[1] {
            f32::NAN
        } else {
            height(x, y)
        }
    };
    (0..POSTS * POSTS)
        .flat_map(|i| post(i).to_le_bytes())
        .collect()
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

    fn close(mut self) {
        self.file.flush().expect("written");
    }
}
