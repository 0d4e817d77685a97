//! The pixel of a raster of classes in which a place of a terrain lies.

use super::ground::{GroundError, place_of};
use heightfield::{Georeference, LonLat, Raster, ReadStatus, Wait};

/// Places along each side of a raster that are tested for an overlap of two rasters.
const TESTED_PLACES: u32 = 33;

/// A raster of classes, and the conversion of a terrain's points to its coordinates.
#[derive(Debug)]
pub(super) struct Pixels {
    raster: Raster,
    conversion: Conversion,
}

/// Conversion from the coordinates of one raster to those of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Conversion {
    /// Both have the same coordinates.
    Same,
    /// Through longitude and latitude.
    LonLat,
}

impl Conversion {
    fn between(
        (terrain, on_terrain): (&str, &Georeference<'_>),
        (classes, on_classes): (&str, &Georeference<'_>),
    ) -> Result<Self, GroundError> {
        if on_terrain.reference() == on_classes.reference()
            && on_terrain.system() == on_classes.system()
        {
            return Ok(Self::Same);
        }
        let middle = |on: &Georeference<'_>| {
            let [west, south, east, north] = on.bounds();
            [0.5 * (west + east), 0.5 * (south + north)]
        };
        let has_lonlat = |on: &Georeference<'_>| {
            let lonlat = on.to_lonlat(middle(on));
            lonlat.and_then(|lonlat| on.of_lonlat(lonlat)).is_some()
        };
        let sides = [
            (terrain, on_terrain, classes),
            (classes, on_classes, terrain),
        ];
        for (file, on, other) in sides {
            if has_lonlat(on) {
                continue;
            }
            let (file, other) = (file.to_owned(), other.to_owned());
            return Err(match on.reference() {
                None => GroundError::NoSystem {
                    unplaced: file,
                    placed: other,
                },
                Some(_) => GroundError::NoConversion { file, other },
            });
        }
        match radius_m(on_terrain) == radius_m(on_classes) {
            true => Ok(Self::LonLat),
            false => Err(GroundError::OtherBody {
                classes: classes.to_owned(),
                terrain: terrain.to_owned(),
            }),
        }
    }

    fn convert(
        self,
        from: &Georeference<'_>,
        to: &Georeference<'_>,
        ground: [f64; 2],
    ) -> Option<[f64; 2]> {
        match self {
            Self::Same => Some(to.nearest_turn(ground)),
            Self::LonLat => from.to_lonlat(ground).and_then(|at| to.of_lonlat(at)),
        }
    }
}

/// Returns the radius of the body on which longitudes and latitudes are given; `None` for the
/// Earth.
fn radius_m(on: &Georeference<'_>) -> Option<f64> {
    match on.lonlat() {
        LonLat::OfBody { radius_m, .. } => Some(radius_m),
        _ => None,
    }
}

/// A raster of classes, and the terrain whose points are converted.
pub(super) struct From<'p> {
    pixels: &'p Pixels,
    terrain: &'p Georeference<'p>,
    classes: Georeference<'p>,
}

impl From<'_> {
    /// Returns the value of the file's pixel at a point in the terrain's coordinates, NaN in
    /// no-data and beyond the file; and whether it is known.
    pub(super) fn value(&self, ground: [f64; 2], wait: Wait) -> (f64, ReadStatus) {
        let there = self
            .pixels
            .conversion
            .convert(self.terrain, &self.classes, ground);
        let place = there.map(|at| self.classes.transform().to_samples(at));
        match place.and_then(|place| pixel(&self.pixels.raster, place)) {
            Some([column, row]) => self.pixels.raster.read_height(column, row, wait),
            None => (f64::NAN, ReadStatus::Complete),
        }
    }
}

impl Pixels {
    pub(super) fn over(
        (terrain, ground): (&str, &Raster),
        (file, raster): (&str, Raster),
    ) -> Result<Self, GroundError> {
        let (on_terrain, on_classes) = (ground.georeference(), raster.georeference());
        let conversion = Conversion::between((terrain, &on_terrain), (file, &on_classes))?;
        // Tested in both directions, because either raster may be much larger than the other.
        let overlap = overlaps(conversion, (&on_terrain, ground), (&on_classes, &raster))
            || overlaps(conversion, (&on_classes, &raster), (&on_terrain, ground));
        match overlap {
            true => Ok(Self { raster, conversion }),
            false => Err(GroundError::Apart {
                classes: file.to_owned(),
                terrain: terrain.to_owned(),
                there: place_of(&raster),
                here: place_of(ground),
            }),
        }
    }

    pub(super) const fn raster(&self) -> &Raster {
        &self.raster
    }

    pub(super) fn from<'p>(&'p self, terrain: &'p Georeference<'p>) -> From<'p> {
        From {
            pixels: self,
            terrain,
            classes: self.raster.georeference(),
        }
    }
}

/// Returns true if one of the tested places of a raster lies on another.
fn overlaps(
    conversion: Conversion,
    (from, of): (&Georeference<'_>, &Raster),
    (to, on): (&Georeference<'_>, &Raster),
) -> bool {
    let place =
        |i: u32, count: u32| f64::from(i) / f64::from(TESTED_PLACES - 1) * f64::from(count - 1);
    (0..TESTED_PLACES * TESTED_PLACES).any(|i| {
        let sample = [
            place(i % TESTED_PLACES, of.columns()),
            place(i / TESTED_PLACES, of.rows()),
        ];
        let there = conversion.convert(from, to, from.transform().to_ground(sample));
        let there = there.map(|at| to.transform().to_samples(at));
        there.is_some_and(|there| pixel(on, there).is_some())
    })
}

/// Returns the pixel whose centre is nearest to a position in columns and rows; `None` beyond the
/// raster.
fn pixel(raster: &Raster, [column, row]: [f64; 2]) -> Option<[u32; 2]> {
    let along = |place: f64, count: u32| {
        let nearest = (place + 0.5).floor();
        (0.0..f64::from(count))
            .contains(&nearest)
            .then_some(nearest as u32)
    };
    Some([along(column, raster.columns())?, along(row, raster.rows())?])
}
