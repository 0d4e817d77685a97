//! All formats that are not implemented here, in blocks, through a libgdal that is loaded when a
//! file needs it. It is tried last, so that all other files are read in the same way with and
//! without it.
//!
//! The steps are: make a name for GDAL, also for a URL (`place`, `at_url`); list an archive
//! (`packed`); open the file or its label; choose one of several rasters; and read its first band
//! in blocks (`blocks`). Results that contradict the file's meaning are corrected: NetCDF's depths
//! and places (`netcdf`), and STAC items that do not state the places of their files (`stac`).

mod at_url;
mod blocks;
mod names;
mod netcdf;
mod packed;
mod place;
mod stac;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use heightfield_gdal::{Dataset, Error, Library, SampleType as Stored};

use super::{flt_bil, height_name, is_read_here};
use crate::blocks::{BlockReader, Part};
use crate::decoded::{Decoded, sides};
use crate::encoding::no_codes;
use crate::file_layout::FileLayout;
use crate::geometry::{metres_in, unknown_unit};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::{OpenOptions, RasterError, ReferenceSystem, gdal};
use blocks::{GdalBlocks, Source, Transposed, memory_type};
pub(crate) use names::by_beginning;
use place::Place;

/// The name in messages.
const NAME: &str = "GDAL";
/// Drivers that read any file with a header beside it as samples.
const BY_HEADER: [&str; 2] = ["ENVI", "EHdr"];
/// Drivers that combine many files.
const COMBINING_DRIVERS: [&str; 2] = ["VRT", "STACIT"];
/// Enough bytes to recognise a file's kind.
const HEAD_BYTES: u64 = 1024;
/// Number of bands of a colour picture, of bytes.
const COLOURS: std::ops::RangeInclusive<u32> = 3..=4;
/// Parts of GDAL's messages about a file without a driver.
const UNKNOWN: [&str; 2] = ["not recognized as", "no driver supports"];

/// Reads a file, folder or other source that a driver opens.
///
/// # Errors
/// [`RasterError::UnknownFormat`] if no driver does; [`RasterError::NeedsGdal`] without a libgdal;
/// else the file's fault.
pub(crate) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let head = head(path, options)?;
    let library = gdal().map_err(|why| match names::of(path, &head) {
        Some(format) => RasterError::NeedsGdal { format, why },
        None => RasterError::UnknownFormat,
    })?;
    let place = Place::of(&library, path, &head, &options.fetcher)?;
    let packing = packed::Packing::of(&head);
    let place = Arc::new(match packing {
        Some(_) => place.with_new_name()?,
        None => place,
    });
    let decoded = match packing {
        Some(packing) => of_archive(packing, &library, &place, &head, options),
        None => opened(&library, &place, &place.path, &head, options),
    };
    match (decoded, place.take_fault()) {
        (Ok(decoded), None) => Ok(decoded),
        (_, Some(error)) => Err(at_url::fault(error)),
        (Err(fault), None) => Err(place.in_words(fault)),
    }
}

fn of_archive(
    packing: packed::Packing,
    library: &Library,
    place: &Arc<Place>,
    head: &[u8],
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    let (entry, options) = packing.entry(library, place, options)?;
    let mut decoded = opened(library, place, &entry, head, &options)?;
    decoded.format = format!("{} in {}", decoded.format, packing.name());
    Ok(decoded)
}

/// Returns the files that a GDAL-only file references, and those beside it.
pub(crate) fn files_read_with(path: &Path) -> Vec<PathBuf> {
    let options = OpenOptions::default();
    let is_own = head(path, &options).is_ok_and(|head| is_read_here(&head));
    match gdal() {
        Ok(library) if !is_own => {
            open(&library, path, &options).map_or(Vec::new(), |it| it.files())
        }
        _ => Vec::new(),
    }
}

/// Returns the reference system that GDAL finds in a file.
pub(crate) fn system_of(input: &FileBytes) -> Option<ReferenceSystem> {
    let library = gdal().ok()?;
    let place = Place::of(&library, input.path()?, &[], input.fetcher()).ok()?;
    let dataset = library.open(&place.path, &[]).ok()?;
    ReferenceSystem::from_wkt(&dataset.wkt()?).0
}

/// Returns the first bytes; empty for a folder.
fn head(path: &Path, options: &OpenOptions) -> Result<Vec<u8>, RasterError> {
    match path.is_dir() {
        true => Ok(Vec::new()),
        false => FileBytes::open(path, &options.fetcher)?.head(HEAD_BYTES),
    }
}

