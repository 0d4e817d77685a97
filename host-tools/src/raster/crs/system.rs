//! A horizontal reference system: its name, its code, and where its coordinates are
//! in longitude and latitude.

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::wkt::Node;
use super::{Vertical, code_wkt, metres_per_unit, name};

/// Where a map's units are shorter or longer than this on the ground, the place is
/// outside of what the projection is for.
const SENSIBLE: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// A horizontal reference system, as far as a file tells it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceSystem {
    code: Option<u16>,
    name: String,
    unit: Unit,
    /// The projection as PROJ writes it; `None` where it is not known.
    projection: Option<String>,
}

/// What a coordinate counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::raster) enum Unit {
    /// Degrees in a unit.
    Angle(f64),
    /// Metres in a unit, where known.
    Length(Option<f64>),
}

impl ReferenceSystem {
    /// The system with a code of EPSG's; `None` where the code is not known.
    pub(in crate::raster) fn from_code(code: u16) -> Option<Self> {
        let wkt = code_wkt(code)?;
        let projected = metres_per_unit(code);
        let unit = match projected {
            Some(metres) => Unit::Length(Some(metres)),
            None if is_geographic(&Node::parse(wkt)?) => Unit::Angle(1.0),
            None => return None,
        };
        Some(Self {
            code: Some(code),
            name: name(code)?,
            unit,
            projection: proj4wkt::wkt_to_projstring(wkt).ok(),
        })
    }

    /// The system that a text describes, and the vertical one that may stand beside
    /// it; the code in the text wins over its parameters, which other programs round.
    pub(in crate::raster) fn from_wkt(text: &str) -> (Option<Self>, Option<Vertical>) {
        let text = text.trim().trim_end_matches('\0');
        let Some(root) = Node::parse(text) else {
            return (None, None);
        };
        let up = root.child(&["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTCS"]);
        let up = up.and_then(|node| {
            let known = node.epsg().and_then(super::vertical);
            known.or_else(|| Vertical::from_node(node))
        });
        let compound = root.is(&["COMPD_CS", "COMPOUNDCRS"]);
        let across = match compound {
            true => root.child(&HORIZONTAL),
            false => Some(&root),
        };
        (across.and_then(|node| Self::from_node(node, text)), up)
    }

    fn from_node(node: &Node, text: &str) -> Option<Self> {
        if let Some(system) = node.epsg().and_then(Self::from_code) {
            return Some(system);
        }
        let unit = match is_geographic(node) {
            true => Unit::Angle(node.unit().map_or(1.0, f64::to_degrees)),
            false if node.is(&PROJECTED) => Unit::Length(node.unit()),
            false => return None,
        };
        Some(Self {
            code: None,
            name: node.name()?.to_owned(),
            unit,
            projection: proj4wkt::wkt_to_projstring(text).ok(),
        })
    }

    /// A system of which only the name and the unit are known.
    pub(in crate::raster) fn named(name: &str, unit: Unit) -> Self {
        Self {
            code: None,
            name: name.to_owned(),
            unit,
            projection: None,
        }
    }

    /// The same system with a projection, as PROJ writes it.
    pub(in crate::raster) fn with_projection(mut self, projection: String) -> Self {
        self.projection = Some(projection);
        self
    }

    /// The size of its globe, as PROJ writes it.
    pub(in crate::raster) fn ellipsoid(&self) -> Option<String> {
        Some(ellipsoid(self.projection.as_deref()?))
    }

    /// EPSG's code, where the file states one or names the system so that it follows.
    #[must_use]
    pub const fn code(&self) -> Option<u16> {
        self.code
    }

    /// Its name, as `NAD83 / UTM zone 11N`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether its places on the globe are known.
    pub(in crate::raster) const fn has_projection(&self) -> bool {
        self.projection.is_some()
    }

    /// The unit of its coordinates.
    pub(in crate::raster) const fn unit(&self) -> Unit {
        self.unit
    }

