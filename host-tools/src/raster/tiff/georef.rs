//! Where the image lies: cell size, units, which way is north.

use std::collections::HashMap;
use std::io::{Read, Seek};

use tiff::decoder::Decoder;
use tiff::tags::Tag;

use crate::raster::{CellSize, CellUnit, Certainty, Decoded};

/// Sines below this are rounding, not a rotation.
const STRAIGHT: f64 = 1e-6;

/// Sets cell size, units and orientation as far as the file states them.
pub(super) fn apply<R: Read + Seek>(decoder: &mut Decoder<R>, decoded: &mut Decoded) {
    let keys = GeoKeys::read(decoder);
    decoded.metres_per_vertical_unit = keys.code(VERTICAL_UNITS).and_then(metres_of_code);
    let Some(grid) = Grid::read(decoder) else {
        return;
    };
    decoded.format = decoded.format.replacen("TIFF", "GeoTIFF", 1);
    if grid.is_straight() {
        decoded.east_first = grid.east.0 < 0.0;
        decoded.south_up = grid.south.1 > 0.0;
    } else {
        // Felt along its own rows and columns; only a mirror image is turned.
        decoded.south_up = grid.east.0 * grid.south.1 - grid.south.0 * grid.east.1 > 0.0;
        decoded.remarks.push(format!(
            "the grid is rotated by {:.1}° against east: x runs along its rows, not to the east",
            grid.east.1.atan2(grid.east.0).to_degrees()
        ));
    }
    decoded.cell = grid.cell(&keys, decoded.columns, decoded.rows);
}

/// The map from column and row to ground coordinates.
struct Grid {
    origin: (f64, f64),
    /// Step from one column to the next.
    east: (f64, f64),
    /// Step from one row of the file to the next.
    south: (f64, f64),
}

impl Grid {
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Option<Self> {
        let mut numbers = |tag| decoder.get_tag_f64_vec(tag).unwrap_or_default();
        let grid = match (
            numbers(Tag::ModelTransformationTag).as_slice(),
            numbers(Tag::ModelPixelScaleTag).as_slice(),
            numbers(Tag::ModelTiepointTag).as_slice(),
        ) {
            (&[a, b, _, x, d, e, _, y, ..], _, _) => Self {
                origin: (x, y),
                east: (a, d),
                south: (b, e),
            },
            (_, &[east, north, ..], tie) => {
                let (column, row, x, y) = match tie {
                    &[column, row, _, x, y, ..] => (column, row, x, y),
                    _ => (0.0, 0.0, 0.0, 0.0),
                };
                Self {
                    origin: (x - column * east, y + row * north),
                    east: (east, 0.0),
                    south: (0.0, -north),
                }
            }
            _ => return None,
        };
        let all = [grid.origin, grid.east, grid.south];
        let finite = all.iter().all(|(x, y)| x.is_finite() && y.is_finite());
        (finite && grid.steps().0 > 0.0 && grid.steps().1 > 0.0).then_some(grid)
    }

    /// Distance between columns, and between rows.
    fn steps(&self) -> (f64, f64) {
        let length = |(x, y): (f64, f64)| x.hypot(y);
        (length(self.east), length(self.south))
    }

    fn is_straight(&self) -> bool {
        let (east, south) = self.steps();
        self.east.1.abs() <= STRAIGHT * east && self.south.0.abs() <= STRAIGHT * south
    }

    fn at(&self, column: f64, row: f64) -> (f64, f64) {
        (
            self.origin.0 + column * self.east.0 + row * self.south.0,
            self.origin.1 + column * self.east.1 + row * self.south.1,
        )
    }

    fn cell(&self, keys: &GeoKeys, columns: u32, rows: u32) -> Option<CellSize> {
        let (east, north) = self.steps();
        let (columns, rows) = (f64::from(columns), f64::from(rows));
        let middle = self.at(columns / 2.0, rows / 2.0);
        let stated = |unit, latitude| CellSize {
            east,
            north,
            unit,
            latitude,
            certainty: Certainty::Stated,
        };
        Some(match keys.unit() {
            Some(Unit::Length { metres }) => stated(CellUnit::Length { metres }, None),
            Some(Unit::Angle { degrees }) => CellSize {
                east: east * degrees,
                north: north * degrees,
                ..stated(CellUnit::Degree, Some(middle.1 * degrees))
            },
            None => {
                let corners = [self.at(0.0, 0.0), self.at(columns, rows)];
                let west = corners[0].0.min(corners[1].0);
                let south = corners[0].1.min(corners[1].1);
                let extent = (east * columns, north * rows);
                CellSize::guessed((east, north), Some((west, south)), extent)
            }
        })
    }
}

const MODEL_TYPE: u16 = 1024;
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;
const GEOGRAPHIC_SYSTEM: u16 = 2048;
const ANGULAR_UNITS: u16 = 2054;
const PROJECTED_SYSTEM: u16 = 3072;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_UNITS: u16 = 4099;
/// Where a key's number is when it is not in the directory itself.
const DOUBLES: u16 = 34736;

/// The unit of the ground coordinates.
enum Unit {
    Length { metres: f64 },
    Angle { degrees: f64 },
}

/// The GeoTIFF keys with a number.
#[derive(Default)]
struct GeoKeys {
    codes: HashMap<u16, u16>,
    numbers: HashMap<u16, f64>,
}

impl GeoKeys {
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Self {
        let directory = decoder
            .get_tag_u16_vec(Tag::GeoKeyDirectoryTag)
            .unwrap_or_default();
        let doubles = decoder
            .get_tag_f64_vec(Tag::GeoDoubleParamsTag)
            .unwrap_or_default();
        let mut keys = Self::default();
        for entry in directory.chunks_exact(4).skip(1) {
            let (key, place, value) = (entry[0], entry[1], entry[3]);
            if place == 0 {
                keys.codes.insert(key, value);
            } else if let Some(&number) =
                doubles.get(usize::from(value)).filter(|_| place == DOUBLES)
            {
                keys.numbers.insert(key, number);
            }
        }
        keys
    }

    fn code(&self, key: u16) -> Option<u16> {
        self.codes.get(&key).copied()
    }

    fn unit(&self) -> Option<Unit> {
        let projected = match self.code(MODEL_TYPE) {
            Some(PROJECTED) => true,
            Some(GEOGRAPHIC) => false,
            _ if self.code(PROJECTED_SYSTEM).is_some() => true,
            _ if self.code(GEOGRAPHIC_SYSTEM).is_some() => false,
            _ => return None,
        };
        Some(if projected {
            let size = self.numbers.get(&LINEAR_UNIT_SIZE).copied();
            let named = self.code(LINEAR_UNITS).and_then(metres_of_code);
            let metres = named
                .or(size)
                .filter(|&metres| metres.is_finite() && metres > 0.0);
            Unit::Length {
                metres: metres.unwrap_or(1.0),
            }
        } else {
            let degrees = match self.code(ANGULAR_UNITS) {
                Some(9101) => 1.0_f64.to_degrees(),
                Some(9103) => 1.0 / 60.0,
                Some(9104) => 1.0 / 3600.0,
                Some(9105 | 9106) => 0.9,
                _ => 1.0,
            };
            Unit::Angle { degrees }
        })
    }
}

/// Metres in a unit of length by its EPSG code.
fn metres_of_code(code: u16) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => 0.3048,
        9003 => 1200.0 / 3937.0,
        9005 => 0.304_797_265_4,
        9014 => 1.8288,
        9030 => 1852.0,
        9036 => 1000.0,
        1025 => 0.001,
        1033 => 0.01,
        _ => return None,
    })
}
