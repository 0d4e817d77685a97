//! Scale bars and coordinates of a recording, compared with the CSV of the same run.

use std::collections::BTreeMap;

use re_chunk::Chunk;
use re_sdk_types::Loggable;
use re_sdk_types::components::{
    HalfSize2D, LineStrip2D, LineStrip3D, Position2D, Position3D, Text,
};

use super::recorded::{Csv, places};

type Shown = BTreeMap<String, Vec<Chunk>>;

const HIP: [&str; 3] = ["x_mm", "y_mm", "z_mm"];
/// Tolerance of single precision, m.
const OFF: f64 = 0.02;
/// Tolerance of coordinates of a file, which are checked to the metre, m; and the share by which a
/// metre of a map may differ from one on the ground.
const ROUNDED: f64 = 0.51;
const MAP_METRE: f64 = 5e-4;

/// Returns the component in a chunk's only row.
fn read<T: Loggable>(chunk: &Chunk, component: &'static str) -> Vec<T> {
    let rows = chunk.components().get_array(component.into());
    let rows = rows.unwrap_or_else(|| panic!("{component} of {:?}", chunk.entity_path()));
    T::from_arrow(&rows.value(0)).expect("what it is called")
}

fn texts(chunk: &Chunk, component: &'static str) -> Vec<String> {
    let texts = read::<Text>(chunk, component).into_iter();
    texts.map(|text| text.0.as_str().to_owned()).collect()
}

/// Returns the length in a label, m.
fn metres(label: &str) -> f64 {
    let (value, unit) = label.split_once(' ').expect("a unit");
    let metres = match unit {
        "km" => 1000.0,
        "m" => 1.0,
        "cm" => 0.01,
        _ => panic!("{label}"),
    };
    metres * value.parse::<f64>().expect("a number")
}

/// Returns the position in a label, m: in the file's coordinates, or from its south-west sample.
fn place(label: &str) -> [f64; 2] {
    let label = label.trim_start_matches(|c: char| c.is_ascii_uppercase() || c == ' ');
    let label = label.strip_suffix(" m").unwrap_or(label);
    let (east, north) = label.split_once(", ").expect("two");
    [east, north].map(|number| number.parse().expect("a number"))
}

fn is_round(length: f64) -> bool {
    let digit = length / 10_f64.powf((length * 1.000_001).log10().floor());
    [1.0, 2.0, 5.0]
        .iter()
        .any(|round| (digit - round).abs() < 1e-6)
}

/// Returns the positions of the CSV's rows, m from the south-west sample, by their time.
fn on_ground(csv: &Csv) -> BTreeMap<i64, [f64; 2]> {
    let rows = 0..csv.rows.len();
    rows.map(|row| {
        let [x, y, _] = csv.vector(row, HIP);
        let [cell, _] = csv.scales[csv.number(row, "view") as usize];
        let time = (csv.number(row, "t_s") * 1e9).round() as i64;
        (time, [x, y].map(|mm| mm / cell * csv.units))
    })
    .collect()
}

/// Checks that scale bars have the length of their labels, which is round, and corners the position
/// of their labels. Returns the lengths of the bars on the terrain, in their order, m.
pub fn check_frames(csv: &Csv, shown: &Shown) -> Vec<f64> {
    let ground = on_ground(csv);
    let (time, hip) = places(&shown["/hand/hip"]).swap_remove(0);
    let origin = [0, 1].map(|axis| ground[&time][axis] - f64::from(hip[0][axis]));
    let base = place(&texts(&shown["/map/corners"][0], "Points2D:labels")[0]);
    let mut lengths = Vec::new();
    for chunk in &shown["/frame/bar"] {
        let strips = read::<LineStrip3D>(chunk, "LineStrips3D:strips");
        let (first, last) = (&strips[0].0, &strips[strips.len() - 1].0);
        let (from, to) = (first[0].0, last[last.len() - 1].0);
        let [east, north, up] = [0, 1, 2].map(|axis| f64::from(to[axis] - from[axis]));
        let label = metres(&texts(chunk, "LineStrips3D:labels")[0]);
        assert!(
            (east - label).abs() < OFF && north == 0.0 && up == 0.0,
            "{label}: {east}"
        );
        assert!(is_round(label), "{label}");
        lengths.push(label);
    }
    for chunk in &shown["/frame/corners"] {
        let at = read::<Position3D>(chunk, "Points3D:positions");
        let labels = texts(chunk, "Points3D:labels");
        assert_eq!((labels.len(), labels[2].as_str()), (3, "N"));
        for (at, label) in at.iter().zip(&labels).take(2) {
            for axis in 0..2 {
                let labelled = place(label)[axis] - base[axis];
                let off = f64::from(at.0.0[axis]) + origin[axis] - labelled;
                assert!(off.abs() < ROUNDED + MAP_METRE * labelled, "{label}: {off}");
            }
        }
    }
    check_map(shown, &ground);
    lengths
}

