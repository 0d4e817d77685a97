//! Disk cache of a terrain that stays in its file: another run reads almost nothing, and no state
//! of the folder or the file ever changes a height.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use hapterra::phantom::PlacedTerrain;
use hapterra::synth::Kind;
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::SurfaceParams;
use hapterra_tests::timeouts::{set_age, set_just_changed};
use hapterra_tests::{hapterra_binary, terrain_file};
use heightfield::disk_cache::DiskCache;
use heightfield::{OpenOptions, Raster, Wait};

/// A level whose samples lie in many blocks.
const LEVEL: u8 = 6;

/// Writes a TIFF without overviews, old enough to be identified by its time.
fn hills(path: &Path, seed: u64) {
    terrain_file(path, Kind::Fractal, 1500, seed);
    age(path, 1000);
}

fn age(path: &Path, seconds: u64) {
    set_age(path, Duration::from_secs(seconds));
}

fn open(path: &Path, disk_cache: &DiskCache) -> Raster {
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        disk_cache: disk_cache.clone(),
        ..OpenOptions::default()
    };
    Raster::open(path, &options).expect("opens")
}

/// Returns all heights of a level as bits, with one value for no-data.
fn heights(raster: &Raster, level: u8) -> Vec<u64> {
    let [columns, rows] = [raster.columns(), raster.rows()].map(|count| ((count - 1) >> level) + 1);
    let mut row_of = vec![0.0; columns as usize];
    let mut all = vec![];
    for row in 0..rows {
        assert!(
            raster
                .read_row(level, row, 0, &mut row_of, Wait::UntilRead)
                .is_complete()
        );
        let bits = |height: &f64| if height.is_nan() { 0 } else { height.to_bits() };
        all.extend(row_of.iter().map(bits));
    }
    all
}

/// Returns the heights with this cache, and the blocks read besides opening the file.
fn read_heights(path: &Path, cache: &DiskCache) -> (Vec<u64>, u64) {
    let raster = open(path, cache);
    let before = raster.blocks_read();
    (heights(&raster, LEVEL), raster.blocks_read() - before)
}

fn truth(path: &Path) -> Vec<u64> {
    let raster = Raster::open(path, &OpenOptions::default()).expect("opens");
    assert!(raster.samples().is_some());
    heights(&raster, LEVEL)
}

struct Bed {
    folder: tempfile::TempDir,
    file: PathBuf,
    cache: DiskCache,
}

fn bed() -> Bed {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hills.tif");
    hills(&file, 1);
    let cache = DiskCache::at(&folder.path().join("cache"), 64 << 20);
    Bed {
        file,
        cache,
        folder,
    }
}

impl Bed {
    /// Returns all records.
    fn records(&self) -> Vec<PathBuf> {
        let pattern = self.folder.path().join("cache/v1/*/*");
        files(&pattern)
    }
}

fn files(folder_of_folders: &Path) -> Vec<PathBuf> {
    let top = folder_of_folders.ancestors().nth(2).expect("a folder");
    let entries = |path: &Path| fs::read_dir(path).into_iter().flatten().flatten();
    let inner = entries(top).flat_map(|entry| entries(&entry.path()).collect::<Vec<_>>());
    inner.map(|entry| entry.path()).collect()
}

#[test]
fn second_run_reads_no_coarse_block_and_has_identical_heights() {
    let bed = bed();
    let truth = truth(&bed.file);
    let (first, read) = read_heights(&bed.file, &bed.cache);
    assert!(first == truth && read > 0, "{read}");
    assert!(!bed.records().is_empty());
    let (second, read) = read_heights(&bed.file, &bed.cache);
    assert!(second == truth && read == 0, "{read}");
    // No file is created beside the user's file.
    assert_eq!(fs::read_dir(bed.folder.path()).expect("there").count(), 2);
    fs::remove_dir_all(bed.folder.path().join("cache")).expect("deleted");
    let (third, read) = read_heights(&bed.file, &bed.cache);
    assert!(third == truth && read > 0, "{read}");
    assert_eq!(read_heights(&bed.file, &bed.cache), (truth, 0));
}

