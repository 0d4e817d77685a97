//! Costs of streaming, as a table and as a CSV file.

use std::path::Path;

use crate::streaming::{Row, SPEEDS};

/// The columns of the CSV file: the fields of a [`Row`].
pub const STREAMING_HEADER: [&str; 35] = [
    "terrain",
    "reading",
    "latency_ms",
    "link_kb_per_s",
    "samples",
    "open_ms",
    "first_force_ms",
    "peak_mb",
    "open_requests",
    "open_bytes",
    "way_requests",
    "way_bytes",
    "straight_cells",
    "turning_cells",
    "tiles",
    "tile_bytes_mean",
    "tile_bytes_p99",
    "tiles_per_s",
    "host_ms_mean",
    "host_ms_worst",
    "held_straight",
    "held_turning",
    "missing_straight_500",
    "missing_straight_2000",
    "missing_straight_5000",
    "missing_turning_500",
    "missing_turning_2000",
    "missing_turning_5000",
    "coarse_straight_500",
    "coarse_straight_2000",
    "coarse_straight_5000",
    "coarse_turning_500",
    "coarse_turning_2000",
    "coarse_turning_5000",
    "no_data_over_fallback",
];

/// Writes all rows.
///
/// # Errors
/// If the file cannot be written.
pub fn write_streaming(path: &Path, rows: &[Row]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(writer.flush()?)
}

/// Returns the two heading lines of the table.
#[must_use]
pub fn streaming_head() -> String {
    let [slow, usual, fast] = SPEEDS;
    let names = line(
        [
            "terrain",
            "read",
            "late ms",
            "link kB/s",
            "open ms",
            "1st force",
            "peak MB",
            "requests",
            "kB",
            "B/tile",
            "p99",
            "tiles/s",
            "host ms",
            "held",
            "turning",
            "missing ticks",
            "coarse ticks",
            "no-data",
        ]
        .map(str::to_owned),
    );
    format!(
        "held: highest sustained speed of the hand, cells/s, straight and turning; missing: ticks without their terrain at {slow}, {usual} \
         and {fast} cells/s, straight / turning; coarse: the same ticks over a fallback; no-data: ticks without terrain over a fallback\n{names}"
    )
}

/// Joins the columns of a line.
fn line(columns: [String; 18]) -> String {
    let [
        terrain,
        read,
        late,
        link,
        open,
        first,
        peak,
        requests,
        kb,
        mean,
        p99,
        tiles,
        host,
        held,
        turning,
        missing,
        coarse,
        no_data,
    ] = columns;
    format!(
        "  {terrain:<18} {read:<6} {late:>7} {link:>9} | {open:>8} {first:>9} | {peak:>7} | {requests:>8} {kb:>7} \
         | {mean:>6} {p99:>5} {tiles:>7} {host:>7} | {held:>6} {turning:>7} \
         | {missing:<29} | {coarse:<29} {no_data:>7}"
    )
}

/// Returns a row as a line of the table.
#[must_use]
pub fn streaming(row: &Row) -> String {
    let sum = |a: Option<u64>, b: Option<u64>| Some(a? + b.unwrap_or(0));
    let kb = sum(row.open_bytes, row.way_bytes).map(|bytes| bytes as f64 / 1e3);
    let counts = |paths: [[Option<u32>; 3]; 2]| {
        let counts = paths.map(|path| path.map(|count| formatted(count, 0)).join(" "));
        counts.join(" / ")
    };
    line([
        row.terrain.clone(),
        row.reading.name().to_owned(),
        row.latency_ms.to_string(),
        row.link_kb_per_s.to_string(),
        formatted(Some(row.open_ms), 1),
        formatted(Some(row.first_force_ms), 1),
        formatted(row.peak_mb, 0),
        formatted(sum(row.open_requests, row.way_requests), 0),
        formatted(kb, 0),
        formatted(row.tile_bytes_mean, 0),
        formatted(row.tile_bytes_p99, 0),
        formatted(row.tiles_per_s, 0),
        formatted(row.host_ms_mean, 2),
        formatted(row.held_straight, 0),
        formatted(row.held_turning, 0),
        counts(row.missing()),
        counts(row.coarse()),
        formatted(row.no_data_over_fallback, 0),
    ])
}

/// Formats a figure with this many decimals, or a dash if there is none.
fn formatted<T: Figure>(value: Option<T>, decimals: usize) -> String {
    value.map_or("–".to_owned(), |value| {
        format!("{:.decimals$}", value.number())
    })
}

/// A number of a row.
trait Figure {
    /// Returns it as a float, which represents every count of a row exactly.
    fn number(self) -> f64;
}

impl Figure for f64 {
    fn number(self) -> f64 {
        self
    }
}

impl Figure for u32 {
    fn number(self) -> f64 {
        self.into()
    }
}

impl Figure for u64 {
    fn number(self) -> f64 {
        self as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streaming::Reading;

    #[test]
    fn file_has_the_documented_columns() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("streaming.csv");
        let row = Row {
            terrain: "1024 × 1024".into(),
            reading: Reading::Whole,
            samples: 1 << 20,
            open_ms: 3.25,
            ..Row::default()
        };
        write_streaming(&path, std::slice::from_ref(&row)).expect("written");
        let mut table = csv::Reader::from_path(path).expect("there");
        assert_eq!(table.headers().expect("a header"), &STREAMING_HEADER[..]);
        let read: Row = table.deserialize().next().expect("one").expect("a row");
        assert_eq!(read, row);
        let line = streaming(&row);
        assert!(
            line.contains("whole") && line.contains("– – – / – – –"),
            "{line}"
        );
        // A heading is as wide as its column.
        let head = streaming_head();
        let bars = |line: &str| -> Vec<usize> {
            let at = line.chars().enumerate().filter(|(_, c)| *c == '|');
            at.map(|(at, _)| at).collect()
        };
        assert_eq!(bars(head.lines().last().expect("two")), bars(&line));
    }
}
