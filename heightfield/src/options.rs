//! Options of the user for a file.

use super::fill::Fill;
use super::samples::{Endian, SampleType};
use crate::disk_cache::DiskCache;
use crate::remote::RemoteFetcher;

/// Options for opening a file. The default believes the file.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// The file is raw samples of this layout, whatever its content looks like.
    pub raw: Option<RawLayout>,
    /// Which channel of a PNG holds the height. Without it: the grey of a grey
    /// picture, the alpha of one with colours and an alpha that varies.
    pub png_channel: Option<PngChannel>,
    /// Stored sample value that means no data; replaces what the file says.
    pub no_data: Option<f64>,
    /// Distance within which samples without data are filled from data. Without it, and of
    /// [`OpenOptions::classes`], they stay without a height.
    pub fill: Option<Fill>,
    /// Which band holds the height, the first being 1. Without it: the first.
    pub band: Option<u32>,
    /// Which raster of several holds the height: a variable of a NetCDF file, a file of an archive,
    /// an asset of a STAC's items. Without it: the one that is named as heights are, or the only one.
    pub variable: Option<String>,
    /// Options of the GDAL driver that opens the file, each as `NAME=VALUE`.
    pub open_options: Vec<String>,
    /// Side of a cell on the ground, metres, of a file that does not state it.
    pub ground_cell_m: Option<f64>,
    /// Metres in a unit of the heights; replaces what the file says.
    pub vertical_unit_m: Option<f64>,
    /// Encoding of heights in a picture's colours, if any.
    pub encoding: Option<Encoding>,
    /// The numbers are classes and no heights: those of a palette are taken as they are.
    pub classes: bool,
    /// True if other formats are read by GDAL, where there is a libgdal.
    pub gdal: bool,
    /// Samples that take more bytes than this stay in the file, where its format allows it,
    /// and are read in blocks when they are touched.
    pub most_in_memory_bytes: u64,
    /// The files at URLs that are read with these options.
    pub elsewhere: RemoteFetcher,
    /// Folder for coarse samples of a terrain in its file. The default
    /// keeps nothing.
    pub disk_cache: DiskCache,
}

impl OpenOptions {
    /// Default of [`OpenOptions::most_in_memory_bytes`], in units of
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
            most_in_memory_bytes: u64::from(Self::IN_MEMORY_MB) << 20,
            elsewhere: RemoteFetcher::default(),
            disk_cache: DiskCache::off(),
        }
    }
}

/// Layout of a raw file: rows from north to south, samples from west to east,
/// nothing before, between or after.
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
    /// Alpha, where the paper's data holds the height
    Alpha,
}

impl Encoding {
    /// All of them.
    pub const ALL: &[Self] = &[Self::TerrainRgb, Self::Terrarium];

    /// Its name, as `terrain-rgb`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TerrainRgb => "terrain-rgb",
            Self::Terrarium => "terrarium",
        }
    }
}

impl PngChannel {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Grey, Self::Red, Self::Green, Self::Blue, Self::Alpha];

    /// Its name, as `grey`.
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
