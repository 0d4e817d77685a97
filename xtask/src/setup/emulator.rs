//! What the emulated core of the image tests is built with: cmake for its C
//! code, libclang for its bindings.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::packages::{self, Packages};
use crate::run::{on_path, say};

const PACKAGES: Packages = Packages {
    apt: Some("cmake libclang-dev"),
    dnf: Some("cmake clang-devel"),
    pacman: Some("cmake clang"),
    brew: Some("cmake llvm"),
};

/// Where systems keep libclang. A `*` is any folder.
const PLACES: [&str; 8] = [
    "/usr/lib",
    "/usr/lib64",
    "/usr/lib/*",
    "/usr/lib/*/lib",
    "/usr/local/lib",
    "/usr/local/opt/llvm/lib",
    "/opt/homebrew/opt/llvm/lib",
    "/Library/Developer/CommandLineTools/usr/lib",
];

/// Finds both, or installs them.
pub(crate) fn ready() -> Result<()> {
    if let Err(missing) = is_whole() {
        say(format!("the emulated core of the image tests: {missing}"));
        packages::install(&PACKAGES)?;
    }
    is_whole()
}

fn is_whole() -> Result<()> {
    on_path("cmake").context("no cmake on the PATH")?;
    // A user who sets it knows where it is.
    let set = std::env::var_os("LIBCLANG_PATH").is_some();
    let found = set
        || PLACES
            .iter()
            .any(|place| folders(place).iter().any(|f| holds(f)));
    // Elsewhere (Windows) its own installer is found by bindgen.
    ensure!(found || !cfg!(unix), "no libclang found");
    Ok(())
}

/// The folders that a pattern with at most one `*` stands for.
fn folders(pattern: &str) -> Vec<PathBuf> {
    let Some((before, after)) = pattern.split_once('*') else {
        return vec![pattern.into()];
    };
    let Ok(entries) = Path::new(before).read_dir() else {
        return vec![];
    };
    let rest = after.trim_start_matches('/');
    entries.flatten().map(|e| e.path().join(rest)).collect()
}

fn holds(folder: &Path) -> bool {
    let Ok(entries) = folder.read_dir() else {
        return false;
    };
    let mut names = entries.flatten().map(|e| e.file_name());
    names.any(|name| is_libclang(&name.to_string_lossy()))
}

/// `libclang.so`, `libclang-14.so.14.0.6`, `libclang.dylib`; not `libclang-cpp.so`.
fn is_libclang(name: &str) -> bool {
    let Some(rest) = name.strip_prefix("libclang") else {
        return false;
    };
    let versioned = rest.strip_prefix('-').unwrap_or(rest);
    let library = versioned.trim_start_matches(|c: char| c.is_ascii_digit());
    library.starts_with(".so") || library == ".dylib"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_c_interface_is_told_from_the_other_libraries() {
        for name in [
            "libclang.so",
            "libclang-14.so.14.0.6",
            "libclang.so.1",
            "libclang.dylib",
        ] {
            assert!(is_libclang(name), "{name}");
        }
        for name in ["libclang-cpp.so.14", "libclangAST.a", "libclang.a", "clang"] {
            assert!(!is_libclang(name), "{name}");
        }
    }

    #[test]
    fn a_pattern_stands_for_every_folder() {
        assert_eq!(folders("/usr/lib"), [PathBuf::from("/usr/lib")]);
        assert!(folders("/no/such/*/lib").is_empty());
    }
}
