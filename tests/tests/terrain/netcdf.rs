//! NetCDF files, through a libgdal of the machine: many ways to store a variable, written by
//! NetCDF's and HDF5's libraries (`data/netcdf.py` has the command), and many attributes, written
//! here. Reading on demand returns the same bits as reading the whole file.

use std::fs;
use std::path::{Path, PathBuf};

use heightfield::{OpenOptions, Raster, RasterError, Wait, gdal};

const SIZE: (u32, u32) = (90, 70);
const NO_DATA: (u32, u32) = (3, 4);

const FILES: [&str; 11] = [
    "big_endian.nc",
    "classic.nc",
    "classic_records.nc",
    "contiguous.nc",
    "depths.nc",
    "growing.nc",
    "packed.nc",
    "southern.nc",
    "time.nc",
    "turned.nc",
    "turned_contiguous.nc",
];

/// Returns true if there is a libgdal; prints a message otherwise.
fn has_gdal() -> bool {
    gdal()
        .inspect_err(|why| eprintln!("skipped: {why}"))
        .is_ok()
}

/// Returns all of them; none without a libgdal.
fn files() -> impl Iterator<Item = &'static str> {
    FILES.into_iter().filter(|_| has_gdal())
}

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/netcdf")
        .join(name)
}

/// Returns the height at a column and a row from the north, as in `netcdf.py`.
fn height(column: u32, row: u32) -> f64 {
    f64::from(20 + (3 * column + 2 * row + (column * row) % 5) % 230)
}

fn windows() -> OpenOptions {
    OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    }
}

fn open(path: &Path, options: &OpenOptions) -> Raster {
    let raster = Raster::open(path, options);
    raster.unwrap_or_else(|error| panic!("{error}"))
}

/// Returns all samples of a level, from the southernmost row.
fn samples(raster: &Raster, level: u8) -> Vec<Vec<f64>> {
    let step = 1 << level;
    let (columns, rows) = (SIZE.0.div_ceil(step), SIZE.1.div_ceil(step));
    let row = |row| {
        let mut heights = vec![0.0; columns as usize];
        assert!(
            raster
                .read_row(level, row, 0, &mut heights, Wait::UntilRead)
                .is_complete()
        );
        heights
    };
    (0..rows).map(row).collect()
}

fn bits(samples: &[Vec<f64>]) -> Vec<u64> {
    let all = samples.iter().flatten();
    all.map(|height| {
        if height.is_nan() {
            u64::MAX
        } else {
            height.to_bits()
        }
    })
    .collect()
}

#[test]
fn every_netcdf_storage_yields_the_same_samples_in_windows() {
    for name in files() {
        let whole = open(&path(name), &OpenOptions::default());
        let touched = open(&path(name), &windows());
        assert!(
            whole.samples().is_some() && touched.samples().is_none(),
            "{name}"
        );
        for level in 0..=6 {
            let [whole, touched] = [&whole, &touched].map(|raster| bits(&samples(raster, level)));
            assert_eq!(whole, touched, "{name}, level {level}");
        }
        let places = [
            [0.5, 0.25],
            [13.75, 69.0],
            [88.9, 0.1],
            [2.5, 65.5],
            [40.0, 33.3],
        ];
        for place in places {
            let [one, other] = [&whole, &touched].map(|raster| raster.surface(0, place).to_bits());
            assert_eq!(one, other, "{name} {place:?}");
        }
        assert_eq!(whole.format(), touched.format(), "{name}");
        assert_eq!(
            whole.bounds().map(|b| [b.west, b.south, b.east, b.north]),
            touched.bounds().map(|b| [b.west, b.south, b.east, b.north]),
            "{name}"
        );
        assert_eq!(whole.remarks(), touched.remarks(), "{name}");
        assert!(
            touched.memory_bytes() <= 256 << 20,
            "{name}: {}",
            touched.memory_bytes()
        );
        // The same file is the same terrain.
        let again = open(&path(name), &windows());
        assert_eq!(samples(&again, 0).len(), SIZE.1 as usize);
    }
}

#[test]
fn every_netcdf_storage_yields_the_exact_field() {
    for name in files() {
        let raster = open(&path(name), &windows());
        let sign = if name == "depths.nc" { -1.0 } else { 1.0 };
        let rows = samples(&raster, 0);
        for row in 0..SIZE.1 {
            for column in 0..SIZE.0 {
                let found = rows[(SIZE.1 - 1 - row) as usize][column as usize];
                let expected = sign * height(column, row);
                match name {
                    // Its valid range, in stored numbers.
                    "packed.nc" if expected > 300.0 => {
                        assert!(found.is_nan(), "{name}: {column} {row}");
                    }
                    _ if (column, row) == NO_DATA => {
                        assert!(found.is_nan(), "{name}: {column} {row}: {found}");
                    }
                    _ => assert_eq!(found, expected, "{name}: {column} {row}"),
                }
            }
        }
        let bounds = raster.bounds().expect("its place");
        for (found, expected) in [(bounds.west, 7.995), (bounds.north, 50.005)] {
            assert!((found - expected).abs() < 1e-9, "{name}: {found}");
        }
    }
}

