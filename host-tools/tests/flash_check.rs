//! Tests `hapterra flash --check` with the boards' own images, which `cargo xtask test` builds and
//! names. They are here because the command has to be built with its feature.

use std::process::{Command, Output};

use hapterra::board::BOARDS;

fn check(board: &str, image: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapterra"))
        .args(["flash", "--check", "--board", board, "--image", image])
        .output()
        .expect("it runs")
}

fn output_text(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}

#[test]
fn image_fits_only_its_board() {
    let images = [
        ("nucleo-g474re", "HAPTERRA_G474_ELF"),
        ("nucleo-h743zi2", "HAPTERRA_H743_ELF"),
        ("nucleo-h743zi2-spi", "HAPTERRA_H743_SPI_ELF"),
    ];
    let flashable = BOARDS.iter().filter(|board| board.chip.is_some());
    assert_eq!(flashable.count(), images.len());
    for (board, variable) in images {
        let Some(image) = std::env::var(variable).ok().filter(|path| !path.is_empty()) else {
            eprintln!("skipped: no image of {board}: {variable} is not set");
            continue;
        };
        let output = check(board, &image);
        let text = output_text(&output);
        assert!(output.status.success(), "{board}: {text}");
        assert!(text.contains("flash") && text.contains("RAM"), "{text}");
        for (other, _) in images.iter().filter(|(other, _)| *other != board) {
            let output = check(other, &image);
            let text = output_text(&output);
            assert_eq!(output.status.code(), Some(1), "{board} as {other}: {text}");
            assert!(text.contains("built for"), "{text}");
            assert!(text.contains("--board"), "{text}");
        }
    }
}

/// A foreign checkout around the working folder is not built, because a build runs its code.
///
/// Safety: 37.
#[cfg(unix)]
#[test]
fn own_checkout_is_built_from_any_folder() {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let manifest = "[package]\nname = \"hapterra-firmware\"\n";
    fs::create_dir(here.join("firmware")).expect("made");
    fs::write(here.join("firmware/Cargo.toml"), manifest).expect("written");
    // Replaces cargo: it prints its working folder, and makes no image.
    let cargo = here.join("cargo");
    fs::write(&cargo, "#!/bin/sh\npwd -P >&2\nexit 1\n").expect("written");
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).expect("set");
    let output = Command::new(env!("CARGO_BIN_EXE_hapterra"))
        .args(["flash", "--check", "--board", "nucleo-g474re"])
        .current_dir(here.join("firmware"))
        .env("CARGO", &cargo)
        .output()
        .expect("it runs");
    let text = output_text(&output);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    let root = fs::canonicalize(root.expect("a folder above")).expect("there");
    let started = format!("\n{}\n", root.display());
    assert!(format!("\n{text}").contains(&started), "{started}: {text}");
    assert!(text.contains("source         "), "{text}");
    assert_eq!(output.status.code(), Some(1), "{text}");
}
