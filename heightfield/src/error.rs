//! Errors of terrain files.

use std::path::{Path, PathBuf};

use super::options::Encoding;
use crate::printable_text::printable;
use crate::remote::{is_lost, is_missing, is_outage, without_key};

/// Error of a file that cannot be opened as a height field.
#[derive(Debug, thiserror::Error)]
#[error("{}", printable(&format!("{fault} ({})", without_key(path))))]
pub struct Error {
    path: PathBuf,
    fault: RasterError,
}

impl Error {
    pub(super) fn new(path: &Path, fault: RasterError) -> Self {
        Self {
            path: path.to_path_buf(),
            fault,
        }
    }

    /// Returns the file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns its fault.
    pub fn fault(&self) -> &RasterError {
        &self.fault
    }
}

/// Fault of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// The operating system denies reading it.
    #[error("cannot read the file: {0}")]
    Unreadable(std::io::Error),
    /// A URL that cannot be read, perhaps only at present.
    #[error("cannot read the URL's content: {0}")]
    Remote(std::io::Error),
    /// Neither content nor extension identifies the format.
    #[error("unknown file format")]
    UnknownFormat,
    /// GDAL reads the format, but libgdal is missing.
    #[error("{format} is read through GDAL: {why}")]
    NeedsGdal {
        /// Name of the format.
        format: &'static str,
        /// Reason why GDAL is not available.
        why: heightfield_gdal::Error,
    },
    /// GDAL supports the format, but rejects the file.
    #[error("{0}")]
    ByGdal(heightfield_gdal::Error),
    /// Raw samples carry no header, and none was stated.
    #[error("raw samples without a stated size")]
    RawSizeMissing,
    /// The format is supported, but not this variant.
    #[error("{format}: {feature} is not supported")]
    Unsupported {
        /// Name of the format.
        format: &'static str,
        /// The missing feature.
        feature: String,
    },
    /// Readable, but its samples are not heights.
    #[error("not a height field: {0}")]
    NotAHeightField(String),
    /// Neither heights nor data that can be converted into heights.
    #[error("not a height field: {0}")]
    NoNumbers(String),
    /// Several parts could be the heights; none was chosen.
    #[error("several {kind}s may be the heights: {}", names.join(", "))]
    SeveralHeights {
        /// The file's word for a part, as `raster`.
        kind: &'static str,
        /// Their names.
        names: Vec<String>,
    },
    /// A colour image whose bands could each be the height; none was chosen.
    #[error("not a height field: {what}")]
    ColourBands {
        /// Its name.
        what: String,
        /// Number of bands.
        bands: u16,
    },
    /// The user chose a band or variable that does not exist.
    #[error("there is no {requested}: {available}")]
    NoSuchPart {
        /// The request.
        requested: String,
        /// The available parts.
        available: String,
    },
    /// The user stated a cell size, but the file states another.
    #[error("the file states its own cell size: {0}")]
    CellSizeStated(String),
    /// A colour picture that looks as if its colours encoded heights.
    #[error("not a height field as it is: a colour picture that looks like {}", match .0 {
        Encoding::TerrainRgb => "Terrain-RGB heights",
        Encoding::Terrarium => "Terrarium heights",
    })]
    EncodedPicture(Encoding),
    /// Samples whose header is a separate file, which is missing.
    #[error("its header is missing: there is no {0} beside it")]
    HeaderMissing(String),
    /// A valid file with more samples than fit in memory.
    #[error("too large: {columns} × {rows} samples would require {gigabytes} GB of memory")]
    TooLarge {
        /// Samples from west to east.
        columns: u64,
        /// Samples from south to north.
        rows: u64,
        /// Memory for the samples, 10⁹ bytes, rounded up.
        gigabytes: u64,
    },
    /// A picture whose channels could each be the height; none was chosen.
    #[error("not a height field: {0}")]
    AmbiguousChannels(String),
    /// Too few samples for a patch.
    #[error(
        "too small: {columns} × {rows} samples; a surface needs at least two samples in each direction"
    )]
    TooSmall {
        /// Samples from west to east.
        columns: u64,
        /// Samples from south to north.
        rows: u64,
    },
    /// No sample has a height.
    #[error("no surface: all {samples} samples are no-data")]
    AllNoData {
        /// Number of samples.
        samples: u64,
    },
    /// A folder or pattern without readable files.
    #[error("no terrain: {0}")]
    NoTiles(String),
    /// STAC items in which no asset, or more than one, could be the heights.
    #[error("no terrain: {why} (assets: {})", names.join(", "))]
    AmbiguousAssets {
        /// The item, and its fault.
        why: String,
        /// Names of all its assets, or of those that could be the heights.
        names: Vec<String>,
    },
    /// STAC items that GDAL cannot open as a terrain, though it can open their files.
    #[error("no terrain: {why}")]
    NeedsVrt {
        /// The fault.
        why: String,
        /// The files, by GDAL's names.
        files: Vec<String>,
    },
    /// One file of many is at fault.
    #[error("{fault}; it is in {}", without_key(file))]
    InTile {
        /// The file.
        file: PathBuf,
        /// The file's fault.
        fault: Box<RasterError>,
    },
    /// One of many files that is not on a grid.
    #[error("cannot be one of many files: {0}")]
    NoPlace(String),
    /// Files of one terrain without a common grid.
    #[error("its files do not fit together: of {} {why}, as {}", file.display(), other.display())]
    TilesDiffer {
        /// The file that does not fit.
        file: PathBuf,
        /// The other file.
        other: PathBuf,
        /// The difference.
        why: String,
    },
    /// Two of many files with different heights at the same samples.
    #[error(
        "two rasters cover the same place and differ by up to {difference}: {} and {}",
        without_key(&files[0]),
        without_key(&files[1])
    )]
    SamePlace {
        /// The files.
        files: [PathBuf; 2],
        /// The max difference found.
        difference: f64,
    },
    /// The header states more than the file can contain, or than fits in memory.
    #[error("absurd size in the header: {0}")]
    AbsurdSize(String),
    /// The file ends too early.
    #[error("truncated file: {0}")]
    Truncated(String),
    /// The file contradicts itself or its format.
    #[error("damaged file: {0}")]
    Damaged(String),
    /// A third-party decoder does not support it.
    #[error("not understood: {0}; the file is damaged or of an unsupported kind")]
    Unfamiliar(String),
    /// A third-party decoder panicked.
    #[error("the {0} decoder failed: the file is damaged or of an unsupported kind")]
    DecoderFailed(&'static str),
}

impl RasterError {
    /// Returns a `Damaged` error.
    pub(super) fn damaged(what: impl Into<String>) -> Self {
        Self::Damaged(what.into())
    }

    /// Returns the fault of one of many files.
    pub(super) fn in_tile(file: &Path, fault: Self) -> Self {
        Self::InTile {
            file: file.to_owned(),
            fault: Box::new(fault),
        }
    }

    /// Returns true if a retry may succeed: the error is not about the file's samples.
    pub(super) fn is_connection_error(&self) -> bool {
        match self {
            Self::Remote(error) => !is_missing(error),
            Self::InTile { fault, .. } => fault.is_connection_error(),
            _ => false,
        }
    }

    /// Converts an input error while decoding: an early end is a truncated file.
    pub(super) fn from_io(error: std::io::Error, during: &str) -> Self {
        match error.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                Self::Truncated(format!("it ends while reading {during}"))
            }
            std::io::ErrorKind::InvalidData | std::io::ErrorKind::InvalidInput => {
                Self::Unfamiliar(format!("{during}: {error}"))
            }
            _ if is_outage(&error) || is_lost(&error) => Self::Remote(error),
            _ => Self::Unreadable(error),
        }
    }
}
