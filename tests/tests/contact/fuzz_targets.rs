//! The bodies of the fuzz targets, run without a fuzzer: random bytes, and valid inputs with some
//! of their bytes changed. They are the same in each run.

use std::panic::catch_unwind;

use hapterra_core::Vec3;
use hapterra_core::contact::WORK_PER_TICK;
use hapterra_core::force::{Material, MaterialTable, SurfaceParams};
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{HipCommand, Source};
use hapterra_core::terrain::packed::{HeightStep, MAX_PACKED, pack};
use hapterra_core::terrain::{TILE_SAMPLES, TileKey};
use hapterra_core::tick::Outcome;
use hapterra_core::wire::materials::{
    MAX_TABLE_BYTES, MaterialScene, MaterialTile, TileMaterials, table_bytes,
};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice};
use hapterra_core::wire::request::Request;
use hapterra_tests::fuzzing::{terrain, text, tick, tile, wire};
use hapterra_tests::random::Random;

fn random_bytes(random: &mut Random, length: usize) -> Vec<u8> {
    (0..length).map(|_| random.bits() as u8).collect()
}

/// Returns an input with some bytes changed, dropped or doubled.
fn mutated(random: &mut Random, input: &[u8]) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..random.below(6) {
        let at = random.below(bytes.len());
        match random.below(4) {
            0 => bytes[at] = random.bits() as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => {
                bytes.remove(at);
            }
            _ => bytes.insert(at, bytes[at]),
        }
    }
    bytes
}

/// Returns short random bytes every third time, else valid ones with changes.
fn input(
    random: &mut Random,
    round: u32,
    fewer_than: usize,
    sensible: fn(&mut Random) -> Vec<u8>,
) -> Vec<u8> {
    let length = random.below(fewer_than);
    if round.is_multiple_of(3) {
        return random_bytes(random, length);
    }
    let sensible = sensible(random);
    mutated(random, &sensible)
}

/// Returns a scene of points, a tile, and points that go down into it.
fn sensible_ticks(random: &mut Random) -> Vec<u8> {
    let mut bytes = vec![0, random.below(4) as u8, 0, 0, 0, 0, 0, 0];
    bytes.extend([1, 0, 1, 1, 0]);
    bytes.extend((0..7).map(|_| 120 + random.below(20) as u8));
    bytes.extend([0; 6]);
    for step in 0..random.below(30) as u8 {
        bytes.extend([5, 0, 10, 10, 6 - step / 6, step, step, 0]);
        bytes.extend([step, 0, 0, 0, step, step]);
    }
    bytes
}

/// Returns a table and a scene with it, driven by points; a tile with its materials, and points
/// that go down into it and along.
fn sensible_materials(random: &mut Random) -> Vec<u8> {
    let count = random.below(4) as u8;
    // One in four has another table than it declares.
    let kind = [247, 247, 247, 246][random.below(4)];
    let mut bytes = vec![kind, count];
    for _ in 0..=count {
        let kind = random.below(250) as u8;
        bytes.extend([kind, 40, 20, 30 + random.below(200) as u8]);
        bytes.extend([random.below(100) as u8, kind, 100]);
    }
    // The scene, its table's checksum, and the counts of its tick.
    bytes.push([0, 64][random.below(2)]);
    bytes.extend(vec![7; 4 * usize::from(kind == 246)]);
    bytes.extend([0; 6]);
    bytes.extend([9, 0, 1, 1, 0]);
    bytes.extend((0..7).map(|_| 120 + random.below(20) as u8));
    // Classes of the table, or up to 16.
    bytes.extend([[17, 17, 0, 1][random.below(4)], 0, 1, 2, 3, 14]);
    bytes.extend([0; 6]);
    for step in 0..random.below(60) as u8 {
        bytes.extend([
            5,
            0,
            10,
            10,
            6_u8.saturating_sub(step / 6),
            4 * step,
            step,
            0,
        ]);
        bytes.extend([step, 0, 0, 0, step, step]);
    }
    bytes
}

#[test]
fn tick_survives_random_bytes() {
    let mut random = Random::new(11);
    for round in 0..20_000 {
        tick::run(&input(&mut random, round, 400, sensible_ticks));
    }
}

#[test]
fn tick_on_materials_survives_random_bytes() {
    let mut random = Random::new(13);
    for round in 0..20_000 {
        tick::run(&input(&mut random, round, 600, sensible_materials));
    }
}

