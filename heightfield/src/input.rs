//! The bytes to decode: a file, here or at a URL, or what was packed inside one.

use std::fs::{File, FileType, Metadata};
use std::io::{BufRead, BufReader, Cursor, Error, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::BadRaster;
use crate::disk_cache::FileStamp;
use crate::remote::{Elsewhere, RemoteFile, RemoteReader, file_name, is_url};

/// Deflate packs at most this many bytes into one.
pub(super) const DEFLATE_RATIO: u64 = 1040;

/// Refuses what is no file, by the name of its kind.
fn check_regular(metadata: &Metadata) -> Result<(), BadRaster> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(BadRaster::Unreadable(match metadata.is_dir() {
        true => Error::new(ErrorKind::IsADirectory, "it is a folder"),
        false => Error::other(format!(
            "it is {}, not a regular file",
            kind(metadata.file_type())
        )),
    }))
}

#[cfg(unix)]
fn kind(of: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match of {
        of if of.is_fifo() => "a pipe (FIFO)",
        of if of.is_socket() => "a socket",
        of if of.is_char_device() => "a character device",
        of if of.is_block_device() => "a block device",
        _ => "something else",
    }
}

#[cfg(not(unix))]
fn kind(_: FileType) -> &'static str {
    "something else"
}

/// A buffered reader that a decoder may move about in.
pub(super) trait ReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> ReadSeek for T {}

/// The bytes to decode, and the name that goes with them.
pub(super) struct FileBytes {
    name: String,
    extension: String,
    len: u64,
    data: Data,
    outline: bool,
    /// Where neighbours that have URLs are.
    elsewhere: Elsewhere,
}

/// Where the bytes are.
pub(super) enum Data {
    /// In an open file at a path.
    File(File, PathBuf),
    /// In memory.
    Memory(Vec<u8>),
    /// At a server, and its URL.
    Remote(Arc<RemoteFile>, String),
}

impl FileBytes {
    /// A file on disk or at a URL.
    pub(super) fn open(path: &Path, elsewhere: &Elsewhere) -> Result<Self, BadRaster> {
        let bytes = match path.to_str().filter(|name| is_url(name)) {
            Some(url) => Self::at_url(url, elsewhere)?,
            None => Self::on_disk(path)?,
        };
        Ok(Self {
            elsewhere: elsewhere.clone(),
            ..bytes
        })
    }

    fn at_url(url: &str, elsewhere: &Elsewhere) -> Result<Self, BadRaster> {
        let file = elsewhere.open(url).map_err(BadRaster::elsewhere)?;
        let (len, data) = (file.len(), Data::Remote(file, url.to_owned()));
        Ok(Self::new(file_name(url), len, data))
    }

    fn on_disk(path: &Path) -> Result<Self, BadRaster> {
        // Before it is opened: to open a pipe waits for a writer, and may start a device.
        check_regular(&std::fs::metadata(path).map_err(BadRaster::Unreadable)?)?;
        let file = File::open(path).map_err(BadRaster::Unreadable)?;
        let metadata = file.metadata().map_err(BadRaster::Unreadable)?;
        check_regular(&metadata)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let data = Data::File(file, path.to_owned());
        Ok(Self::new(&name, metadata.len(), data))
    }

