//! Where a terrain lies, what its heights count from, and where each of that comes from.

use serde::Serialize;

use crate::raster::{Bounds, CellUnit, Certainty, Raster};

/// Where something comes from, as the JSON says it.
pub(super) const fn from(certainty: Certainty) -> &'static str {
    match certainty {
        Certainty::Stated => "file",
        Certainty::FromCode => "code",
        Certainty::Assumed => "assumed",
        Certainty::Given => "option",
    }
}

/// The same for people.
pub(super) fn told(from: &str) -> &'static str {
    match from {
        "file" => "stated",
        "code" => "by the code of its reference system",
        "option" => "as you say",
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
    /// Of the sides: `metre`, `degree` or `unit of 0.3048 m`.
    unit: String,
    /// Where the unit comes from; of longitudes and latitudes, where the way to them
    /// does.
    from: &'static str,
}

impl Rectangle {
    /// The outer edges of a raster's cells in its own units.
    pub(super) fn of(raster: &Raster) -> Option<Self> {
        let cell = raster.cell()?;
        let unit = match cell.unit {
            CellUnit::Degree => "degree".to_owned(),
            CellUnit::Length { metres: 1.0 } => "metre".to_owned(),
            CellUnit::Length { metres } => format!("unit of {metres} m"),
        };
        Some(Self::new(raster.bounds()?, unit, from(cell.certainty)))
    }

    /// The same in longitude and latitude.
    pub(super) fn lonlat(raster: &Raster) -> Option<Self> {
        let way = match (raster.cell()?.unit, raster.reference_system()) {
            _ if raster.reference_system_from() == Certainty::Assumed => Certainty::Assumed,
            (CellUnit::Degree, _) => raster.cell()?.certainty,
            (CellUnit::Length { .. }, Some(system)) if system.code().is_some() => {
                Certainty::FromCode
            }
            (CellUnit::Length { .. }, _) => Certainty::Stated,
        };
        Some(Self::new(
            raster.bounds_lonlat()?,
            "degree".into(),
            from(way),
        ))
    }

    fn new(bounds: Bounds, unit: String, from: &'static str) -> Self {
        Self {
            west: bounds.west,
            south: bounds.south,
            east: bounds.east,
            north: bounds.north,
            unit,
            from,
        }
    }

    pub(super) fn text(&self) -> String {
        let digits = if self.unit == "degree" { 6 } else { 3 };
        let [west, south, east, north] = [self.west, self.south, self.east, self.north];
        format!(
            "west {west:.digits$}, south {south:.digits$}, east {east:.digits$}, \
             north {north:.digits$} ({}, {})",
            self.unit,
            told(self.from)
        )
    }
}

/// What the heights are in, and what they count from.
#[derive(Serialize)]
pub(super) struct Vertical {
    metres_per_unit: f64,
    unit_from: &'static str,
    /// Name of the vertical reference system, where the file states it.
    datum: Option<String>,
    /// As `EPSG:5703`.
    datum_code: Option<String>,
    /// `file`, where there is a datum: none is ever assumed.
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

    /// As `metres (assumed), above EPSG:5703 NAVD88 height (stated)`.
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
        format!("{unit} ({}), {datum}", told(self.unit_from))
    }
}
