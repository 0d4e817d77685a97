//! Where the image lies: cell size, units, which way is north.

use geotiff_core::geokeys::{
    GEODETIC_CRS_TYPE, GEOG_ANGULAR_UNITS, GT_MODEL_TYPE, GT_RASTER_TYPE, GeoKeyDirectory,
    PROJ_LINEAR_UNITS, PROJECTED_CRS_TYPE, VERTICAL_CS_TYPE, VERTICAL_UNITS,
};
use geotiff_core::transform::GeoTransform;
use tiff_reader::Ifd;

use crate::raster::decoded::Decoded;
use crate::raster::{CellSize, CellUnit, Certainty, GroundTransform, crs};

const MODEL_PIXEL_SCALE: u16 = 33550;
const MODEL_TIEPOINT: u16 = 33922;
const MODEL_TRANSFORMATION: u16 = 34264;
const GEO_KEY_DIRECTORY: u16 = 34735;
const GEO_DOUBLE_PARAMS: u16 = 34736;

/// Sines below this are rounding, not a rotation.
const STRAIGHT: f64 = 1e-6;

/// Sets cell size, units and orientation as far as the file states them.
pub(super) fn apply(image: &Ifd, decoded: &mut Decoded) {
    let keys = GeoKeys::read(image);
    apply_vertical(&keys, decoded);
    decoded.epsg = keys.projected().or_else(|| keys.known(GEODETIC_CRS_TYPE));
    let Some(grid) = GroundMap::read(image) else {
        return;
    };
    decoded.format = decoded.format.replacen("TIFF", "GeoTIFF", 1);
    if grid.is_straight() {
        decoded.east_first = grid.0.pixel_width < 0.0;
        decoded.south_up = grid.0.pixel_height > 0.0;
    } else {
        // Felt along its own rows and columns; only a mirror image is turned.
        let GroundMap(map) = &grid;
        decoded.south_up = map.pixel_width * map.pixel_height - map.skew_x * map.skew_y > 0.0;
        decoded.remarks.push(format!(
            "the grid is rotated by {:.1}° against east: x runs along its rows, not to the east",
            map.skew_y.atan2(map.pixel_width).to_degrees()
        ));
    }
    decoded.ground = grid.of_samples(keys.code(GT_RASTER_TYPE) == Some(POINTS));
    let mut cell = grid.cell(&keys, decoded.columns, decoded.rows);
    cell.lean = grid.lean(decoded.south_up);
    if let Some(scale) = grid.map_scale(&keys, &cell, (decoded.columns, decoded.rows)) {
        cell.map_scale = scale;
    }
    decoded.cell = Some(cell);
}

/// The vertical unit, by its own code or by that of the vertical reference system;
/// depths become heights.
fn apply_vertical(keys: &GeoKeys, decoded: &mut Decoded) {
    let system = keys.code(VERTICAL_CS_TYPE).and_then(crs::vertical);
    let stated = keys.code(VERTICAL_UNITS).and_then(metres_of_code);
    decoded.metres_per_vertical_unit = stated.or(system.as_ref().map(|system| system.metres));
    if let Some(system) = system.filter(|system| system.is_depth) {
        decoded.turn_depths_into_heights(&system.name);
    }
}

/// The map from column and row to ground coordinates.
struct GroundMap(GeoTransform);

