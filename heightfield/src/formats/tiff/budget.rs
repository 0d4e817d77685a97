//! Check that a file can hold what its header promises, before memory is allocated.

use super::layout::Layout;
use super::unpack;
use crate::RasterError;
use crate::blocks::Part;

/// Room that a sparse file's holes may take beyond its data, so that a small file
/// does not fill a machine's memory with nothing.
const SPARSE_FLOOR: u64 = 64 << 20;
const SPARSE_RATIO: u64 = 1024;

/// More samples than this are not held in memory, however well the file packs them:
/// 16 GB of them would leave a usual machine no room.
const MAX_BYTES: u64 = 16 << 30;
/// Larger strips and tiles are not decoded: as `tiff-reader` has it.
const MAX_CHUNK: u64 = 1 << 30;

/// Checks that a machine can hold all samples. A sparse or well packed file may hold more:
/// that is no damage.
pub(super) fn check_memory(layout: &Layout) -> Result<(), RasterError> {
    let (columns, rows, bytes) = (layout.columns.into(), layout.rows.into(), layout.bytes());
    let all = Part::whole(layout.columns, layout.rows);
    let is_in_parts = layout.is_plain || unpack::suits_whole(layout, &all);
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

/// Checks the promised size against the bytes that are stored for it. Where samples stay in the
/// file no room is made for its holes.
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
        let what = "the samples are said to lie behind its end".into();
        return Err(RasterError::Truncated(what));
    }
    // Both sides of a product are at most 2^32 and a texel at most 2^19 bytes.
    let ratio = u128::from(layout.compression.1);
    let texel = u128::from(layout.texel_bytes());
    let image = u128::from(columns) * u128::from(rows) * texel;
    let promised = stored.saturating_mul(ratio);
    let in_file = u128::from(file_bytes) * ratio;
    if u128::from(layout.chunk.0) * texel > in_file {
        return Err(absurd("in rows longer than the file could hold"));
    }
    let chunk = u128::from(layout.chunk.0) * u128::from(layout.chunk.1) * texel;
    let left_out = u128::from(missing) * chunk;
    let room = promised.min(in_file) * u128::from(SPARSE_RATIO);
    let holes = match stays {
        true => left_out,
        false => left_out.min(room.max(u128::from(SPARSE_FLOOR))),
    };
    if image > promised.saturating_add(holes) {
        return Err(absurd("are more than the bytes in its index can hold"));
    }
    if image > in_file.saturating_add(holes) {
        return Err(RasterError::Truncated(format!(
            "{columns} × {rows} samples do not fit into its {file_bytes} bytes"
        )));
    }
    Ok(())
}
