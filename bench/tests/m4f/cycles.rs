//! The table of cycles on the boards' chips: `bench/cycles.csv`.

use super::table::Row;

/// The kept table.
const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/cycles.csv");
/// More than this share above the kept figure is a regression, as for instructions.
const TOLERANCE: f64 = 1.05;
/// The columns: cycles, of an STM32G474 and of an STM32H743.
pub(crate) const TITLES: [&str; 8] = [
    "state",
    "max instructions",
    "g474 median",
    "g474 p99",
    "g474 max",
    "h743 median",
    "h743 p99",
    "h743 max",
];

/// A row's cells.
pub(crate) fn record(row: &Row) -> Vec<String> {
    let figures = row.cycles.as_flattened().iter();
    let figures = row.counts[2..].iter().chain(figures);
    let cells = [row.state.clone()].into_iter();
    cells.chain(figures.map(ToString::to_string)).collect()
}

/// Writes the table anew.
pub(crate) fn write(rows: &[Row]) {
    let mut table = csv::Writer::from_path(TABLE).expect("the table can be written");
    table.write_record(TITLES).expect("written");
    for row in rows {
        table.write_record(record(row)).expect("written");
    }
}

/// A sentence for each figure that is more than the table allows.
pub(crate) fn worse(rows: &[Row]) -> Vec<String> {
    let mut table = csv::Reader::from_path(TABLE).expect("the table is there");
    let kept: Vec<_> = table.records().map(|row| row.expect("a row")).collect();
    let worse_row = |row: &Row| {
        let record = record(row);
        let Some(kept) = kept.iter().find(|kept| kept[0] == *row.state) else {
            return vec![format!("{}: not in the table", row.state)];
        };
        let number = |text: &str| text.parse::<f64>().expect("a number");
        let is_worse = |i: &usize| number(&record[*i]) > TOLERANCE * number(&kept[*i]);
        let told = |i: usize| {
            let (title, now, kept) = (TITLES[i], &record[i], &kept[i]);
            format!("{}: {title} {now}, {kept} in the table", row.state)
        };
        (1..TITLES.len()).filter(is_worse).map(told).collect()
    };
    rows.iter().flat_map(worse_row).collect()
}