/// An attribute of text.
type Attribute<'a> = (&'a str, &'a str);

/// Writes NetCDF's classic format: `x` and `y`, a grid mapping, and variables of 4 × 3 singles,
/// which are 1 to 12 from the north.
fn classic(
    axes: &[Attribute<'_>],
    mapping: &[Attribute<'_>],
    heights: &[(&str, &[Attribute<'_>])],
) -> Vec<u8> {
    let mut file = b"CDF\x01\0\0\0\0".to_vec();
    let number = |file: &mut Vec<u8>, value: u32| file.extend(value.to_be_bytes());
    let name = |file: &mut Vec<u8>, text: &str| {
        file.extend((text.len() as u32).to_be_bytes());
        file.extend(text.as_bytes());
        file.resize(file.len().next_multiple_of(4), 0);
    };
    let attributes = |file: &mut Vec<u8>, all: &[Attribute<'_>]| {
        file.extend(if all.is_empty() { 0 } else { 12_u32 }.to_be_bytes());
        file.extend((all.len() as u32).to_be_bytes());
        for (key, value) in all {
            name(file, key);
            file.extend(2_u32.to_be_bytes());
            name(file, value);
        }
    };
    // Dimensions y and x.
    number(&mut file, 10);
    number(&mut file, 2);
    for (dimension, length) in [("y", 3), ("x", 4)] {
        name(&mut file, dimension);
        number(&mut file, length);
    }
    attributes(&mut file, &[]);
    let axis = |of: &'static str, standard: &'static str| {
        let mut all = vec![("standard_name", standard)];
        all.extend(axes);
        (of, all)
    };
    let (y, x) = (
        axis("y", "projection_y_coordinate"),
        axis("x", "projection_x_coordinate"),
    );
    let doubles = |values: &[f64]| {
        values
            .iter()
            .flat_map(|value| value.to_be_bytes())
            .collect()
    };
    let singles: Vec<u8> = (1..=12_u8)
        .flat_map(|value| f32::from(value).to_be_bytes())
        .collect();
    let mut variables: Vec<Variable<'_>> = vec![
        (y.0, vec![0], y.1, 6, doubles(&[50.0, 25.0, 0.0])),
        (x.0, vec![1], x.1, 6, doubles(&[0.0, 25.0, 50.0, 75.0])),
        ("crs", vec![], mapping.to_vec(), 4, vec![0; 4]),
    ];
    for (variable, all) in heights {
        let mut all = all.to_vec();
        all.push(("grid_mapping", "crs"));
        variables.push((variable, vec![0, 1], all, 5, singles.clone()));
    }
    number(&mut file, 11);
    number(&mut file, variables.len() as u32);
    let mut begins = Vec::new();
    for (variable, dimensions, all, kind, data) in &variables {
        name(&mut file, variable);
        number(&mut file, dimensions.len() as u32);
        for dimension in dimensions {
            number(&mut file, *dimension);
        }
        attributes(&mut file, all);
        number(&mut file, *kind);
        number(&mut file, data.len() as u32);
        begins.push(file.len());
        number(&mut file, 0);
    }
    for (begin, (.., data)) in begins.into_iter().zip(&variables) {
        let at = file.len() as u32;
        file[begin..begin + 4].copy_from_slice(&at.to_be_bytes());
        file.extend(data);
    }
    file
}

/// Name, dimensions, attributes, type and data.
type Variable<'a> = (&'a str, Vec<u32>, Vec<Attribute<'a>>, u32, Vec<u8>);

/// The polar stereographic map of WGS 84, in metres.
const POLAR: [Attribute<'_>; 1] = [(
    "crs_wkt",
    "PROJCS[\"WGS 84 / NSIDC Sea Ice Polar Stereographic North\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",\
     SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],\
     PROJECTION[\"Polar_Stereographic\"],PARAMETER[\"latitude_of_origin\",70],PARAMETER[\"central_meridian\",-45],\
     PARAMETER[\"scale_factor\",1],PARAMETER[\"false_easting\",0],PARAMETER[\"false_northing\",0],\
     UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"3413\"]]",
)];

fn written(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("written.nc");
    fs::write(&file, bytes).expect("written");
    (folder, file)
}

#[test]
fn axes_in_kilometres_are_as_long_on_the_ground() {
    if !has_gdal() {
        return;
    }
    for (unit, metres) in [("m", 25.0), ("km", 25_000.0)] {
        let bytes = classic(&[("units", unit)], &POLAR, &[("z", &[("units", "m")])]);
        let (_folder, file) = written(&bytes);
        let raster = open(&file, &OpenOptions::default());
        assert_eq!(raster.height(0, 2), 1.0);
        let cell = raster.cell().expect("a cell").metres();
        assert!((cell.0 / metres - 1.0).abs() < 0.05, "{unit}: {cell:?}");
        // The corner farthest from the pole is at 107 units.
        let south = raster.bounds_lonlat().expect("known").south;
        assert!((south > 89.99) == (unit == "m"), "{unit}: {south}");
    }
}

#[test]
fn depth_sign_follows_positive_then_standard_name() {
    if !has_gdal() {
        return;
    }
    for (attribute, value, sign) in [
        ("positive", "down", -1.0),
        ("positive", "Down", -1.0),
        ("standard_name", "sea_floor_depth_below_geoid", -1.0),
        ("standard_name", "depth", -1.0),
        ("standard_name", "height_above_reference_ellipsoid", 1.0),
        ("long_name", "depth of the sea floor", 1.0),
    ] {
        let bytes = classic(&[("units", "m")], &POLAR, &[("z", &[(attribute, value)])]);
        let (_folder, file) = written(&bytes);
        let raster = open(&file, &OpenOptions::default());
        assert_eq!(raster.height(3, 0), sign * 12.0, "{attribute} {value}");
    }
    // Two sources that disagree are reported.
    let both = [
        ("standard_name", "sea_floor_depth_below_geoid"),
        ("positive", "up"),
    ];
    let (_folder, file) = written(&classic(&[("units", "m")], &POLAR, &[("z", &both)]));
    let raster = open(&file, &OpenOptions::default());
    assert_eq!(raster.height(3, 0), 12.0);
    let remarks = raster.remarks().join(" ");
    assert!(remarks.contains("positive is up"), "{remarks}");
}

#[test]
fn variable_is_selected_by_name() {
    if !has_gdal() {
        return;
    }
    let named = |name: &str| OpenOptions {
        variable: Some(name.to_owned()),
        ..OpenOptions::default()
    };
    let bytes = classic(
        &[("units", "m")],
        &POLAR,
        &[("bed", &[("positive", "down")]), ("ice", &[])],
    );
    let (_folder, file) = written(&bytes);
    assert_eq!(open(&file, &named("bed")).height(0, 2), -1.0);
    assert_eq!(open(&file, &named("ice")).height(0, 2), 1.0);
    let refused = |options: &OpenOptions| Raster::open(&file, options).expect_err("refused");
    let error = refused(&OpenOptions::default());
    assert!(
        matches!(error.fault(), RasterError::SeveralHeights { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("bed, ice"), "{error}");
    let error = refused(&named("z"));
    assert!(
        matches!(error.fault(), RasterError::NoSuchPart { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("bed, ice"), "{error}");
    // A file with one variable has no parts, but the variable has a name.
    let (_folder, file) = written(&classic(&[("units", "m")], &POLAR, &[("bed", &[])]));
    assert_eq!(open(&file, &named("bed")).height(0, 2), 1.0);
    Raster::open(&file, &named("ice")).expect_err("it has one variable");
}

#[test]
fn open_options_reach_the_driver_and_unknown_ones_are_refused() {
    if !has_gdal() {
        return;
    }
    let with = |option: &str| OpenOptions {
        open_options: vec![option.to_owned()],
        ..OpenOptions::default()
    };
    // Samples beyond the valid range are no-data, unless the range is ignored.
    let [honoured, ignored] = ["YES", "NO"].map(|value| {
        let options = with(&format!("HONOUR_VALID_RANGE={value}"));
        open(&path("packed.nc"), &options).summary().no_data
    });
    assert!(honoured >= ignored, "{honoured} {ignored}");
    let error = Raster::open(path("packed.nc"), &with("NO_SUCH=1")).expect_err("unknown");
    assert!(error.to_string().contains("NO_SUCH"), "{error}");
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/by_gdal/lerc_i16.tif");
    let error = Raster::open(own, &with("NO_SUCH=1")).expect_err("read without GDAL");
    assert!(error.to_string().contains("read without GDAL"), "{error}");
}

/// If a build of GDAL lacks a compression, its own error is reported: the file is not damaged.
#[test]
fn unsupported_packing_is_not_reported_as_damage() {
    if !has_gdal() {
        return;
    }
    match Raster::open(path("early.nc"), &OpenOptions::default()) {
        Ok(_) => eprintln!("skipped: this GDAL has the filter"),
        Err(error) => assert!(matches!(error.fault(), RasterError::ByGdal(_)), "{error}"),
    }
}
