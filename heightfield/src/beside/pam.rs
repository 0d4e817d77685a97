//! GDAL's notes beside a file (`hills.tif.aux.xml`, PAM): no-data, scale, offset, unit, reference
//! system and place, as GDAL, QGIS and ArcGIS store them if the format has no field for them.
//!
//! As in GDAL, the notes override the file for no-data, reference system and place, and the file
//! overrides the notes for scale, offset and unit. A remark reports each difference.

use crate::RasterError;
use crate::crs::ReferenceSystem;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::numbers::{no_data, number};
use crate::xml;

/// Notes on one band of a file.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Notes {
    /// The notes' file name.
    name: String,
    /// Stored value that means no data.
    pub(crate) no_data: Option<f64>,
    scale: Option<f64>,
    offset: Option<f64>,
    unit: Option<String>,
    system: Option<String>,
    place: Option<String>,
    control_points: usize,
    remarks: Vec<String>,
}

impl Notes {
    /// Reads the notes on a band, the first being 1, beside a file on disk or at a URL.
    ///
    /// # Errors
    /// If they are remote and cannot be read at present: no-data would be read as heights.
    pub(crate) fn read(input: &FileBytes, band: u32) -> Result<Self, RasterError> {
        let (text, name) = match super::text_appended(input, "aux.xml") {
            Ok(Some(found)) => found,
            Ok(None) => return Ok(Self::default()),
            Err(fault) if fault.is_connection_error() => return Err(fault),
            Err(fault) => return Ok(Self::unread(&fault.to_string())),
        };
        let mut notes = Self::of(&text, band).unwrap_or_else(|fault| {
            Self::unread(&format!("{name} beside it cannot be read ({fault})"))
        });
        notes.name = name;
        Ok(notes)
    }

    fn unread(why: &str) -> Self {
        Self {
            remarks: vec![format!("{why}: it is not used")],
            ..Self::default()
        }
    }

    fn of(text: &str, band: u32) -> Result<Self, String> {
        let mut notes = Self::default();
        let band = band.to_string();
        xml::for_each(text, |open| {
            let names: Vec<&str> = open.iter().map(|element| element.name.as_str()).collect();
            let text = open.last().map_or("", |element| element.text.trim());
            let own_band = || open[1].attribute("band").unwrap_or("1") == band;
            match names[..] {
                ["PAMDataset", "SRS"] => notes.system = Some(text.to_owned()),
                ["PAMDataset", "GeoTransform"] => notes.place = Some(text.to_owned()),
                ["PAMDataset", "GCPList", "GCP"] => notes.control_points += 1,
                ["PAMDataset", "PAMRasterBand", key] if own_band() => notes.set(key, text),
                _ => {}
            }
        })?;
        Ok(notes)
    }

    fn set(&mut self, key: &str, text: &str) {
        match key {
            "NoDataValue" => {
                let parsed = no_data(text, 0, 1);
                self.no_data = parsed.value;
                self.remarks.extend(parsed.remark);
            }
            "Scale" => self.scale = number(text),
            "Offset" => self.offset = number(text),
            "UnitType" => self.unit = Some(text.to_owned()),
            _ => {}
        }
    }

