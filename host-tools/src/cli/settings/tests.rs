use std::fs;
use std::path::Path;

use clap::Parser as _;
use hapterra_core::contact::Friction;
use hapterra_core::force::{Shading, SurfaceParams};

use super::*;
use crate::cli::options::exaggeration::Exaggeration;
use crate::cli::options::level::LevelChoice;
use crate::cli::options::surface::{SurfaceChoice, SurfaceOptions};
use crate::replay::settings::Device;
use crate::replay::{Rule, Settings};
use crate::terrain::{Scale, Terrain};
use heightfield::Raster;

/// Returns the arguments of a command with a settings file.
fn completed(text: &str, line: &str) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("s.toml");
    fs::write(&file, text).expect("written");
    let file = file.display().to_string();
    let arguments = format!("hapterra {line} --settings {file}");
    let arguments = arguments.split_whitespace().map(OsString::from).collect();
    let completed = complete(&Cli::command(), arguments).map_err(|failure| failure.text())?;
    assert_eq!(completed.line, Some(format!("settings       {file}")));
    let parsed = Cli::try_parse_from(&completed.arguments);
    parsed.map_err(|error| error.render().to_string())?;
    let arguments = completed
        .arguments
        .iter()
        .map(|word| word.to_string_lossy());
    let without = arguments.map(|word| word.replace(&file, "FILE"));
    Ok(without.filter(|word| word.starts_with("--")).collect())
}

#[test]
fn settings_precede_user_arguments() {
    let text = "scale = \"5m/mm\"\ntip = 2\nsurface = \"sand\"\ninput = [\"band=2\", \"cell=30m\"]\nview = true\n";
    let arguments = completed(text, "run t.tif").expect("settings");
    assert_eq!(
        arguments,
        [
            "--input=band=2",
            "--input=cell=30m",
            "--scale=5m/mm",
            "--surface=sand",
            "--tip=2",
            "--view",
            "--settings"
        ]
    );
    let arguments = completed("view = false\n", "run t.tif").expect("settings");
    assert_eq!(arguments, ["--settings"]);
}

#[test]
fn command_line_wins() {
    let text =
        "scale = \"5m/mm\"\ninput = [\"band=2\", \"cell=30m\"]\nat = \"1,2\"\ncrs = \"lonlat\"\n";
    let arguments = completed(text, "run t.tif --scale 1mm/cell --input band=1").expect("settings");
    assert_eq!(
        arguments,
        [
            "--at=1,2",
            "--crs=lonlat",
            "--input=cell=30m",
            "--scale",
            "--input",
            "--settings"
        ]
    );
    // A box is fitted, so it excludes a place and a scale.
    let arguments = completed(text, "run t.tif --bbox 1,2,3,4").expect("settings");
    assert_eq!(
        arguments,
        [
            "--crs=lonlat",
            "--input=band=2",
            "--input=cell=30m",
            "--bbox",
            "--settings"
        ]
    );
}

#[test]
fn keys_of_other_commands_are_ignored() {
    let text = "rounds = 3\nsilence = \"30s\"\nrows-are-ticks = true\n";
    let arguments = completed(text, "demo t.tif").expect("settings");
    assert_eq!(arguments, ["--rounds=3", "--settings"]);
    let arguments = completed(text, "run t.tif").expect("settings");
    assert_eq!(arguments, ["--silence=30s", "--settings"]);
}

#[test]
fn settings_file_may_contain_a_surface() {
    let text = "device = \"native\"\n[surface.default]\nfriction = 0.4\n";
    let arguments = completed(text, "run t.tif").expect("settings");
    assert_eq!(
        arguments,
        ["--device=native", "--surface=FILE", "--settings"]
    );
}

#[test]
fn errors_name_file_and_line() {
    for (text, expected) in [
        (
            "tip = 2\nscales = 3\n",
            "line 2: no command has an option --scales",
        ),
        ("settings = \"a.toml\"\n", "line 1: no command has"),
        ("\ntip = \"2m\"\n", "line 2: invalid value '2m' for '--tip"),
        ("view = 1\n", "line 1: view must be true or false"),
        ("view = \"yes\"\n", "line 1: view must be true or false"),
        ("[tip]\nx = 1\n", "line 1: tip is a text, a number"),
        ("tip = 2\ntip = 3\n", "duplicate"),
        ("tip\n", "s.toml"),
        ("at = \"1,2\"\nbbox = \"1,2,3,4\"\n", "cannot be used with"),
    ] {
        let why = completed(text, "run t.tif").expect_err(text);
        assert!(why.contains(expected), "{text}: {why}");
    }
}

#[test]
fn command_line_without_settings_is_left_unchanged() {
    let arguments =
        |line: &str| -> Vec<OsString> { line.split_whitespace().map(OsString::from).collect() };
    for line in [
        "hapterra run t.tif --settings none",
        "hapterra info t.tif",
        "hapterra run --help",
        "hapterra",
        "hapterra run t.tif --nonsense",
    ] {
        let completed =
            complete(&Cli::command(), arguments(line)).map_err(|failure| failure.text());
        let completed = completed.expect(line);
        assert_eq!(
            (completed.arguments, completed.line),
            (arguments(line), None)
        );
    }
    let missing = complete(
        &Cli::command(),
        arguments("hapterra run t.tif --settings no.toml"),
    );
    assert!(missing.is_err());
}

