//! GDAL's virtual rasters, as `gdalbuildvrt` and `gdal_translate` write them: a size, a place,
//! and sources, each a rectangle of a file's band that fills one of the terrain.
//!
//! The last source counts, and a source's declared no-data lets those below through, as in
//! GDAL. Where no source fills a sample GDAL has the band's no-data or zero; here it is a hole.
//! What is warped or worked out by functions is refused.

mod rectangles;
mod sources;
pub(super) mod xml;

use std::io::Read;
use std::path::{Path, PathBuf};

use super::super::beside;
use super::super::crs::ReferenceSystem;
use super::super::decoded::{Decoded, sides};
use super::super::geometry::metres_in;
use super::super::ground_map::GroundMap;
use super::super::input::FileBytes;
use super::super::samples::SampleType;
use super::super::{BadRaster, OpenOptions};
use super::VRT;
use super::reader::Mosaic;
use super::source::Source;
use crate::remote::is_url;
use sources::Taking;
pub(super) use sources::url as gdal_url;
use xml::{Element, Xml};

/// No VRT is larger, bytes: one of 26,000 files has 20 MB.
const LARGEST: u64 = 128 << 20;

/// What a VRT says.
struct Vrt {
    size: (u32, u32),
    /// x and y: origin, and the steps to the next column and row.
    place: Option<[[f64; 3]; 2]>,
    system: Option<String>,
    band: Band,
    bands: u32,
}

/// What it says of a band.
#[derive(Default)]
struct Band {
    sample: Option<SampleType>,
    no_data: Option<f64>,
    scale: Option<f64>,
    offset: Option<f64>,
    unit: Option<String>,
    sources: Vec<Source>,
}

/// The terrain that a VRT describes.
pub(crate) fn decode(
    input: &FileBytes,
    path: &Path,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    let vrt = read(input, path, options.band, true)?;
    let mut band = vrt.band;
    if band.sources.is_empty() {
        return Err(BadRaster::damaged("VRT: no source of it lies inside of it"));
    }
    let sample = band.sample.unwrap_or(SampleType::U8);
    for source in &mut band.sources {
        source.bytes = bytes_of(source);
    }
    if band.sources.iter().all(|source| source.bytes == 0) {
        return Err(BadRaster::NoTiles(
            "none of the VRT's source files is there".into(),
        ));
    }
    let held = match sample {
        SampleType::U32 | SampleType::I32 | SampleType::F64 => SampleType::F64,
        _ => SampleType::F32,
    };
    let format = format!(
        "VRT, {}, sources: {}",
        sample.none().type_name(),
        band.sources.len()
    );
    let tiles = OpenOptions {
        band: None,
        ..options.clone()
    };
    let mosaic = Mosaic::new(vrt.size, band.sources, held, &tiles);
    let mut decoded = Decoded::new(format, vrt.size, mosaic);
    decoded.no_data = band.no_data;
    decoded.scale = band.scale.unwrap_or(1.0);
    decoded.offset = band.offset.unwrap_or(0.0);
    let (system, vertical) = vrt.system.map_or((None, None), |text| system(&text));
    decoded.set_vertical(vertical, band.unit.and_then(|unit| metres_in(&unit)));
    decoded.system = system;
    if decoded.system.is_none() {
        beside::reference_system(input, &mut decoded)?;
    }
    // The terrain's rows are counted from the south.
    decoded.south_up = true;
    if let Some(place) = vrt.place {
        decoded.lay_out(south_up(place, vrt.size.1)?, None);
    }
    if vrt.bands > 1 && options.band.is_none() {
        decoded.remarks.push(format!(
            "it has {} bands: the first is taken for the height (--band)",
            vrt.bands
        ));
    }
    Ok(decoded)
}

/// The files that a VRT names.
pub(crate) fn sources(input: &FileBytes, path: &Path) -> Result<Vec<PathBuf>, BadRaster> {
    let sources = read(input, path, None, false)?.band.sources;
    let mut files: Vec<_> = sources.into_iter().map(|source| source.path).collect();
    files.sort();
    files.dedup();
    Ok(files)
}

