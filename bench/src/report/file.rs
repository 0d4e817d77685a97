//! The CSV file: one row for each terrain, path and variant.

use std::path::Path;

use crate::compare::Row;
use crate::continuity;

/// The columns.
pub const HEADER: [&str; 17] = [
    "terrain",
    "path",
    "variant",
    "family",
    "ns_q1",
    "ns_median",
    "ns_q3",
    "times_plain",
    "error_mean_cells",
    "error_p99_cells",
    "error_max_cells",
    "force_off_mean_deg",
    "force_off_p99_deg",
    "largest_jump_cells",
    "missed_part",
    "unsettled_part",
    "extra_bytes_per_sample",
];

/// Writes all rows; errors are empty if no force was rendered. The changes of the force are last,
/// with the path "force", the ground as their terrain, and no times.
///
/// # Errors
/// If the file cannot be written.
pub fn write_csv(path: &Path, rows: &[Row], changes: &[continuity::Row]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record(HEADER)?;
    for row in rows {
        let mut record = vec![
            row.terrain.clone(),
            row.path.to_owned(),
            row.label.name.to_owned(),
            format!("{:?}", row.label.family).to_lowercase(),
        ];
        record.extend(row.ns.iter().map(f64::to_string));
        record.push(row.ratio.to_string());
        record.extend(match &row.error {
            None => std::array::repeat(String::new()),
            Some(error) => [
                error.mean,
                error.p99,
                error.max,
                error.angle_mean,
                error.angle_p99,
            ]
            .map(|x| x.to_string()),
        });
        let rest = [row.jump, row.missed, row.unconverged, row.label.extra_bytes];
        record.extend(rest.map(|x| x.to_string()));
        writer.write_record(&record)?;
    }
    for row in changes {
        let mut record = vec![String::new(); HEADER.len()];
        record[0] = row.ground.to_owned();
        record[1] = "force".to_owned();
        record[2] = row.label.name.to_owned();
        record[3] = format!("{:?}", row.label.family).to_lowercase();
        record[13] = row.max_change.to_string();
        record[14] = row.missed.to_string();
        record[16] = row.label.extra_bytes.to_string();
        writer.write_record(&record)?;
    }
    Ok(writer.flush()?)
}
