//! A horizontal reference system: its name, its code, and where its coordinates are
//! in longitude and latitude.

use super::bound;
use super::code_wkt;
use super::datum::{Datum, LonLat};
use super::projection::Projection;
use super::wkt::Node;
use super::{Globe, Vertical};
use crate::tangents::Tangents;

/// Where a map's units are shorter or longer than this on the ground, the place is
/// outside of what the projection is for.
const SENSIBLE: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// How far from a place its scale is asked for, m: a projection's formulas end their
/// rounds at 1e-10 rad, and its scale changes over kilometres.
const STEP_M: f64 = 100.0;

/// A horizontal reference system, as far as a file tells it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceSystem {
    code: Option<u16>,
    name: String,
    unit: Unit,
    /// `None` where it is not known.
    projection: Option<Projection>,
    /// `None` where the file does not tell it.
    datum: Option<Datum>,
}

/// What a coordinate counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    /// Degrees in a unit.
    Angle(f64),
    /// Metres in a unit, where known.
    Length(Option<f64>),
}

impl ReferenceSystem {
    /// The system with a code of EPSG's; `None` where the code is not known.
    pub(crate) fn from_code(code: u16) -> Option<Self> {
        let text = code_wkt(code)?;
        Self::described(&Node::parse(text)?, text, Some(code))
    }

    /// The system that a text describes, and the vertical one that may stand beside
    /// it; the code in the text wins over its parameters, which other programs round.
    pub(crate) fn from_wkt(text: &str) -> (Option<Self>, Option<Vertical>) {
        let text = text.trim().trim_end_matches('\0');
        let Some(root) = Node::parse(text) else {
            return (None, None);
        };
        let up = root.child(&["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTCS"]);
        let up = up.and_then(|node| {
            let known = node.epsg().and_then(super::vertical);
            known.or_else(|| Vertical::from_node(node))
        });
        if let Some((source, shift)) = bound::parts(&root, text) {
            let (across, of_source) = Self::from_wkt(source);
            let across = across.map(|system| system.shifted_by(&shift));
            return (across, up.or(of_source));
        }
        let compound = root.is(&["COMPD_CS", "COMPOUNDCRS"]);
        let across = match compound {
            true => root.child(&HORIZONTAL),
            false => Some(&root),
        };
        let by_code = |node: &Node| node.epsg().and_then(Self::from_code);
        let across =
            across.and_then(|node| by_code(node).or_else(|| Self::described(node, text, None)));
        (across, up)
    }

    fn described(node: &Node, text: &str, code: Option<u16>) -> Option<Self> {
        let unit = match node.is(&GEOGRAPHIC) {
            true => Unit::Angle(node.unit().map_or(1.0, degrees)),
            false if node.is(&PROJECTED) => Unit::Length(node.unit()),
            false => return None,
        };
        let projection = proj4wkt::wkt_to_projstring(text).ok();
        let meridian = projection.as_deref().map_or(0.0, Projection::meridian_of);
        let base = node.child(&BASES).unwrap_or(node);
        let datum = Datum::of(base, code, meridian);
        let globe = datum.as_ref().map_or(Globe::EARTH, Datum::globe);
        Some(Self {
            code,
            name: node.name()?.to_owned(),
            unit,
            projection: projection.map(|text| Projection::new(&text, globe)),
            datum,
        })
    }

    /// A system of which only the name, the unit and perhaps the datum are known.
    pub(crate) fn named(name: &str, unit: Unit, datum: Option<Datum>) -> Self {
        Self {
            code: None,
            name: name.to_owned(),
            unit,
            projection: None,
            datum,
        }
    }

    /// The same system with a projection, as PROJ writes it.
    pub(crate) fn with_projection(mut self, projection: &str) -> Self {
        self.projection = Some(Projection::new(projection, self.globe()));
        self
    }

    /// The same system with a shift to WGS 84 of its own, where those numbers are one.
    fn shifted_by(mut self, numbers: &[f64]) -> Self {
        self.datum = self.datum.map(|datum| datum.shifted_by(numbers));
        self
    }

    /// Its datum, where it is known.
    pub(crate) const fn datum(&self) -> Option<&Datum> {
        self.datum.as_ref()
    }

