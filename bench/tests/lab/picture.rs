//! The picture of run time against error, from the stored figures.

use std::path::Path;

use hapterra_lab::compare::{Error, Family, Label, Row};
use hapterra_lab::report;

/// Returns the stored figures as measured; names live as long as the program.
fn recorded() -> Vec<Row> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/bench.csv");
    let mut table = csv::Reader::from_path(file).expect("it is kept");
    assert_eq!(table.headers().expect("a header"), &report::HEADER[..]);
    let leak = |text: &str| -> &'static str { Box::leak(text.to_owned().into_boxed_str()) };
    table
        .records()
        .map(|record| record.expect("a row"))
        .filter(|record| !record[5].is_empty())
        .map(|record| {
            let number = |i: usize| record[i].parse::<f64>().expect("a number");
            let family = match &record[3] {
                "ours" => Family::Ours,
                "paper" => Family::Paper,
                "triangles" => Family::Triangles,
                _ => Family::Bound,
            };
            let error = (!record[8].is_empty()).then(|| Error {
                mean: number(8),
                p99: number(9),
                max: number(10),
                angle_mean: number(11),
                angle_p99: number(12),
            });
            Row {
                terrain: record[0].to_owned(),
                path: leak(&record[1]),
                label: Label {
                    name: leak(&record[2]),
                    family,
                    extra_bytes: number(16),
                },
                ns: [number(4), number(5), number(6)],
                ratio: number(7),
                error,
                jump: number(13),
                missed: number(14),
                unconverged: number(15),
            }
        })
        .collect()
}

#[test]
fn picture_is_drawn_from_recorded_figures() {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench.png");
    report::draw(&recorded(), &file).expect("it is drawn");
    let written = std::fs::read(file).expect("it is there");
    assert!(written.starts_with(b"\x89PNG") && written.len() > 20_000);
}
