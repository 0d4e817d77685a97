//! Position and vertical datum of a terrain, and their sources.

use serde::Serialize;

use heightfield::{Bounds, CellUnit, Certainty, LonLat, Raster, ReferenceSystem, System};

/// Returns the source of a value, as in the JSON.
pub(super) const fn from(certainty: Certainty) -> &'static str {
    match certainty {
        Certainty::Stated => "file",
        Certainty::FromCode => "code",
        Certainty::Assumed => "assumed",
        Certainty::Given => "option",
    }
}

/// Returns the source as text for the user.
pub(super) fn source_text(from: &str) -> &'static str {
    match from {
        "file" => "stated",
        "code" => "by the code of its reference system",
        "option" => "by an option",
        _ => "assumed",
    }
}

/// A rectangle along the axes of a reference system.
#[derive(Serialize)]
pub(super) struct Rectangle {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
    /// Unit of the sides: `metre`, `degree`, `grad` or `unit of 0.3048 m`.
    unit: String,
    /// Source of the unit; for longitudes and latitudes, source of their conversion.
    from: &'static str,
    /// Datum of longitudes and latitudes.
    #[serde(flatten)]
    globe: Option<Globe>,
}

/// Datum of longitudes and latitudes.
#[derive(Serialize)]
struct Globe {
    /// `WGS 84`, the name of a datum or of its body; `None` if the file states none.
    datum: Option<String>,
    /// Usual maximum error of a conversion to WGS 84 from another datum, m.
    within_m: Option<f64>,
    /// Semi-major axis of a body other than the Earth, m.
    body_radius_m: Option<f64>,
    #[serde(skip)]
    text: String,
}

impl Globe {
    fn of(kind: LonLat<'_>) -> Self {
        let wgs84 = || Some("WGS 84".to_owned());
        let (datum, within_m, body_radius_m, text) = match kind {
            LonLat::Unstated => (None, None, None, "no datum stated".into()),
            LonLat::Wgs84 => (wgs84(), None, None, "WGS 84".into()),
            LonLat::ShiftedToWgs84 { within_m } => (
                wgs84(),
                Some(within_m),
                None,
                format!("WGS 84, usually within {within_m} m"),
            ),
            LonLat::OfOwnDatum { name } => (
                Some(name.to_owned()),
                None,
                None,
                format!(
                    "of its own datum, {name}, from Greenwich; its conversion to WGS 84 is not supported"
                ),
            ),
            LonLat::OfBody { name, radius_m } => (
                Some(name.to_owned()),
                None,
                Some(radius_m),
                format!(
                    "on a body of {} km radius, not the Earth: {name}",
                    radius_m / 1000.0
                ),
            ),
        };
        Self {
            datum,
            within_m,
            body_radius_m,
            text,
        }
    }
}

impl Rectangle {
    /// Returns the outer edges of a raster's cells in its own units.
    pub(super) fn of(raster: &Raster) -> Option<Self> {
        let cell = raster.cell()?;
        let unit = match cell.unit {
            CellUnit::Degree => match raster.georeference().system() {
                System::Geographic { degrees: 0.9 } => "grad".to_owned(),
                System::Geographic { degrees } if degrees != 1.0 => {
                    format!("unit of {degrees} degrees")
                }
                _ => "degree".to_owned(),
            },
            CellUnit::Length { metres: 1.0 } => "metre".to_owned(),
            CellUnit::Length { metres } => format!("unit of {metres} m"),
        };
        Some(Self::new(raster.bounds()?, unit, cell.certainty, None))
    }

    /// Returns the edges in longitude and latitude.
    pub(super) fn lonlat(raster: &Raster) -> Option<Self> {
        let source = match (raster.cell()?.unit, raster.reference_system()) {
            _ if raster.reference_system_from() == Certainty::Assumed => Certainty::Assumed,
            (CellUnit::Degree, system) if system.is_none_or(ReferenceSystem::counts_lonlat) => {
                raster.cell()?.certainty
            }
            (_, Some(system)) if system.code().is_some() => Certainty::FromCode,
            _ => Certainty::Stated,
        };
        let globe = Globe::of(raster.georeference().lonlat());
        Some(Self::new(
            raster.bounds_lonlat()?,
            "degree".into(),
            source,
            Some(globe),
        ))
    }

    fn new(bounds: Bounds, unit: String, certainty: Certainty, globe: Option<Globe>) -> Self {
        Self {
            west: bounds.west,
            south: bounds.south,
            east: bounds.east,
            north: bounds.north,
            unit,
            from: from(certainty),
            globe,
        }
    }

    pub(super) fn text(&self) -> String {
        let is_angle = ["degree", "grad"].contains(&self.unit.as_str());
        let digits = if is_angle { 6 } else { 3 };
        let globe = self.globe.as_ref();
        let globe = globe.map_or(String::new(), |globe| format!("; {}", globe.text));
        let [west, south, east, north] = [self.west, self.south, self.east, self.north];
        format!(
            "west {west:.digits$}, south {south:.digits$}, east {east:.digits$}, \
             north {north:.digits$} ({}, {}{globe})",
            self.unit,
            source_text(self.from)
        )
    }
}

/// Unit and datum of the heights.
#[derive(Serialize)]
pub(super) struct Vertical {
    metres_per_unit: f64,
    unit_from: &'static str,
    /// Name of the vertical reference system, if the file states it.
    datum: Option<String>,
    /// Code such as `EPSG:5703`.
    datum_code: Option<String>,
    /// `file` if there is a datum, because none is assumed.
    datum_from: Option<&'static str>,
}

impl Vertical {
    pub(super) fn of(raster: &Raster) -> Self {
        let datum = raster.vertical_datum();
        let code = datum.and_then(|datum| datum.code);
        Self {
            metres_per_unit: raster.metres_per_vertical_unit(),
            unit_from: from(raster.vertical_unit_from()),
            datum: datum.map(|datum| datum.name.clone()),
            datum_code: code.map(|code| format!("EPSG:{code}")),
            datum_from: datum.map(|_| from(Certainty::Stated)),
        }
    }

    /// Returns text such as `metres (assumed), above EPSG:5703 NAVD88 height (stated)`.
    pub(super) fn text(&self) -> String {
        let unit = match self.metres_per_unit {
            1.0 => "metres".to_owned(),
            metres => format!("units of {metres} m"),
        };
        let datum = match (&self.datum, &self.datum_code) {
            (Some(name), Some(code)) => format!("datum {code} {name} (stated)"),
            (Some(name), None) => format!("datum {name} (stated)"),
            (None, _) => "datum not stated".into(),
        };
        format!("{unit} ({}), {datum}", source_text(self.unit_from))
    }
}
