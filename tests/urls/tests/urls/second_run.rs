//! Pages of a file at a URL that are cached on disk for another run.

use std::path::{Path, PathBuf};

use hapterra_tests::timeouts::wait_until;
use hapterra_url_tests::cog::cog;
use hapterra_url_tests::http::Server;
use heightfield::disk_cache::DiskCache;
use heightfield::{OpenOptions, Raster, Wait};

/// Pages that [`Bed::read_all`] needs.
const PAGES: usize = 50;

fn height(column: u32, row: u32) -> f32 {
    (column * 7 % 1000) as f32 + 0.25 * (row % 400) as f32
}

fn other(column: u32, row: u32) -> f32 {
    height(column, row) + 5000.0
}

struct Bed {
    folder: tempfile::TempDir,
    cache_folder: tempfile::TempDir,
    server: Server,
}

fn bed() -> Bed {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.tif");
    std::fs::write(path, cog(2200, 1800, 2, height)).expect("written");
    Bed {
        server: Server::of(folder.path()),
        cache_folder: tempfile::tempdir().expect("a folder"),
        folder,
    }
}

impl Bed {
    /// Reads heights at fine and coarse levels. Returns them, and the number of requests.
    fn read_all(&self, name: &str) -> (Vec<f64>, usize) {
        // Like another program: only the folder on disk is the same.
        let options = OpenOptions {
            disk_cache: DiskCache::at(self.cache_folder.path(), 256 << 20),
            ..OpenOptions::default()
        };
        let before = self.server.log().0.len();
        let raster = Raster::open(self.server.url(name), &options).expect("opens");
        let mut heights = vec![0.0; 500];
        for (number, heights) in heights.chunks_exact_mut(50).enumerate() {
            let number = number as u32;
            assert!(
                raster
                    .read_row(
                        (number % 3) as u8,
                        31 * number,
                        17 * number,
                        heights,
                        Wait::UntilRead
                    )
                    .is_complete()
            );
        }
        (heights, self.server.log().0.len() - before)
    }

    /// Waits until the pages of the first run are written, each to a file.
    fn wait_for_pages(&self) {
        let is_whole = |path: &PathBuf| {
            let name = path.file_name().expect("a name").to_string_lossy();
            !name.starts_with('.')
        };
        wait_until("all pages on disk", || {
            let files = files(self.cache_folder.path());
            files.iter().filter(|path| is_whole(path)).count() >= PAGES
        });
    }
}

/// Returns all files in a folder and its subfolders.
fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let each = entries.flat_map(|entry| match entry.path().is_dir() {
        true => files(&entry.path()),
        false => vec![entry.path()],
    });
    each.collect()
}

#[test]
fn second_run_requests_only_file_start_and_sidecars() {
    let bed = bed();
    let (first, requests) = bed.read_all("hills.tif");
    assert!(requests > 10, "{requests}");
    bed.wait_for_pages();
    // The file's beginning, and the four possible sidecars.
    let (second, second_requests) = bed.read_all("hills.tif");
    assert_eq!(second, first);
    assert!(second_requests <= 5, "{second_requests} after {requests}");
    // Damaged pages are fetched again.
    for file in files(bed.cache_folder.path()) {
        let mut bytes = std::fs::read(&file).expect("there");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(file, bytes).expect("written");
    }
    let (third, after_damage) = bed.read_all("hills.tif");
    assert_eq!(third, first);
    assert!(after_damage > second_requests);
}

#[test]
fn pages_of_a_file_changed_on_its_server_are_not_used() {
    let bed = bed();
    let (first, requests) = bed.read_all("hills.tif");
    bed.wait_for_pages();
    // The same size, another tag.
    let path = bed.folder.path().join("hills.tif");
    std::fs::write(path, cog(2200, 1800, 2, other)).expect("written");
    bed.server.change();
    let (second, second_requests) = bed.read_all("hills.tif");
    assert!(
        second_requests + 5 >= requests,
        "{second_requests} {requests}"
    );
    for (one, other) in first.iter().zip(&second) {
        assert!((other - one - 5000.0).abs() < 0.01, "{one} {other}");
    }
}

#[test]
fn cache_folder_contains_no_part_of_the_url() {
    let bed = bed();
    bed.read_all("hills.tif?sig=VerySecretKey");
    bed.wait_for_pages();
    let all = files(bed.cache_folder.path());
    assert!(!all.is_empty());
    let holds = |bytes: &[u8], word: &[u8]| bytes.windows(word.len()).any(|some| some == word);
    for file in all {
        let name = file.as_os_str().as_encoded_bytes();
        let bytes = std::fs::read(&file).expect("there");
        for word in [&b"VerySecretKey"[..], b"hills.tif", b"127.0.0.1"] {
            assert!(!holds(name, word) && !holds(&bytes, word));
        }
    }
    // With another key it may be another file.
    let (_, requests) = bed.read_all("hills.tif?sig=Other");
    assert!(requests > 10, "{requests}");
}