#[test]
fn replaced_file_has_its_own_heights() {
    let bed = bed();
    read_heights(&bed.file, &bed.cache);
    // With the same size, path and time.
    let modified = fs::metadata(&bed.file).and_then(|metadata| metadata.modified());
    let other = bed.folder.path().join("other.tif");
    hills(&other, 2);
    let bytes = fs::read(&other).expect("there");
    assert_eq!(
        bytes.len() as u64,
        fs::metadata(&bed.file).expect("there").len()
    );
    fs::write(&bed.file, bytes).expect("written");
    let file = fs::File::options()
        .append(true)
        .open(&bed.file)
        .expect("opens");
    file.set_modified(modified.expect("known")).expect("set");
    if cfg!(unix) {
        let (found, read) = read_heights(&bed.file, &bed.cache);
        assert!(found == truth(&other) && read > 0, "{read}");
    }
    // Renamed over it.
    let third = bed.folder.path().join("third.tif");
    hills(&third, 3);
    fs::rename(&third, &bed.file).expect("renamed");
    let (found, _) = read_heights(&bed.file, &bed.cache);
    assert_eq!(found, truth(&bed.file));
    // A new mask beside it, which declares everything no-data.
    let mask = bed.folder.path().join("hills.tif.msk");
    let (_, read) = read_heights(&bed.file, &bed.cache);
    assert_eq!(read, 0);
    fs::write(&mask, b"no mask at all").expect("written");
    age(&mask, 500);
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        disk_cache: bed.cache.clone(),
        ..OpenOptions::default()
    };
    Raster::open(&bed.file, &options).expect_err("its mask cannot be read");
}

#[test]
fn file_overwritten_while_open_is_reread_by_next_run() {
    let bed = bed();
    let other = bed.folder.path().join("other.tif");
    hills(&other, 2);
    let raster = open(&bed.file, &bed.cache);
    heights(&raster, 9);
    fs::write(&bed.file, fs::read(&other).expect("there")).expect("written");
    age(&bed.file, 300);
    heights(&raster, LEVEL);
    drop(raster);
    let (found, read) = read_heights(&bed.file, &bed.cache);
    assert!(found == truth(&other) && read > 0, "{read}");
}

#[test]
fn just_written_file_is_not_cached() {
    let bed = bed();
    set_just_changed(&bed.file);
    read_heights(&bed.file, &bed.cache);
    assert!(bed.records().is_empty());
    age(&bed.file, 1000);
    read_heights(&bed.file, &bed.cache);
    assert!(!bed.records().is_empty());
}

#[test]
fn heights_are_right_with_a_damaged_cache() {
    let bed = bed();
    let truth = truth(&bed.file);
    read_heights(&bed.file, &bed.cache);
    let whole: Vec<_> = (bed.records().into_iter())
        .map(|path| (path.clone(), fs::read(path).expect("there")))
        .collect();
    assert!(!whole.is_empty());
    type Harm = fn(&[u8]) -> Vec<u8>;
    let harms: [Harm; 6] = [
        |_| vec![],
        |bytes| bytes[..bytes.len() / 2].to_vec(),
        |bytes| [bytes, &[0; 9]].concat(),
        |bytes| bytes.iter().map(|byte| byte ^ 1).collect(),
        |bytes| {
            let mut bytes = bytes.to_vec();
            let last = bytes.len() - 1;
            bytes[last] ^= 0x80;
            bytes
        },
        |_| b"a note of another program".to_vec(),
    ];
    for (number, harm) in harms.into_iter().enumerate() {
        for (path, bytes) in &whole {
            fs::write(path, harm(bytes)).expect("written");
        }
        let (found, read) = read_heights(&bed.file, &bed.cache);
        assert!(found == truth && read > 0, "{number}: {read}");
        // It was written again, and is complete.
        assert_eq!(
            read_heights(&bed.file, &bed.cache),
            (truth.clone(), 0),
            "{number}"
        );
    }
    for (path, _) in &whole {
        fs::remove_file(path).expect("removed");
        fs::create_dir(path).expect("made");
    }
    let (found, read) = read_heights(&bed.file, &bed.cache);
    assert!(found == truth && read > 0, "{read}");
}

#[test]
fn unwritable_or_full_folder_behaves_like_no_cache() {
    let bed = bed();
    let truth = truth(&bed.file);
    let blocked = bed.folder.path().join("blocked");
    fs::write(&blocked, b"a file").expect("written");
    let tiny = bed.folder.path().join("tiny");
    let mut caches = vec![
        DiskCache::at(&blocked, 64 << 20),
        DiskCache::at(&tiny, 1),
        DiskCache::off(),
    ];
    // A full device.
    if Path::new("/dev/full").exists() {
        caches.push(DiskCache::at(Path::new("/dev/full"), 64 << 20));
    }
    for cache in caches {
        for _ in 0..2 {
            let (found, read) = read_heights(&bed.file, &cache);
            assert!(found == truth && read > 0, "{cache:?}: {read}");
        }
    }
    assert_eq!(fs::read(&blocked).expect("there"), b"a file");
}

