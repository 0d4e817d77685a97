//! One source of a VRT's band.

use std::path::{Path, PathBuf};

use super::super::super::samples::SampleType;
use super::super::super::{BadRaster, Elsewhere, OpenOptions};
use super::super::pool::options_for_tiles;
use super::super::source::{Source, Values};
use super::super::tile_file;
use super::rectangles::Rectangle;
use super::unsupported;
use super::xml::{Element, number};
use crate::remote::{beside, escaped, is_url};

/// What sources are of.
#[derive(Clone, Copy)]
pub(super) struct Taking<'p> {
    /// The VRT.
    pub(super) path: &'p Path,
    /// Its columns and rows.
    pub(super) size: (u32, u32),
    /// Whether files may be looked into for their sizes.
    pub(super) looks: bool,
    /// The files at URLs.
    pub(super) elsewhere: &'p Elsewhere,
}

/// Elements of a source that are understood, or that change no sample.
const KNOWN: [&str; 9] = [
    "SourceFilename",
    "SourceBand",
    "SourceProperties",
    "SrcRect",
    "DstRect",
    "NODATA",
    "ScaleOffset",
    "ScaleRatio",
    "UseMaskBand",
];

impl Taking<'_> {
    /// A source of a band whose samples have a type; `None` where it lies outside.
    pub(super) fn source(
        &self,
        element: &Element,
        sample: SampleType,
    ) -> Result<Option<Source>, BadRaster> {
        let mut children = element.children.iter();
        if let Some(other) = children.find(|child| !KNOWN.contains(&child.name.as_str())) {
            return Err(unsupported(format!("{} in a {}", other.name, element.name)));
        }
        let path = self.file(element)?;
        let band = band(element)?;
        let rectangle = |name: &str| match element.child(name) {
            Some(child) => Rectangle::read(child),
            None => Ok(None),
        };
        let to = rectangle("DstRect")?.unwrap_or(Rectangle::whole(self.size));
        let size = stated_size(element);
        let from = match (rectangle("SrcRect")?, size) {
            (Some(from), _) => from,
            (None, Some(size)) => Rectangle::whole(size),
            // Whatever its size: all of it.
            (None, None) if !self.looks => to,
            (None, None) => Rectangle::whole(self.looked_up_size(&path)?),
        };
        let resampling = element.attribute("resampling").unwrap_or("nearest");
        let is_nearest =
            resampling.eq_ignore_ascii_case("nearest") || resampling.eq_ignore_ascii_case("near");
        if !from.is_as_large_as(&to) && !is_nearest {
            return Err(unsupported(format!(
                "a source that is resampled ({resampling})"
            )));
        }
        let Some(covers) = to.covers(self.size) else {
            return Ok(None);
        };
        Ok(Some(Source {
            path,
            bytes: 0,
            band,
            covers,
            axes: to.to(&from, self.size.1),
            size: None,
            values: values(element, sample)?,
        }))
    }

    /// The file, beside the VRT where it says so.
    fn file(&self, element: &Element) -> Result<PathBuf, BadRaster> {
        let named = element.child("SourceFilename");
        let named = named.filter(|named| !named.text.trim().is_empty());
        let named = named.ok_or_else(|| BadRaster::damaged("VRT: a source names no file"))?;
        let name = named.text.trim();
        let is_beside = named
            .attribute("relativeToVRT")
            .is_some_and(|text| text.trim() == "1");
        if let Some(url) = url(name) {
            return Ok(url.into());
        }
        let is_gdals = name.starts_with("/vsi") || name.starts_with('<');
        let has_parts = name.contains(":\"") || name.ends_with('"');
        if is_gdals || has_parts {
            return Err(unsupported(format!(
                "a source that only GDAL finds ({name})"
            )));
        }
        if name.to_lowercase().ends_with(".vrt") {
            return Err(unsupported(format!("a VRT as a source of a VRT ({name})")));
        }
        if let Some(vrt) = self.path.to_str().filter(|path| is_url(path)) {
            // Where a VRT is elsewhere, so are its files.
            return Ok(beside(vrt, name).into());
        }
        let folder = self.path.parent().filter(|_| is_beside);
        Ok(folder.map_or_else(|| PathBuf::from(name), |folder| folder.join(name)))
    }

    /// The size of a file that the VRT does not state.
    fn looked_up_size(&self, path: &Path) -> Result<(u32, u32), BadRaster> {
        let options = options_for_tiles(&OpenOptions {
            elsewhere: self.elsewhere.clone(),
            ..OpenOptions::default()
        });
        let outline = tile_file::outline(path, &options);
        let outline = outline.map_err(|fault| BadRaster::in_tile(path, fault))?;
        Ok((outline.columns, outline.rows))
    }
}

/// The URL that a name is, be it in GDAL's way.
pub(in super::super) fn url(name: &str) -> Option<String> {
    const GDALS: [(&str, &str); 4] = [
        ("/vsicurl/", ""),
        ("/vsis3/", "s3://"),
        ("/vsigs/", "gs://"),
        ("/vsiaz/", "az://"),
    ];
    let gdals = GDALS.iter().find_map(|(prefix, scheme)| {
        let rest = name.strip_prefix(prefix)?;
        // Behind `/vsicurl/` stands a URL, and behind the others a key as it is.
        Some(match scheme.is_empty() {
            true => rest.to_owned(),
            false => format!("{scheme}{}", escaped(rest)),
        })
    });
    Some(gdals.unwrap_or_else(|| name.to_owned())).filter(|name| is_url(name))
}

/// The band of a source; `None` for the first.
fn band(element: &Element) -> Result<Option<u32>, BadRaster> {
    let text = element.text_of("SourceBand").unwrap_or("1");
    match text.parse::<u32>() {
        Ok(1) => Ok(None),
        Ok(band) if band > 1 => Ok(Some(band)),
        _ => Err(unsupported(format!("the source band {text}"))),
    }
}

/// Columns and rows of a file as the VRT states them.
fn stated_size(element: &Element) -> Option<(u32, u32)> {
    let properties = element.child("SourceProperties")?;
    let side = |name: &str| properties.attribute(name)?.trim().parse().ok();
    Some((side("RasterXSize")?, side("RasterYSize")?))
}

/// What the samples of a source are in the terrain.
fn values(element: &Element, sample: SampleType) -> Result<Values, BadRaster> {
    let stated = |name: &str| match element.text_of(name) {
        None => Ok(None),
        Some(text) => match number(text) {
            Some(value) => Ok(Some(value)),
            None => Err(BadRaster::damaged(format!("VRT: {name} is no number"))),
        },
    };
    let no_data = stated("NODATA")?;
    let is_masked = element
        .text_of("UseMaskBand")
        .is_some_and(|text| text.eq_ignore_ascii_case("true") || text == "1");
    Ok(Values::Stored {
        covers: no_data.is_none() && !is_masked,
        no_data,
        scale: stated("ScaleRatio")?.unwrap_or(1.0),
        offset: stated("ScaleOffset")?.unwrap_or(0.0),
        sample,
    })
}