/// Writes a recording to a folder: cells of 2 mm, a soft spring with friction.
fn recording(folder: &Path) -> (PathBuf, Settings) {
    let raster = Raster::from_fn(9, 9, |x, _| x as f32).expect("raster");
    let scale = Scale::new(2.0, 6.0).expect("valid");
    let terrain = Terrain::new(&raster, scale, 1).expect("terrain");
    let params = SurfaceParams {
        stiffness_n_per_mm: 0.3,
        max_force_n: 4.0,
        friction: Friction::coulomb(0.25),
        shading: Shading::Smooth,
        ..SurfaceParams::PREMIUM
    };
    let device = Device {
        board: "native".into(),
        firmware: String::new(),
        tick_hz: 1000,
    };
    let settings = Settings::new("t.tif", &terrain, (params, Rule::Swept), None, device);
    let path = folder.join("felt.csv");
    let lines = settings.to_toml();
    let lines: String = lines.lines().map(|line| format!("# {line}\n")).collect();
    fs::write(&path, lines + "t_s,x_mm,y_mm,z_mm\n0,1,1,1\n").expect("written");
    (path, settings)
}

/// Parses a replay with a recording's settings; returns the lines about differences.
fn replayed(more: &str) -> (crate::cli::replay::Args, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, settings) = recording(folder.path());
    let line = format!("hapterra replay t.tif {} -o x.csv {more}", path.display());
    let arguments = line.split_whitespace().map(OsString::from).collect();
    let completed = complete(&Cli::command(), arguments).map_err(|failure| failure.text());
    let cli = Cli::try_parse_from(completed.expect(more).arguments).expect(more);
    let crate::cli::Command::Replay(args) = cli.command else {
        panic!("{more}");
    };
    let cells = args.terrain.reading.cells();
    let lines = differences(&args.rendering, cells, (&path, &settings));
    (args, lines)
}

#[test]
fn recording_options_are_those_of_the_recorded_run() {
    let (args, lines) = replayed("");
    assert_eq!(lines, [""; 0]);
    let rendering = &args.rendering;
    assert_eq!(rendering.scale, Some(MapScale::CellMm(2.0)));
    assert_eq!(rendering.exaggeration, Some(Exaggeration::MmPerUnit(6.0)));
    assert_eq!(
        (rendering.level, rendering.tip),
        (Some(LevelChoice::Fixed(1)), Some(0.0))
    );
    let (args, _) = replayed("--ignore-settings");
    assert_eq!(args.rendering.scale, None);
}

#[test]
fn options_win_over_a_recording_and_are_named() {
    // Half the size and half the height.
    let (args, lines) = replayed("--scale 1mm/cell --stiffness 0.5");
    assert_eq!(
        args.rendering.exaggeration,
        Some(Exaggeration::MmPerUnit(3.0))
    );
    assert_eq!(
        lines,
        [
            "--scale 1mm/cell, where the recording has 2mm/cell",
            "--stiffness 0.5N/mm, where the recording has 0.3N/mm"
        ]
    );
    // Another kind of cells keeps the factor.
    let (args, lines) = replayed("--input cells=stored");
    assert_eq!(args.rendering.exaggeration, Some(Exaggeration::Times(3.0)));
    assert_eq!(lines.len(), 1, "{lines:?}");
    let (_, lines) = replayed("--exaggeration 2 --surface sand --friction 0.7");
    assert_eq!(
        lines,
        [
            "--exaggeration 2, where the recording has 3",
            "--surface sand, where the recording has its own",
            "--friction 0.7, where the recording has 0.25"
        ]
    );
}

#[test]
fn recorded_surface_restores_every_bit_of_its_params() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, settings) = recording(folder.path());
    let options = SurfaceOptions {
        surface: Some(SurfaceChoice::File(path.clone())),
        max_force: Some(4.0),
        ..SurfaceOptions::default()
    };
    let params = options
        .load()
        .map(|surface| surface.params)
        .map_err(|it| it.text());
    assert_eq!(params, Ok(settings.params()));
    // A stated friction also sets the static part, and leaves the shading unchanged.
    let rough = SurfaceOptions {
        friction: Some(0.7),
        ..options
    };
    let params = rough
        .load()
        .map(|surface| surface.params)
        .map_err(|it| it.text());
    let friction = Friction::coulomb(0.7);
    assert_eq!(
        params,
        Ok(SurfaceParams {
            friction,
            ..settings.params()
        })
    );
    // `run` also accepts the recording.
    let line = format!("hapterra run t.tif --settings {}", path.display());
    let arguments = line.split_whitespace().map(OsString::from).collect();
    let completed = complete(&Cli::command(), arguments).map_err(|failure| failure.text());
    let arguments = completed.expect("a recording").arguments;
    for word in [
        "--scale=2mm/cell",
        "--exaggeration=6mm/unit",
        "--max-force=4N",
    ] {
        assert!(arguments.contains(&word.into()), "{arguments:?}");
    }
}
