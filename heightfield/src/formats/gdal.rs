//! What GDAL reads and nothing here does, block by block, through a libgdal that is found when a
//! file wants it. It is asked last, so that a machine with it reads nothing in another way than one
//! without.

use std::hash::Hasher;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use heightfield_gdal::{
    Band, Dataset, Error, Library, Mask, Sample, SampleType as Stored, Settings, Window,
};
use twox_hash::XxHash64;

use crate::blocks::{
    Block, BlockImage, BlockReader, LARGEST_BLOCK_BYTES, Looks, Part, usual_block,
};
use crate::decoded::{Decoded, sides};
use crate::formats::headered;
use crate::geometry::metres_in;
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::samples::{HoleMask, SampleType, with_samples};
use crate::{BadRaster, OpenOptions, ReferenceSystem, thinned};

/// The format's name in messages.
const NAME: &str = "GDAL";
/// When a file that stays on disk is opened, so many places each way are looked at.
const PLACES: u32 = 6;
/// Drivers that take any file for samples that has a header beside it.
const BY_HEADER: [&str; 2] = ["ENVI", "EHdr"];
/// Enough to tell a file's kind.
const HEAD_BYTES: u64 = 1024;
/// Colour pictures have three bands, or four, of bytes.
const COLOURS: std::ops::RangeInclusive<u32> = 3..=4;

/// The libgdal of this machine; it is loaded the first time.
///
/// # Errors
/// Why there is none that can be used.
pub(crate) fn library() -> Result<Library, Error> {
    Library::load(Settings::default())
}

/// Reads a file, folder or whatever else a driver opens; none where no driver does, or there is no
/// libgdal.
///
/// # Errors
/// What is wrong with it, once a driver has opened it.
pub(crate) fn decode(path: &Path, options: &OpenOptions) -> Result<Option<Decoded>, BadRaster> {
    let library = match library() {
        Ok(library) => library,
        Err(why) => {
            tracing::debug!("{} is not given to GDAL: {why}", path.display());
            return Ok(None);
        }
    };
    let Ok(dataset) = library.open(path, &[]) else {
        return Ok(None);
    };
    if BY_HEADER.contains(&dataset.driver().as_str()) && is_of_another_kind(path, options)? {
        return Ok(None);
    }
    let dataset = match chosen(&dataset, options)? {
        Some(name) => library.open(Path::new(&name), &[]).map_err(fault)?,
        None => dataset,
    };
    decoded(dataset, options).map(Some)
}

/// Whether the content is of a kind that has no samples by a header beside it.
fn is_of_another_kind(path: &Path, options: &OpenOptions) -> Result<bool, BadRaster> {
    let input = FileBytes::open(path, &options.elsewhere)?;
    Ok(headered::is_of_another_kind(&input.head(HEAD_BYTES)?))
}

/// The name of the raster to take, where the file holds several.
fn chosen(dataset: &Dataset, options: &OpenOptions) -> Result<Option<String>, BadRaster> {
    let parts = dataset.subdatasets();
    // As `depth` of `NETCDF:"ocean.nc":depth`.
    let short = |name: &str| name.rsplit([':', '/']).next().unwrap_or(name).to_owned();
    let names: Vec<_> = parts.iter().map(|part| short(&part.name)).collect();
    match &options.variable {
        Some(asked) => {
            let is_asked = |name: &str| name == asked || short(name) == *asked;
            let part = parts.iter().find(|part| is_asked(&part.name));
            let part = part.ok_or_else(|| BadRaster::NoSuchPart {
                asked: format!("variable {asked}"),
                there: match parts.is_empty() {
                    true => "the file holds one raster".to_owned(),
                    false => format!("the file holds {}", names.join(", ")),
                },
            })?;
            Ok(Some(part.name.clone()))
        }
        None if dataset.bands() > 0 => Ok(None),
        None => match &parts[..] {
            [] => Err(BadRaster::NoNumbers("it holds no raster".into())),
            [only] => Ok(Some(only.name.clone())),
            _ => Err(BadRaster::SeveralHeights {
                kind: "raster",
                names,
            }),
        },
    }
}

