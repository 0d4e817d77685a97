//! The display of a run, compared with the CSV of the same run.

mod common;

use std::path::Path;
use std::process::Command;

use common::framed::{check_frames, stick_sides};
use common::recorded::{Csv, check, check_views, entities, scalars};
use common::{Running, folder, hapterra};

/// Creates a terrain file by formula, with the program that `cargo xtask view --test` sets.
fn synth(file: &Path, size: &str) {
    let program = std::env::var_os("HAPTERRA_LAB").expect("named beside HAPTERRA");
    let mut synth = Command::new(program);
    synth.args(["synth", "fractal", "--size", size, "--out"]);
    let made = synth.arg(file).output().expect("it starts");
    assert!(made.status.success(), "{made:?}");
}

/// Returns the option that also writes the display to a file.
fn rrd(into: &Path) -> String {
    format!("-o {}", into.display())
}

#[test]
fn live_and_recorded_views_have_the_values_of_the_csv() {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let folder = folder("demo");
    let live = folder.join("live.rrd");
    demo.args(["demo", "--device", "native", "--duration", "4s", "--view"]);
    let output = Running::run_to_end(demo.arg("--out").arg(&folder), &rrd(&live));
    assert!(!output.contains("not shown"), "{output}");
    let recording = folder.join("fractal.csv");
    let csv = Csv::read(&recording);
    let shown = entities(&live);
    check(&csv, &shown);
    check_frames(&csv, &shown);
    for entity in ["/terrain/held", "/map/held", "/plot/tick", "/plot/link"] {
        assert!(shown.contains_key(entity), "{entity}");
    }
    assert!(
        shown
            .keys()
            .any(|entity| entity.starts_with("/terrain/tiles/"))
    );
    assert_eq!(scalars(&shown["/plot/tick"])[0].1.len(), 2);
    let rates = scalars(&shown["/plot/link"]);
    let has_two = rates.iter().all(|(_, row)| row.len() == 2);
    assert!(rates.len() > 3 && has_two, "{rates:?}");
    assert!(rates.iter().any(|(_, row)| row[0] > 0.0), "{rates:?}");

    let terrain = folder.join("hills.tif");
    synth(&terrain, "1024");
    let repeated = folder.join("again.rrd");
    let mut view = hapterra().expect("named");
    view.arg("view").arg(&recording).arg("--ignore-settings");
    Running::run_to_end(view.arg(&terrain), &rrd(&repeated));
    check(&csv, &entities(&repeated));
    std::fs::remove_dir_all(folder).expect("it is removed");
}

#[test]
fn views_of_a_terrain_lie_on_it_live_recorded_and_replayed() {
    if hapterra().is_none() {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    }
    let folder = folder("views");
    let at = |name: &str| folder.join(name);
    let (terrain, commands) = (at("hills.tif"), at("commands"));
    let lines = "at 3.5 zoom 2\nat 4.3 pan 4 3\nat 5.1 exaggerate 1.5\n";
    std::fs::write(&commands, lines).expect("written");
    let run = |command: &mut Command, into: &Path| Running::run_to_end(command, &rrd(into));
    synth(&terrain, "512");
    let mut demo = hapterra().expect("named");
    demo.args(["demo", "--device", "native", "--duration", "6s", "--view"]);
    demo.arg("--commands").arg(&commands);
    demo.arg("--out").arg(&folder).arg(&terrain);
    run(&mut demo, &at("live.rrd"));
    let recording = at("hills.csv");
    let csv = Csv::read(&recording);
    assert_eq!(csv.scales.len(), 4, "{:?}", csv.scales);
    let live = entities(&at("live.rrd"));
    check_views(&csv, &live, false);
    // The bar is shorter on the ground after the zoom.
    let bars = check_frames(&csv, &live);
    let (first, last) = (bars[0], bars[bars.len() - 1]);
    assert!((0.39..0.51).contains(&(last / first)), "{bars:?}");
    let mut view = hapterra().expect("named");
    view.arg("view").arg(&recording).arg(&terrain);
    run(&mut view, &at("viewed.rrd"));
    let viewed = entities(&at("viewed.rrd"));
    check_views(&csv, &viewed, true);
    check_frames(&csv, &viewed);
    // A replay has the same forces and the same picture; here as Parquet.
    let rendered = at("felt.parquet");
    let mut replay = hapterra().expect("named");
    replay
        .args(["replay", "--view"])
        .arg(&terrain)
        .arg(&recording);
    run(replay.arg("-o").arg(&rendered), &at("replayed.rrd"));
    check_views(&csv, &entities(&at("replayed.rrd")), true);
    let mut view = hapterra().expect("named");
    view.arg("view").arg(&rendered).arg(&terrain);
    run(&mut view, &at("parquet.rrd"));
    check_views(&csv, &entities(&at("parquet.rrd")), true);
    std::fs::remove_dir_all(folder).expect("it is removed");
}

#[test]
fn map_shows_the_extent_fitted_to_the_workspace() {
    if hapterra().is_none() {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    }
    let folder = folder("laid");
    let (terrain, shown) = (folder.join("hills.tif"), folder.join("shown.rrd"));
    synth(&terrain, "512");
    let mut demo = hapterra().expect("named");
    demo.args(["demo", "--device", "native", "--duration", "4s", "--view"])
        .args(["--bbox", "501000,1500,503000,3000", "--out"])
        .arg(&folder)
        .arg(&terrain);
    Running::run_to_end(&mut demo, &rrd(&shown));
    let csv = Csv::read(&folder.join("hills.csv"));
    let sides = stick_sides(&csv, &entities(&shown));
    // The first sample is at 500,005, 5; a metre of this map is 1.0004 on the ground here.
    let expected = [995.0, 1495.0, 2995.0, 2995.0].map(|metres| 1.0004 * metres);
    let off = sides
        .iter()
        .zip(expected)
        .map(|(side, expected)| (side - expected).abs());
    assert!(off.fold(0.0, f64::max) < 1.0, "{sides:?}");
    std::fs::remove_dir_all(folder).expect("it is removed");
}
