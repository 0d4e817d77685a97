//! Check that a file fits on the disk before it is written.

use std::path::Path;

use super::Synth;
use super::format::WrittenFormat;
use super::rows::{Grid, append_row, write_asc_row};
use crate::output::folder_of;

/// Number of samples whose text length is measured.
const MEASURED_SAMPLES: u32 = 4096;
/// Max compression ratio of Deflate.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// A disk with too little room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it needs {:.1} GB and {:.1} GB are free there", *needed as f64 / 1e9, *free as f64 / 1e9)]
pub struct NoRoom {
    /// Size of the file, or a lower bound, bytes.
    pub needed: u64,
    /// Free bytes on its disk.
    pub free: u64,
}

/// Fails if the folder's file system has less free space than the file needs. If the free space is
/// unknown, or the output is a pipe or device, the check passes.
pub(super) fn check(
    path: &Path,
    format: WrittenFormat,
    synth: &Synth,
    grid: &Grid,
) -> Result<(), NoRoom> {
    let goes_to_a_disk =
        std::fs::metadata(path).is_ok_and(|there| there.is_file()) || !path.exists();
    let Some(free) = goes_to_a_disk.then(|| free_at(path)).flatten() else {
        return Ok(());
    };
    let needed = bytes(format, synth, grid);
    if needed > free {
        return Err(NoRoom { needed, free });
    }
    Ok(())
}

fn free_at(path: &Path) -> Option<u64> {
    let free = fs4::available_space(folder_of(path));
    free.inspect_err(|error| tracing::debug!("free space is unknown: {error}"))
        .ok()
}

/// Returns the size of the file: exact except for the header as a GeoTIFF, from the length of the
/// first samples as text, and a lower bound by the best compression as a PNG.
fn bytes(format: WrittenFormat, synth: &Synth, grid: &Grid) -> u64 {
    let samples = u64::from(grid.columns) * u64::from(grid.rows);
    match format {
        WrittenFormat::GeoTiff => samples.saturating_mul(size_of::<f32>() as u64),
        WrittenFormat::EsriAscii => {
            let columns = grid.columns.min(MEASURED_SAMPLES);
            let mut row = Vec::new();
            append_row(synth, columns, grid.rows / 2, &mut row);
            let mut text = Vec::new();
            // Writing to a vector cannot fail.
            let _ = write_asc_row(&mut text, &row);
            let text = text.len() as u128;
            (u128::from(samples) * text / u128::from(columns.max(1)))
                .try_into()
                .unwrap_or(u64::MAX)
        }
        WrittenFormat::Png => samples.saturating_mul(size_of::<u16>() as u64) / MAX_DEFLATE_RATIO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Kind, write};

    /// Returns the predicted and the real size of a file.
    fn predicted_and_real_bytes(name: &str, kind: Kind) -> (u64, u64) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        let synth = Synth::new(kind, 3, 500.0);
        let grid = Grid {
            columns: 300,
            rows: 200,
            cell_m: 10.0,
        };
        write(&path, &synth, &grid, &mut || true).expect("written");
        let format = match name {
            "a.tif" => WrittenFormat::GeoTiff,
            "a.asc" => WrittenFormat::EsriAscii,
            _ => WrittenFormat::Png,
        };
        let length = std::fs::metadata(&path).expect("there").len();
        (bytes(format, &synth, &grid), length)
    }

    #[test]
    fn size_estimate_matches_the_written_file() {
        for kind in [Kind::Fractal, Kind::Plane, Kind::Steps] {
            let (foretold, length) = predicted_and_real_bytes("a.tif", kind);
            assert!(
                length >= foretold && length < foretold + 4000,
                "{foretold} {length}"
            );
            let (foretold, length) = predicted_and_real_bytes("a.asc", kind);
            let ratio = foretold as f64 / length as f64;
            assert!((0.7..1.4).contains(&ratio), "{foretold} {length}");
            let (foretold, length) = predicted_and_real_bytes("a.png", kind);
            assert!(foretold <= length, "{foretold} {length}");
        }
    }

    #[test]
    fn oversized_output_is_refused_without_leaving_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let grid = Grid {
            columns: 4_000_000_000,
            rows: 4_000_000_000,
            cell_m: 10.0,
        };
        let synth = Synth::new(Kind::Plane, 1, 10.0);
        for name in ["a.tif", "a.asc", "a.png"] {
            let path = folder.path().join(name);
            let error = write(&path, &synth, &grid, &mut || true).expect_err("no such disk");
            let text = error.to_string();
            assert!(
                text.contains(name) && text.contains("GB are free"),
                "{text}"
            );
        }
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 0);
    }

    #[test]
    fn interrupted_write_keeps_the_existing_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.tif");
        std::fs::write(&path, "before").expect("written");
        let grid = Grid {
            columns: 100,
            rows: 100,
            cell_m: 10.0,
        };
        let mut rows = 0;
        let mut should_continue = || {
            rows += 1;
            rows < 50
        };
        let synth = Synth::new(Kind::Plane, 1, 10.0);
        write(&path, &synth, &grid, &mut should_continue).expect_err("interrupted");
        assert_eq!(std::fs::read(&path).expect("there"), b"before");
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1);
    }
}
