//! The bytes to decode: a file, or what was packed inside one.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use netcdf_reader::{BytesStorage, DynStorage, FileStorage};

use super::Fault;

/// A buffered reader that a decoder may move about in.
pub(super) trait ReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> ReadSeek for T {}

/// The bytes to decode, and the name that goes with them.
pub(super) struct Input {
    /// File name without folders, which may tell format and place.
    name: String,
    /// Number of bytes.
    len: u64,
    data: Data,
}

enum Data {
    File(File),
    Memory(Vec<u8>),
}

impl Input {
    /// A file on disk.
    pub(super) fn open(path: &Path) -> Result<Self, Fault> {
        let file = File::open(path).map_err(Fault::Unreadable)?;
        let metadata = file.metadata().map_err(Fault::Unreadable)?;
        if metadata.is_dir() {
            let error = std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder");
            return Err(Fault::Unreadable(error));
        }
        if !metadata.is_file() {
            // A pipe has no end to seek to, and may never end at all.
            let error = std::io::Error::other("it is not a regular file");
            return Err(Fault::Unreadable(error));
        }
        Ok(Self {
            name: path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default(),
            len: metadata.len(),
            data: Data::File(file),
        })
    }

    /// Bytes unpacked from another file.
    pub(super) fn unpacked(name: &str, bytes: Vec<u8>) -> Self {
        Self {
            name: name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned(),
            len: bytes.len() as u64,
            data: Data::Memory(bytes),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// What follows the last dot of the name, in lower case.
    pub(super) fn extension(&self) -> String {
        match self.name.rsplit_once('.') {
            Some((_, extension)) => extension.to_lowercase(),
            None => String::new(),
        }
    }

    /// Number of bytes.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    /// A buffered reader at the start.
    pub(super) fn reader(&self) -> Result<Box<dyn ReadSeek + '_>, Fault> {
        Ok(match &self.data {
            Data::File(file) => {
                let mut file = file;
                file.seek(SeekFrom::Start(0)).map_err(Fault::Unreadable)?;
                Box::new(BufReader::with_capacity(1 << 16, file))
            }
            Data::Memory(bytes) => Box::new(Cursor::new(bytes.as_slice())),
        })
    }

    /// The first bytes, up to `count` of them.
    pub(super) fn head(&self, count: u64) -> Result<Vec<u8>, Fault> {
        let mut head = Vec::new();
        self.reader()?
            .take(count)
            .read_to_end(&mut head)
            .map_err(Fault::Unreadable)?;
        Ok(head)
    }

    /// The bytes as a store that can be read anywhere, for the NetCDF reader.
    pub(super) fn storage(&self) -> Result<DynStorage, Fault> {
        Ok(match &self.data {
            Data::File(file) => {
                let file = file.try_clone().map_err(Fault::Unreadable)?;
                Arc::new(
                    FileStorage::from_file(file)
                        .map_err(|error| Fault::Unreadable(std::io::Error::other(error)))?,
                )
            }
            Data::Memory(bytes) => Arc::new(BytesStorage::from_owner(bytes.clone())),
        })
    }

    /// All bytes. Only for formats whose decoder cannot read piece by piece.
    pub(super) fn bytes(&self) -> Result<Vec<u8>, Fault> {
        self.head(u64::MAX)
    }
}
