//! Tests of whole pictures, drawn and read back.

use super::*;
use crate::picture::style::{HIP, PROXY};

fn hills(x: f64, y: f64, _: f64) -> Option<f64> {
    let far = (x - 70.0).hypot(y - 40.0) > 9.0;
    far.then(|| 12.0 * libm::sin(x / 17.0) * libm::cos(y / 13.0))
}

fn walk() -> Vec<Record> {
    (0..4000)
        .map(|i| {
            let t_s = 1e-3 * f64::from(i);
            let (x, y) = (20.0 + 15.0 * t_s, 50.0 + 25.0 * libm::sin(2.0 * t_s));
            let ground = hills(x, y, 0.0).unwrap_or(0.0);
            let depth = 3.0 * libm::sin(3.0 * t_s);
            let contact = depth > 0.0;
            let up = if contact { 0.5 * depth } else { 0.0 };
            Record {
                t_s,
                hip_mm: [x, y, ground - depth],
                proxy_mm: [x, y, ground - if contact { 0.0 } else { depth }],
                force_n: [0.1 * up, 0.0, up],
                contact,
            }
        })
        .collect()
}

fn session<'a>(records: &'a [Record], size_mm: [f64; 2]) -> SessionPicture<'a> {
    SessionPicture {
        title: "Hills",
        subtitles: ["by formula · 1 cell = 1 mm", "by a path"],
        surface: Surface {
            height_mm: &hills,
            size_mm,
            cell_mm: 1.0,
        },
        records,
        facts: &[],
        ground: None,
    }
}

/// Counts pixels of a colour from the first row to before the second.
fn count(canvas: &Canvas, color: plotters::style::RGBColor, rows: [i32; 2]) -> usize {
    count_from(0, canvas, color, rows)
}

/// As `count`, from a column eastwards.
fn count_from(
    column: usize,
    canvas: &Canvas,
    color: plotters::style::RGBColor,
    rows: [i32; 2],
) -> usize {
    let rgb = canvas.to_rgb();
    let pixels = rgb.as_chunks::<3>().0;
    let (first, last) = (rows[0] as usize, rows[1] as usize);
    let part = pixels.chunks(WIDTH_PX as usize).take(last).skip(first);
    let same = |p: &&[u8; 3]| **p == [color.0, color.1, color.2];
    part.flat_map(|row| &row[column..]).filter(same).count()
}

#[test]
fn picture_shows_hip_and_proxy_on_map_and_profile() {
    let samples = walk();
    let canvas = session(&samples, [100.0, 90.0]).draw().expect("drawn");
    let bottom = canvas.size().1.cast_signed();
    let forces = bottom - MARGIN_PX - FORCES_PX;
    let heights = forces - GAP_PX - HEIGHTS_PX;
    let map = [HEADER_PX, heights];
    let profile = [heights, forces];
    for (color, part) in [(HIP, map), (PROXY, map), (HIP, profile), (PROXY, profile)] {
        let count = count(&canvas, color, part);
        assert!(count > 900, "{color:?} in rows {part:?}: {count}");
    }
    assert!(count(&canvas, style::INK, [forces, bottom]) > 900);
    let empty = session(&[], [100.0, 90.0]).draw().expect("drawn");
    assert_eq!(count(&empty, HIP, profile), 0);
}

/// A map of a part shows its position on the whole terrain, whatever the length of the panel.
#[test]
fn partial_map_is_located_on_the_terrain() {
    let samples = walk();
    let rows: Vec<_> = (0..9)
        .map(|i| (format!("fact {i}"), "value".to_owned()))
        .collect();
    let facts = GroundFacts {
        metres_per_mm: Some(2.0),
        place_of: &|east, north| format!("{east}, {north}"),
        lines: &rows,
    };
    for size_mm in [[5000.0, 3000.0], [1000.0, 3000.0], [5000.0, 400.0]] {
        let picture = SessionPicture {
            facts: &rows,
            ground: Some(facts),
            ..session(&samples, size_mm)
        };
        let canvas = picture.draw().expect("drawn");
        let below = HEIGHTS_PX + GAP_PX + FORCES_PX + MARGIN_PX + GAP_PX;
        let heights = canvas.size().1.cast_signed() - below;
        // The frame around the window, below the key and the scale of heights.
        let panel = (MARGIN_PX + LEFT_PX + 1096) as usize;
        let framed = count_from(panel, &canvas, PROXY, [HEADER_PX + 400, heights]);
        assert!(framed > 20, "{size_mm:?}: {framed}");
    }
}

#[test]
fn saved_picture_has_the_drawn_size() {
    let samples = walk();
    let drawn = session(&samples, [5000.0, 3000.0]).draw().expect("drawn");
    let path = std::env::temp_dir().join(format!("hapterra-{}.png", std::process::id()));
    drawn.save(&path).expect("written");
    let file = std::io::BufReader::new(std::fs::File::open(&path).expect("there"));
    let reader = png::Decoder::new(file).read_info().expect("a PNG");
    let info = reader.info();
    assert_eq!((info.width, info.height), drawn.size());
    std::fs::remove_file(&path).expect("removed");
}

#[test]
fn degenerate_sessions_are_drawn() {
    let one = [walk()[0]];
    let still = vec![walk()[0]; 50];
    let mut wild = walk();
    wild[7].hip_mm = [f64::NAN; 3];
    wild[9].force_n = [f64::INFINITY, 0.0, 0.0];
    for samples in [&one[..], &still, &wild] {
        for size in [[100.0, 90.0], [1e5, 2.0], [3.0, 2000.0]] {
            session(samples, size).draw().expect("drawn");
        }
    }
}
