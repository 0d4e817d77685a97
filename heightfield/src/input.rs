//! The bytes to decode: a file, here or at a URL.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::RasterError;
use crate::disk_cache::FileStamp;
use crate::regular_file;
use crate::remote::{RemoteFetcher, RemoteFile, RemoteReader, file_name, is_url};

/// Max expansion of deflate, bytes per stored byte.
pub(super) const DEFLATE_RATIO: u64 = 1040;

/// A buffered reader in which a decoder may seek.
pub(super) trait ReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> ReadSeek for T {}

/// The bytes to decode, and the name of their file.
pub(super) struct FileBytes {
    name: String,
    extension: String,
    len: u64,
    data: Data,
    outline: bool,
    /// Source of neighbouring files at URLs.
    fetcher: RemoteFetcher,
}

/// Source of the bytes.
pub(super) enum Data {
    /// In an open file at a path.
    File(File, PathBuf),
    /// In memory, for tests.
    #[cfg(test)]
    Memory(Vec<u8>),
    /// On a server, with its URL.
    Remote(Arc<RemoteFile>, String),
}

impl FileBytes {
    /// Opens a file on disk or at a URL.
    pub(super) fn open(path: &Path, fetcher: &RemoteFetcher) -> Result<Self, RasterError> {
        let bytes = match path.to_str().filter(|name| is_url(name)) {
            Some(url) => Self::at_url(url, fetcher)?,
            None => Self::on_disk(path)?,
        };
        Ok(Self {
            fetcher: fetcher.clone(),
            ..bytes
        })
    }

    fn at_url(url: &str, fetcher: &RemoteFetcher) -> Result<Self, RasterError> {
        let file = fetcher.open(url).map_err(RasterError::Remote)?;
        let (len, data) = (file.len(), Data::Remote(file, url.to_owned()));
        Ok(Self::new(file_name(url), len, data))
    }

    fn on_disk(path: &Path) -> Result<Self, RasterError> {
        let file = regular_file::open(path).map_err(RasterError::Unreadable)?;
        let metadata = file.metadata().map_err(RasterError::Unreadable)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let data = Data::File(file, path.to_owned());
        Ok(Self::new(&name, metadata.len(), data))
    }

    /// Returns bytes in memory under a name.
    #[cfg(test)]
    pub(super) fn unpacked(name: &str, bytes: Vec<u8>) -> Self {
        let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
        Self::new(name, bytes.len() as u64, Data::Memory(bytes))
    }

    fn new(name: &str, len: u64, data: Data) -> Self {
        let extension = name.rsplit_once('.').map(|(_, end)| end.to_lowercase());
        Self {
            name: name.to_owned(),
            extension: extension.unwrap_or_default(),
            len,
            data,
            outline: false,
            fetcher: RemoteFetcher::default(),
        }
    }

    /// Returns the same bytes; if `outline` is true, only the header's metadata is read.
    pub(super) fn with_outline(self, outline: bool) -> Self {
        Self { outline, ..self }
    }

    /// Returns true if only the header's metadata is requested: size, sample type and place. A
    /// format that can read these without the samples returns no samples.
    pub(super) const fn is_outline(&self) -> bool {
        self.outline
    }

    /// Returns the file's name without folders; it may imply format and place.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the part after the last dot of the name, in lower case.
    pub(super) fn extension(&self) -> &str {
        &self.extension
    }

    /// Returns the number of bytes.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    /// Returns the source of the bytes, for decoders that read at any offset.
    pub(super) fn data(&self) -> &Data {
        &self.data
    }

    /// Returns the path or URL; `None` for bytes in memory.
    pub(super) fn path(&self) -> Option<&Path> {
        match &self.data {
            Data::File(_, path) => Some(path),
            Data::Remote(_, url) => Some(Path::new(url)),
            #[cfg(test)]
            Data::Memory(_) => None,
        }
    }

    /// Returns the fetcher of the files at URLs.
    pub(super) const fn fetcher(&self) -> &RemoteFetcher {
        &self.fetcher
    }

    /// Returns the file, if it is at a URL.
    pub(super) fn remote(&self) -> Option<Arc<RemoteFile>> {
        match &self.data {
            Data::Remote(file, _) => Some(file.clone()),
            Data::File(..) => None,
            #[cfg(test)]
            Data::Memory(_) => None,
        }
    }

