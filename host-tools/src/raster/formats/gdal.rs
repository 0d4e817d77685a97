//! What GDAL reads and nothing here does: a feature of the build (`gdal`), as it needs
//! GDAL's C library. It is asked last, so that a build with it reads nothing in another
//! way than one without.

use ::gdal::raster::{GdalDataType, GdalType, RasterBand};
use ::gdal::{Dataset, errors::GdalError};

use crate::raster::decoded::{Decoded, sides};
use crate::raster::geometry::metres_in;
use crate::raster::ground_map::GroundMap;
use crate::raster::input::{Data, FileBytes};
use crate::raster::samples::{HoleMask, Samples};
use crate::raster::{BadRaster, OpenOptions, ReferenceSystem};

/// More samples than this are not held in memory.
const MOST_BYTES: u64 = 16 << 30;

/// Reads a file with GDAL; `None` where GDAL does not know it either. What comes out of
/// an archive has no path that GDAL could open.
pub(in crate::raster) fn decode(
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<Option<Decoded>, BadRaster> {
    let Data::File(_, path) = input.data() else {
        return Ok(None);
    };
    let Ok(dataset) = Dataset::open(path) else {
        return Ok(None);
    };
    match dataset.raster_count() {
        // A container of several: which one is for GDAL's own tools to say.
        0 => Ok(None),
        bands => field(&dataset, bands, options).map(Some),
    }
}

fn field(dataset: &Dataset, bands: usize, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let asked = options.band.unwrap_or(1) as usize;
    if asked > bands {
        return Err(BadRaster::NoSuchPart {
            asked: format!("band {asked}"),
            there: format!("the file has bands 1 to {bands}"),
        });
    }
    let band = dataset.rasterband(asked).map_err(fault)?;
    let (columns, rows) = dataset.raster_size();
    let size = sides(columns as u64, rows as u64)?;
    let samples = samples(&band, (columns, rows))?;
    let driver = dataset.driver().short_name();
    let format = format!("{driver} by GDAL, {}", samples.type_name());
    let mut decoded = Decoded::new(format, size, samples);
    decoded.no_data = band.no_data_value();
    decoded.scale = band.scale().unwrap_or(1.0);
    decoded.offset = band.offset().unwrap_or(0.0);
    decoded.storage.set_holes(holes(&band, (columns, rows))?);
    if bands > 1 && options.band.is_none() {
        decoded.remarks.push(format!(
            "it has {bands} bands: the first is taken for the height (--band)"
        ));
    }
    let wkt = dataset
        .spatial_ref()
        .and_then(|system| system.to_wkt())
        .ok();
    let (system, vertical) = wkt.map_or((None, None), |wkt| ReferenceSystem::from_wkt(&wkt));
    decoded.system = system;
    decoded.set_vertical(vertical, metres_in(&band.unit()));
    if let Ok([x, per_column_x, per_row_x, y, per_column_y, per_row_y]) = dataset.geo_transform() {
        let map = GroundMap::new([x, per_column_x, per_row_x], [y, per_column_y, per_row_y]);
        if let Some(map) = map {
            decoded.lay_out(map, None);
        }
    }
    Ok(decoded)
}

fn samples(band: &RasterBand<'_>, size: (usize, usize)) -> Result<Samples, BadRaster> {
    let kind = band.band_type();
    let bytes = (size.0 as u64 * size.1 as u64).saturating_mul(u64::from(kind.bytes()));
    if bytes > MOST_BYTES {
        return Err(BadRaster::TooLarge {
            columns: size.0 as u64,
            rows: size.1 as u64,
            gigabytes: bytes.div_ceil(1_000_000_000),
        });
    }
    Ok(match kind {
        GdalDataType::UInt8 => read::<u8>(band, size)?.into(),
        GdalDataType::UInt16 => read::<u16>(band, size)?.into(),
        GdalDataType::Int16 => read::<i16>(band, size)?.into(),
        GdalDataType::UInt32 => read::<u32>(band, size)?.into(),
        GdalDataType::Int32 => read::<i32>(band, size)?.into(),
        GdalDataType::Float32 => read::<f32>(band, size)?.into(),
        GdalDataType::Unknown => {
            return Err(BadRaster::NotAHeightField(
                "samples of an unknown type".into(),
            ));
        }
        // 64-bit integers become doubles, exact to 2^53.
        _ => read::<f64>(band, size)?.into(),
    })
}

/// Samples that a mask or an alpha band calls no data.
fn holes(band: &RasterBand<'_>, size: (usize, usize)) -> Result<Option<HoleMask>, BadRaster> {
    let flags = band.mask_flags().map_err(fault)?;
    if flags.is_all_valid() || flags.is_nodata() {
        return Ok(None);
    }
    let mask = band.open_mask_band().map_err(fault)?;
    let mut holes = HoleMask::with_capacity(size.0 * size.1);
    for (index, valid) in read::<u8>(&mask, size)?.iter().enumerate() {
        holes.set(index, *valid == 0);
    }
    Ok(Some(holes).filter(|holes| !holes.is_clear()))
}

fn read<T: Copy + GdalType>(
    band: &RasterBand<'_>,
    size: (usize, usize),
) -> Result<Vec<T>, BadRaster> {
    let buffer = band.read_as::<T>((0, 0), size, size, None).map_err(fault)?;
    Ok(buffer.into_shape_and_vec().1)
}

fn fault(error: GdalError) -> BadRaster {
    BadRaster::Damaged(format!("GDAL: {error}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use ::gdal::DriverManager;
    use ::gdal::raster::Buffer;
    use ::gdal::spatial_ref::SpatialRef;

    use super::*;
    use crate::raster::{Error, Raster};

    fn height(column: usize, row: usize) -> f32 {
        100.5 + 7.0 * column as f32 - 3.0 * row as f32
    }

    /// Two bands of 5 × 4 samples, the second 1000 higher, in a format of GDAL's.
    fn write(path: &Path, driver: &str) {
        let driver = DriverManager::get_driver_by_name(driver).expect("a driver");
        let created = driver.create_with_band_type::<f32, _>(path, 5, 4, 2);
        let mut dataset = created.expect("a file");
        let system = SpatialRef::from_epsg(32611).expect("known");
        dataset.set_spatial_ref(&system).expect("set");
        let place = [400_000.0, 30.0, 0.0, 3_800_000.0, 0.0, -30.0];
        dataset.set_geo_transform(&place).expect("set");
        for number in 1..=2 {
            let places = (0..4).flat_map(|row| (0..5).map(move |column| (column, row)));
            let above = 1000.0 * (number - 1) as f32;
            let values = places.map(|(column, row)| match (column, row) {
                (3, 1) => -9999.0,
                _ => height(column, row) + above,
            });
            let mut buffer = Buffer::new((5, 4), values.collect::<Vec<f32>>());
            let mut band = dataset.rasterband(number).expect("a band");
            band.set_no_data_value(Some(-9999.0)).expect("set");
            band.write((0, 0), (5, 4), &mut buffer).expect("written");
        }
    }

    fn open(path: &Path, band: Option<u32>) -> Result<Raster, Error> {
        let options = OpenOptions {
            band,
            ..OpenOptions::default()
        };
        Raster::open(path, &options)
    }

    #[test]
    fn what_only_gdal_reads_is_exact_and_in_its_place() {
        let folder = tempfile::tempdir().expect("a folder");
        for (driver, name) in [
            ("HFA", "erdas.img"),
            ("PCIDSK", "geomatica.pix"),
            ("KEA", "kea.kea"),
        ] {
            if DriverManager::get_driver_by_name(driver).is_err() {
                eprintln!("skipped: this GDAL has no {driver}");
                continue;
            }
            let path = folder.path().join(name);
            write(&path, driver);
            for (band, above) in [(None, 0.0), (Some(2), 1000.0)] {
                let raster = open(&path, band).expect(driver);
                assert_eq!((raster.columns(), raster.rows()), (5, 4));
                assert_eq!(raster.summary().holes, 1, "{driver}");
                assert!(raster.height(3, 2).is_nan(), "{driver}");
                for (column, row) in [(0, 0), (4, 3), (2, 1)] {
                    let found = raster.height(column, 3 - row);
                    let wanted = f64::from(height(column as usize, row as usize)) + above;
                    assert_eq!(found, wanted, "{driver}");
                }
                let bounds = raster.bounds().expect("placed");
                assert_eq!((bounds.west, bounds.south), (400_000.0, 3_799_880.0));
                // Some formats keep a system's parameters and lose its code.
                let degrees = raster.bounds_lonlat().expect("a known projection");
                assert!(
                    (degrees.west + 118.0873).abs() < 1e-3,
                    "{driver}: {degrees:?}"
                );
            }
            let error = open(&path, Some(3)).expect_err("two bands");
            assert!(error.to_string().contains("bands 1 to 2"), "{error}");
        }
    }

    #[test]
    fn what_gdal_does_not_know_keeps_its_own_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("letter.doc");
        std::fs::write(&path, "Dear friend").expect("written");
        let error = open(&path, None).expect_err("no terrain");
        assert!(matches!(error.fault(), BadRaster::UnknownFormat), "{error}");
        let cut = folder.path().join("cut.img");
        write(&cut, "HFA");
        let bytes = std::fs::read(&cut).expect("readable");
        std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("written");
        open(&cut, None).expect_err("half of a file");
    }
}
