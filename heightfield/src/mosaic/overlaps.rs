//! Comparison of the heights of files that overlap.

use std::collections::BTreeMap;

use super::super::RasterError;
use super::super::blocks::Part;
use super::reader::Mosaic;
use super::source::Source;
use crate::remote::is_url;

/// Max number of neighbours' pairs to compare, evenly spread; pairs on the same samples are all
/// compared.
const MAX_PAIRS: usize = 8;
/// Max number of comparisons in the search for pairs.
const MAX_COMPARISONS: usize = 1 << 22;
/// Overlaps of up to `FEW_SAMPLES` are compared whole, larger ones at `MAX_PLACES_PER_AXIS`
/// positions per direction.
const FEW_SAMPLES: u64 = 4096;
const MAX_PLACES_PER_AXIS: u32 = 5;
/// Max difference of equal heights, in the file's unit, and as a share of the height.
const SAME: f64 = 1e-3;
const SAME_SHARE: f64 = 1e-5;

/// Two files with different heights at the same positions.
struct Disagreement {
    /// Their numbers.
    files: [usize; 2],
    /// True if both have all their samples at the same positions.
    is_on_same_samples: bool,
    /// Number of positions with heights in both, and how many of them differ.
    compared: u32,
    different: u32,
    /// The max difference.
    max_difference: f64,
}

impl Mosaic {
    /// Returns remarks on files whose heights differ in an overlap.
    ///
    /// # Errors
    /// [`RasterError::SamePlace`] if both have the same samples.
    pub(super) fn remark_differences(&self) -> Result<Vec<String>, RasterError> {
        const MAX_NAMED: usize = 3;
        let found = self.disagreements()?;
        let path = |number: usize| &self.sources[number].path;
        if let Some(same) = found.iter().find(|it| it.is_on_same_samples) {
            return Err(RasterError::SamePlace {
                files: same.files.map(|number| path(number).clone()),
                difference: same.max_difference,
            });
        }
        let named = found.iter().take(MAX_NAMED);
        Ok(named
        .map(|it| {
            let [one, other] = it.files.map(|number| {
                let name = path(number).file_name().unwrap_or_default();
                name.to_string_lossy().into_owned()
            });
            format!(
                "{one} and {other} overlap and differ there by up to {} ({} of {} places compared): {other} is used",
                it.max_difference, it.different, it.compared
            )
        })
        .collect())
    }

    /// Compares files on disk that overlap.
    ///
    /// # Errors
    /// Files that cannot be read at present.
    fn disagreements(&self) -> Result<Vec<Disagreement>, RasterError> {
        let mut found = Vec::new();
        for pair in chosen_pairs(&self.sources) {
            found.extend(self.compared(pair)?.filter(|it| it.different > 0));
        }
        Ok(found)
    }

    /// Compares two files; `None` if one cannot be read.
    fn compared(&self, files: [usize; 2]) -> Result<Option<Disagreement>, RasterError> {
        let sources = files.map(|number| &self.sources[number]);
        let mut opened = Vec::new();
        for (number, source) in files.into_iter().zip(sources) {
            let Some(file) = self.opened(number, source)? else {
                return Ok(None);
            };
            opened.push(file);
        }
        let mut disagreement = Disagreement {
            files,
            is_on_same_samples: sources[0].covers == sources[1].covers,
            compared: 0,
            different: 0,
            max_difference: 0.0,
        };
        let Some(overlap) = sources[0].overlap(0, &sources[1].covers) else {
            return Ok(None);
        };
        for (column, row) in places(&overlap) {
            let height = |index: usize| {
                let place = sources[index].place([column, row]);
                opened[index].height(0, place)
            };
            let Some((one, other)) = height(0)?.zip(height(1)?) else {
                continue;
            };
            let (difference, size) = ((one - other).abs(), one.abs().max(other.abs()));
            disagreement.compared += 1;
            disagreement.different += u32::from(difference > SAME.max(SAME_SHARE * size));
            disagreement.max_difference = disagreement.max_difference.max(difference);
        }
        Ok(Some(disagreement))
    }
}

/// Returns positions in an overlap: all, or a few evenly spread.
fn places(overlap: &Part) -> Vec<(u32, u32)> {
    let is_small = u64::from(overlap.columns) * u64::from(overlap.rows) <= FEW_SAMPLES;
    let along = |first: u32, count: u32| -> Vec<u32> {
        let chosen = if is_small {
            count
        } else {
            count.min(MAX_PLACES_PER_AXIS)
        };
        let steps = u64::from(chosen.max(2) - 1);
        let at = |index: u32| (u64::from(index) * u64::from(count - 1) / steps) as u32;
        (0..chosen).map(|index| first + at(index)).collect()
    };
    let columns = along(overlap.column, overlap.columns);
    let rows = along(overlap.row, overlap.rows);
    let each = rows
        .iter()
        .flat_map(|row| columns.iter().map(|column| (*column, *row)));
    each.collect()
}

/// Returns pairs of overlapping files: each file with the previous one on the same samples, and
/// some others.
fn chosen_pairs(sources: &[Source]) -> Vec<[usize; 2]> {
    let is_here = |number: &usize| !sources[*number].path.to_str().is_some_and(is_url);
    let mut same: BTreeMap<[u32; 4], usize> = BTreeMap::new();
    let mut chosen = Vec::new();
    let mut order: Vec<usize> = (0..sources.len()).filter(is_here).collect();
    for &number in &order {
        let covers = &sources[number].covers;
        let key = [covers.column, covers.row, covers.columns, covers.rows];
        chosen.extend(same.insert(key, number).map(|previous| [previous, number]));
    }
    order.sort_by_key(|number| sources[*number].covers.column);
    let mut others = Vec::new();
    let mut comparisons = 0;
    for (at, &number) in order.iter().enumerate() {
        let covers = &sources[number].covers;
        for &other in &order[at + 1..] {
            let theirs = &sources[other].covers;
            comparisons += 1;
            if theirs.column >= covers.column + covers.columns || comparisons > MAX_COMPARISONS {
                break;
            }
            if covers != theirs && sources[number].overlap(0, theirs).is_some() {
                others.push([number.min(other), number.max(other)]);
            }
        }
    }
    let step = others.len().div_ceil(MAX_PAIRS).max(1);
    chosen.extend(others.into_iter().step_by(step));
    chosen
}
