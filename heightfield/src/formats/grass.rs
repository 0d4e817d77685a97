//! GRASS ASCII grids (`r.out.ascii`): the edges of the field by name, then numbers.

use std::collections::HashMap;
use std::io::Read;

use crate::decoded::{Decoded, sides};
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::{BadRaster, Samples, beside};

use super::asc::Tokens;

/// GRASS ASCII grids: no extension is theirs alone.
pub(super) const FORMAT: Format = Format {
    name: "GRASS ASCII",
    begins: |head| {
        let mut words = head
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        let first = words.next().map(<[u8]>::to_ascii_lowercase);
        matches!(
            first.as_deref(),
            Some(b"north:" | b"south:" | b"rows:" | b"proj:")
        )
    },
    extensions: &[("grass", Claim::Decides), ("txt", Claim::Suggests)],
    parts: Parts::One,
    decode: |input, _| decode(input),
};

/// Reads a grid. Every sample takes at least a digit and a separator, so the file's
/// length bounds what is allocated.
fn decode(input: &FileBytes) -> Result<Decoded, BadRaster> {
    let mut tokens = Tokens::new(input.reader()?);
    let header = Header::read(&mut tokens)?;
    let size = sides(header.count("cols")?, header.count("rows")?)?;
    let samples = samples(&mut tokens, &header, size, input.len())?;
    let mut decoded = Decoded::new("GRASS ASCII grid".into(), size, Samples::from(samples));
    decoded.scale = header.number("multiplier")?.unwrap_or(1.0);
    beside::reference_system(input, &mut decoded)?;
    let edge = |key: &str| {
        let at = header.coordinate(key)?;
        at.ok_or_else(|| BadRaster::damaged(format!("the header has no {key}")))
    };
    let (north, south, west, east) = (edge("north")?, edge("south")?, edge("west")?, edge("east")?);
    let steps = (
        (east - west) / f64::from(size.0),
        (north - south) / f64::from(size.1),
    );
    let map = GroundMap::from_south_west((west, south), steps, size.1);
    let map = map.filter(|_| steps.0 > 0.0 && steps.1 > 0.0);
    let map = map.ok_or_else(|| BadRaster::damaged("the edges in its header enclose nothing"))?;
    decoded.lay_out(map, None);
    Ok(decoded)
}

fn samples<R: Read>(
    tokens: &mut Tokens<R>,
    header: &Header,
    (columns, rows): (u32, u32),
    file_bytes: u64,
) -> Result<Vec<f32>, BadRaster> {
    let promised = u64::from(columns) * u64::from(rows);
    let possible = promised.min(file_bytes / 2 + 1);
    let mut samples = Vec::with_capacity(usize::try_from(possible).unwrap_or(0));
    let null = header.text("null").unwrap_or("*");
    while let Some(word) = tokens.next()? {
        let held = samples.len() as u64;
        if held == promised {
            return Err(BadRaster::damaged(format!(
                "more numbers than the {columns} × {rows} of its header: '{word}' follows the last"
            )));
        }
        let height = match word {
            word if word == null || word == "*" => f32::NAN,
            word => word.parse().map_err(|_| {
                let (row, column) = (held / u64::from(columns), held % u64::from(columns));
                BadRaster::damaged(format!(
                    "row {row}, column {column}: '{word}' is not a number"
                ))
            })?,
        };
        samples.push(height);
    }
    let held = samples.len() as u64;
    if held < promised {
        return Err(BadRaster::Truncated(format!(
            "its header promises {columns} × {rows} = {promised} numbers, {held} follow"
        )));
    }
    Ok(samples)
}

/// The values by their keys in lower case, without colons.
struct Header(HashMap<String, String>);

impl Header {
    /// Reads keys, which end with a colon, and their values up to the first sample.
    fn read<R: Read>(tokens: &mut Tokens<R>) -> Result<Self, BadRaster> {
        let mut values = HashMap::new();
        while let Some(word) = tokens.next()? {
            let Some(key) = word.strip_suffix(':').map(str::to_lowercase) else {
                tokens.put_back();
                break;
            };
            let Some(value) = tokens.next()? else {
                let what = format!("it ends after the header key '{key}'");
                return Err(BadRaster::Truncated(what));
            };
            values.insert(key, value.to_owned());
        }
        Ok(Self(values))
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, BadRaster> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        let wrong = |_| BadRaster::damaged(format!("header: {key} is '{text}', not a number"));
        text.parse().map(Some).map_err(wrong)
    }