    /// Adds the notes to the file's own metadata.
    pub(crate) fn apply(self, decoded: &mut Decoded) {
        let name = self.name.as_str();
        let mut remarks = self.remarks;
        let mut differ = |what: &str, own: String, theirs: String, used: &str| {
            remarks.push(format!(
                "{what}: the file states {own}, {name} beside it {theirs}; {used} is used"
            ));
        };
        if let Some(value) = self.no_data {
            if let Some(own) = decoded
                .no_data
                .filter(|own| *own != value && !value.is_nan())
            {
                differ("no data", own.to_string(), value.to_string(), "the latter");
            }
            decoded.no_data = Some(value);
        }
        let (scale, offset) = (self.scale.unwrap_or(1.0), self.offset.unwrap_or(0.0));
        if (self.scale, self.offset) != (None, None) {
            match (decoded.scale, decoded.offset) {
                (1.0, 0.0) => (decoded.scale, decoded.offset) = (scale, offset),
                own if own != (scale, offset) => differ(
                    "scale and offset",
                    format!("{} and {}", own.0, own.1),
                    format!("{scale} and {offset}"),
                    "the former",
                ),
                _ => {}
            }
        }
        match (decoded.metres_per_vertical_unit, self.unit.as_deref()) {
            (None, unit) => decoded.set_unit(unit),
            (Some(own), Some(unit)) if metres_in(unit).is_some_and(|metres| metres != own) => {
                differ(
                    "unit of heights",
                    format!("{own} m"),
                    unit.to_owned(),
                    "the former",
                );
            }
            _ => {}
        }
        decoded.remarks.extend(remarks);
        decoded.place_by_notes(name, self.system.as_deref(), self.place.as_deref());
        if self.control_points > 0 && decoded.place.is_none() {
            decoded.remark_control_points(self.control_points);
        }
    }
}

impl Decoded {
    /// Sets reference system and place from the notes in file `name`.
    fn place_by_notes(&mut self, name: &str, system: Option<&str>, place: Option<&str>) {
        let unit = self.ground_unit();
        let mut has_system = false;
        if let Some(text) = system.filter(|text| !text.is_empty()) {
            let (system, vertical) = reference_system(text);
            match system {
                None => self.remarks.push(format!(
                    "{name} beside it names no supported reference system: it is not used"
                )),
                Some(system) => {
                    if self
                        .system
                        .as_ref()
                        .is_some_and(|own| !is_same(own, &system))
                    {
                        self.remarks.push(format!(
                            "reference system: the file states {}, {name} beside it {}; the latter is used",
                            self.system.as_ref().map_or("", |own| own.name()),
                            system.name()
                        ));
                    }
                    has_system = true;
                    self.system = Some(system);
                }
            }
            if vertical.is_some() && self.vertical_datum.is_none() {
                self.set_vertical(vertical, self.metres_per_vertical_unit);
            }
        }
        let map = match place.map(ground_map) {
            Some(None) => {
                self.remarks.push(format!(
                    "{name} beside it states no valid place of the samples: it is not used"
                ));
                None
            }
            Some(Some(map)) => {
                if self.place.is_some_and(|own| !own.map.is_near(&map)) {
                    self.remarks.push(format!(
                        "place: the file and {name} beside it differ; the latter is used"
                    ));
                }
                Some(map)
            }
            None => self.place.filter(|_| has_system).map(|place| place.map),
        };
        if let Some(map) = map {
            self.set_layout(map, unit.filter(|_| !has_system));
        }
    }
}

/// Reads a reference system as text, or by its code as in `EPSG:32632`.
fn reference_system(text: &str) -> (Option<ReferenceSystem>, Option<crate::crs::Vertical>) {
    let code = text
        .strip_prefix("EPSG:")
        .and_then(|code| code.parse().ok());
    match code {
        Some(code) => (ReferenceSystem::from_code(code), None),
        None => ReferenceSystem::from_wkt(text),
    }
}

fn is_same(own: &ReferenceSystem, other: &ReferenceSystem) -> bool {
    let is_same = match (own.code(), other.code()) {
        (Some(own), Some(other)) => own == other,
        _ => own == other || own.name() == other.name(),
    };
    is_same && own.has_unit_of(other)
}

/// Reads six numbers: x of the corner, x per column, x per row, then the same for y.
fn ground_map(text: &str) -> Option<GroundMap> {
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    match numbers?[..] {
        [x, x_column, x_row, y, y_column, y_row] => {
            GroundMap::new([x, x_column, x_row], [y, y_column, y_row])
        }
        _ => None,
    }
}

#[cfg(test)]
#[path = "pam_tests.rs"]
mod tests;
