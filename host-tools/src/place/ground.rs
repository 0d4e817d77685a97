//! The user's coordinates as places in a haptic grid.

use super::coordinates::Coordinates;
use super::error::PlaceError;
use super::place_text::{
    bounds_in_words, box_in_words, own_box_in_words, place_as_given, system_in_words,
};
use crate::terrain::HapticGrid;
use heightfield::{
    Georeference, LonLat, ReadStatus, ReadTracker, ReferenceSystem, Sides, System, around,
};

/// Points along each side of a box in another reference system: its sides are curved on the map.
const ALONG: u32 = 24;
/// Distance of neighbours on a side of a box, as a share of the box, above which they lie on
/// different sides of a map's seam.
const TORN: f64 = 0.5;
/// Tolerance for a place beyond the outermost sample, in samples.
const ON_SAMPLE: f64 = 1e-6;
/// Samples along each side of a box that are read for its lowest and highest point.
const MAX_SAMPLES_PER_SIDE: u32 = 257;

/// Returns a place in the file's coordinates.
pub(super) fn place(
    file: &Georeference<'_>,
    place: [f64; 2],
    coordinates: Coordinates,
) -> Result<[f64; 2], PlaceError> {
    let coordinates = coordinates.of(file);
    if coordinates == Coordinates::Own {
        return Ok(file.nearest_turn(place));
    }
    if matches!(file.system(), System::Cells | System::Unstated) {
        let bounds = bounds_in_words(file);
        return Err(match file.reference() {
            Some(system) if !system.has_lonlat() => PlaceError::NoProjection {
                system: system.name().to_owned(),
                bounds,
            },
            _ => PlaceError::NoSystem { bounds },
        });
    }
    let lonlat = match coordinates {
        Coordinates::Epsg(code) => lonlat_of(file, code, place)?,
        Coordinates::Own | Coordinates::LonLat => place,
    };
    file.of_lonlat(lonlat).ok_or_else(|| {
        match coordinates == Coordinates::LonLat && is_latitude_first(file, lonlat) {
            true => PlaceError::LatitudeFirst(place),
            false => PlaceError::NotOnMap {
                lonlat,
                system: system_in_words(file),
                bounds: bounds_in_words(file),
            },
        }
    })
}

/// Returns the file's longitude and latitude of a place in another reference system.
fn lonlat_of(file: &Georeference<'_>, code: u16, place: [f64; 2]) -> Result<[f64; 2], PlaceError> {
    let system = ReferenceSystem::from_code(code).ok_or(PlaceError::UnknownCode(code))?;
    let is_wgs84 = |kind| matches!(kind, LonLat::Wgs84 | LonLat::ShiftedToWgs84 { .. });
    let is_same = match (system.lonlat(), file.lonlat()) {
        (one, other) if is_wgs84(one) => is_wgs84(other) || other == LonLat::Unstated,
        (one, other) => one == other,
    };
    if !is_same {
        return Err(PlaceError::OtherDatum {
            code,
            system: system_in_words(file),
        });
    }
    let lonlat = system.to_lonlat(place.into());
    let (longitude, latitude) = lonlat.ok_or(PlaceError::NotInSystem { code, place })?;
    Ok([longitude, latitude])
}

/// Returns true if the place lies in the raster after its two numbers are exchanged.
fn is_latitude_first(file: &Georeference<'_>, [one, other]: [f64; 2]) -> bool {
    let [west, south, east, north] = file.bounds();
    let swapped = file.of_lonlat([other, one]);
    swapped.is_some_and(|[x, y]| (west..=east).contains(&x) && (south..=north).contains(&y))
}