fn decoded(dataset: Dataset, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let bands = dataset.bands();
    let number = options.band.unwrap_or(1);
    let band = dataset.band(number).map_err(fault)?;
    let stored = band.sample_type();
    let stored = stored.map_err(|name| BadRaster::NotAHeightField(format!("samples of {name}")))?;
    if options.band.is_none() && stored == Stored::U8 && COLOURS.contains(&bands) {
        return Err(BadRaster::ColourBands {
            what: format!("a picture of {bands} bands of bytes"),
            bands: bands as u16,
        });
    }
    let [columns, rows] = band.size();
    let size = sides(columns.into(), rows.into())?;
    let (no_data, scale, offset) = (band.no_data(), band.scale(), band.offset());
    let unit = band.unit();
    let (driver, map, wkt) = (dataset.driver(), dataset.geo_transform(), dataset.wkt());
    let blocks = GdalBlocks::new(dataset, number, held(stored))?;
    let format = format!("{driver} by GDAL, {}", blocks.held.none().type_name());
    let samples = u64::from(columns) * u64::from(rows);
    let mut decoded = match samples * blocks.held.bytes() > options.most_in_memory_bytes {
        true => {
            // A packing that GDAL cannot undo is known here, and is no hole.
            blocks.read(0, &blocks.images[0].part([0, 0]))?;
            Decoded::new(format, size, blocks)
        }
        false => {
            let all = blocks.read(0, &Part::whole(columns, rows))?;
            let mut decoded = Decoded::new(format, size, all.samples);
            decoded.storage.set_holes(all.holes);
            decoded
        }
    };
    decoded.no_data = no_data;
    decoded.scale = scale.unwrap_or(1.0);
    decoded.offset = offset.unwrap_or(0.0);
    if bands > 1 && options.band.is_none() {
        decoded.remarks.push(format!(
            "it has {bands} bands: the first is taken for the height (--band)"
        ));
    }
    if driver == "VRT" && no_data.is_none() {
        decoded.remarks.push(
            "it is read by GDAL, which has height 0 where no file of a VRT is: for holes, make it with a no-data value (gdalbuildvrt -vrtnodata)"
                .into(),
        );
    }
    let of_wkt = wkt.map(|wkt| ReferenceSystem::from_wkt(&wkt));
    let (system, vertical) = of_wkt.unwrap_or((None, None));
    decoded.system = system;
    decoded.set_vertical(vertical, unit.as_deref().and_then(metres_in));
    if let Some([x, x_column, x_row, y, y_column, y_row]) = map
        && let Some(map) = GroundMap::new([x, x_column, x_row], [y, y_column, y_row])
    {
        decoded.lay_out(map, None);
    }
    Ok(decoded)
}

/// The type in which samples are held.
const fn held(stored: Stored) -> SampleType {
    match stored {
        Stored::U8 => SampleType::U8,
        Stored::I8 => SampleType::I8,
        Stored::U16 => SampleType::U16,
        Stored::I16 => SampleType::I16,
        Stored::U32 => SampleType::U32,
        Stored::I32 => SampleType::I32,
        Stored::F16 | Stored::F32 => SampleType::F32,
        // Exact to 2^53.
        Stored::U64 | Stored::I64 | Stored::F64 => SampleType::F64,
    }
}

/// A band in its file.
struct GdalBlocks {
    /// GDAL is used by one thread at a time.
    dataset: Mutex<Dataset>,
    /// Number of the band.
    number: u32,
    held: SampleType,
    images: Vec<BlockImage>,
    /// Of each image but the full one, its number among the band's overviews.
    overviews: Vec<usize>,
    is_masked: bool,
    index: u64,
}

