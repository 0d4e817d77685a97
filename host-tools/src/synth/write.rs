//! Files that GIS programs open, written a few rows at a time, so that a terrain
//! may be larger than memory.

use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use tiff::TiffError;
use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype};
use tiff::tags::Tag;

use super::Synth;
use super::room::{self, NoRoom};
use crate::output::{Output, OutputError};

/// How much of a terrain is written, and how large it is on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Samples from west to east, at least 2.
    pub columns: u32,
    /// Samples from south to north, at least 2.
    pub rows: u32,
    /// Side of a cell in metres; heights are in metres too.
    pub cell_m: f64,
}

/// A terrain that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be created or filled.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// It would not fit.
    #[error("cannot write {}: {lack}", path.display())]
    NoRoom {
        /// The file.
        path: PathBuf,
        /// What is needed and what is free.
        lack: NoRoom,
    },
    /// The caller did not want to go on.
    #[error("interrupted")]
    Interrupted,
    /// The extension names no format that is written.
    #[error("cannot write {}: its extension is none of .tif, .asc, .png", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// A 16-bit PNG holds whole metres from 0 to 65535.
    #[error("a height of {height} m does not fit into a 16-bit PNG")]
    TooHighForPng {
        /// The height.
        height: f32,
    },
    /// An encoder refused, which only absurd sizes make it do.
    #[error("cannot write {}: {cause}", path.display())]
    Encoder {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        cause: String,
    },
}

/// Writes a terrain in the format of the path's extension: `.tif` (GeoTIFF, float32,
/// metres, BigTIFF when it has to be), `.asc` (Esri ASCII) or `.png` (16-bit grey,
/// whole metres). The file appears when it is complete. `go_on` is asked once a row
/// whether to.
///
/// # Errors
/// When the extension, the free space, the file or the heights do not allow it.
/// Nothing is left of what was written.
pub fn write(
    path: &Path,
    synth: &Synth,
    grid: &Grid,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<(), WriteError> {
    let format = Format::of(path).ok_or_else(|| WriteError::UnknownExtension {
        path: path.to_path_buf(),
    })?;
    room::check(path, format, synth, grid).map_err(|lack| WriteError::NoRoom {
        path: path.to_path_buf(),
        lack,
    })?;
    let mut sink = Sink {
        out: Output::create(path)?,
        synth,
        grid,
        go_on,
    };
    let written = match format {
        Format::GeoTiff => write_geotiff(&mut sink),
        Format::EsriAscii => write_asc(&mut sink),
        Format::Png => write_png(&mut sink),
    };
    written.map_err(|stop| stop.at(path))?;
    Ok(sink.out.finish()?)
}

/// What a terrain is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    GeoTiff,
    EsriAscii,
    Png,
}

