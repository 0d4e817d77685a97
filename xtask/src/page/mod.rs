//! `cargo xtask demo --touch` and `cargo xtask page`: the page that touches a terrain in a
//! browser.

mod server;

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::run::{
    TEST_ARGUMENTS, cargo, hapterra, on_path, report, root, run, run_quietly, target_dir,
    tested_programs, timed,
};
use crate::setup::{packages, toolchain};
use crate::view;
use server::Server;

/// Files of the page, in `page/`.
const FILES: [&str; 3] = ["index.html", "style.css", "js"];
/// The reader of GeoTIFF, in npm's folder, and its name beside the page.
const GEOTIFF: [(&str, &str); 2] = [
    ("dist-browser/geotiff.js", "geotiff.js"),
    ("LICENSE", "geotiff-LICENSE.txt"),
];

/// Writes the page into a folder, with a terrain file if there is one, and serves it unless the
/// user named that folder. `extra` is passed to `hapterra cut`.
pub(crate) fn demo(
    file: Option<&OsString>,
    out: Option<PathBuf>,
    extra: &[OsString],
) -> Result<()> {
    let is_served = out.is_none();
    let folder = out.unwrap_or_else(|| target_dir().join("page"));
    build(&folder)?;
    if let Some(file) = file {
        let features: &[&str] = match file.to_string_lossy().contains("://") {
            true => &["--features", "remote"],
            false => &[],
        };
        let mut cut = Command::new(hapterra(features)?);
        cut.arg("cut").arg(file).arg("--out").arg(&folder);
        run(cut.args(extra))?;
    }
    if !is_served {
        report(format!(
            "wrote the page: any web server can serve {}",
            folder.display()
        ));
        return Ok(());
    }
    let server = Server::bind(&folder).context("no port on the loopback address is free")?;
    report(format!(
        "open {} in a browser; Ctrl-C ends it",
        server.address()
    ));
    server.serve();
    Ok(())
}

/// Builds the page and runs its tests: with node, and in a browser if there is one or one can be
/// installed.
pub(crate) fn test() -> Result<()> {
    match packages::found_or_installed(node, &packages::NODE) {
        Ok(node) => timed("running the page's unit tests", || {
            run(Command::new(node)
                .current_dir(root().join("page"))
                .args(["--test", "tests/"]))
        })?,
        Err(why) => report(format!("SKIPPED: the page's unit tests: {why:#}")),
    }
    let folder = target_dir().join("page-test");
    build(&folder)?;
    let [hapterra, lab] = tested_programs()?;
    let mut tests = cargo();
    tests
        .arg("test")
        .args(TEST_ARGUMENTS)
        .args(["--test", "page"])
        .env("HAPTERRA", hapterra)
        .env("HAPTERRA_LAB", lab)
        .env("HAPTERRA_PAGE", folder);
    match view::browser() {
        Ok(browser) => drop(tests.env(view::BROWSER, browser)),
        Err(why) => report(format!("SKIPPED: the page in a browser: {why:#}")),
    }
    timed("running the page's tests in a browser", || run(&mut tests))
}

fn node() -> Result<PathBuf> {
    on_path("node").context("there is no node on the PATH")
}

/// Writes the page without a terrain file.
fn build(folder: &Path) -> Result<()> {
    let write = |name: &str, bytes: Vec<u8>| {
        let path = folder.join(name);
        fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))
    };
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for name in FILES {
        copy(&root().join("page").join(name), &folder.join(name))?;
    }
    copy(&kernel()?, &folder.join("kernel.wasm"))?;
    // From the previous build.
    let _ = fs::remove_file(folder.join("terrain.npy"));
    write("terrain.json", b"{}\n".to_vec())?;
    if let Err(why) = geotiff(folder) {
        report(format!(
            "SKIPPED: GeoTIFF files dropped on the page: {why:#}"
        ));
    }
    Ok(())
}

/// Compiles the kernel for browsers: the C library as it is.
fn kernel() -> Result<PathBuf> {
    toolchain::with_wasm()?;
    let mut build = cargo();
    build
        .args([
            "build",
            "--release",
            "--package",
            "hapterra-c",
            "--lib",
            "--target",
            toolchain::WASM,
        ])
        .env_remove("RUSTFLAGS")
        .env("CARGO_PROFILE_RELEASE_DEBUG", "0")
        .env("CARGO_PROFILE_RELEASE_STRIP", "true");
    timed("compiling the kernel to WebAssembly", || run(&mut build))?;
    Ok(target_dir()
        .join(toolchain::WASM)
        .join("release/hapterra_c.wasm"))
}

/// Copies npm's reader of GeoTIFF, of the version in `page/package-lock.json`.
fn geotiff(folder: &Path) -> Result<()> {
    let npm = on_path("npm").context("there is no npm on the PATH")?;
    let cache = target_dir().join("page-npm");
    fs::create_dir_all(&cache)?;
    let locks = ["package.json", "package-lock.json"];
    let is_same = |name: &&str| {
        let read = |folder: &Path| fs::read(folder.join(name)).ok();
        read(&cache) == read(&root().join("page"))
    };
    let library = cache.join("node_modules/geotiff");
    if !locks.iter().all(is_same) || !library.join(GEOTIFF[0].0).is_file() {
        for name in locks {
            copy(&root().join("page").join(name), &cache.join(name))?;
        }
        let words = ["ci", "--ignore-scripts", "--no-audit", "--no-fund"];
        timed("getting geotiff.js from npm", || {
            run_quietly(Command::new(npm).current_dir(&cache).args(words))
        })?;
    }
    GEOTIFF
        .iter()
        .try_for_each(|(from, to)| copy(&library.join(from), &folder.join(to)))
}

/// Copies a file, or a folder with all its content.
fn copy(from: &Path, to: &Path) -> Result<()> {
    if from.is_dir() {
        fs::create_dir_all(to)?;
        for entry in from.read_dir()? {
            let entry = entry?;
            copy(&entry.path(), &to.join(entry.file_name()))?;
        }
        return Ok(());
    }
    fs::copy(from, to)
        .map(drop)
        .with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))
}