impl GdalBlocks {
    fn new(dataset: Dataset, number: u32, held: SampleType) -> Result<Self, BadRaster> {
        let band = dataset.band(number).map_err(fault)?;
        let is_masked = band.mask() == Mask::Band;
        let full = image(&band);
        let samples = band.block_size().map(u64::from).iter().product::<u64>();
        if samples.saturating_mul(held.bytes()) > LARGEST_BLOCK_BYTES {
            let [columns, rows] = band.block_size();
            return Err(BadRaster::Unsupported {
                format: NAME,
                feature: format!("a file that is read {columns} × {rows} samples at once"),
            });
        }
        // Those that GDAL would serve a coarse view of the band by.
        let overviews = band.overviews();
        let mut coarser: Vec<_> = (0..overviews.len())
            .filter(|at| {
                let [own, of_full] = [&overviews[*at], &band].map(Band::size);
                own < of_full && (own[0] > 1 && own[1] > 1)
            })
            .filter(|at| !is_masked || overviews[*at].mask() == Mask::Band)
            .collect();
        coarser.sort_by_key(|at| std::cmp::Reverse(overviews[*at].size()));
        coarser.dedup_by_key(|at| overviews[*at].size());
        let images: Vec<_> = (coarser.iter().map(|at| image(&overviews[*at]))).collect();
        let mut hasher = XxHash64::with_seed(0);
        for side in full
            .block
            .iter()
            .chain([&full.columns, &full.rows, &number])
        {
            hasher.write_u32(*side);
        }
        hasher.write(dataset.driver().as_bytes());
        Ok(Self {
            number,
            held,
            images: [full].into_iter().chain(images).collect(),
            overviews: coarser,
            is_masked,
            index: hasher.finish(),
            dataset: Mutex::new(dataset),
        })
    }

    fn dataset(&self) -> MutexGuard<'_, Dataset> {
        // A panic in between has changed nothing of it.
        self.dataset.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An image as the rest of the program knows it, in blocks of a few of GDAL's.
fn image(band: &Band<'_>) -> BlockImage {
    let [columns, rows] = band.size();
    let [across, down] = band.block_size();
    BlockImage {
        columns,
        rows,
        block: usual_block([across.min(columns.max(1)), down.min(rows.max(1))]),
        every: None,
        first: [0; 2],
    }
}

impl BlockReader for GdalBlocks {
    fn format(&self) -> &'static str {
        NAME
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.held
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        true
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, BadRaster> {
        let dataset = self.dataset();
        let full = dataset.band(self.number).map_err(fault)?;
        let band = match image.checked_sub(1) {
            None => full,
            Some(coarser) => {
                let overviews = full.overviews();
                let overview = (self.overviews.get(coarser)).and_then(|at| overviews.get(*at));
                *overview.ok_or_else(|| BadRaster::damaged("GDAL: an overview has gone"))?
            }
        };
        let mut samples = self.held.none();
        with_samples!(&mut samples, values => *values = read(&band, part)?);
        let mask = self.is_masked.then(|| band.mask_band()).flatten();
        let holes = mask.map(|mask| holes(&mask, part)).transpose()?;
        Ok(Block {
            samples,
            holes: holes.filter(|holes| !holes.is_clear()),
            is_lacking: false,
        })
    }

    fn index(&self) -> u64 {
        self.index
    }

    fn looks(&self) -> Option<Looks> {
        // Overviews show all of it at once.
        match &self.images[..] {
            [full] => Some(thinned::places(full, PLACES)),
            _ => None,
        }
    }
}

fn read<T: Sample>(band: &Band<'_>, part: &Part) -> Result<Vec<T>, BadRaster> {
    let count = part.columns as usize * part.rows as usize;
    let mut samples = vec![T::default(); count];
    let window = Window {
        column: part.column,
        row: part.row,
        columns: part.columns,
        rows: part.rows,
    };
    band.read(window, &mut samples).map_err(fault)?;
    Ok(samples)
}

/// Samples that a mask or an alpha band calls none.
fn holes(mask: &Band<'_>, part: &Part) -> Result<HoleMask, BadRaster> {
    let valid = read::<u8>(mask, part)?;
    let mut holes = HoleMask::with_capacity(valid.len());
    for (at, valid) in valid.iter().enumerate() {
        holes.set(at, *valid == 0);
    }
    Ok(holes)
}

fn fault(error: Error) -> BadRaster {
    match error {
        Error::NoSuchPart { asked, there } => BadRaster::NoSuchPart { asked, there },
        error => BadRaster::Unfamiliar(error.to_string()),
    }
}