impl GroundMap {
    /// A negative step of the scale stays one: such files are south-up.
    fn read(image: &Ifd) -> Option<Self> {
        let numbers = |tag| numbers(image, tag);
        let grid = Self(
            match (
                numbers(MODEL_TRANSFORMATION).as_slice(),
                numbers(MODEL_PIXEL_SCALE).as_slice(),
                numbers(MODEL_TIEPOINT).as_slice(),
            ) {
                (&[a, b, _, x, d, e, _, y, ..], _, _) => transform([x, a, b], [y, d, e]),
                (_, &[east, north, ..], &[column, row, _, x, y, ..]) => transform(
                    [x - column * east, east, 0.0],
                    [y + row * north, 0.0, -north],
                ),
                (_, &[east, north, ..], _) => transform([0.0, east, 0.0], [0.0, 0.0, -north]),
                _ => return None,
            },
        );
        let (corner, steps) = (grid.0.pixel_to_geo(0.0, 0.0), grid.steps());
        let finite = [corner, steps]
            .iter()
            .all(|(x, y)| x.is_finite() && y.is_finite());
        (finite && steps.0 > 0.0 && steps.1 > 0.0).then_some(grid)
    }

    /// The same from a sample's column and row to its own place: in the middle of its
    /// pixel, unless the file's coordinates are those of points.
    fn of_samples(&self, points: bool) -> Option<GroundTransform> {
        let map = &self.0;
        let middle = if points { 0.0 } else { 0.5 };
        let origin = map.pixel_to_geo(middle, middle);
        GroundTransform::new(
            origin.into(),
            [map.pixel_width, map.skew_y],
            [map.skew_x, map.pixel_height],
        )
    }

    /// Distance between columns, and between rows.
    fn steps(&self) -> (f64, f64) {
        let grid = &self.0;
        (
            grid.pixel_width.hypot(grid.skew_y),
            grid.skew_x.hypot(grid.pixel_height),
        )
    }

    fn is_straight(&self) -> bool {
        let (east, south) = self.steps();
        self.0.skew_y.abs() <= STRAIGHT * east && self.0.skew_x.abs() <= STRAIGHT * south
    }

    /// Cosine of the angle between a row and a column northwards; `south_up` as the
    /// rows are stored.
    fn lean(&self, south_up: bool) -> f64 {
        let (map, (east, south)) = (&self.0, self.steps());
        let along = map.pixel_width * map.skew_x + map.skew_y * map.pixel_height;
        match self.is_straight() {
            true => 0.0,
            false if south_up => along / (east * south),
            false => -along / (east * south),
        }
    }

    /// Ground metres in a metre of the map along rows and columns, where the
    /// projection is known by a code.
    fn map_scale(&self, keys: &GeoKeys, cell: &CellSize, size: (u32, u32)) -> Option<(f64, f64)> {
        let CellUnit::Length { metres } = cell.unit else {
            return None;
        };
        let middle = (f64::from(size.0) / 2.0, f64::from(size.1) / 2.0);
        let place = self.0.pixel_to_geo(middle.0, middle.1);
        let (x, y) = crs::local_metres(keys.projected()?, place)?;
        // Along a row and a column, which need not be along x and y.
        let along = |dx: f64, dy: f64| (x * dx).hypot(y * dy) / dx.hypot(dy) / metres;
        let map = &self.0;
        Some((
            along(map.pixel_width, map.skew_y),
            along(map.skew_x, map.pixel_height),
        ))
    }

    fn cell(&self, keys: &GeoKeys, columns: u32, rows: u32) -> CellSize {
        let (east, north) = self.steps();
        let (columns, rows) = (f64::from(columns), f64::from(rows));
        match keys.unit() {
            Some((unit @ CellUnit::Length { .. }, _)) => CellSize {
                certainty: keys.certainty(),
                ..CellSize::stated((east, north), unit, None)
            },
            Some((CellUnit::Degree, degrees)) => {
                let (_, latitude) = self.0.pixel_to_geo(columns / 2.0, rows / 2.0);
                let sides = (east * degrees, north * degrees);
                CellSize::stated(sides, CellUnit::Degree, Some(latitude * degrees))
            }
            None => {
                let corners = [
                    self.0.pixel_to_geo(0.0, 0.0),
                    self.0.pixel_to_geo(columns, rows),
                ];
                let west = corners[0].0.min(corners[1].0);
                let south = corners[0].1.min(corners[1].1);
                let extent = (east * columns, north * rows);
                CellSize::guessed((east, north), Some((west, south)), extent)
            }
        }
    }
}

