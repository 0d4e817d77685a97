//! The page that touches a terrain, in a real browser: `cargo xtask page --test`.

// The viewer's tests use all of it.
#[allow(dead_code, unreachable_pub)]
#[path = "../../../view/tests/common/browser.rs"]
mod browser;
mod hands;
#[path = "../../src/page/server.rs"]
mod server;
mod site;
#[allow(dead_code, unreachable_pub)]
#[path = "../../../tests/src/timeouts.rs"]
mod timeouts;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;

use serde_json::json;

use server::Server;
use site::{Site, one, program};
use timeouts::{HANG, wait_until};

/// Returns the rows of a CSV file's columns, as numbers of single precision.
fn forces(path: &Path) -> Vec<[u32; 3]> {
    let text = fs::read_to_string(path).expect("a file");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<_> = lines.next().expect("a header").split(',').collect();
    let columns = ["force_x_n", "force_y_n", "force_z_n"]
        .map(|name| names.iter().position(|other| *other == name).expect(name));
    lines
        .map(|line| {
            let words: Vec<_> = line.split(',').collect();
            columns.map(|column| words[column].parse::<f32>().expect("a number").to_bits())
        })
        .collect()
}

/// Saves the path into a folder beside the site, replays it there, and fails unless the forces are
/// the same, bit for bit. Returns the line that the page shows; `None` without the command.
fn check_saved(site: &mut Site, folder: &str, min_touching: usize) -> Option<String> {
    let saved = site.folder.path().join(folder);
    fs::create_dir(&saved).expect("a folder");
    let allow = json!({ "behavior": "allow", "downloadPath": saved });
    let _ = site
        .browser
        .call("Browser.setDownloadBehavior", allow, None);
    let _ = site.value("document.getElementById('save').click()");
    let files = ["path.csv", "terrain.npy", "surface.toml"].map(|name| saved.join(name));
    wait_until("the saved files", || {
        files.iter().all(|file| file.is_file())
    });
    let line = site.text("command");
    let words: Vec<_> = line.split(' ').skip(1).collect();
    program("HAPTERRA", &saved, &words, &[])?;
    let (rendered, replayed) = (forces(&files[0]), forces(&saved.join("forces.csv")));
    let touching = rendered.iter().filter(|force| **force != [0; 3]).count();
    println!("{} rows, {touching} with a force: {line}", rendered.len());
    assert!(touching > min_touching, "{touching} of {}", rendered.len());
    assert_eq!(rendered.len(), replayed.len());
    let differing = rendered.iter().zip(&replayed).position(|(a, b)| a != b);
    assert_eq!(differing, None, "{line}");
    Some(line)
}

/// Moves the mouse over the ground for some 2,000 ticks.
fn stroke(site: &mut Site) {
    for step in 1..40 {
        let share = f64::from(step) / 40.0;
        site.point([0.35 + 0.3 * share, 0.5 + 0.1 * (9.0 * share).sin()]);
        let rows = site.value("hapterra.touch.path.rows").as_u64().unwrap_or(0);
        site.wait(&format!("hapterra.touch.path.rows >= {}", rows + 50));
    }
}

#[test]
fn saved_path_replays_with_bit_identical_forces() {
    let _one = one();
    let Some(mut site) = Site::open(None) else {
        return;
    };
    // On the way the surface changes to a rough and grainy one: all effects of the page.
    site.point([0.35, 0.5]);
    site.wait("hapterra.touch.state === 'touching'");
    let _ = site.value("[...document.querySelectorAll('#presets button')].at(-1).click()");
    site.wait("hapterra.touch.surface.friction === 0.5 && hapterra.touch.surface.texture === 0.22");
    stroke(&mut site);
    let colours = site.pixels_near_the_ball();
    assert!(colours.count > 400, "{colours:?}");
    assert!(colours.near.iter().all(|pixels| *pixels > 5), "{colours:?}");
    let Some(line) = check_saved(&mut site, "changed", 1000) else {
        return;
    };
    assert!(line.ends_with("--tip 3mm"), "{line}");
    assert_eq!(site.value("document.getElementById('mixed').hidden"), false);
    // A ball of more than 8 cells, and a point; the surface stays.
    for (tip_mm, word) in [(5.0, "--tip 5mm"), (0.0, "--surface surface.toml")] {
        site.slide("tip", tip_mm);
        site.wait(&format!("hapterra.touch.tipMm === {tip_mm}"));
        stroke(&mut site);
        let line = check_saved(&mut site, word, 500).expect("the command");
        assert!(line.ends_with(word), "{line}");
        assert_eq!(site.value("document.getElementById('mixed').hidden"), true);
    }
    site.check_requests();
}

