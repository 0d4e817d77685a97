//! What is shown of a run, beside the CSV of the same run.

mod common;

use std::collections::BTreeMap;
use std::path::Path;

use re_chunk::Chunk;
use re_log_encoding::Decoder;
use re_log_types::LogMsg;
use re_sdk_types::Loggable as _;
use re_sdk_types::components::{Position3D, Scalar};

use common::{folder, hapterra};

/// Entities of an `.rrd`, with all chunks of each.
fn entities(path: &Path) -> BTreeMap<String, Vec<Chunk>> {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a file"));
    let mut entities = BTreeMap::<String, Vec<Chunk>>::new();
    for message in Decoder::<LogMsg>::decode_eager(file).expect("an .rrd") {
        if let LogMsg::ArrowMsg(store, message) = message.expect("a message")
            && store.is_recording()
        {
            let chunk = Chunk::from_arrow_msg(&message).expect("a chunk");
            let chunks = entities.entry(chunk.entity_path().to_string());
            chunks.or_default().push(chunk);
        }
    }
    entities
}

/// Rows of an entity's only component over time: time in ns, and values.
fn rows<T>(
    chunks: &[Chunk],
    read: &dyn Fn(&dyn re_chunk::external::arrow::array::Array) -> Vec<T>,
) -> Vec<(i64, Vec<T>)> {
    let mut rows = Vec::new();
    for chunk in chunks.iter().filter(|chunk| !chunk.is_static()) {
        let (_, times) = chunk.timelines().iter().next().expect("a timeline");
        let component = chunk
            .components()
            .list_arrays()
            .next()
            .expect("a component");
        for (i, time) in times.times_raw().iter().enumerate() {
            rows.push((*time, read(&component.value(i))));
        }
    }
    rows
}

fn scalars(chunks: &[Chunk]) -> Vec<(i64, Vec<f64>)> {
    rows(chunks, &|values| {
        let values = Scalar::from_arrow(values).expect("scalars");
        values.into_iter().map(|value| value.0.0).collect()
    })
}

fn places(chunks: &[Chunk]) -> Vec<(i64, Vec<[f32; 3]>)> {
    rows(chunks, &|values| {
        let values = Position3D::from_arrow(values).expect("places");
        values.into_iter().map(|value| value.0.0).collect()
    })
}

/// Columns of a CSV recording by name.
struct Csv {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Hand millimetres of a cell of level 0 and of a vertical unit, by view.
    scales: Vec<[f64; 2]>,
    /// The picture's units in a cell of level 0: metres, or millimetres in the first view.
    units: f64,
}

impl Csv {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a recording");
        let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(split);
        Self {
            names: lines.next().expect("a header"),
            rows: lines.collect(),
            units: [said(&text, "cell_m"), said(&text, "cell_mm")]
                .concat()
                .first()
                .copied()
                .expect("settings"),
            scales: said(&text, "cell_mm")
                .into_iter()
                .zip(said(&text, "height_mm_per_unit"))
                .map(|(cell, height)| [cell, height])
                .collect(),
        }
    }

    fn number(&self, row: usize, name: &str) -> f64 {
        let column = self.names.iter().position(|column| column == name);
        self.rows[row][column.expect(name)]
            .parse()
            .expect("a number")
    }

    fn vector(&self, row: usize, names: [&str; 3]) -> [f64; 3] {
        names.map(|name| self.number(row, name))
    }
}

/// Numbers that the remarks of a recording say under a name, in their order.
fn said(text: &str, name: &str) -> Vec<f64> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("# "));
    let pairs = lines.filter_map(|line| line.split_once(" = "));
    pairs
        .filter(|(key, _)| *key == name)
        .map(|(_, value)| value.parse().expect("a number"))
        .collect()
}

const HIP: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
const PROXY: [&str; 3] = ["proxy_x_mm", "proxy_y_mm", "proxy_z_mm"];
const FORCE: [&str; 3] = ["force_x_n", "force_y_n", "force_z_n"];