#[test]
fn concurrent_runs_on_one_file_have_the_same_heights() {
    let bed = bed();
    let truth = truth(&bed.file);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                // As separate processes.
                let cache = DiskCache::at(&bed.folder.path().join("cache"), 1 << 20);
                for _ in 0..3 {
                    assert_eq!(read_heights(&bed.file, &cache).0, truth);
                }
            });
        }
    });
    assert_eq!(read_heights(&bed.file, &bed.cache), (truth, 0));
}

/// Writes SRTM's tiles: a folder of them is one terrain.
fn tiles(folder: &Path) {
    for (column, name) in (0..).zip(["N00E000.hgt", "N00E001.hgt"]) {
        let places =
            (0..1201).flat_map(|row| (0..1201).map(move |east| (column * 1200 + east, row)));
        let height = |(east, row): (u32, u32)| ((east * 7 + row * 3) % 3000) as i16;
        let bytes: Vec<u8> = places
            .flat_map(|place| height(place).to_be_bytes())
            .collect();
        let path = folder.join(name);
        fs::write(&path, bytes).expect("written");
        age(&path, 1000);
    }
}

#[test]
fn changed_file_of_a_mosaic_invalidates_its_cached_samples() {
    let folder = tempfile::tempdir().expect("a folder");
    let srtm = folder.path().join("srtm");
    fs::create_dir(&srtm).expect("made");
    tiles(&srtm);
    let cache = DiskCache::at(&folder.path().join("cache"), 64 << 20);
    let (truth, read) = read_heights(&srtm, &DiskCache::off());
    assert!(read > 0 && truth.iter().any(|bits| *bits != 0));
    assert_eq!(read_heights(&srtm, &cache), (truth.clone(), read));
    assert_eq!(read_heights(&srtm, &cache), (truth.clone(), 0));
    // One of the two has changed.
    let west = srtm.join("N00E000.hgt");
    let mut bytes = fs::read(&west).expect("there");
    bytes
        .chunks_exact_mut(2)
        .for_each(|sample| sample.swap(0, 1));
    for byte in &mut bytes {
        *byte &= 0x0f;
    }
    fs::write(&west, bytes).expect("written");
    age(&west, 1000);
    let now = read_heights(&srtm, &DiskCache::off()).0;
    assert_ne!(now, truth);
    let (found, again) = read_heights(&srtm, &cache);
    assert!(found == now && again > 0 && again <= read, "{again}");
}

/// A tour covers the whole terrain. Its targets are found in coarse samples, which are cached.
#[test]
fn another_tour_of_a_large_file_is_planned_without_reading_it() {
    let bed = bed();
    let plan = || {
        let raster = open(&bed.file, &bed.cache);
        let before = raster.blocks_read();
        // Ten samples from one target to the next, so coarse samples suffice.
        let scale = Scale::new(0.05, 0.05).expect("a scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
        let placed = PlacedTerrain::new(&terrain, SurfaceParams::PREMIUM).expect("in reach");
        (placed.home_mm(), raster.blocks_read() - before)
    };
    let (home, read) = plan();
    assert!(
        (1..=open(&bed.file, &bed.cache).blocks()).contains(&read),
        "{read}"
    );
    // Only the samples under the home position are read again, at the rendered level.
    let (same, again) = plan();
    assert_eq!(same, home);
    assert!(again <= 1 && again < read, "{again} of {read}");
}

/// Returns the blocks that a run at a coarse level reads, as printed with `-vv`.
fn blocks_of_run(file: &Path, cache: &Path, megabytes: &str) -> u64 {
    let output = Command::new(hapterra_binary())
        .args(["-vv", "run", "--device", "native", "--duration", "0.2s"])
        .args(["--input", "in-memory=0MB", "--level", "4"])
        .arg(file)
        .env("HAPTERRA_CACHE_DIR", cache)
        .env("HAPTERRA_CACHE_MB", megabytes)
        .output()
        .expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    let line = text.lines().find(|line| line.contains(" blocks of "));
    let words = line.map(|line| line.split_whitespace().collect::<Vec<_>>());
    let words = words.unwrap_or_else(|| panic!("{text}"));
    let at = words.iter().position(|word| *word == "blocks");
    let number = words[at.expect("found") - 1].parse();
    number.unwrap_or_else(|_| panic!("{text}"))
}

#[test]
fn coarse_samples_are_cached_only_in_the_given_folder() {
    let bed = bed();
    let opening = open(&bed.file, &DiskCache::off()).blocks_read();
    let there = bed.folder.path().join("there");
    for _ in 0..2 {
        assert!(blocks_of_run(&bed.file, &there, "0") > opening);
    }
    assert!(!there.exists());
    assert!(blocks_of_run(&bed.file, &there, "8") > opening);
    assert_eq!(blocks_of_run(&bed.file, &there, "8"), opening);
}