/// Returns points around a box, in the file's coordinates.
pub(super) fn outline(
    file: &Georeference<'_>,
    requested: Sides,
    coordinates: Coordinates,
) -> Result<Vec<[f64; 2]>, PlaceError> {
    let coordinates = coordinates.of(file);
    let turn = match (coordinates, file.system()) {
        (Coordinates::LonLat, _) => Some(360.0),
        (Coordinates::Own, System::Geographic { degrees }) => Some(360.0 / degrees),
        (Coordinates::Own | Coordinates::Epsg(_), _) => None,
    };
    let [west, south, mut east, north] = requested;
    if let Some(turn) = turn.filter(|_| west > east) {
        east += turn;
        if let System::Geographic { degrees } = file.system() {
            let [first, _, last, _] = file.bounds();
            // More than half of the globe, for a raster with less.
            if east - west > 0.5 * turn && (last - first) * degrees < 180.0 {
                return Err(PlaceError::WestInTheEast(requested));
            }
        }
    }
    if !(west < east && south < north) {
        return Err(PlaceError::NoBox(box_in_words(requested)));
    }
    let corners = [[west, south], [east, south], [east, north], [west, north]];
    let middle = [0.5 * (west + east), 0.5 * (south + north)];
    let there = place(file, middle, coordinates)?;
    if coordinates == Coordinates::Own {
        let moved = there[0] - middle[0];
        let corners = corners.map(|[x, y]| [x + moved, y]);
        return unwrap_outline(file, requested, corners.to_vec());
    }
    let mut points = Vec::new();
    for side in 0..4 {
        let (from, to) = (corners[side], corners[(side + 1) % 4]);
        for step in 0..ALONG {
            let share = f64::from(step) / f64::from(ALONG);
            let point = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            points.push(match coordinates {
                Coordinates::LonLat => {
                    let found = place(file, within_turn(point), coordinates)?;
                    in_turn_of(file, there, point[0] - middle[0], found)
                }
                _ => place(file, point, coordinates)?,
            });
        }
    }
    match is_torn(&points) {
        true => Err(PlaceError::BoxAcrossSeam {
            place: box_in_words(requested),
            system: system_in_words(file),
        }),
        false => unwrap_outline(file, requested, points),
    }
}

/// Returns the outline of a box in a raster in degrees. A raster around the whole globe has a
/// border, and a box across that border has two parts, of which only one can be placed in front of
/// an arm. A box around the globe is the whole raster.
fn unwrap_outline(
    file: &Georeference<'_>,
    requested: Sides,
    points: Vec<[f64; 2]>,
) -> Result<Vec<[f64; 2]>, PlaceError> {
    let System::Geographic { degrees } = file.system() else {
        return Ok(points);
    };
    let (turn, step) = (360.0 / degrees, file.transform().column_step()[0].abs());
    let [west, south, east, north] = around(points.iter().copied());
    let [first, _, last, _] = file.bounds();
    if east - west > turn - 1.5 * step {
        let (west, east) = (first, last);
        return Ok([[west, south], [east, south], [east, north], [west, north]].to_vec());
    }
    let part = |turns: f64| {
        let (from, to) = (west + turns * turn, east + turns * turn);
        let part = [from.max(first), south, to.min(last), north];
        (part[2] - part[0] >= step).then_some(part)
    };
    let parts: Vec<Sides> = [-1.0, 0.0, 1.0].into_iter().filter_map(part).collect();
    match parts.as_slice() {
        [one, other, ..] => Err(PlaceError::BoxInTwoParts {
            place: box_in_words(requested),
            parts: [one, other].map(|part| own_box_in_words(file, *part)),
        }),
        _ => Ok(points),
    }
}

/// Returns the place with a longitude that the projection accepts.
fn within_turn([longitude, latitude]: [f64; 2]) -> [f64; 2] {
    match longitude > 360.0 {
        true => [longitude - 360.0, latitude],
        false => [longitude, latitude],
    }
}

/// Returns a place with its longitude in the turn where it is about `east` degrees east of another.
fn in_turn_of(file: &Georeference<'_>, other: [f64; 2], east: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let System::Geographic { degrees } = file.system() else {
        return [x, y];
    };
    let (turn, expected) = (360.0 / degrees, other[0] + east / degrees);
    [x + ((expected - x) / turn).round() * turn, y]
}

/// Returns true if neighbours on an outline are too far apart for one piece of a map.
fn is_torn(points: &[[f64; 2]]) -> bool {
    let [west, south, east, north] = around(points.iter().copied());
    let whole = (east - west).hypot(north - south);
    let next = points.iter().cycle().skip(1);
    points
        .iter()
        .zip(next)
        .any(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]) > TORN * whole)
}