/// Every row of the CSV is there, with its time and its values.
fn check(csv: &Csv, shown: &BTreeMap<String, Vec<Chunk>>) {
    let count = csv.rows.len();
    let (height, force) = (
        scalars(&shown["/plot/height"]),
        scalars(&shown["/plot/force"]),
    );
    let depth = scalars(&shown["/plot/penetration"]);
    assert_eq!(
        (height.len(), force.len(), depth.len()),
        (count, count, count)
    );
    let (mut touched, mut metres) = (0, None);
    for row in 0..count {
        let time = (csv.number(row, "t_s") * 1e9).round() as i64;
        assert_eq!(
            (height[row].0, force[row].0, depth[row].0),
            (time, time, time)
        );
        assert_eq!(force[row].1, csv.vector(row, FORCE), "row {row}");
        let (hip, proxy) = (csv.vector(row, HIP), csv.vector(row, PROXY));
        let deep = hip
            .iter()
            .zip(proxy)
            .map(|(h, p)| (p - h) * (p - h))
            .sum::<f64>()
            .sqrt();
        assert!((depth[row].1[0] - deep).abs() <= 1e-9, "row {row}");
        // Heights are ground metres: the same factor in every row.
        let factor = height[row].1[0] / hip[2];
        let metres = *metres.get_or_insert(factor);
        assert!(
            (factor / metres - 1.0).abs() < 1e-9,
            "row {row}: {factor} {metres}"
        );
        let contact = csv.number(row, "contact") == 1.0;
        touched += u32::from(contact);
        if contact {
            // The proxy is on the surface; the surface under the HIP is near.
            let ground = height[row].1[1];
            assert!(ground.is_finite(), "row {row}");
        }
    }
    assert!(touched > 100, "{touched} rows in contact");
    // The hand, 60 times a second at most and half of that at least.
    let seconds = csv.number(count - 1, "t_s") - csv.number(0, "t_s");
    let proxies = places(&shown["/hand/proxy"]);
    let (least, most) = (30.0 * seconds, 61.0 * seconds + 2.0);
    assert!(
        (least..=most).contains(&(proxies.len() as f64)),
        "{}",
        proxies.len()
    );
    let row_at =
        |time: i64| (0..count).find(|row| (csv.number(*row, "t_s") * 1e9).round() as i64 == time);
    let (first, last) = (&proxies[0], &proxies[proxies.len() - 1]);
    let rows = [first.0, last.0].map(|time| row_at(time).expect("the time of a row"));
    let moved = [0, 1, 2].map(|i| csv.vector(rows[1], PROXY)[i] - csv.vector(rows[0], PROXY)[i]);
    let drawn = [0, 1, 2].map(|i| f64::from(last.1[0][i]) - f64::from(first.1[0][i]));
    let scale = drawn[0].hypot(drawn[1]) / moved[0].hypot(moved[1]);
    for i in 0..3 {
        assert!(
            (drawn[i] - scale * moved[i]).abs() < 1e-3 * (1.0 + drawn[i].abs()),
            "{drawn:?} {moved:?}"
        );
    }
    for entity in [
        "/hand/hip",
        "/hand/ray",
        "/hand/force",
        "/hand/trace",
        "/map/hip",
        "/map/relief",
        "/words",
        "/terrain/layer0/0",
        "/plot/energy",
    ] {
        assert!(shown.contains_key(entity), "{entity} of {:?}", shown.keys());
    }
}

#[test]
fn the_live_view_of_a_demo_and_of_its_recording_have_the_values_of_its_csv() {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let folder = folder("demo");
    let live = folder.join("live.rrd");
    let options = format!("--no-browser --port 0 --linger 0 --rrd {}", live.display());
    let done = demo
        .args([
            "demo",
            "--device",
            "native",
            "--seconds",
            "4",
            "--view",
            "--out",
        ])
        .arg(&folder)
        .env("HAPTERRA_VIEW_OPTIONS", options)
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    assert!(!said.contains("not shown"), "{said}");
    let recording = folder.join("fractal.csv");
    let csv = Csv::read(&recording);
    let shown = entities(&live);
    check(&csv, &shown);
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
    let made = hapterra()
        .expect("named")
        .args(["synth", "fractal", "--size", "1024", "--seed", "1", "-o"])
        .arg(&terrain)
        .output()
        .expect("it starts");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let again = folder.join("again.rrd");
    let viewed = hapterra()
        .expect("named")
        .arg("view")
        .arg(&recording)
        .arg("--ignore-settings")
        .arg("--terrain")
        .arg(&terrain)
        .arg("--rrd")
        .arg(&again)
        .env("HAPTERRA_VIEW_OPTIONS", "--no-browser --port 0 --linger 0")
        .output()
        .expect("it starts");
    assert!(
        viewed.status.success(),
        "{}",
        String::from_utf8_lossy(&viewed.stderr)
    );
    check(&csv, &entities(&again));
    std::fs::remove_dir_all(folder).expect("it goes");
}