/// Bytes of a source's file; none, with a warning, where it is not there.
fn bytes_of(source: &Source) -> u64 {
    if source.path.to_str().is_some_and(is_url) {
        // How many they are is known when it is opened.
        return 1;
    }
    match std::fs::metadata(&source.path) {
        Ok(metadata) if metadata.is_file() => metadata.len(),
        Ok(_) => {
            tracing::warn!("{} is no file and is a hole", source.path.display());
            0
        }
        Err(error) => {
            tracing::warn!(
                "{} cannot be read and is a hole: {error}",
                source.path.display()
            );
            0
        }
    }
}

/// Reads a VRT; of several bands the one that was `asked` for, else the first.
/// `looks` says whether files may be looked into for their sizes.
fn read(input: &FileBytes, path: &Path, asked: Option<u32>, looks: bool) -> Result<Vrt, BadRaster> {
    if input.len() > LARGEST {
        return Err(BadRaster::AbsurdSize(format!(
            "a VRT of {} bytes",
            input.len()
        )));
    }
    let mut text = String::new();
    let mut reader = input.reader()?.take(LARGEST);
    reader
        .read_to_string(&mut text)
        .map_err(|error| BadRaster::from_io(error, "its text"))?;
    let mut xml = Xml::new(text.trim_start_matches('\u{feff}'));
    let root = xml.next()?.unwrap_or_default();
    if root.name != "VRTDataset" {
        return Err(BadRaster::damaged("VRT: it does not begin with VRTDataset"));
    }
    refuse_kind(&root, &["VRTDataset"])?;
    let size = size(&root)?;
    let mut vrt = Vrt {
        size,
        place: None,
        system: None,
        band: Band::default(),
        bands: 0,
    };
    while let Some(element) = xml.next()? {
        if element.name == "VRTRasterBand" {
            vrt.bands += 1;
            let is_asked = vrt.bands == asked.unwrap_or(1);
            let taking = Taking {
                path,
                size,
                looks,
                elsewhere: input.elsewhere(),
            };
            let band = read_band(&mut xml, &element, taking)?;
            if is_asked {
                vrt.band = band?;
            }
            continue;
        }
        vrt.take(&xml.whole(element)?)?;
    }
    let band = asked.unwrap_or(1);
    match vrt.bands {
        0 => Err(BadRaster::damaged("VRT: it has no band")),
        bands if band == 0 || band > bands => Err(BadRaster::NoSuchPart {
            asked: format!("band {band}"),
            there: format!("the VRT has {bands}"),
        }),
        _ => Ok(vrt),
    }
}

/// Reads a band to its end: what it holds, or why that is refused.
#[allow(clippy::type_complexity)]
fn read_band(
    xml: &mut Xml<'_>,
    start: &Element,
    taking: Taking<'_>,
) -> Result<Result<Band, BadRaster>, BadRaster> {
    let kind = refuse_kind(start, &["VRTRasterBand", "VRTSourcedRasterBand"]);
    let sample = kind.and_then(|()| sample(start.attribute("dataType").unwrap_or("Byte")));
    let mut band = sample.map(|sample| Band {
        sample: Some(sample),
        ..Band::default()
    });
    if start.is_empty {
        return Ok(band);
    }
    while let Some(element) = xml.next()? {
        let element = xml.whole(element)?;
        if let Ok(taken) = &mut band
            && let Err(fault) = taken.take(&element, &taking)
        {
            band = Err(fault);
        }
    }
    Ok(band)
}

/// What is derived, warped or sharpened is not read.
fn refuse_kind(element: &Element, known: &[&str]) -> Result<(), BadRaster> {
    match element.attribute("subClass") {
        Some(kind) if !known.contains(&kind) => Err(unsupported(kind)),
        _ => Ok(()),
    }
}

fn unsupported(what: impl Into<String>) -> BadRaster {
    BadRaster::Unsupported {
        format: VRT,
        feature: what.into(),
    }
}

