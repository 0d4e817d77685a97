//! World files: six numbers in a text beside a picture, which define the place of its samples.

use super::text;
use crate::RasterError;
use crate::decoded::Decoded;
use crate::ground_map::GroundMap;
use crate::input::{Data, FileBytes};

/// Sets the place from the world file beside a file, and from its `.prj`, if any. `own` are the
/// extensions of the format's world files; `.wld` is for all formats.
///
/// The numbers, one per line, are: x per column, y per column, x per row, y per row, x and y of the
/// centre of the first sample.
pub(crate) fn apply_world_file(
    input: &FileBytes,
    own: &[&'static str],
    decoded: &mut Decoded,
) -> Result<(), RasterError> {
    if let Some((map, name)) = find(input, own)? {
        super::reference_system(input, decoded)?;
        decoded.set_layout(map, None);
        decoded.format += &format!(", placed by {name}");
    }
    Ok(())
}

/// Adds a remark if a world file beside a file on disk contradicts the file's own place.
pub(crate) fn remark_other_place(input: &FileBytes, own: &[&'static str], decoded: &mut Decoded) {
    if let (Data::File(..), Some(place)) = (input.data(), decoded.place)
        && let Ok(Some((map, name))) = find(input, own)
        && !map.is_near(&place.map)
    {
        decoded.remarks.push(format!(
            "place: the file and {name} beside it differ; the former is used"
        ));
    }
}

/// Returns the map of the world file beside a file, and the world file's name.
fn find(
    input: &FileBytes,
    own: &[&'static str],
) -> Result<Option<(GroundMap, String)>, RasterError> {
    let extensions = || own.iter().copied().chain(["wld"]);
    super::prefetch_files(input, extensions());
    for extension in extensions() {
        let Some((text, name)) = text(input, extension)? else {
            continue;
        };
        let map = read(&text).ok_or_else(|| {
            RasterError::damaged(format!(
                "{name} beside it is no world file: six numbers are required, the steps not zero"
            ))
        })?;
        return Ok(Some((map, name)));
    }
    Ok(None)
}

fn read(text: &str) -> Option<GroundMap> {
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|word| word.replace(',', ".").parse().ok())
        .collect::<Option<_>>()?;
    match numbers.as_slice() {
        &[column_x, column_y, row_x, row_y, x, y] => {
            GroundMap::from_centre([x, column_x, row_x], [y, column_y, row_y])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_numbers_place_the_centre_of_the_first_sample() {
        let map = read("10\r\n0\r\n0\r\n-20,0\r\n505\r\n190\r\n").expect("a world file");
        assert_eq!(map.at(0.5, 0.5), (505.0, 190.0));
        assert_eq!(map.at(0.0, 0.0), (500.0, 200.0));
        for text in [
            "",
            "1 2 3 4 5",
            "1 0 0 -1 5 5 7",
            "0 0 0 0 5 5",
            "a 0 0 -1 5 5",
        ] {
            assert!(read(text).is_none(), "{text}");
        }
    }
}
