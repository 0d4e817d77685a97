//! Archives, which GDAL can open: one raster in them is read.

use std::io::{Read, copy, sink};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;
use heightfield_gdal::{Error, Library};

use super::fault;
use super::place::Place;
use crate::format::Claim;
use crate::formats::claim_of;
use crate::{OpenOptions, RasterError};

/// Max size of a file inside an archive, bytes: to reach a sample, all bytes before it are
/// decompressed.
const MAX_BYTES: u64 = 1 << 30;
/// Max number of files in an archive.
const MAX_ENTRIES: usize = 1 << 14;
/// Max number of files that GDAL tries to open.
const MAX_TRIED: usize = 64;
/// Offset of a tar file's signature.
const TAR_SIGN: usize = 257;
/// Packing of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Zip,
    Gzip,
    Tar,
}

impl Packing {
    /// Returns the packing of a file, by its first bytes.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        match head {
            _ if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") => {
                Some(Self::Zip)
            }
            _ if head.starts_with(b"\x1f\x8b") => Some(Self::Gzip),
            _ if head
                .get(TAR_SIGN..)
                .is_some_and(|rest| rest.starts_with(b"ustar")) =>
            {
                Some(Self::Tar)
            }
            _ => None,
        }
    }

    /// Returns the name for messages.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Zip => "ZIP",
            Self::Gzip => "gzip",
            Self::Tar => "tar",
        }
    }

    /// Returns GDAL's name of the raster in an archive, and the remaining options for it.
    ///
    /// # Errors
    /// [`RasterError::SeveralHeights`] if there are several and none is chosen by `--input
    /// variable=NAME`.
    pub(super) fn entry(
        self,
        library: &Library,
        place: &Place,
        options: &OpenOptions,
    ) -> Result<(PathBuf, OpenOptions), RasterError> {
        let path = &place.path;
        let absolute = match place.is_served() {
            true => path.clone(),
            false => std::path::absolute(path).map_err(RasterError::Unreadable)?,
        };
        let inside = absolute.display();
        let is_tar = match self {
            Self::Gzip => {
                check_unpacked(path)?;
                unpacked_head(path)?.is_some_and(|head| Self::of(&head) == Some(Self::Tar))
            }
            Self::Zip | Self::Tar => self == Self::Tar,
        };
        let folder = match (self, is_tar) {
            (_, true) => format!("/vsitar/{{{inside}}}"),
            (Self::Zip, _) => format!("/vsizip/{{{inside}}}"),
            _ => return Ok((format!("/vsigzip/{inside}").into(), options.clone())),
        };
        let mut entries = library.entries(Path::new(&folder)).map_err(fault)?;
        if entries.len() > MAX_ENTRIES {
            return Err(RasterError::AbsurdSize(format!(
                "an archive of {} files",
                entries.len()
            )));
        }
        entries.retain(|name| !is_hidden(name));
        let full = |name: &str| PathBuf::from(format!("{folder}/{name}"));
        let mut inner_options = options.clone();
        let name = match options
            .variable
            .as_deref()
            .and_then(|it| named(&entries, it))
        {
            Some(name) => {
                inner_options.variable = None;
                name
            }
            None => only(library, &entries, &full)?,
        };
        let entry = full(&name);
        match library.length(&entry) {
            Some(bytes) if bytes > MAX_BYTES => Err(too_large(&name)),
            _ => Ok((entry, inner_options)),
        }
    }
}

/// Returns true for files and folders that some systems add.
fn is_hidden(name: &str) -> bool {
    name.split('/').any(|part| {
        part.starts_with("__MACOSX")
            || (part.starts_with('.') && part != ".")
            || part == "@PaxHeader"
    })
}

/// Returns the requested entry, by its whole name or its last part.
fn named(entries: &[String], requested: &str) -> Option<String> {
    let matches = |name: &&String| *name == requested || name.rsplit('/').next() == Some(requested);
    entries.iter().find(matches).cloned()
}

/// Returns the only raster among entries.
fn only(
    library: &Library,
    entries: &[String],
    full: &dyn Fn(&str) -> PathBuf,
) -> Result<String, RasterError> {
    let is_likely = |name: &&String| claim_of(name).is_some_and(|claim| claim != Claim::Possible);
    let mut rasters: Vec<String> = entries.iter().filter(is_likely).cloned().collect();
    if rasters.is_empty() {
        let tried = entries.iter().take(MAX_TRIED);
        for name in tried {
            match library.open_part(&full(name).display().to_string(), &[]) {
                Ok(_) => rasters.push(name.clone()),
                // Each further entry may take as long.
                Err(error @ Error::Slow { .. }) => return Err(fault(error)),
                Err(_) => {}
            }
        }
    }
    match rasters.len() {
        1 => Ok(rasters.remove(0)),
        0 => Err(RasterError::NotAHeightField(
            "the archive contains no terrain file".into(),
        )),
        _ => Err(RasterError::SeveralHeights {
            kind: "file",
            names: rasters,
        }),
    }
}

fn too_large(name: &str) -> RasterError {
    RasterError::Unsupported {
        format: "archive",
        feature: format!(
            "{name}, which has more than {} MB unpacked,",
            MAX_BYTES >> 20
        ),
    }
}

/// Checks that a gzip file can be decompressed, to at most [`MAX_BYTES`].
fn check_unpacked(path: &Path) -> Result<(), RasterError> {
    let file = std::fs::File::open(path).map_err(RasterError::Unreadable)?;
    let unpacked = MultiGzDecoder::new(std::io::BufReader::new(file));
    match copy(&mut unpacked.take(MAX_BYTES + 1), &mut sink()) {
        Ok(bytes) if bytes > MAX_BYTES => Err(too_large("a file")),
        Ok(_) => Ok(()),
        Err(error) => Err(RasterError::from_io(error, "the packed data")),
    }
}

fn unpacked_head(path: &Path) -> Result<Option<Vec<u8>>, RasterError> {
    let file = std::fs::File::open(path).map_err(RasterError::Unreadable)?;
    let mut head = Vec::new();
    let read = MultiGzDecoder::new(file)
        .take(super::HEAD_BYTES)
        .read_to_end(&mut head);
    Ok(read.ok().map(|_| head))
}