/// Tries each check of the fuzz target: a tick with one change is refused.
#[test]
fn invalid_tick_is_refused_by_the_fuzz_target() {
    let refuses = |change: fn(&mut Outcome)| {
        let mut outcome = Outcome::default();
        change(&mut outcome);
        catch_unwind(|| tick::check(&outcome, &SurfaceParams::PREMIUM)).is_err()
    };
    assert!(!refuses(|_| ()));
    assert!(!refuses(|o| o.sample.work = WORK_PER_TICK));
    assert!(refuses(|o| o.sample.work = WORK_PER_TICK + 1));
    assert!(refuses(|o| o.sample.force_n.x = 8.6));
    assert!(refuses(|o| o.sample.force_n.z = f32::NAN));
    assert!(refuses(|o| o.drive.currents_a.y = 0.1));
    assert!(refuses(|o| {
        o.drive.enabled = true;
        o.drive.currents_a.y = 100.0;
    }));
}

/// Returns whole messages on the line, cut into the target's chunks.
fn sensible_talk(random: &mut Random) -> Vec<u8> {
    let samples = [0.5f32.to_le_bytes(); 33 * 33].concat();
    let material = Material::of(&SurfaceParams::PREMIUM);
    let table = MaterialTable::new(&[material; 2]).expect("two");
    let mut room = [0; MAX_TABLE_BYTES];
    let mut line = Vec::new();
    for seq in 0..1 + random.below(6) as u32 {
        let key = TileKey::new(0, random.below(3) as i32, 0);
        let heights = match random.below(3) {
            0 => Heights::Samples {
                base: 1,
                bytes: &samples,
            },
            1 => Heights::Flat {
                base: 0,
                height: 1.5,
            },
            _ => Heights::NoData,
        };
        let depth = random.between(-2.0, 3.0) as f32;
        let hip = GridPoint::new([10, 10, 0], Vec3::new(0.3, 0.4, depth));
        let tile = TileMessage {
            epoch: 7,
            key,
            heights,
        };
        let message = match random.below(7) {
            0 => ToDevice::Tile(tile),
            5 => ToDevice::MaterialScene(MaterialScene {
                scene: hapterra_core::scene::Scene {
                    // Sometimes with another table than its own.
                    materials: Some(table.check_sum() ^ u32::from(random.below(4) == 0)),
                    ..wire::scene()
                },
                table: table_bytes(&table, &mut room),
            }),
            6 => ToDevice::MaterialTile(MaterialTile {
                tile,
                materials: match random.below(3) {
                    0 => TileMaterials::One(random.below(3) as u8),
                    1 => TileMaterials::Runs(
                        &[1, 255, 1, 255, 1, 255, 1, 255, 1, 64][..random.below(11)],
                    ),
                    _ => TileMaterials::Each(&[0x10; 600][..540 + random.below(10)]),
                },
            }),
            1 => ToDevice::Scene(hapterra_core::scene::Scene {
                epoch: seq,
                source: Source::Encoders,
                ..wire::scene()
            }),
            2 => ToDevice::Request {
                number: seq as u8 + 2,
                request: Request::ClearFault { fault: None },
            },
            _ => ToDevice::Hip(HipCommand { seq, hip }),
        };
        line.extend(wire::message(&message));
    }
    let chunks = line.chunks(255);
    chunks
        .flat_map(|chunk| [&[0, chunk.len() as u8], chunk].concat())
        .collect()
}

#[test]
fn link_survives_random_bytes() {
    let mut random = Random::new(12);
    let mut wire = wire::Wire::default();
    for round in 0..20_000 {
        wire.run(&input(&mut random, round, 600, sensible_talk));
    }
}

/// Returns hills in steps of 1/32 of a cell, some with no-data, packed.
fn sensible_tile(random: &mut Random) -> Vec<u8> {
    let (rough, holes) = (random.between(0.0, 40.0), random.below(3) * 40);
    let heights: [f32; TILE_SAMPLES * TILE_SAMPLES] = std::array::from_fn(|i| {
        let height = (i % TILE_SAMPLES) as f64 + random.between(0.0, rough);
        match random.below(holes.max(1)) {
            1 => f32::NAN,
            _ => height.round() as f32 / 32.0,
        }
    });
    let steps = [HeightStep::Cells(1.0 / 32.0)];
    let steps = &steps[..random.below(2)];
    let mut buffer = [0; MAX_PACKED];
    let packed = pack(&heights, 0, steps, &mut buffer);
    packed.expect("packing pays").to_vec()
}

#[test]
fn tile_packing_survives_random_bytes() {
    let mut random = Random::new(13);
    for round in 0..4_000 {
        tile::run(&input(&mut random, round, 5000, sensible_tile));
    }
}