/// Returns a place with a height, in haptic cells, and the height in the file's vertical unit.
pub(super) fn spot(
    grid: &HapticGrid<'_>,
    requested: [f64; 2],
    coordinates: Coordinates,
) -> Result<([f64; 2], f64), PlaceError> {
    let file = grid.raster().georeference();
    let ground = place(&file, requested, coordinates)?;
    let reported = || {
        (
            place_as_given(&file, requested, coordinates),
            bounds_in_words(&file),
        )
    };
    let last = [grid.raster().columns(), grid.raster().rows()].map(|n| f64::from(n) - 1.0);
    let sample = file.transform().to_samples(ground);
    let inside = |axis: usize| (-ON_SAMPLE..=last[axis] + ON_SAMPLE).contains(&sample[axis]);
    if !(inside(0) && inside(1)) {
        if coordinates == Coordinates::LonLat && is_latitude_first(&file, requested) {
            return Err(PlaceError::LatitudeFirst(requested));
        }
        let (place, bounds) = reported();
        return Err(PlaceError::Outside { place, bounds });
    }
    let haptic = grid.of_ground(ground);
    let last = [grid.columns(), grid.rows()].map(|n| f64::from(n) - 1.0);
    let haptic = [0, 1].map(|axis| haptic[axis].clamp(0.0, last[axis]));
    match grid.read_surface(haptic) {
        (Some(height), _) => Ok((haptic, height)),
        (None, ReadStatus::Pending) => Err(PlaceError::Unread {
            place: reported().0,
        }),
        (None, ReadStatus::Complete) => {
            let (place, bounds) = reported();
            Err(PlaceError::NoData { place, bounds })
        }
    }
}

/// Returns the part of a terrain in a box: haptic cells, and its lowest and highest point in the
/// file's vertical unit.
pub(super) fn area(
    grid: &HapticGrid<'_>,
    requested: Sides,
    coordinates: Coordinates,
) -> Result<(Sides, [f64; 2]), PlaceError> {
    let file = grid.raster().georeference();
    let reported = || (box_in_words(requested), bounds_in_words(&file));
    let points = outline(&file, requested, coordinates)?;
    let haptic: Vec<_> = points.iter().map(|point| grid.of_ground(*point)).collect();
    let [west, south, east, north] = around(haptic);
    let last = [grid.columns(), grid.rows()].map(|n| f64::from(n) - 1.0);
    let [west, south] = [west.max(0.0), south.max(0.0)];
    let [east, north] = [east.min(last[0]), north.min(last[1])];
    if west >= east || south >= north {
        let (place, bounds) = reported();
        return Err(PlaceError::BoxOutside { place, bounds });
    }
    if east - west < 1.0 || north - south < 1.0 {
        let (place, bounds) = reported();
        return Err(PlaceError::BoxTooSmall { place, bounds });
    }
    let cells = [west, south, east, north];
    match heights(grid, cells) {
        // The range of the available heights would be too small.
        (_, ReadStatus::Pending) => Err(PlaceError::Unread {
            place: format!("the box {}", reported().0),
        }),
        (Some(heights), ReadStatus::Complete) => Ok((cells, heights)),
        (None, ReadStatus::Complete) => {
            let (place, bounds) = reported();
            Err(PlaceError::BoxOfHoles { place, bounds })
        }
    }
}

/// Returns the lowest and highest sample in a rectangle of haptic cells, of a subset if there are
/// very many; and whether all of them were read.
fn heights(
    grid: &HapticGrid<'_>,
    [west, south, east, north]: Sides,
) -> (Option<[f64; 2]>, ReadStatus) {
    let along = |from: f64, to: f64| {
        let samples = MAX_SAMPLES_PER_SIDE
            .min((to.ceil() - from.floor()) as u32 + 1)
            .max(2);
        (0..samples).map(move |index| {
            let share = f64::from(index) / f64::from(samples - 1);
            (from.floor() + share * (to.ceil() - from.floor())).round() as u32
        })
    };
    let apart = (east - west).max(north - south) / f64::from(MAX_SAMPLES_PER_SIDE);
    let level = grid.raster().level_for(apart);
    let reads = ReadTracker::default();
    let known = along(south, north)
        .flat_map(|row| along(west, east).map(move |column| (column >> level, row >> level)))
        .map(|(column, row)| reads.record(grid.read_height(level, column, row)))
        .filter(|height| !height.is_nan());
    let range = known.fold(None, |range: Option<[f64; 2]>, height| {
        let [low, high] = range.unwrap_or([height; 2]);
        Some([low.min(height), high.max(height)])
    });
    (range, reads.status())
}
