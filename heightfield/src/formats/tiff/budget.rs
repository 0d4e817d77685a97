//! Check that a file can contain the samples in its header, before memory is allocated.

use super::layout::Layout;
use super::unpack;
use crate::RasterError;
use crate::blocks::Part;

/// Memory for a sparse file's no-data beyond its data, so that a small file cannot fill a machine's
/// memory.
const SPARSE_FLOOR: u64 = 64 << 20;
const SPARSE_RATIO: u64 = 1024;

/// Max size of samples in memory, whatever their compression: more than 16 GB would not fit in a
/// usual machine.
const MAX_BYTES: u64 = 16 << 30;
/// Max size of strips and tiles to decode, as in `tiff-reader`.
const MAX_CHUNK: u64 = 1 << 30;

/// Checks that all samples fit in memory. If not, the file is not damaged: it may be sparse or well
/// compressed.
pub(super) fn check_memory(layout: &Layout) -> Result<(), RasterError> {
    let (columns, rows, bytes) = (layout.columns.into(), layout.rows.into(), layout.bytes());
    let all = Part::whole(layout.columns, layout.rows);
    let is_in_parts = layout.is_plain || unpack::suits_whole_band(layout, &all);
    let is_large = bytes > MAX_BYTES || (layout.chunk_size() > MAX_CHUNK && !is_in_parts);
    let bytes = bytes.max(layout.chunk_size());
    match is_large && layout.of_band().is_some() {
        true => Err(RasterError::TooLarge {
            columns,
            rows,
            gigabytes: bytes.div_ceil(1_000_000_000),
        }),
        false => Ok(()),
    }
}

/// Checks the stated size against the stored bytes. If samples stay in the file, no memory is
/// needed for its no-data.
pub(super) fn check(layout: &Layout, file_bytes: u64, stays: bool) -> Result<(), RasterError> {
    let (columns, rows) = (u64::from(layout.columns), u64::from(layout.rows));
    let absurd = |why: &str| RasterError::AbsurdSize(format!("{columns} × {rows} samples {why}"));
    let has_no_place = || absurd("have no place in its index");
    let (mut missing, mut all, mut inside, mut stored) = (0_u64, 0_u64, 0_u64, 0_u128);
    for (place, bytes) in layout.of_band().ok_or_else(has_no_place)? {
        all += 1;
        missing += u64::from(bytes == 0);
        inside += u64::from(bytes > 0 && place < file_bytes);
        stored += u128::from(bytes);
    }
    if missing == all {
        return Err(RasterError::AllNoData {
            samples: columns * rows,
        });
    }
    if inside == 0 {
        let what = "its index places the samples behind its end".into();
        return Err(RasterError::Truncated(what));
    }
    // These cannot overflow: columns and rows are below 2^32, and a texel has at most 2^19 bytes.
    let ratio = u128::from(layout.compression.1);
    let texel = u128::from(layout.texel_bytes());
    let image = u128::from(columns) * u128::from(rows) * texel;
    let promised = stored.saturating_mul(ratio);
    let in_file = u128::from(file_bytes) * ratio;
    if u128::from(layout.chunk.0) * texel > in_file {
        return Err(absurd("in rows longer than the file"));
    }
    let chunk = u128::from(layout.chunk.0) * u128::from(layout.chunk.1) * texel;
    let omitted = u128::from(missing) * chunk;
    let room = promised.min(in_file) * u128::from(SPARSE_RATIO);
    let no_data_bytes = match stays {
        true => omitted,
        false => omitted.min(room.max(u128::from(SPARSE_FLOOR))),
    };
    if image > promised.saturating_add(no_data_bytes) {
        return Err(absurd("are more than the bytes in its index can contain"));
    }
    if image > in_file.saturating_add(no_data_bytes) {
        return Err(RasterError::Truncated(format!(
            "{columns} × {rows} samples do not fit into its {file_bytes} bytes"
        )));
    }
    Ok(())
}