    /// Longitude and latitude in degrees of a place in the system's units. They belong
    /// to the system's own datum: no shift to another is made, which would want grids
    /// of shifts to be better than 100 m. `None` where the projection is not known or
    /// does not reach.
    #[must_use]
    pub fn lonlat(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        match self.unit {
            Unit::Angle(degrees) => Some((x * degrees, y * degrees)),
            Unit::Length(_) => Projection::new(self.projection.as_deref()?)?.degrees((x, y)),
        }
    }

    /// Place in the system's units of a longitude and latitude in degrees of its own
    /// datum: the inverse of [`ReferenceSystem::lonlat`].
    #[must_use]
    pub fn from_lonlat(&self, (longitude, latitude): (f64, f64)) -> Option<(f64, f64)> {
        match self.unit {
            Unit::Angle(degrees) => Some((longitude / degrees, latitude / degrees)),
            Unit::Length(_) => {
                let projection = Projection::new(self.projection.as_deref()?)?;
                let mut place = (longitude.to_radians(), latitude.to_radians(), 0.0);
                transform(&projection.globe, &projection.map, &mut place).ok()?;
                finite((place.0, place.1))
            }
        }
    }

    /// Ground metres in a unit of a projected system, towards its x and its y, at a
    /// place in its units: a map's scale is true in few places.
    pub(in crate::raster) fn local_metres(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        const STEP: f64 = 1.0;
        if matches!(self.unit, Unit::Angle(_)) {
            return None;
        }
        let projection = Projection::new(self.projection.as_deref()?)?;
        let here = projection.degrees((x, y))?;
        let [east, north] = projection.metres_per_degree(here.1);
        let length = |there: (f64, f64)| {
            let length = (east * (there.0 - here.0)).hypot(north * (there.1 - here.1)) / STEP;
            SENSIBLE.contains(&length).then_some(length)
        };
        Some((
            length(projection.degrees((x + STEP, y))?)?,
            length(projection.degrees((x, y + STEP))?)?,
        ))
    }
}

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 5] = [
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
];
const HORIZONTAL: [&str; 8] = [
    "PROJCS",
    "PROJCRS",
    "PROJECTEDCRS",
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
];

fn is_geographic(node: &Node) -> bool {
    node.is(&GEOGRAPHIC)
}

/// The words of a projection that tell the globe's size and datum.
fn ellipsoid(projection: &str) -> String {
    const KEYS: [&str; 4] = ["+a=", "+b=", "+rf=", "+towgs84="];
    let of_globe = |word: &&str| KEYS.iter().any(|key| word.starts_with(key));
    let words: Vec<&str> = projection.split_whitespace().filter(of_globe).collect();
    words.join(" ")
}

/// A projection and the globe that it projects.
struct Projection {
    map: Proj,
    globe: Proj,
}

impl Projection {
    fn new(text: &str) -> Option<Self> {
        // Both sides have one datum, so that none is shifted.
        let globe = format!("+proj=longlat {}", ellipsoid(text));
        Some(Self {
            map: Proj::from_proj_string(text).ok()?,
            globe: Proj::from_proj_string(&globe).ok()?,
        })
    }

    fn degrees(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let mut place = (x, y, 0.0);
        transform(&self.map, &self.globe, &mut place).ok()?;
        finite((place.0.to_degrees(), place.1.to_degrees()))
    }

    /// Metres in a degree of longitude and of latitude at a latitude in degrees: the
    /// radii of curvature of the ellipsoid.
    fn metres_per_degree(&self, latitude: f64) -> [f64; 2] {
        let (a, e2) = self.globe_shape();
        let (sin, cos) = latitude.to_radians().sin_cos();
        let w = (1.0 - e2 * sin * sin).sqrt();
        [a * cos / w, a * (1.0 - e2) / (w * w * w)].map(f64::to_radians)
    }

    /// Semi-major axis, m, and eccentricity squared.
    fn globe_shape(&self) -> (f64, f64) {
        let (a, b) = self.globe.ellipse_parameters();
        (a, 1.0 - (b / a) * (b / a))
    }
}

fn finite(place: (f64, f64)) -> Option<(f64, f64)> {
    (place.0.is_finite() && place.1.is_finite()).then_some(place)
}