    /// Bytes unpacked from another file.
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
            elsewhere: Elsewhere::default(),
        }
    }

    /// The same bytes, of which only what their header says is wanted.
    pub(super) fn in_outline(self, outline: bool) -> Self {
        Self { outline, ..self }
    }

    /// Whether only what the header says is wanted: size, type of samples and place. A
    /// format that can tells these without reading the samples, and hands over none.
    pub(super) const fn is_outline(&self) -> bool {
        self.outline
    }

    /// The file's name without folders, which may tell format and place.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// What follows the last dot of the name, in lower case.
    pub(super) fn extension(&self) -> &str {
        &self.extension
    }

    /// Number of bytes.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    /// Where the bytes are, for decoders that read anywhere.
    pub(super) fn data(&self) -> &Data {
        &self.data
    }

    /// The files at URLs among which this one is.
    pub(super) const fn elsewhere(&self) -> &Elsewhere {
        &self.elsewhere
    }

    /// The file, where it is at a URL.
    pub(super) fn remote(&self) -> Option<Arc<RemoteFile>> {
        match &self.data {
            Data::Remote(file, _) => Some(file.clone()),
            Data::File(..) | Data::Memory(_) => None,
        }
    }

    /// A buffered reader at the start.
    pub(super) fn reader(&self) -> Result<Box<dyn ReadSeek + '_>, BadRaster> {
        Ok(match &self.data {
            Data::File(file, _) => {
                let mut file = file;
                file.seek(SeekFrom::Start(0))
                    .map_err(BadRaster::Unreadable)?;
                Box::new(BufReader::with_capacity(1 << 16, file))
            }
            Data::Memory(bytes) => Box::new(Cursor::new(bytes.as_slice())),
            Data::Remote(file, _) => {
                let reader = RemoteReader::new(file.clone());
                Box::new(BufReader::with_capacity(1 << 16, reader))
            }
        })
    }

    /// The same bytes for somebody who keeps them; `None` where they are in memory.
    pub(super) fn again(&self) -> Result<Option<Self>, BadRaster> {
        let data = match &self.data {
            Data::File(file, path) => {
                let file = file.try_clone().map_err(BadRaster::Unreadable)?;
                Data::File(file, path.clone())
            }
            Data::Remote(file, url) => Data::Remote(file.clone(), url.clone()),
            Data::Memory(_) => return Ok(None),
        };
        let own = Self::new(&self.name, self.len, data);
        Ok(Some(Self {
            elsewhere: self.elsewhere.clone(),
            ..own
        }))
    }

    /// What tells the file in its present state from others; `None` where that is not known.
    pub(super) fn stamp(&self) -> Option<FileStamp> {
        match &self.data {
            Data::File(file, path) => Some(FileStamp::of(path, &file.metadata().ok()?)),
            Data::Remote(file, _) => file.stamp(),
            Data::Memory(_) => None,
        }
    }

    /// Whether the file at its path is still this one, in its present state.
    pub(super) fn is_at_its_path(&self) -> bool {
        match &self.data {
            Data::File(_, path) => FileStamp::at(path) == self.stamp(),
            Data::Remote(..) => true,
            Data::Memory(_) => false,
        }
    }

    /// Bytes at a place of the file.
    pub(super) fn read_at(&self, at: u64, count: u64) -> Result<Vec<u8>, BadRaster> {
        let end = at.checked_add(count).filter(|end| *end <= self.len);
        let (Some(end), Ok(room)) = (end, usize::try_from(count)) else {
            return Err(BadRaster::Truncated("it ends before its samples do".into()));
        };
        let read = match &self.data {
            Data::File(file, _) => {
                let mut bytes = vec![0; room];
                read_exact_at(file, &mut bytes, at).map(|()| bytes)
            }
            Data::Memory(bytes) => Ok(bytes[at as usize..end as usize].to_vec()),
            Data::Remote(file, _) => file.read_at(at, room),
        };
        read.map_err(|error| BadRaster::from_io(error, "the samples"))
    }

    /// The first bytes, up to `count` of them.
    pub(super) fn head(&self, count: u64) -> Result<Vec<u8>, BadRaster> {
        let mut head = Vec::new();
        self.reader()?
            .take(count)
            .read_to_end(&mut head)
            .map_err(|error| BadRaster::from_io(error, "its beginning"))?;
        Ok(head)
    }

    /// All bytes, for decoders that cannot wait for some.
    pub(super) fn all(&self) -> Result<Vec<u8>, BadRaster> {
        const LARGEST: u64 = 1 << 30;
        if self.len > LARGEST {
            return Err(BadRaster::Unsupported {
                format: "a file at a URL",
                feature: format!("{} MB in a format that is read as a whole", self.len >> 20),
            });
        }
        self.head(self.len)
    }

    /// Checks that so many samples, packed with deflate at its best, fit into the
    /// bytes there are, before room is made for them.
    ///
    /// # Errors
    /// [`BadRaster::AbsurdSize`].
    pub(super) fn check_holds(&self, columns: u32, rows: u32, bytes: u64) -> Result<(), BadRaster> {
        let samples = u64::from(columns) * u64::from(rows);
        let room = self.len.saturating_mul(DEFLATE_RATIO);
        match samples.checked_mul(bytes) {
            Some(promised) if promised <= room => Ok(()),
            _ => Err(BadRaster::AbsurdSize(format!(
                "{columns} × {rows} samples in a file of {} bytes",
                self.len
            ))),
        }
    }
}

/// Reads bytes at a place, whatever others read of the same file meanwhile.
#[cfg(unix)]
pub(super) fn read_exact_at(file: &File, into: &mut [u8], at: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, into, at)
}

/// Reads bytes at a place, whatever others read of the same file meanwhile.
#[cfg(windows)]
pub(super) fn read_exact_at(file: &File, mut into: &mut [u8], mut at: u64) -> std::io::Result<()> {
    while !into.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, into, at)? {
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            count => {
                into = &mut into[count..];
                at += count as u64;
            }
        }
    }
    Ok(())
}