#[test]
fn dropped_files_of_one_terrain_have_the_same_heights() {
    let _one = one();
    let Some(mut site) = Site::open(None) else {
        return;
    };
    let folder = site.folder.path().to_owned();
    let has_geotiff = folder.join("site/geotiff.js").is_file();
    let mut heights = vec![];
    for name in ["hill.asc", "hill.png", "hill.tif"] {
        if name == "hill.tif" && !has_geotiff {
            println!("SKIPPED: GeoTIFF: the page was built without npm");
            continue;
        }
        let words = [
            "synth",
            "fractal",
            "--amplitude",
            "3000",
            "--size",
            "70x50",
            "--out",
            name,
        ];
        if program("HAPTERRA_LAB", &folder, &words, &[]).is_none() {
            return;
        }
        site.drop_file(name, &fs::read(folder.join(name)).expect("a file"));
        site.wait(&format!("hapterra.touch.terrain.name === '{name}'"));
        let shape = site.value("[hapterra.touch.terrain.nx, hapterra.touch.terrain.ny]");
        assert_eq!(shape, json!([70, 50]), "{name}");
        // As shares of the relief: a PNG has whole metres, and no cell size.
        let shares = site.value(
            "Array.from(hapterra.touch.terrain.heights, (h) => h / hapterra.touch.terrain.topMm)",
        );
        let shares = shares.as_array().expect("heights").clone();
        heights.push(
            shares
                .iter()
                .map(|share| share.as_f64().expect("a height"))
                .collect::<Vec<_>>(),
        );
    }
    for others in &heights[1..] {
        let difference = others.iter().zip(&heights[0]).map(|(a, b)| (a - b).abs());
        assert!(difference.fold(0.0, f64::max) < 0.02);
    }
    site.drop_file("notes.txt", b"not a terrain");
    site.wait("document.getElementById('said').textContent.startsWith('notes.txt: its format is not supported')");
    assert_eq!(site.value("hapterra.touch.terrain.nx"), 70);
    site.check_requests();
}

#[test]
fn cursor_stays_behind_the_hand_on_a_slope() {
    let _one = one();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ramp.asc");
    // Up to the east, by one in two; 60,501 heights, of which the page uses every fourth.
    let row = (0..301)
        .map(|i| (5 * i).to_string())
        .collect::<Vec<_>>()
        .join(" ");
    let rows = vec![row; 201].join("\n");
    fs::write(
        &path,
        format!("ncols 301\nnrows 201\nxllcorner 0\nyllcorner 0\ncellsize 10\n{rows}\n"),
    )
    .expect("written");
    let Some(mut site) = Site::open(Some(&path)) else {
        return;
    };
    let name = site.text("name");
    assert!(
        name.contains("ramp.asc")
            && name.contains("of 301 × 201")
            && name.contains("true to scale"),
        "{name}"
    );
    site.slide("tip", 0.0);
    site.point([0.5, 0.5]);
    // One newton on a slope of one in two pushes by half a newton: 4.2 mm of the hand's spring.
    site.wait("(({ arm, state }) => state === 'touching' && Math.hypot(...arm.speed) < 0.01 && Math.abs(arm.hand[0] - arm.at[0] - 0.5 / 0.12) < 0.05)(hapterra.touch)");
    let behind = "(() => {
        const [x] = document.getElementById('cursor').getAttribute('transform').match(/[\\d.]+/);
        return document.getElementById('hand').getAttribute('cx') - x;
    })()";
    let behind = site.value(behind).as_f64().expect("px");
    assert!(behind > 3.0, "{behind} px");
    let push = site.value("hapterra.touch.force").to_string();
    assert!(
        push.starts_with("[-0.5") || push.starts_with("[-0.49"),
        "{push}"
    );
    site.check_requests();
}

#[test]
fn server_answers_its_own_page_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("js")).expect("a folder");
    fs::write(folder.path().join("index.html"), "page").expect("written");
    fs::write(folder.path().join("js/a.js"), "script").expect("written");
    let server = Server::bind(folder.path()).expect("a port");
    let address = server.address();
    let own = address
        .trim_start_matches("http://")
        .trim_end_matches('/')
        .to_owned();
    std::thread::spawn(|| server.serve());
    let ask = |line: &str, host: &str| {
        let mut stream = TcpStream::connect(&own).expect("a server");
        write!(stream, "{line} HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    };
    assert!(ask("GET /", &own).ends_with("\r\n\r\npage"));
    let script = ask("GET /js/a.js?v=1", &own);
    assert!(
        script.contains("text/javascript") && script.ends_with("script"),
        "{script}"
    );
    for (line, host, status) in [
        ("GET /", "evil.example", "421"),
        ("GET /../Cargo.toml", own.as_str(), "404"),
        ("GET //etc/passwd", own.as_str(), "404"),
        ("POST /", own.as_str(), "405"),
    ] {
        let answer = ask(line, host);
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")),
            "{answer}"
        );
    }
}
