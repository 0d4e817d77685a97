//! A recording for rerun's own viewer, compared with the CSV of the same run.

use std::collections::BTreeMap;
use std::path::Path;

use re_chunk::Chunk;
use re_log_encoding::Decoder;
use re_log_types::LogMsg;
use re_sdk_types::Loggable as _;
use re_sdk_types::components::{Position3D, Scalar};

/// Returns the entities of an `.rrd`, with all chunks of each.
pub fn entities(path: &Path) -> BTreeMap<String, Vec<Chunk>> {
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

/// Returns the rows of an entity's only component over time: time in ns, and values.
fn rows_of<T>(
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

pub fn scalars(chunks: &[Chunk]) -> Vec<(i64, Vec<f64>)> {
    rows_of(chunks, &|values| {
        let values = Scalar::from_arrow(values).expect("scalars");
        values.into_iter().map(|value| value.0.0).collect()
    })
}

pub fn places(chunks: &[Chunk]) -> Vec<(i64, Vec<[f32; 3]>)> {
    rows_of(chunks, &|values| {
        let values = Position3D::from_arrow(values).expect("places");
        values.into_iter().map(|value| value.0.0).collect()
    })
}

/// Columns of a CSV recording by name.
pub struct Csv {
    names: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Device millimetres of a cell of level 0 and of a vertical unit, by placement.
    pub scales: Vec<[f64; 2]>,
    /// The picture's units in a cell of level 0: metres, or millimetres in the first placement.
    pub units: f64,
}

impl Csv {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a recording");
        let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(split);
        Self {
            names: lines.next().expect("a header"),
            rows: lines.collect(),
            units: [parameters(&text, "cell_m"), parameters(&text, "cell_mm")]
                .concat()
                .first()
                .copied()
                .expect("settings"),
            scales: parameters(&text, "cell_mm")
                .into_iter()
                .zip(parameters(&text, "height_mm_per_unit"))
                .map(|(cell, height)| [cell, height])
                .collect(),
        }
    }

    pub fn number(&self, row: usize, name: &str) -> f64 {
        let column = self.names.iter().position(|column| column == name);
        self.rows[row][column.expect(name)]
            .parse()
            .expect("a number")
    }

    /// Returns the rows by their time, ns.
    fn rows_by_time(&self) -> BTreeMap<i64, usize> {
        let time = |row| (self.number(row, "t_s") * 1e9).round() as i64;
        (0..self.rows.len()).map(|row| (time(row), row)).collect()
    }

    pub fn vector(&self, row: usize, names: [&str; 3]) -> [f64; 3] {
        names.map(|name| self.number(row, name))
    }
}

/// Returns the numbers with this name in the remarks of a recording, in their order.
pub fn parameters(text: &str, name: &str) -> Vec<f64> {
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

/// Checks that every row of the CSV is present, with its time and its values.
pub fn check(csv: &Csv, shown: &BTreeMap<String, Vec<Chunk>>) {
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
    // The hand, at most 60 times a second and at least half of that.
    let seconds = csv.number(count - 1, "t_s") - csv.number(0, "t_s");
    let proxies = places(&shown["/hand/proxy"]);
    let (min_count, max_count) = (30.0 * seconds, 61.0 * seconds + 2.0);
    assert!(
        (min_count..=max_count).contains(&(proxies.len() as f64)),
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

/// Checks that records of several placements are at their positions on the ground: positions and
/// heights of all of them in one scale, and in `stretched` placements the heights of the first.
pub fn check_views(csv: &Csv, shown: &BTreeMap<String, Vec<Chunk>>, stretched: bool) {
    let drawn = places(&shown["/hand/hip"]);
    let heights = scalars(&shown["/plot/height"]);
    let rows = csv.rows_by_time();
    let (mut cells, mut counts) = (None, vec![0; csv.scales.len()]);
    for (time, place) in &drawn {
        let row = rows[time];
        let view = csv.number(row, "view") as usize;
        counts[view] += 1;
        let ([cell, unit], first) = (csv.scales[view], csv.scales[0]);
        let [x, y, z] = csv.vector(row, HIP);
        let upright = match stretched {
            true => z / unit * first[1] / first[0],
            false => z / cell,
        };
        let in_cells = [x / cell, y / cell, upright];
        let place = place[0].map(f64::from);
        let (cells_at, place_at) = *cells.get_or_insert((in_cells, place));
        let [east, north, up] = [0, 1, 2].map(|i| place[i] - place_at[i]);
        let [x, y, z] = [0, 1, 2].map(|i| csv.units * (in_cells[i] - cells_at[i]));
        let off = [east - x, north - y, up - z];
        assert!(
            off.iter().all(|off| off.abs() < 2e-3 * csv.units),
            "row {row}, view {view}: {off:?}"
        );
    }
    assert!(counts.iter().all(|count: &i32| *count > 10), "{counts:?}");
    // Heights are in the file's unit, independent of the exaggeration.
    for (time, values) in &heights {
        let row = rows[time];
        let [_, unit] = csv.scales[csv.number(row, "view") as usize];
        let expected = csv.vector(row, HIP)[2] / unit;
        assert!((values[0] - expected).abs() < 1e-6, "row {row}");
    }
}