    fn count(&self, key: &str) -> Result<u64, BadRaster> {
        match self.number(key)? {
            Some(count) if count.fract() == 0.0 && (1.0..9e15).contains(&count) => Ok(count as u64),
            Some(count) => Err(BadRaster::damaged(format!("header: {key} is {count}"))),
            None => Err(BadRaster::damaged(format!("the header has no {key}"))),
        }
    }

    /// A number, or degrees as `40:30:15N`.
    fn coordinate(&self, key: &str) -> Result<Option<f64>, BadRaster> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        let (digits, sign) = match text.to_ascii_uppercase().as_str() {
            upper if upper.ends_with(['N', 'E']) => (&text[..text.len() - 1], 1.0),
            upper if upper.ends_with(['S', 'W']) => (&text[..text.len() - 1], -1.0),
            _ => (text, 1.0),
        };
        let parts = digits.split(':').map(|part| part.parse::<f64>());
        let wrong = |_| BadRaster::damaged(format!("header: {key} is '{text}', not a place"));
        let parts: Vec<f64> = parts.collect::<Result<_, _>>().map_err(wrong)?;
        let sixtieths = parts.iter().rev().fold(0.0, |sum, part| sum / 60.0 + part);
        Ok(Some(sign * sixtieths))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CellUnit, Raster};

    fn open(text: &str) -> Result<Raster, BadRaster> {
        let input = FileBytes::unpacked("test.txt", text.as_bytes().to_vec());
        assert!((FORMAT.begins)(&input.head(1024)?));
        Raster::checked(decode(&input)?, None)
    }

    const EDGES: &str = "north: 4299060\nsouth: 4299000\neast: 585090\nwest: 585000\n";

    #[test]
    fn edges_rows_and_nulls() {
        let text = format!("{EDGES}rows: 2\ncols: 3\nnull: -9\ntype: float\n1 2.5 *\n-9 5 6e2\n");
        let raster = open(&text).expect("a grid");
        assert_eq!((raster.columns(), raster.rows()), (3, 2));
        assert_eq!([raster.height(0, 1), raster.height(1, 1)], [1.0, 2.5]);
        assert_eq!(raster.height(2, 0), 600.0);
        assert!(raster.height(2, 1).is_nan() && raster.height(0, 0).is_nan());
        let cell = raster.cell().expect("a cell");
        assert_eq!((cell.east, cell.north), (30.0, 30.0));
        assert_eq!(raster.bounds().expect("placed").west, 585_000.0);
    }

    #[test]
    fn degrees_and_a_multiplier() {
        let text = "north: 40:30N\nsouth: 40:00N\neast: 105:00:00W\nwest: 105:45W\nrows: 2\n\
                    cols: 3\nmultiplier: 0.5\n2 4 6 8 10 12\n";
        let raster = open(text).expect("a grid");
        let cell = raster.cell().expect("a cell");
        assert_eq!(
            (cell.unit, cell.east, cell.north),
            (CellUnit::Degree, 0.25, 0.25)
        );
        assert_eq!(raster.bounds().expect("placed").west, -105.75);
        assert_eq!(raster.summary().highest, 6.0);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let told = |text: &str| open(text).expect_err("refused").to_string();
        let whole = format!("{EDGES}rows: 2\ncols: 2\n");
        assert!(told(&format!("{whole}1 2 3")).contains("3 follow"));
        assert!(told(&format!("{whole}1 2 3 4 5")).contains("more numbers"));
        assert!(told(&format!("{whole}1 2 x 4")).contains("row 1, column 0: 'x'"));
        assert!(told(&format!("{EDGES}rows: 2\n1 2")).contains("no cols"));
        assert!(told(&format!("{EDGES}rows: 2\ncols: 4000000000\n1 2")).contains("truncated"));
        assert!(told(&format!("{EDGES}rows: 2\ncols: 1e30\n1 2")).contains("cols is"));
        let inverted = "north: 0\nsouth: 9\neast: 5\nwest: 1\nrows: 2\ncols: 2\n1 2 3 4";
        assert!(told(inverted).contains("enclose nothing"));
        assert!(told("rows: 2\ncols: 2\n1 2 3 4").contains("no north"));
        assert!(told(&format!("{EDGES}rows:")).contains("ends after"));
    }
}
