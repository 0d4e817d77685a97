//! Images with every 2ᵏ-th sample of a field, for files without overviews.

use super::blocks::{BlockImage, Part, SurveyParts};

/// Side, in samples, of the parts that are read at opening, if a file is not read whole.
const PART_SIDE: u32 = 64;

/// Returns the full image and coarser ones while these have cells; `block` returns the columns and
/// rows of a block of the image with every 2ᵏ-th sample.
pub(super) fn images(size: [u32; 2], block: impl Fn(u32) -> [u32; 2]) -> Vec<BlockImage> {
    let image = |k: u32| {
        let [columns, rows] = size.map(|count| ((count.max(1) - 1) >> k) + 1);
        BlockImage {
            columns,
            rows,
            block: block(k),
            every: Some(1 << k),
            first: [0; 2],
        }
    };
    let has_cells = |image: &BlockImage| image.columns > 1 && image.rows > 1;
    let coarser = (1..31).map(image).take_while(has_cells);
    std::iter::once(image(0)).chain(coarser).collect()
}

/// Aligns the samples of coarse images to the south-west of a file in that order.
pub(super) fn set_order(images: &mut [BlockImage], south_up: bool, east_first: bool) {
    let Some(full) = images.first() else {
        return;
    };
    let last = [full.columns, full.rows].map(|count| count.max(1) - 1);
    for (k, image) in images.iter_mut().enumerate() {
        let remainder = |last: u32, is_turned: bool| if is_turned { last % (1 << k) } else { 0 };
        image.first = [
            remainder(last[0], east_first),
            remainder(last[1], !south_up),
        ];
    }
}

/// Returns parts spread over a full image, `each` per direction.
pub(super) fn spread_parts(full: &BlockImage, each: u32) -> SurveyParts {
    let along = |count: u32, number: u32| {
        let size = PART_SIDE.min(count);
        let last = u64::from(count - size) * u64::from(number) / u64::from(each.max(2) - 1);
        (last as u32, size)
    };
    let numbers = (0..each).flat_map(|row| (0..each).map(move |column| (column, row)));
    let parts = numbers.map(|(column, row)| {
        let (column, columns) = along(full.columns, column);
        let (row, rows) = along(full.rows, row);
        Part {
            column,
            row,
            columns,
            rows,
        }
    });
    SurveyParts {
        image: 0,
        parts: parts.collect(),
    }
}
