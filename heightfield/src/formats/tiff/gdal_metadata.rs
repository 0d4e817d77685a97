//! GDAL's tags in a TIFF: the no-data value, scale, offset and unit of a band.

use tiff_reader::Ifd;

use crate::geometry::{metres_in, unknown_unit};
use crate::numbers::{no_data, number};
use crate::xml;

const GDAL_METADATA: u16 = 42112;
const GDAL_NODATA: u16 = 42113;
/// Max size of GDAL's metadata, bytes: a longer text is something else.
const MAX_NOTE: usize = 1 << 20;

/// GDAL's metadata of a band.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Metadata {
    pub(super) no_data: Option<f64>,
    pub(super) scale: Option<f64>,
    pub(super) offset: Option<f64>,
    pub(super) metres_per_vertical_unit: Option<f64>,
    /// Remarks for the user.
    pub(super) remarks: Vec<String>,
}

impl Metadata {
    /// Reads the metadata of one of `bands` bands, the first being 0.
    pub(super) fn read(image: &Ifd, band: usize, bands: u16) -> Self {
        let mut metadata = match text(image, GDAL_METADATA) {
            Some(xml) => Self::from_xml(xml, band),
            None => Self::default(),
        };
        if let Some(text) = text(image, GDAL_NODATA) {
            let parsed = no_data(text, band, bands.into());
            metadata.no_data = parsed.value;
            metadata.remarks.extend(parsed.remark);
        }
        metadata
    }

    /// Reads items such as `<Item name="SCALE" sample="0" role="scale">0.3048</Item>`.
    fn from_xml(text: &str, band: usize) -> Self {
        let mut metadata = Self::default();
        let read = xml::for_each(text, |open| {
            let Some(item) = open.last() else { return };
            if item.attribute("sample").unwrap_or("0").parse() != Ok(band) {
                return;
            }
            let value = item.text.trim();
            match item.attribute("role") {
                Some("scale") => metadata.scale = number(value),
                Some("offset") => metadata.offset = number(value),
                Some("unittype") => metadata.set_unit(value),
                _ => {}
            }
        });
        match read {
            Ok(()) => metadata,
            Err(fault) => Self {
                remarks: vec![format!(
                    "its GDAL metadata cannot be read ({fault}): it is not used"
                )],
                ..Self::default()
            },
        }
    }

    fn set_unit(&mut self, unit: &str) {
        self.metres_per_vertical_unit = metres_in(unit);
        if self.metres_per_vertical_unit.is_none() && !unit.is_empty() {
            self.remarks.push(unknown_unit(unit));
        }
    }
}

/// Returns a text tag without its final zero and white space.
fn text(image: &Ifd, tag: u16) -> Option<&str> {
    let text = image.tag(tag)?.value.as_str()?;
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    (!text.is_empty() && text.len() <= MAX_NOTE).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_of_other_bands_are_not_used() {
        let xml = r#"<GDALMetadata>
            <Item name="OFFSET" sample="0" role="offset">100</Item>
            <Item name="SCALE" sample="0" role="scale">0.5</Item>
            <Item name="UNITTYPE" sample="0" role="unittype">ft</Item>
            <Item name="SCALE" sample="1" role="scale">7</Item>
        </GDALMetadata>"#;
        let expected = Metadata {
            no_data: None,
            scale: Some(0.5),
            offset: Some(100.0),
            metres_per_vertical_unit: Some(0.3048),
            remarks: Vec::new(),
        };
        assert_eq!(Metadata::from_xml(xml, 0), expected);
        assert_eq!(Metadata::from_xml(xml, 1).scale, Some(7.0));
    }

    #[test]
    fn notes_that_are_no_xml_are_ignored() {
        let read = Metadata::from_xml("<a", 0);
        assert_eq!(
            (read.scale, read.offset, read.remarks.len()),
            (None, None, 1)
        );
    }
}