impl Format {
    /// By the path's extension.
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        match extension.as_str() {
            "tif" | "tiff" => Some(Self::GeoTiff),
            "asc" => Some(Self::EsriAscii),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}

/// Where the rows go, and what makes them.
struct Sink<'a> {
    out: Output,
    synth: &'a Synth,
    grid: &'a Grid,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl Sink<'_> {
    fn row_done(&mut self) -> Result<(), Stop> {
        row_done(self.go_on)
    }
}

fn row_done(go_on: &mut dyn FnMut() -> bool) -> Result<(), Stop> {
    if go_on() {
        Ok(())
    } else {
        Err(Stop::Interrupted)
    }
}

/// Why writing stopped.
enum Stop {
    Interrupted,
    Io(std::io::Error),
    TooHigh(f32),
    Encoder(String),
}

impl Stop {
    fn at(self, path: &Path) -> WriteError {
        let path = path.to_path_buf();
        match self {
            Self::Interrupted => WriteError::Interrupted,
            Self::Io(source) => OutputError { path, source }.into(),
            Self::TooHigh(height) => WriteError::TooHighForPng { height },
            Self::Encoder(cause) => WriteError::Encoder { path, cause },
        }
    }
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<TiffError> for Stop {
    fn from(error: TiffError) -> Self {
        match error {
            TiffError::IoError(error) => Self::Io(error),
            error => Self::Encoder(error.to_string()),
        }
    }
}

impl From<png::EncodingError> for Stop {
    fn from(error: png::EncodingError) -> Self {
        match error {
            png::EncodingError::IoError(error) => Self::Io(error),
            error => Self::Encoder(error.to_string()),
        }
    }
}

/// Appends a row's heights; rows are counted from the south.
pub(super) fn append_row(synth: &Synth, columns: u32, row: u32, heights: &mut Vec<f32>) {
    heights.extend((0..columns).map(|column| synth.height(column, row)));
}

/// Bytes past which a classic TIFF's 32-bit offsets no longer reach.
const CLASSIC_TIFF_BYTES: u64 = 4_000_000_000;

fn write_geotiff(sink: &mut Sink<'_>) -> Result<(), Stop> {
    let bytes = 4 * u64::from(sink.grid.columns) * u64::from(sink.grid.rows);
    if bytes < CLASSIC_TIFF_BYTES {
        write_tiff_kind::<TiffKindStandard>(sink)
    } else {
        write_tiff_kind::<TiffKindBig>(sink)
    }
}

fn write_tiff_kind<K: TiffKind>(sink: &mut Sink<'_>) -> Result<(), Stop> {
    const STRIP_BYTES: u32 = 1 << 18;
    let Grid {
        columns,
        rows,
        cell_m,
    } = *sink.grid;
    let mut encoder = TiffEncoder::<_, K>::new_generic(&mut sink.out)?;
    let mut image = encoder.new_image::<colortype::Gray32Float>(columns, rows)?;
    let strip_rows = (STRIP_BYTES / 4 / columns).clamp(1, rows);
    image.rows_per_strip(strip_rows)?;
    georeference(image.encoder(), rows, cell_m)?;
    let mut strip = Vec::new();
    let mut north = rows;
    while north > 0 {
        let south = north.saturating_sub(strip_rows);
        strip.clear();
        for row in (south..north).rev() {
            append_row(sink.synth, columns, row, &mut strip);
            row_done(sink.go_on)?;
        }
        image.write_strip(&strip)?;
        north = south;
    }
    image.finish()?;
    Ok(())
}

/// Metres on UTM zone 31 north, its south-west corner on the equator at 3° east:
/// there is no land, so nobody takes it for a survey.
fn georeference<W: Write + Seek, K: TiffKind>(
    tags: &mut tiff::encoder::DirectoryEncoder<'_, W, K>,
    rows: u32,
    cell_m: f64,
) -> Result<(), TiffError> {
    const WEST: f64 = 500_000.0;
    let north = f64::from(rows) * cell_m;
    /// Version 1.1.0, five keys, each (key, 0, 1, value): projected, samples are
    /// areas, WGS 84 / UTM 31N, metres, heights in metres.
    const KEYS: [u16; 24] = [
        1, 1, 0, 5, //
        1024, 0, 1, 1, //
        1025, 0, 1, 1, //
        3072, 0, 1, 32631, //
        3076, 0, 1, 9001, //
        4099, 0, 1, 9001,
    ];
    tags.write_tag(Tag::ModelPixelScaleTag, [cell_m, cell_m, 0.0].as_slice())?;
    tags.write_tag(
        Tag::ModelTiepointTag,
        [0.0, 0.0, 0.0, WEST, north, 0.0].as_slice(),
    )?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, KEYS.as_slice())
}

fn write_asc(sink: &mut Sink<'_>) -> Result<(), Stop> {
    let Grid {
        columns,
        rows,
        cell_m,
    } = *sink.grid;
    write!(
        sink.out,
        "ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize {cell_m}\n"
    )?;
    let mut heights = Vec::new();
    for row in (0..rows).rev() {
        heights.clear();
        append_row(sink.synth, columns, row, &mut heights);
        write_asc_row(&mut sink.out, &heights)?;
        sink.row_done()?;
    }
    Ok(())
}

/// One row as text.
pub(super) fn write_asc_row(out: &mut dyn Write, heights: &[f32]) -> std::io::Result<()> {
    for (column, height) in heights.iter().enumerate() {
        let separator = if column == 0 { "" } else { " " };
        write!(out, "{separator}{height}")?;
    }
    writeln!(out)
}

fn write_png(sink: &mut Sink<'_>) -> Result<(), Stop> {
    let Grid { columns, rows, .. } = *sink.grid;
    let mut encoder = png::Encoder::new(&mut sink.out, columns, rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let mut heights = Vec::new();
    let mut bytes = Vec::new();
    for row in (0..rows).rev() {
        heights.clear();
        bytes.clear();
        append_row(sink.synth, columns, row, &mut heights);
        for &height in &heights {
            let whole = height.round();
            if !(0.0..=f32::from(u16::MAX)).contains(&whole) {
                return Err(Stop::TooHigh(height));
            }
            bytes.extend((whole as u16).to_be_bytes());
        }
        stream.write_all(&bytes)?;
        row_done(sink.go_on)?;
    }
    stream.finish()?;
    writer.finish()?;
    Ok(())
}
