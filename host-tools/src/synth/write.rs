//! Files for GIS programs, written a few rows at a time, so that a terrain may be larger than
//! memory.

use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use tiff::TiffError;
use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype};
use tiff::tags::Tag;

use super::Synth;
use super::format::WrittenFormat;
use super::room::{self, NoRoom};
use super::rows::{Grid, Interrupted, Rows, write_asc_row};
use crate::output::Output;

/// A terrain that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {fault}", path.display())]
pub struct WriteError {
    path: PathBuf,
    /// The reason.
    pub fault: WriteFault,
}

/// Reason why a terrain was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteFault {
    /// The file could not be created or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The disk has too little free space.
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
    /// The caller stopped the operation.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The extension belongs to no output format.
    #[error("its extension is none of .tif, .asc, .png")]
    UnknownExtension,
    /// A height outside the whole metres from 0 to 65535 of a 16-bit PNG.
    #[error("a height of {0} m does not fit into a 16-bit PNG")]
    TooHighForPng(f32),
    /// An encoder failed, which happens only with absurd sizes.
    #[error("{0}")]
    Encoder(String),
}

impl From<TiffError> for WriteFault {
    fn from(error: TiffError) -> Self {
        match error {
            TiffError::IoError(error) => Self::Io(error),
            error => Self::Encoder(error.to_string()),
        }
    }
}

impl From<png::EncodingError> for WriteFault {
    fn from(error: png::EncodingError) -> Self {
        match error {
            png::EncodingError::IoError(error) => Self::Io(error),
            error => Self::Encoder(error.to_string()),
        }
    }
}

/// Writes a terrain in the format of the path's extension: `.tif` (GeoTIFF, float32, metres,
/// BigTIFF if it is large), `.asc` (Esri ASCII) or `.png` (16-bit grey, whole metres). The file
/// appears when it is complete. `should_continue` is called once for each row and returns false to stop.
///
/// # Errors
/// When the extension, the free space, the file or the heights do not allow it. No part of the file
/// remains.
pub fn write(
    path: &Path,
    synth: &Synth,
    grid: &Grid,
    should_continue: &mut dyn FnMut() -> bool,
) -> Result<(), WriteError> {
    write_file(path, synth, grid, should_continue).map_err(|fault| WriteError {
        path: path.to_path_buf(),
        fault,
    })
}

fn write_file(
    path: &Path,
    synth: &Synth,
    grid: &Grid,
    should_continue: &mut dyn FnMut() -> bool,
) -> Result<(), WriteFault> {
    let format = WrittenFormat::of(path).ok_or(WriteFault::UnknownExtension)?;
    room::check(path, format, synth, grid)?;
    let mut out = Output::create(path).map_err(|error| error.source)?;
    let rows = &mut Rows::new(synth, grid, should_continue);
    match format {
        WrittenFormat::GeoTiff => write_geotiff(&mut out, rows)?,
        WrittenFormat::EsriAscii => write_asc(&mut out, rows)?,
        WrittenFormat::Png => write_png(&mut out, rows)?,
    }
    Ok(out.finish().map_err(|error| error.source)?)
}

/// Max bytes of a classic TIFF, for its 32-bit offsets.
const CLASSIC_TIFF_BYTES: u64 = 4_000_000_000;

fn write_geotiff(out: &mut Output, rows: &mut Rows<'_>) -> Result<(), WriteFault> {
    let bytes = 4 * u64::from(rows.grid.columns) * u64::from(rows.grid.rows);
    if bytes < CLASSIC_TIFF_BYTES {
        write_tiff_kind::<TiffKindStandard>(out, rows)
    } else {
        write_tiff_kind::<TiffKindBig>(out, rows)
    }
}

fn write_tiff_kind<K: TiffKind>(out: &mut Output, rows: &mut Rows<'_>) -> Result<(), WriteFault> {
    const STRIP_BYTES: u32 = 1 << 18;
    let grid = *rows.grid;
    let mut encoder = TiffEncoder::<_, K>::new_generic(out)?;
    let mut image = encoder.new_image::<colortype::Gray32Float>(grid.columns, grid.rows)?;
    let strip_rows = (STRIP_BYTES / 4 / grid.columns).clamp(1, grid.rows);
    image.rows_per_strip(strip_rows)?;
    georeference(image.encoder(), grid.rows, grid.cell_m)?;
    let mut strip = Vec::new();
    while let Some(row) = rows.next()? {
        strip.extend_from_slice(row);
        // The last strip may be shorter.
        if rows.left == 0 || strip.len() == (strip_rows * grid.columns) as usize {
            image.write_strip(&strip)?;
            strip.clear();
        }
    }
    image.finish()?;
    Ok(())
}

/// Metres on UTM zone 31 north, with the south-west corner on the equator at 3° east: in the sea,
/// so that it is not mistaken for a survey.
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

fn write_asc(out: &mut Output, rows: &mut Rows<'_>) -> Result<(), WriteFault> {
    let Grid {
        columns,
        rows: count,
        cell_m,
    } = *rows.grid;
    write!(
        out,
        "ncols {columns}\nnrows {count}\nxllcorner 0\nyllcorner 0\ncellsize {cell_m}\n"
    )?;
    while let Some(row) = rows.next()? {
        write_asc_row(out, row)?;
    }
    Ok(())
}

fn write_png(out: &mut Output, rows: &mut Rows<'_>) -> Result<(), WriteFault> {
    let mut encoder = png::Encoder::new(out, rows.grid.columns, rows.grid.rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let mut bytes = Vec::new();
    while let Some(row) = rows.next()? {
        bytes.clear();
        for &height in row {
            let whole = height.round();
            if !(0.0..=f32::from(u16::MAX)).contains(&whole) {
                return Err(WriteFault::TooHighForPng(height));
            }
            bytes.extend((whole as u16).to_be_bytes());
        }
        stream.write_all(&bytes)?;
    }
    stream.finish()?;
    writer.finish()?;
    Ok(())
}
