//! GDAL's notes beside a file (`hills.tif.aux.xml`, PAM): no-data, scale, offset, unit, reference
//! system and place, as GDAL, QGIS and ArcGIS keep them where the format has no place for them.
//!
//! Which of two sources counts is as in GDAL: the notes for no-data, reference system and place,
//! the file for scale, offset and unit. Where both differ, a remark says so.

use crate::crs::ReferenceSystem;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::ground_map::GroundMap;
use crate::input::{Data, FileBytes};
use crate::numbers::{no_data, number};
use crate::xml;

/// What lies beside a file for one of its bands.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Notes {
    /// The name of the file that they are in.
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
    /// The notes on a band, the first being 1, beside a file on disk: at a server they would be one
    /// more request for every file.
    pub(crate) fn read(input: &FileBytes, band: u32) -> Self {
        if !matches!(input.data(), Data::File(..)) {
            return Self::default();
        }
        let (text, name) = match super::text_appended(input, "aux.xml") {
            Ok(Some(found)) => found,
            Ok(None) => return Self::default(),
            Err(fault) => return Self::unread(&fault.to_string()),
        };
        let mut notes = Self::of(&text, band).unwrap_or_else(|fault| {
            Self::unread(&format!("{name} beside it cannot be read ({fault})"))
        });
        notes.name = name;
        notes
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
                let stated = no_data(text, 0, 1);
                self.no_data = stated.value;
                self.remarks.extend(stated.remark);
            }
            "Scale" => self.scale = number(text),
            "Offset" => self.offset = number(text),
            "UnitType" => self.unit = Some(text.to_owned()),
            _ => {}
        }
    }

    /// Adds them to what the file says itself.
    pub(crate) fn apply(self, decoded: &mut Decoded) {
        let name = self.name.as_str();
        let mut remarks = self.remarks;
        let mut differ = |what: &str, own: String, theirs: String, taken: &str| {
            remarks.push(format!(
                "{what}: the file says {own}, {name} beside it {theirs}; {taken} is taken"
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
    /// Takes reference system and place from notes in a file of a name.
    fn place_by_notes(&mut self, name: &str, system: Option<&str>, place: Option<&str>) {
        let unit = self.ground_unit();
        let mut has_system = false;
        if let Some(text) = system.filter(|text| !text.is_empty()) {
            let (system, vertical) = reference_system(text);
            match system {
                None => self.remarks.push(format!(
                    "{name} beside it names no reference system that is known here: it is not used"
                )),
                Some(system) => {
                    if self
                        .system
                        .as_ref()
                        .is_some_and(|own| !is_same(own, &system))
                    {
                        self.remarks.push(format!(
                            "reference system: the file says {}, {name} beside it {}; the latter is taken",
                            self.system.as_ref().map_or("", |own| own.name()),
                            system.name()
                        ));
                    }
                    has_system = true;
                    self.system = Some(system);
                }
            }
            if vertical.is_some() && self.metres_per_vertical_unit.is_none() {
                self.set_vertical(vertical, None);
            }
        }
        let map = match place.map(ground_map) {
            Some(None) => {
                self.remarks.push(format!(
                    "{name} beside it places the samples nowhere: it is not used"
                ));
                None
            }
            Some(Some(map)) => {
                if self.place.is_some_and(|own| !own.map.is_near(&map)) {
                    self.remarks.push(format!(
                        "place: the file and {name} beside it differ; the latter is taken"
                    ));
                }
                Some(map)
            }
            None => self.place.filter(|_| has_system).map(|place| place.map),
        };
        if let Some(map) = map {
            self.lay_out(map, unit.filter(|_| !has_system));
        }
    }
}

/// A reference system as text, or by its code as in `EPSG:32632`.
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
    match (own.code(), other.code()) {
        (Some(own), Some(other)) => own == other,
        _ => own == other || own.name() == other.name(),
    }
}

/// Six numbers: x of the corner, x per column, x per row, and the same of y.
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
mod tests {
    use super::*;
    use crate::{Certainty, OpenOptions, Raster};

    #[test]
    fn notes_of_the_asked_band_are_read() {
        let text = r#"<PAMDataset>
            <SRS dataAxisToSRSAxisMapping="1,2">EPSG:32632</SRS>
            <PAMRasterBand band="1"><NoDataValue>-9.999E3</NoDataValue><UnitType>ft</UnitType></PAMRasterBand>
            <PAMRasterBand band="2"><Scale>0.5</Scale><Offset>10</Offset></PAMRasterBand>
        </PAMDataset>"#;
        let first = Notes::of(text, 1).expect("notes");
        assert_eq!((first.no_data, first.scale), (Some(-9999.0), None));
        assert_eq!(first.unit.as_deref(), Some("ft"));
        assert_eq!(first.system.as_deref(), Some("EPSG:32632"));
        let second = Notes::of(text, 2).expect("notes");
        assert_eq!((second.scale, second.offset), (Some(0.5), Some(10.0)));
        assert_eq!(second.no_data, None);
    }

    /// A grid of the heights 1 to 6, with notes beside it.
    fn noted(notes: &str, options: &OpenOptions) -> Raster {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.asc");
        let grid =
            "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n1 2 3 4 5 6";
        std::fs::write(&path, grid).expect("written");
        std::fs::write(folder.path().join("x.asc.aux.xml"), notes).expect("written");
        Raster::open(&path, options).expect("a grid")
    }

    fn in_band(notes: &str) -> String {
        format!("<PAMDataset><PAMRasterBand band='1'>{notes}</PAMRasterBand></PAMDataset>")
    }

    #[test]
    fn notes_beside_a_file_are_used() {
        let notes = in_band(
            "<NoDataValue>6</NoDataValue><Scale>2</Scale><Offset>1</Offset><UnitType>ft</UnitType>",
        );
        let system = "<PAMDataset><SRS>EPSG:32632</SRS>";
        let notes = notes.replace("<PAMDataset>", system);
        let raster = noted(&notes, &OpenOptions::default());
        let summary = raster.summary();
        assert_eq!(
            (summary.lowest, summary.highest, summary.holes),
            (3.0, 11.0, 1)
        );
        assert_eq!(raster.stated_metres_per_vertical_unit(), Some(0.3048));
        let code = raster.reference_system().and_then(ReferenceSystem::code);
        assert_eq!(code, Some(32632));
        assert_eq!(
            raster.cell().expect("a cell").certainty,
            Certainty::FromCode
        );
        // What the user states wins.
        let options = OpenOptions {
            no_data: Some(1.0),
            ..OpenOptions::default()
        };
        assert_eq!(noted(&notes, &options).summary().lowest, 5.0);
    }

    #[test]
    fn notes_that_contradict_the_file_are_reported() {
        let placed = "<PAMDataset><GeoTransform>0, 2, 0, 9, 0, -2</GeoTransform></PAMDataset>";
        let raster = noted(placed, &OpenOptions::default());
        assert_eq!(raster.bounds().expect("placed").west, 0.0);
        let said = raster.remarks().join(" ");
        assert!(said.contains("x.asc.aux.xml beside it differ"), "{said}");
        let raster = noted(
            &in_band("<NoDataValue>2</NoDataValue>"),
            &OpenOptions::default(),
        );
        let said = raster.remarks().join(" ");
        assert!(
            said.contains("the file says -9999") && raster.summary().holes == 1,
            "{said}"
        );
    }

    #[test]
    fn notes_that_cannot_be_read_are_named() {
        for notes in ["<PAMDataset>", "no XML", &"<a>".repeat(400_000)] {
            let said = noted(notes, &OpenOptions::default()).remarks().join(" ");
            assert!(said.contains("x.asc.aux.xml beside it"), "{said}");
        }
    }
}
