//! Shared parts of the tests across crates: the location of the shared data, and the real
//! `hapterra` binary.

#![forbid(unsafe_code)]

pub mod campaign;
pub mod campaign_table;
pub mod cycles;
pub mod dense_search;
pub mod emulation;
pub mod faulty_links;
pub mod figures;
pub mod fuzzing;
pub mod gdal_stand_in;
pub mod greedy_device;
pub mod instruction_counter;
pub mod invariants;
pub mod link_campaign;
pub mod link_model;
pub mod local_minima;
pub mod memory_limit;
pub mod random;
pub mod random_paths;
pub mod reader;
pub mod real_ground;
pub mod scene;
pub mod slow_line;
pub mod soak;
#[cfg(unix)]
pub mod socket_device;
mod terrain_file;
pub mod tiffs;
pub mod timeouts;
pub mod traceability;
pub mod usb;
pub mod whole_field;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

pub use terrain_file::terrain_file;

/// The program of the Rust tutorial, which is run.
#[cfg(doctest)]
#[doc = include_str!("../../docs/tutorials/kernel-in-rust.md")]
struct KernelTutorial;

/// Returns the repository's root folder.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests package is inside the repository")
}

/// Returns the newest file of this name in `log/`, which has a folder for each month.
///
/// # Panics
/// If there is none.
pub fn newest_log(name: &str) -> PathBuf {
    let months = repository().join("log").read_dir().expect("the log");
    let files = months.map(|month| month.expect("readable").path().join(name));
    files
        .filter(|file| file.is_file())
        .max()
        .expect("a file of this name in the log")
}

/// Returns a file or folder of the shared data beside the repository (`../shared`), or `None` after
/// a visible message if it is absent: the caller then returns.
pub fn shared(path: &str) -> Option<PathBuf> {
    let full = repository().parent()?.join("shared").join(path);
    if full.exists() {
        return Some(full);
    }
    eprintln!("skipped: no shared data at {}", full.display());
    None
}

/// Variables that cargo sets for a test program, one a line. Without their removal, build scripts
/// that read them run again, and the binary is rebuilt for the tests of each package.
const CARGO_ENVIRONMENT: &str = include_str!("cargo_variables.txt");

/// Returns the path of the real `hapterra` binary, which is built first if necessary.
///
/// # Panics
/// If the binary does not build.
pub fn hapterra_binary() -> &'static Path {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        // This program is TARGET/PROFILE/deps/NAME: the binary belongs beside `deps`, where it was
        // probably built before.
        let this = std::env::current_exe().expect("this program has a path");
        let target = this.ancestors().nth(3).expect("it is in a target folder");
        let build = CARGO_ENVIRONMENT
            .lines()
            .fold(escargot::CargoBuild::new(), |build, variable| {
                build.env_remove(variable)
            });
        let build = build
            .target_dir(target)
            // From the root, so that the features are the whole workspace's and nothing is built
            // twice.
            .manifest_path(repository().join("Cargo.toml"))
            .bin("hapterra");
        let build = if cfg!(debug_assertions) {
            build
        } else {
            build.release()
        };
        build
            .run()
            .expect("the hapterra binary builds")
            .path()
            .to_path_buf()
    })
}

/// Returns the output of `hapterra info --json` for a terrain.
///
/// # Panics
/// If the command fails.
pub fn info(path: &Path) -> serde_json::Value {
    let output = Command::new(hapterra_binary())
        .args(["info", "--json"])
        .arg(path)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// A surface without the passivity controller, as a file for `--surface`.
pub const UNCONTROLLED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/data/surfaces/uncontrolled.toml"
);
