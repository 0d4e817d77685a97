//! The user's options for a file.

use super::fill::Fill;
use super::samples::{Endian, SampleType};
use crate::disk_cache::DiskCache;
use crate::remote::RemoteFetcher;

/// Options for opening a file. By default, the file's own metadata is used.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// The file is raw samples in this layout, whatever its content.
    pub raw: Option<RawLayout>,
    /// The channel of a PNG that contains the height. By default: grey in a grey picture, alpha in
    /// a colour picture whose alpha varies.
    pub png_channel: Option<PngChannel>,
    /// Stored sample value that means no-data; overrides the file's.
    pub no_data: Option<f64>,
    /// Distance within which no-data is filled from data. By default, and with
    /// [`OpenOptions::classes`], it stays no-data.
    pub fill: Option<Fill>,
    /// The band that contains the height, the first being 1. By default: the first.
    pub band: Option<u32>,
    /// The raster that contains the height, if there are several: a variable of a NetCDF file, a
    /// file of an archive, an asset of STAC items. By default: the one with a usual name for
    /// heights, or the only one.
    pub variable: Option<String>,
    /// Options of the GDAL driver that opens the file, each as `NAME=VALUE`.
    pub open_options: Vec<String>,
    /// Side of a cell on the ground, metres, for a file that does not state it.
    pub ground_cell_m: Option<f64>,
    /// Metres in a unit of the heights; overrides the file's.
    pub vertical_unit_m: Option<f64>,
    /// Encoding of heights in a picture's colours, if any.
    pub encoding: Option<Encoding>,
    /// The numbers are classes, not heights: the numbers of a palette are used directly.
    pub classes: bool,
    /// True if GDAL reads other formats, if libgdal is installed.
    pub gdal: bool,
    /// Samples that need more bytes than this stay in the file, if its format allows it, and are
    /// read in blocks on access.
    pub max_in_memory_bytes: u64,
    /// Source of files at URLs.
    pub fetcher: RemoteFetcher,
    /// Folder for coarse samples of a terrain in its file. By default, none are stored.
    pub disk_cache: DiskCache,
}

impl OpenOptions {
    /// Default of [`OpenOptions::max_in_memory_bytes`], in units of
    /// 2²⁰ bytes.
    pub const IN_MEMORY_MB: u32 = 128;
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            raw: None,
            png_channel: None,
            no_data: None,
            fill: None,
            band: None,
            variable: None,
            open_options: Vec::new(),
            ground_cell_m: None,
            vertical_unit_m: None,
            encoding: None,
            classes: false,
            gdal: true,
            max_in_memory_bytes: u64::from(Self::IN_MEMORY_MB) << 20,
            fetcher: RemoteFetcher::default(),
            disk_cache: DiskCache::off(),
        }
    }
}

/// Layout of a raw file: rows from north to south, samples from west to east, without other bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Samples from west to east.
    pub columns: u32,
    /// Samples from north to south.
    pub rows: u32,
    /// Type of a sample.
    pub sample: SampleType,
    /// Byte order of a sample.
    pub endian: Endian,
}

/// Encoding of heights in metres as red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Mapbox Terrain-RGB: −10000 + 0.1 · (65536 R + 256 G + B)
    TerrainRgb,
    /// Terrarium: 256 R + G + B / 256 − 32768
    Terrarium,
}

/// A channel of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngChannel {
    /// The grey of a grey picture
    Grey,
    /// Red
    Red,
    /// Green
    Green,
    /// Blue
    Blue,
    /// Alpha, which contains the height in the paper's data
    Alpha,
}

impl Encoding {
    /// All encodings.
    pub const ALL: &[Self] = &[Self::TerrainRgb, Self::Terrarium];

    /// Returns its name, as `terrain-rgb`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TerrainRgb => "terrain-rgb",
            Self::Terrarium => "terrarium",
        }
    }
}

impl PngChannel {
    /// All channels.
    pub const ALL: &[Self] = &[Self::Grey, Self::Red, Self::Green, Self::Blue, Self::Alpha];

    /// Returns its name, as `grey`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Grey => "grey",
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Alpha => "alpha",
        }
    }
}