/// What was felt in several views lies where it lies on the ground: places and heights of
/// all of them in one scale, in `stretched` views as high as in the first.
fn check_views(csv: &Csv, shown: &BTreeMap<String, Vec<Chunk>>, stretched: bool) {
    let drawn = places(&shown["/hand/hip"]);
    let heights = scalars(&shown["/plot/height"]);
    let rows: BTreeMap<i64, usize> = (0..csv.rows.len())
        .map(|row| ((csv.number(row, "t_s") * 1e9).round() as i64, row))
        .collect();
    let (mut cells, mut seen) = (None, [0; 4]);
    for (time, place) in &drawn {
        let row = rows[time];
        let view = csv.number(row, "view") as usize;
        seen[view] += 1;
        let ([cell, unit], first) = (csv.scales[view], csv.scales[0]);
        let [x, y, z] = csv.vector(row, HIP);
        let upright = match stretched {
            true => z / unit * first[1] / first[0],
            false => z / cell,
        };
        let felt = [x / cell, y / cell, upright];
        let place = place[0].map(f64::from);
        let (cells_at, place_at) = *cells.get_or_insert((felt, place));
        let [east, north, up] = [0, 1, 2].map(|i| place[i] - place_at[i]);
        let [x, y, z] = [0, 1, 2].map(|i| csv.units * (felt[i] - cells_at[i]));
        let off = [east - x, north - y, up - z];
        assert!(
            off.iter().all(|off| off.abs() < 2e-3 * csv.units),
            "row {row}, view {view}: {off:?}"
        );
    }
    assert!(seen.iter().all(|count| *count > 10), "{seen:?}");
    // Heights in the file's unit, whatever the hand felt.
    for (time, values) in &heights {
        let row = rows[time];
        let [_, unit] = csv.scales[csv.number(row, "view") as usize];
        let expected = csv.vector(row, HIP)[2] / unit;
        assert!((values[0] - expected).abs() < 1e-6, "row {row}");
    }
}

#[test]
fn views_of_a_terrain_lie_on_it_live_recorded_and_replayed() {
    let Some(mut synth) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let folder = folder("views");
    let at = |name: &str| folder.join(name);
    let (terrain, commands) = (at("hills.tif"), at("commands"));
    let lines = "at 3.5 zoom 2\nat 4.3 pan 4 3\nat 5.1 exaggerate 1.5\n";
    std::fs::write(&commands, lines).expect("written");
    let run = |command: &mut std::process::Command, rrd: &Path| {
        let options = format!("--no-browser --port 0 --linger 0 --rrd {}", rrd.display());
        let done = command.env("HAPTERRA_VIEW_OPTIONS", options).output();
        let done = done.expect("it starts");
        let said = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "{said}");
    };
    let size = ["synth", "fractal", "--size", "512", "--seed", "1", "-o"];
    run(synth.args(size).arg(&terrain), &at("none.rrd"));
    let mut demo = hapterra().expect("named");
    demo.args(["demo", "--device", "native", "--seconds", "6", "--view"]);
    demo.arg("--commands").arg(&commands);
    demo.arg("--out").arg(&folder).arg(&terrain);
    run(&mut demo, &at("live.rrd"));
    let recording = at("hills.csv");
    let csv = Csv::read(&recording);
    assert_eq!(csv.scales.len(), 4, "{:?}", csv.scales);
    check_views(&csv, &entities(&at("live.rrd")), false);
    let mut view = hapterra().expect("named");
    view.arg("view")
        .arg(&recording)
        .arg("--terrain")
        .arg(&terrain);
    run(&mut view, &at("viewed.rrd"));
    check_views(&csv, &entities(&at("viewed.rrd")), true);
    // What a replay felt is the same, and so is its picture; here as Parquet.
    let felt = at("felt.parquet");
    let mut replay = hapterra().expect("named");
    replay
        .args(["replay", "--view"])
        .arg(&terrain)
        .arg(&recording);
    run(replay.arg("-o").arg(&felt), &at("replayed.rrd"));
    check_views(&csv, &entities(&at("replayed.rrd")), true);
    let mut view = hapterra().expect("named");
    view.arg("view").arg(&felt).arg("--terrain").arg(&terrain);
    run(&mut view, &at("parquet.rrd"));
    check_views(&csv, &entities(&at("parquet.rrd")), true);
    std::fs::remove_dir_all(folder).expect("it goes");
}