fn opened(
    library: &Library,
    place: &Arc<Place>,
    path: &Path,
    head: &[u8],
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    let of_stac = || stac::refused(place, options);
    if place.is_served()
        && let Some(refused) = of_stac()?
    {
        return Err(refused);
    }
    let dataset = match open(library, path, options) {
        Err(RasterError::UnknownFormat) => match find_label(path) {
            Some(label) => {
                let mut decoded = opened(library, place, &label, head, options)?;
                let name = label.file_name().unwrap_or_default().display().to_string();
                decoded
                    .remarks
                    .push(format!("it is read by its label {name}"));
                return Ok(decoded);
            }
            None if path.is_dir() && names::of(path, head).is_some() => {
                return Err(no_raster(&format!("version {}", library.version())));
            }
            None => return Err(of_stac()?.unwrap_or(RasterError::UnknownFormat)),
        },
        Err(fault @ RasterError::ByGdal(_)) => return Err(of_stac()?.unwrap_or(fault)),
        dataset => dataset?,
    };
    place.check_files(&dataset, head)?;
    let driver = dataset.driver();
    if BY_HEADER.contains(&driver.as_str()) && flt_bil::is_of_another_kind(head) {
        return Err(RasterError::UnknownFormat);
    }
    if driver == "GRASSASCIIGrid" && has_stars(place, options)? {
        let why = "it reads * as a height of 0: write a number for no data (r.out.ascii null_value=-9999)";
        return Err(RasterError::ByGdal(Error::Refused(why.into())));
    }
    let part = match chosen(&dataset, options) {
        Err(fault @ (RasterError::SeveralHeights { .. } | RasterError::NoSuchPart { .. })) => {
            return Err(of_stac()?.unwrap_or(fault));
        }
        part => part?,
    };
    let (dataset, name) = match part {
        Some(name) => {
            let part = library.open_part(&name, &open_options(options));
            let part = part.map_err(fault)?;
            place.check_files(&part, head)?;
            (part, name)
        }
        None => (dataset, path.display().to_string()),
    };
    stac::check_places(library, &dataset, place, options)?;
    decoded(library, place, dataset, name, options)
}

fn open_options(options: &OpenOptions) -> Vec<&str> {
    options.open_options.iter().map(String::as_str).collect()
}

fn open(library: &Library, path: &Path, options: &OpenOptions) -> Result<Dataset, RasterError> {
    library.open(path, &open_options(options)).map_err(fault)
}

/// Returns true if a text contains a star, which GRASS writes for no-data.
fn has_stars(place: &Place, options: &OpenOptions) -> Result<bool, RasterError> {
    let input = FileBytes::open(&place.source, &options.fetcher)?;
    let mut reader = input.reader()?;
    loop {
        let chunk = reader.fill_buf().map_err(RasterError::Unreadable)?;
        if chunk.is_empty() || chunk.contains(&b'*') {
            return Ok(!chunk.is_empty());
        }
        let read = chunk.len();
        reader.consume(read);
    }
}

/// Returns the label of a planetary image, a separate file beside it.
fn find_label(path: &Path) -> Option<PathBuf> {
    let labels = ["lbl", "LBL", "xml", "XML"].map(|end| path.with_extension(end));
    labels
        .into_iter()
        .find(|label| label != path && label.is_file())
}

/// Returns the error for a file of a known kind in which this GDAL finds no raster.
fn no_raster(who: &str) -> RasterError {
    RasterError::ByGdal(Error::Refused(format!("{who} finds no raster in it")))
}

/// Returns the name of the chosen raster, if the file contains several.
fn chosen(dataset: &Dataset, options: &OpenOptions) -> Result<Option<String>, RasterError> {
    // `depth` for `NETCDF:"ocean.nc":depth`.
    let short = |name: &str| {
        let last = name.rsplit([':', '/']).next().unwrap_or(name);
        last.trim_start_matches("asset=").to_owned()
    };
    let requested = options.variable.as_deref();
    let parts = dataset.subdatasets();
    let names: Vec<_> = parts.iter().map(|part| short(&part.name)).collect();
    let exact = parts
        .iter()
        .position(|part| Some(part.name.as_str()) == requested);
    if dataset.bands() > 0
        && (requested.is_none() || requested == netcdf::variable(dataset).as_deref())
    {
        return Ok(None);
    }
    if parts.is_empty() {
        return Err(match requested {
            Some(requested) => RasterError::NoSuchPart {
                requested: format!("variable {requested}"),
                available: "the file contains one raster".into(),
            },
            None => no_raster(&format!("its driver {}", dataset.driver())),
        });
    }
    let at = match exact {
        Some(at) => at,
        None => {
            // These are cell limits, not heights.
            let is_height = |name: &&String| !name.ends_with("_bnds") && !name.ends_with("_bounds");
            let named: Vec<_> = names.iter().filter(is_height).map(String::as_str).collect();
            let at = height_name::choose("raster", &named, netcdf::HEIGHT_NAMES, requested)?;
            let is_it = |name: &String| name == named[at];
            names.iter().position(is_it).unwrap_or_default()
        }
    };
    Ok(Some(parts[at].name.clone()))
}