/// Returns a small file of any kind.
fn sensible_terrain(random: &mut Random) -> Vec<u8> {
    let kind = random.below(terrain::KINDS.len());
    small_terrain(kind, random.below(32) as u8)
}

/// Returns a small file of a kind, which opens with option byte 0.
fn small_terrain(kind: usize, how: u8) -> Vec<u8> {
    let samples: Vec<u8> = (0..6_i16).flat_map(i16::to_le_bytes).collect();
    let world = b"10\n0\n0\n-10\n505\n5005\n".to_vec();
    let header = b"nrows 2\nncols 3\nnbits 16\nbyteorder I\nlayout BIL\nnbands 1\n".to_vec();
    let prj = b"PROJCS[\"a\",GEOGCS[\"b\",DATUM[\"c\",SPHEROID[\"d\",6378137,298.26]],UNIT[\"Degree\",0.01745]]]".to_vec();
    let (beside, file) = match terrain::KINDS[kind] {
        [name, other] if name.ends_with(".tif") => {
            let beside = match other.rsplit('.').next() {
                Some("tfw") => world,
                Some("prj") => prj,
                _ => vec![],
            };
            (beside, small_tiff(&samples))
        }
        ["t.png", _] => (world, SMALL_PNG.to_vec()),
        ["t.npy", _] => {
            let head = "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 3), }           \n";
            let length = (head.len() as u16).to_le_bytes();
            let begin = [&b"\x93NUMPY\x01\0"[..], &length, head.as_bytes()].concat();
            (prj, [begin, samples].concat())
        }
        ["t.asc", _] => {
            let text = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nnodata_value -9\n1 2 3\n4 -9 6\n";
            (prj, text.into())
        }
        ["t.flt", _] => (b"nrows 2\nncols 3\n".to_vec(), samples.repeat(2)),
        ["t.bil", _] => (header, samples),
        ["t.raw", _] => (prj, [7; 70].to_vec()),
        _ => (prj, vec![1; 2 * 1201 * 1201]),
    };
    terrain::of(kind, how, &beside, &file)
}

/// Returns two rows of three 16-bit samples.
fn small_tiff(samples: &[u8]) -> Vec<u8> {
    use hapterra_tests::tiffs::Values::{Longs, Shorts};
    let image = vec![
        (256, Shorts(vec![3])),
        (257, Shorts(vec![2])),
        (258, Shorts(vec![16])),
        (259, Shorts(vec![1])),
        (262, Shorts(vec![1])),
        (273, Longs(vec![hapterra_tests::tiffs::DATA])),
        (277, Shorts(vec![1])),
        (278, Shorts(vec![2])),
        (279, Longs(vec![12])),
        (339, Shorts(vec![2])),
    ];
    hapterra_tests::tiffs::tiff(samples, &[image])
}

/// Two by two grey samples of 8 bits.
const SMALL_PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x02\0\0\0\x02\x08\0\0\0\0W\xddR\xf8\
\0\0\0\x0eIDATx\x9cc`db`f\x01\0\0\x1d\0\x0b\r\xb5R\x06\0\0\0\0IEND\xaeB`\x82";

#[test]
fn terrain_readers_survive_random_bytes() {
    for (kind, [name, _]) in terrain::KINDS.iter().enumerate() {
        assert!(terrain::run(&small_terrain(kind, 0)), "{name}");
    }
    let mut random = Random::new(14);
    for round in 0..2_000 {
        terrain::run(&input(&mut random, round, 400, sensible_terrain));
    }
}

/// Returns a file of each kind, besides terrain, that the command reads.
fn sensible_text(random: &mut Random) -> Vec<u8> {
    let text = [
        "# hapterra-recording = 1\n# level = 0\nt_s,x_mm,y_mm,z_mm,contact\n0,1,2,3,0\n0.001,1,2,2.5,1\n",
        "format = 1\nmodel = \"premium-1.5\"\n[limits]\nmax_force_n = 8.5\nmax_speed_mm_s = 1000\n",
        "[default]\nstiffness = 0.5\n[class.80]\nname = \"water\"\nstiffness = 0.1\n",
        "[board]\nname = \"nucleo-g474re\"\n[[step]]\nnumber = 1\n",
        "at 2.5 zoom 2\npan 5 0\nmark a #1\non 2 texture grain 0.1 1\nat 3 stiffness 0.5 # soft\n",
    ];
    let kind = random.below(text.len());
    [&[kind as u8], text[kind].as_bytes()].concat()
}

#[test]
fn readers_of_other_input_files_survive_random_bytes() {
    let mut random = Random::new(15);
    for round in 0..10_000 {
        text::run(&input(&mut random, round, 400, sensible_text));
    }
}