/// Positions of the map's pixels: metres a pixel, and a pixel with its position, m from the
/// south-west sample.
struct OnMap {
    of_pixel: f64,
    pixel: [f64; 2],
    place: [f64; 2],
}

impl OnMap {
    /// Creates it from the hand's positions on the map and in the CSV.
    fn new(shown: &Shown, ground: &BTreeMap<i64, [f64; 2]>) -> Self {
        let mut pixels = Vec::new();
        for chunk in shown["/map/hip"].iter().filter(|chunk| !chunk.is_static()) {
            let (_, times) = chunk.timelines().iter().next().expect("a timeline");
            let rows = chunk.components().get_array("Points2D:positions".into());
            let rows = rows.expect("places");
            for (i, time) in times.times_raw().iter().enumerate() {
                let at = Position2D::from_arrow(&rows.value(i)).expect("a place");
                pixels.push((ground[time], at[0].0.0.map(f64::from)));
            }
        }
        pixels.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]));
        let ((place, pixel), (east, at)) = (pixels[0], pixels[pixels.len() - 1]);
        let of_pixel = (east[0] - place[0]) / (at[0] - pixel[0]);
        Self {
            of_pixel,
            pixel,
            place,
        }
    }

    /// Pixels count to the east and to the south.
    fn place(&self, pixel: [f64; 2]) -> [f64; 2] {
        let [right, down] = [0, 1].map(|axis| self.of_pixel * (pixel[axis] - self.pixel[axis]));
        [self.place[0] + right, self.place[1] - down]
    }
}

/// Returns west, south, east and north of the outline in front of the arm on the map, m from the
/// south-west sample.
pub fn stick_sides(csv: &Csv, shown: &Shown) -> [f64; 4] {
    let map = OnMap::new(shown, &on_ground(csv));
    let boxes = &shown["/map/laid"][0];
    let [middle] = read::<Position2D>(boxes, "Boxes2D:centers")[..] else {
        panic!("one box")
    };
    let half = read::<HalfSize2D>(boxes, "Boxes2D:half_sizes")[0].0.0;
    let corner = |side: [f32; 2]| {
        map.place([0, 1].map(|axis| f64::from(middle.0.0[axis] + side[axis] * half[axis])))
    };
    let ([west, south], [east, north]) = (corner([-1.0, 1.0]), corner([1.0, -1.0]));
    [west, south, east, north]
}

fn check_map(shown: &Shown, ground: &BTreeMap<i64, [f64; 2]>) {
    let of_pixel = OnMap::new(shown, ground).of_pixel;
    let bar = &shown["/map/bar"][0];
    let strip = &read::<LineStrip2D>(bar, "LineStrips2D:strips")[0].0;
    let length = of_pixel * f64::from(strip[1].0[0] - strip[0].0[0]);
    let label = metres(&texts(bar, "LineStrips2D:labels")[0]);
    assert!(
        (length / label - 1.0).abs() < 1e-3 && is_round(label),
        "{label}: {length}"
    );
    // The first box on the map is at the position of the first frame on the terrain.
    let labels = texts(&shown["/frame/corners"][0], "Points3D:labels");
    let [from, to] = [place(&labels[0]), place(&labels[1])];
    let half = read::<HalfSize2D>(&shown["/map/frame"][0], "Boxes2D:half_sizes");
    for axis in 0..2 {
        let side = of_pixel * 2.0 * f64::from(half[0].0.0[axis]);
        assert!(
            (side - (to[axis] - from[axis])).abs() < 0.002 * side,
            "{side} {labels:?}"
        );
    }
}