    /// The body that it belongs to; the Earth where nothing says otherwise.
    pub(crate) fn globe(&self) -> Globe {
        self.datum.as_ref().map_or(Globe::EARTH, Datum::globe)
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
    #[must_use]
    pub const fn has_lonlat(&self) -> bool {
        matches!(self.unit, Unit::Angle(_)) || self.projection.is_some()
    }

    /// The unit of its coordinates.
    pub(crate) const fn unit(&self) -> Unit {
        self.unit
    }

    /// What its longitudes and latitudes are.
    #[must_use]
    pub fn lonlat(&self) -> LonLat<'_> {
        self.datum
            .as_ref()
            .map_or(LonLat::Unstated, |datum| datum.lonlat())
    }

    /// Whether its own coordinates are these longitudes and latitudes, to 4 m.
    #[must_use]
    pub fn counts_lonlat(&self) -> bool {
        let datum = self.datum.as_ref();
        self.unit == Unit::Angle(1.0) && datum.is_none_or(Datum::counts_lonlat)
    }

    /// Longitude and latitude in degrees, as [`ReferenceSystem::lonlat`] says, of a place
    /// in the system's units. Longitudes count from Greenwich. `None` where the projection is
    /// not known or does not reach.
    #[must_use]
    pub fn to_lonlat(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let own = self.own_degrees(place)?;
        match &self.datum {
            Some(datum) => datum.to_lonlat(own),
            None => Some(own),
        }
    }

    /// Degrees of the system's own datum, from Greenwich.
    pub(super) fn own_degrees(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        match self.unit {
            Unit::Angle(degrees) => Some((x * degrees + self.meridian(), y * degrees)),
            Unit::Length(_) => self.projection.as_ref()?.degrees((x, y)),
        }
    }

    /// Place in the system's units of a longitude and latitude in degrees: the inverse of
    /// [`ReferenceSystem::to_lonlat`].
    #[must_use]
    pub fn from_lonlat(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        let own = match &self.datum {
            Some(datum) => datum.of_lonlat(lonlat)?,
            None => lonlat,
        };
        match self.unit {
            Unit::Angle(degrees) => Some(((own.0 - self.meridian()) / degrees, own.1 / degrees)),
            Unit::Length(_) => self.projection.as_ref()?.of_degrees(own),
        }
    }

    /// Degrees east of Greenwich at which its longitudes begin.
    pub(crate) fn meridian(&self) -> f64 {
        self.datum.as_ref().map_or(0.0, Datum::meridian)
    }

    /// Where a unit of a projected system's x and y lead on the ground at a place in its
    /// units: a map's scale and its angles are true in few places. Its formulas are asked
    /// [`STEP_M`] to both sides.
    pub(crate) fn tangents(&self, (x, y): (f64, f64)) -> Option<Tangents> {
        let Unit::Length(metres) = self.unit else {
            return None;
        };
        let step = STEP_M / metres.unwrap_or(1.0);
        let projection = self.projection.as_ref()?;
        let globe = self.globe();
        let place = |x: f64, y: f64| Some(globe.surface(projection.degrees((x, y))?));
        let between = |from: [f64; 3], to: [f64; 3]| {
            let lead = [0, 1, 2].map(|axis| (to[axis] - from[axis]) / (2.0 * step));
            let length = lead.iter().map(|part| part * part).sum::<f64>().sqrt();
            SENSIBLE.contains(&length).then_some(lead)
        };
        Some(Tangents {
            x: between(place(x - step, y)?, place(x + step, y)?)?,
            y: between(place(x, y - step)?, place(x, y + step)?)?,
        })
    }
}

/// Degrees in an angle of radians; one, where rounding is all that is between.
fn degrees(radians: f64) -> f64 {
    let degrees = radians.to_degrees();
    let whole = |part: f64| (degrees / part - 1.0).abs() < 1e-9;
    [1.0, 0.9]
        .into_iter()
        .find(|part| whole(*part))
        .unwrap_or(degrees)
}

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 5] = [
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
];
/// The geographic system under a projected one.
const BASES: [&str; 6] = [
    "GEOGCS",
    "BASEGEOGCRS",
    "BASEGEODCRS",
    "GEOGCRS",
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