/// Of x and y: the origin, the step from column to column and from row to row.
fn transform(x: [f64; 3], y: [f64; 3]) -> GeoTransform {
    GeoTransform {
        origin_x: x[0],
        pixel_width: x[1],
        skew_x: x[2],
        origin_y: y[0],
        skew_y: y[1],
        pixel_height: y[2],
    }
}

fn numbers(image: &Ifd, tag: u16) -> Vec<f64> {
    let tag = image.tag(tag);
    tag.and_then(|tag| tag.value.as_f64_vec())
        .unwrap_or_default()
}

/// Values of [`GT_MODEL_TYPE`].
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;
/// Value of [`GT_RASTER_TYPE`] for samples that are points, not areas.
const POINTS: u16 = 2;
/// The key of a linear unit's size in metres, where the unit has no code.
const LINEAR_UNIT_SIZE: u16 = 3077;

/// The GeoTIFF keys, if there are any.
struct GeoKeys(Option<GeoKeyDirectory>);

impl GeoKeys {
    fn read(image: &Ifd) -> Self {
        let doubles = numbers(image, GEO_DOUBLE_PARAMS);
        let directory = image.tag(GEO_KEY_DIRECTORY);
        let directory = directory.and_then(|tag| tag.value.as_u16_slice());
        Self(directory.and_then(|keys| GeoKeyDirectory::parse(keys, &doubles, "")))
    }

    fn code(&self, key: u16) -> Option<u16> {
        self.0.as_ref()?.get_short(key)
    }

    fn number(&self, key: u16) -> Option<f64> {
        self.0.as_ref()?.get_double(key)?.first().copied()
    }

    /// EPSG code of the projected reference system.
    fn projected(&self) -> Option<u16> {
        self.known(PROJECTED_CRS_TYPE)
    }

    /// A code that is one of EPSG's.
    fn known(&self, key: u16) -> Option<u16> {
        const USER_DEFINED: u16 = 32767;
        self.code(key).filter(|code| *code != USER_DEFINED)
    }

    /// Metres in the linear unit, where the file states it.
    fn stated_metres(&self) -> Option<f64> {
        let named = self.code(PROJ_LINEAR_UNITS).and_then(metres_of_code);
        let metres = named.or(self.number(LINEAR_UNIT_SIZE));
        metres.filter(|metres| metres.is_finite() && *metres > 0.0)
    }

    /// Where the linear unit comes from.
    fn certainty(&self) -> Certainty {
        match self.projected().and_then(crs::metres_per_unit) {
            _ if self.stated_metres().is_some() => Certainty::Stated,
            Some(_) => Certainty::FromCode,
            None => Certainty::UnitAssumed,
        }
    }

    /// The unit of the ground coordinates; of an angle, also its size in degrees.
    fn unit(&self) -> Option<(CellUnit, f64)> {
        let projected = match self.code(GT_MODEL_TYPE) {
            Some(PROJECTED) => true,
            Some(GEOGRAPHIC) => false,
            _ if self.code(PROJECTED_CRS_TYPE).is_some() => true,
            _ if self.code(GEODETIC_CRS_TYPE).is_some() => false,
            _ => return None,
        };
        if projected {
            let of_system = || self.projected().and_then(crs::metres_per_unit);
            let metres = self.stated_metres().or_else(of_system).unwrap_or(1.0);
            return Some((CellUnit::Length { metres }, 1.0));
        }
        let degrees = match self.code(GEOG_ANGULAR_UNITS) {
            Some(9101) => 1.0_f64.to_degrees(),
            Some(9103) => 1.0 / 60.0,
            Some(9104) => 1.0 / 3600.0,
            Some(9105 | 9106) => 0.9,
            _ => 1.0,
        };
        Some((CellUnit::Degree, degrees))
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