    /// Returns a buffered reader at the start.
    pub(super) fn reader(&self) -> Result<Box<dyn ReadSeek + '_>, RasterError> {
        Ok(match &self.data {
            Data::File(file, _) => {
                let mut file = file;
                file.seek(SeekFrom::Start(0))
                    .map_err(RasterError::Unreadable)?;
                Box::new(BufReader::with_capacity(1 << 16, file))
            }
            #[cfg(test)]
            Data::Memory(bytes) => Box::new(std::io::Cursor::new(bytes.as_slice())),
            Data::Remote(file, _) => {
                let reader = RemoteReader::new(file.clone());
                Box::new(BufReader::with_capacity(1 << 16, reader))
            }
        })
    }

    /// Returns a second handle on the same bytes, for storage; `None` if they are in memory.
    pub(super) fn try_clone(&self) -> Result<Option<Self>, RasterError> {
        let data = match &self.data {
            Data::File(file, path) => {
                let file = file.try_clone().map_err(RasterError::Unreadable)?;
                Data::File(file, path.clone())
            }
            Data::Remote(file, url) => Data::Remote(file.clone(), url.clone()),
            #[cfg(test)]
            Data::Memory(_) => return Ok(None),
        };
        let own = Self::new(&self.name, self.len, data);
        Ok(Some(Self {
            fetcher: self.fetcher.clone(),
            ..own
        }))
    }

    /// Returns the stamp of the file in its present state; `None` if it is unknown.
    pub(super) fn stamp(&self) -> Option<FileStamp> {
        match &self.data {
            Data::File(file, path) => Some(FileStamp::of(path, &file.metadata().ok()?)),
            Data::Remote(file, _) => file.stamp(),
            #[cfg(test)]
            Data::Memory(_) => None,
        }
    }

    /// Returns true if the path still leads to this file in its present state.
    pub(super) fn is_at_its_path(&self) -> bool {
        match &self.data {
            Data::File(_, path) => FileStamp::at(path) == self.stamp(),
            Data::Remote(..) => true,
            #[cfg(test)]
            Data::Memory(_) => false,
        }
    }

    /// Reads bytes at an offset.
    pub(super) fn read_at(&self, at: u64, count: u64) -> Result<Vec<u8>, RasterError> {
        let is_inside = at.checked_add(count).is_some_and(|end| end <= self.len);
        let (true, Ok(capacity)) = (is_inside, usize::try_from(count)) else {
            return Err(RasterError::Truncated("it ends within its samples".into()));
        };
        let read = match &self.data {
            Data::File(file, _) => {
                let mut bytes = vec![0; capacity];
                read_exact_at(file, &mut bytes, at).map(|()| bytes)
            }
            #[cfg(test)]
            Data::Memory(bytes) => Ok(bytes[at as usize..][..capacity].to_vec()),
            Data::Remote(file, _) => file.read_at(at, capacity),
        };
        read.map_err(|error| RasterError::from_io(error, "the samples"))
    }

    /// Reads the first bytes, up to `count`.
    pub(super) fn head(&self, count: u64) -> Result<Vec<u8>, RasterError> {
        let mut head = Vec::new();
        self.reader()?
            .take(count)
            .read_to_end(&mut head)
            .map_err(|error| RasterError::from_io(error, "its beginning"))?;
        Ok(head)
    }

    /// Checks, before memory is allocated, that the file's bytes can contain the samples at
    /// deflate's max ratio.
    ///
    /// # Errors
    /// [`RasterError::AbsurdSize`].
    pub(super) fn check_size(
        &self,
        columns: u32,
        rows: u32,
        bytes: u64,
    ) -> Result<(), RasterError> {
        let samples = u64::from(columns) * u64::from(rows);
        let capacity = self.len.saturating_mul(DEFLATE_RATIO);
        match samples.checked_mul(bytes) {
            Some(promised) if promised <= capacity => Ok(()),
            _ => Err(RasterError::AbsurdSize(format!(
                "{columns} × {rows} samples in a file of {} bytes",
                self.len
            ))),
        }
    }
}

/// Reads bytes at an offset, also while other threads read the same file.
#[cfg(unix)]
pub(super) fn read_exact_at(file: &File, into: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, into, at)
}

/// Reads bytes at an offset, also while other threads read the same file.
#[cfg(windows)]
pub(super) fn read_exact_at(file: &File, mut into: &mut [u8], mut at: u64) -> std::io::Result<()> {
    while !into.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, into, at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            count => {
                into = &mut into[count..];
                at += count as u64;
            }
        }
    }
    Ok(())
}
