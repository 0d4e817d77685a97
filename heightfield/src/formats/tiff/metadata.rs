//! What GDAL notes beside the samples: no-data, scale, offset, unit.

use tiff_reader::Ifd;

use crate::BadRaster;
use crate::geometry::metres_in;

const GDAL_METADATA: u16 = 42112;
const GDAL_NODATA: u16 = 42113;
/// The file's own notes are short; what is not, is no such note.
const LONGEST_NOTE: usize = 1 << 20;

/// What GDAL notes beside a band's samples.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Metadata {
    pub(super) no_data: Option<f64>,
    pub(super) scale: Option<f64>,
    pub(super) offset: Option<f64>,
    pub(super) metres_per_vertical_unit: Option<f64>,
}

impl Metadata {
    /// The notes on a band, the first being 0.
    pub(super) fn read(image: &Ifd, band: usize) -> Result<Self, BadRaster> {
        let mut metadata = match text(image, GDAL_METADATA) {
            Some(xml) => Self::from_xml(xml, band),
            None => Self::default(),
        };
        if let Some(no_data) = text(image, GDAL_NODATA) {
            metadata.no_data = Some(no_data.parse().map_err(|_| {
                BadRaster::damaged(format!("its no-data value '{no_data}' is not a number"))
            })?);
        }
        Ok(metadata)
    }

    /// `<Item name="SCALE" sample="0" role="scale">0.3048</Item>` and its like.
    fn from_xml(xml: &str, band: usize) -> Self {
        let mut metadata = Self::default();
        let Ok(document) = roxmltree::Document::parse(xml) else {
            tracing::warn!("the file's GDAL metadata is no XML: it is not used");
            return metadata;
        };
        for item in document.descendants() {
            if item.attribute("sample").unwrap_or("0").parse() != Ok(band) {
                continue;
            }
            let value = item.text().unwrap_or_default().trim();
            match item.attribute("role") {
                Some("scale") => metadata.scale = value.parse().ok(),
                Some("offset") => metadata.offset = value.parse().ok(),
                Some("unittype") => metadata.metres_per_vertical_unit = metres_in(value),
                _ => {}
            }
        }
        metadata
    }
}

/// A text tag without its closing zero and blanks.
fn text(image: &Ifd, tag: u16) -> Option<&str> {
    let text = image.tag(tag)?.value.as_str()?;
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    (!text.is_empty() && text.len() <= LONGEST_NOTE).then_some(text)
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
        };
        assert_eq!(Metadata::from_xml(xml, 0), expected);
        assert_eq!(Metadata::from_xml(xml, 1).scale, Some(7.0));
    }

    #[test]
    fn notes_that_are_no_xml_are_left_alone() {
        assert_eq!(Metadata::from_xml("<a", 0), Metadata::default());
    }
}