fn decoded(
    library: &Library,
    place: &Arc<Place>,
    dataset: Dataset,
    name: String,
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    let bands = dataset.bands();
    let number = options.band.unwrap_or(1);
    let band = dataset.band(number).map_err(fault)?;
    let stored = band.sample_type();
    let stored =
        stored.map_err(|name| RasterError::NotAHeightField(format!("samples of {name}")))?;
    let has_codes = options.encoding.is_some();
    if has_codes {
        check_codes(stored, bands, options)?;
    } else if options.band.is_none() && stored == Stored::U8 && COLOURS.contains(&bands) {
        return Err(RasterError::ColourBands {
            what: format!("a picture of {bands} bands of bytes"),
            bands: bands as u16,
        });
    }
    let (no_data, scale, offset) = (band.no_data(), band.scale(), band.offset());
    let unit = band.unit();
    let (driver, map, wkt) = (dataset.driver(), dataset.geo_transform(), dataset.wkt());
    let conventions = netcdf::Conventions::of(library, &place.path, &dataset, &band)?;
    let block = band.block_size();
    let source = Source {
        place: place.clone(),
        name,
        options: options.open_options.clone(),
    };
    let blocks = GdalBlocks::new(source, dataset, number, memory_type(stored), has_codes)?;
    let overviews = blocks.images().iter().skip(1);
    let file_layout = FileLayout {
        bands,
        block: Some(block),
        overviews: overviews.map(|image| [image.columns, image.rows]).collect(),
        raster_type: None,
    };
    let mut decoded = match conventions.is_turned {
        true => read(Transposed::new(blocks), &driver, options)?,
        false => read(blocks, &driver, options)?,
    };
    decoded.file_layout = file_layout;
    decoded.no_data = no_data;
    decoded.scale = scale.unwrap_or(1.0);
    decoded.offset = offset.unwrap_or(0.0);
    if bands > 1 && options.band.is_none() && !has_codes {
        decoded.remarks.push(format!(
            "it has {bands} bands: the first is used as the height (--input band=N)"
        ));
    }
    if COMBINING_DRIVERS.contains(&driver.as_str()) && no_data.is_none() {
        decoded.remarks.push(
            "it is read by GDAL, which has height 0 where none of its files is: to mark no data, build it with a no-data value (gdalbuildvrt -vrtnodata)"
                .into(),
        );
    }
    let of_wkt = wkt.map(|wkt| ReferenceSystem::from_wkt(&wkt));
    let (system, vertical) = of_wkt.unwrap_or((None, None));
    let map = conventions.placed(map, system.as_ref());
    decoded.system = system;
    let unit = unit.filter(|unit| !unit.is_empty());
    let metres = unit.as_deref().map(metres_in);
    decoded.set_vertical(vertical, metres.flatten());
    if let (Some(unit), Some(None)) = (&unit, metres) {
        decoded.remarks.push(unknown_unit(unit));
    }
    conventions.describe(&mut decoded);
    if let Some([x, x_column, x_row, y, y_column, y_row]) = map
        && let Some(map) = GroundMap::new([x, x_column, x_row], [y, y_column, y_row])
    {
        decoded.set_layout(map, None);
    }
    if let Some(encoding) = options.encoding {
        decoded.decode_as_codes(encoding);
    }
    Ok(decoded)
}

/// Checks that a file has colours that may encode heights.
fn check_codes(stored: Stored, bands: u32, options: &OpenOptions) -> Result<(), RasterError> {
    match options.band {
        Some(band) => Err(RasterError::NoSuchPart {
            requested: format!("band {band} with --input encoding=…"),
            available: "three bands together are one height".into(),
        }),
        None if stored == Stored::U8 && COLOURS.contains(&bands) => Ok(()),
        None => Err(no_codes("the file has other bands")),
    }
}

/// Reads the samples into memory if they are few, else leaves them in the file.
fn read(
    blocks: impl BlockReader + 'static,
    driver: &str,
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    let full = blocks.images()[0];
    let size = sides(full.columns.into(), full.rows.into())?;
    let sample_type = blocks.sample_type();
    let format = format!("{driver} by GDAL, {}", sample_type.none().type_name());
    let samples = u64::from(full.columns) * u64::from(full.rows);
    if samples * sample_type.bytes() > options.max_in_memory_bytes {
        // Fails now if GDAL cannot decompress the samples; later, they would be no-data.
        blocks.read(0, &full.part([0, 0]))?;
        return Ok(Decoded::new(format, size, blocks));
    }
    let all = blocks.read(0, &Part::whole(full.columns, full.rows))?;
    let mut decoded = Decoded::new(format, size, all.samples);
    decoded.storage.set_no_data(all.no_data_mask);
    Ok(decoded)
}

fn fault(error: Error) -> RasterError {
    match error {
        Error::NoSuchPart {
            requested,
            available,
        } => RasterError::NoSuchPart {
            requested,
            available,
        },
        Error::Refused(words) if UNKNOWN.iter().any(|unknown| words.contains(unknown)) => {
            RasterError::UnknownFormat
        }
        Error::NotOpened { .. } => RasterError::Unreadable(std::io::Error::other(error)),
        error => RasterError::ByGdal(error),
    }
}
