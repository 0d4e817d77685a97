//! A stand-in for libgdal that sleeps or crashes: `heightfield-gdal/examples/stand_in.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::repository;

/// Builds it into a folder. A command uses it through the variable `GDAL_LIBRARY`.
///
/// # Panics
/// If the build fails.
pub fn library(folder: &Path) -> PathBuf {
    let name = format!(
        "{}stand_in{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    let path = folder.join(name);
    let compiler = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let built = Command::new(compiler)
        .args(["--edition", "2024", "--crate-type", "cdylib", "-o"])
        .arg(&path)
        .arg(repository().join("heightfield-gdal/examples/stand_in.rs"))
        .output()
        .expect("the compiler runs");
    assert!(built.status.success(), "{built:?}");
    path
}

/// Writes a file that only the stand-in accepts as a terrain.
///
/// # Panics
/// If it cannot be written.
pub fn terrain(folder: &Path) -> PathBuf {
    let path = folder.join("ground.stand-in");
    std::fs::write(&path, "a terrain for the stand-in").expect("written");
    path
}