fn size(root: &Element) -> Result<(u32, u32), BadRaster> {
    let side = |name: &str| {
        let side = root
            .attribute(name)
            .and_then(|text| text.trim().parse::<i64>().ok());
        side.ok_or_else(|| BadRaster::damaged(format!("VRT: its {name} is no number")))
    };
    let (columns, rows) = (side("rasterXSize")?, side("rasterYSize")?);
    let most = i64::from(i32::MAX);
    if !(1..=most).contains(&columns) || !(1..=most).contains(&rows) {
        return Err(BadRaster::AbsurdSize(format!("{columns} × {rows} samples")));
    }
    sides(columns as u64, rows as u64)
}

impl Vrt {
    /// Takes what is beside the bands.
    fn take(&mut self, element: &Element) -> Result<(), BadRaster> {
        match element.name.as_str() {
            "SRS" => self.system = Some(element.text.trim().to_owned()),
            "GeoTransform" => {
                let numbers = element
                    .text
                    .split(',')
                    .map(|text| text.trim().parse::<f64>());
                let numbers: Result<Vec<_>, _> = numbers.collect();
                let Ok([x, east, x_skew, y, y_skew, north]) = numbers.as_deref() else {
                    return Err(BadRaster::damaged(
                        "VRT: its GeoTransform is not six numbers",
                    ));
                };
                if *east < 0.0 {
                    return Err(unsupported(
                        "a mirrored grid, whose first column is the easternmost,",
                    ));
                }
                self.place = Some([[*x, *east, *x_skew], [*y, *y_skew, *north]]);
            }
            "MaskBand" => return Err(unsupported("a mask band")),
            _ => {}
        }
        Ok(())
    }
}

impl Band {
    /// Takes what is in a band.
    fn take(&mut self, element: &Element, taking: &Taking<'_>) -> Result<(), BadRaster> {
        let number = || {
            let number = xml::number(&element.text);
            number.ok_or_else(|| BadRaster::damaged(format!("VRT: {} is no number", element.name)))
        };
        match element.name.as_str() {
            "NoDataValue" => self.no_data = Some(number()?),
            "Scale" => self.scale = Some(number()?),
            "Offset" => self.offset = Some(number()?),
            "UnitType" => self.unit = Some(element.text.trim().to_owned()),
            "SimpleSource" | "ComplexSource" => {
                let sample = self.sample.unwrap_or(SampleType::U8);
                self.sources.extend(taking.source(element, sample)?);
            }
            "MaskBand" => return Err(unsupported("a mask band")),
            "PixelFunctionType" | "PixelFunctionCode" => {
                return Err(unsupported("a pixel function"));
            }
            name if name.ends_with("Source") => return Err(unsupported(name)),
            _ => {}
        }
        Ok(())
    }
}

/// The type of samples by GDAL's name for it.
fn sample(name: &str) -> Result<SampleType, BadRaster> {
    Ok(match name {
        "Byte" | "UInt8" => SampleType::U8,
        "Int8" => SampleType::I8,
        "UInt16" => SampleType::U16,
        "Int16" => SampleType::I16,
        "UInt32" => SampleType::U32,
        "Int32" => SampleType::I32,
        "Float16" | "Float32" => SampleType::F32,
        "Float64" | "Int64" | "UInt64" => SampleType::F64,
        _ => return Err(unsupported(format!("samples of the type {name}"))),
    })
}

/// The reference system in a text: a code or WKT.
fn system(text: &str) -> (Option<ReferenceSystem>, Option<super::super::crs::Vertical>) {
    let code = text
        .strip_prefix("EPSG:")
        .and_then(|code| code.parse().ok());
    match code {
        Some(code) => (ReferenceSystem::from_code(code), None),
        None => ReferenceSystem::from_wkt(text),
    }
}

/// The place of rows that are counted from the south. The file's first row is the northernmost
/// but where its rows already go north.
fn south_up(place: [[f64; 3]; 2], rows: u32) -> Result<GroundMap, BadRaster> {
    let nowhere = || BadRaster::damaged("VRT: its GeoTransform places it nowhere");
    let [x, y] = place;
    let map = GroundMap::new(x, y).ok_or_else(nowhere)?;
    if map.is_south_up() {
        return Err(unsupported("a grid whose first row is the southernmost"));
    }
    let turned = |[at, column, row]: [f64; 3]| [at + row * f64::from(rows), column, -row];
    GroundMap::new(turned(x), turned(y)).ok_or_else(nowhere)
}
