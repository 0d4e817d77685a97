//! The bytes of a file as `hdf5-reader` and `netcdf-reader` read them: in parts, of which none
//! is large, or all of them.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use hdf5_reader::error::Error as Hdf5Error;
use hdf5_reader::{Dataset, Hdf5File, StorageBuffer};
use netcdf_reader::{BytesStorage, DynStorage, FileStorage, NcFile, NcOpenOptions, Storage};

use super::{fault, filters};
use crate::BadRaster;
use crate::blocks::LARGEST_BLOCK_BYTES;
use crate::input::{Data, FileBytes};
use crate::remote::RemoteFile;

/// Chunks that `hdf5-reader` keeps unpacked, bytes: those of a coarse image that the next
/// block of it touches, too.
pub(super) const CHUNK_CACHE_BYTES: usize = 16 << 20;
/// No part of the file that is read at once is larger, bytes: a packed chunk may be somewhat
/// larger than the samples in it.
const LARGEST_PART: usize = 2 * LARGEST_BLOCK_BYTES as usize;
/// An object header of more bytes is none.
const LARGEST_HEADER: usize = 8 << 20;

/// A way to the bytes of a file.
pub(super) struct Access {
    storage: DynStorage,
    largest_chunk: usize,
    line: Arc<Line>,
}

/// What the line said of the part that did not come. The decoders pass errors on as texts, and
/// take what cannot be read for what is not there.
#[derive(Default)]
struct Line(Mutex<Option<io::Error>>);

impl Access {
    /// For reading what is touched: no part and no chunk takes more than
    /// [`LARGEST_BLOCK_BYTES`], or twice that packed.
    pub(super) fn in_parts(input: &FileBytes) -> Result<Self, BadRaster> {
        let line = Arc::new(Line::default());
        let inner: DynStorage = match input.data() {
            Data::Remote(file, _) => Arc::new(AtUrl {
                file: file.clone(),
                line: line.clone(),
            }),
            _ => storage(input)?,
        };
        Ok(Self {
            storage: Arc::new(InParts { inner }),
            largest_chunk: LARGEST_BLOCK_BYTES as usize,
            line,
        })
    }

    /// For reading all samples at once.
    pub(super) fn whole(input: &FileBytes) -> Result<Self, BadRaster> {
        Ok(Self {
            storage: storage(input)?,
            largest_chunk: hdf5_reader::DEFAULT_MAX_CHUNK_BYTES,
            line: Arc::default(),
        })
    }

    /// The file by its variables.
    pub(super) fn file(&self) -> Result<NcFile, BadRaster> {
        let options = NcOpenOptions {
            filter_registry: Some(filters::with_zstd(self.largest_chunk)),
            chunk_cache_bytes: CHUNK_CACHE_BYTES,
            max_chunk_bytes: self.largest_chunk,
            max_object_header_bytes: LARGEST_HEADER,
            ..NcOpenOptions::default()
        };
        NcFile::from_storage_with_options(self.storage.clone(), options)
            .map_err(|error| fault(&error))
    }

    /// A variable of a NetCDF-4 file by its name, with the shape that its dimensions have.
    pub(super) fn dataset(&self, name: &str, shape: &[u64]) -> Result<Dataset, BadRaster> {
        let options = hdf5_reader::OpenOptions {
            filter_registry: Some(filters::with_zstd(self.largest_chunk)),
            chunk_cache_bytes: CHUNK_CACHE_BYTES,
            max_chunk_bytes: self.largest_chunk,
            max_read_bytes: LARGEST_PART,
            max_object_header_bytes: LARGEST_HEADER,
            ..hdf5_reader::OpenOptions::default()
        };
        let file = Hdf5File::from_storage_with_options(self.storage.clone(), options);
        let dataset = file.and_then(|file| file.dataset(name)?.with_padded_shape(shape));
        dataset.map_err(|error| fault(&error.into()))
    }

    /// Whether all that was asked for so far has come.
    ///
    /// # Errors
    /// Why something did not.
    pub(super) fn check_came(&self) -> Result<(), BadRaster> {
        let said = self.line.0.lock();
        match said.unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(BadRaster::from_io(error, "the file")),
            None => Ok(()),
        }
    }
}

/// All bytes as a store that can be read anywhere.
fn storage(input: &FileBytes) -> Result<DynStorage, BadRaster> {
    Ok(match input.data() {
        Data::File(file, _) => {
            let file = file.try_clone().map_err(BadRaster::Unreadable)?;
            let storage = FileStorage::from_file(file);
            Arc::new(storage.map_err(|error| BadRaster::Unreadable(io::Error::other(error)))?)
        }
        Data::Memory(bytes) => Arc::new(BytesStorage::from_owner(bytes.clone())),
        Data::Remote(..) => Arc::new(BytesStorage::from_owner(input.all()?)),
    })
}

/// Bytes of which no large part is read at once, whatever the file says of its sizes.
struct InParts {
    inner: DynStorage,
}

impl Storage for InParts {
    fn len(&self) -> u64 {
        self.inner.len()
    }

    fn read_range(&self, offset: u64, len: usize) -> Result<StorageBuffer, Hdf5Error> {
        if len > LARGEST_PART {
            let what = format!("a part of {len} bytes, of which at most {LARGEST_PART} are read");
            return Err(Hdf5Error::ResourceLimit(what));
        }
        self.inner.read_range(offset, len)
    }
}

/// A file at a URL.
struct AtUrl {
    file: Arc<RemoteFile>,
    line: Arc<Line>,
}

impl Storage for AtUrl {
    fn len(&self) -> u64 {
        self.file.len()
    }

    fn read_range(&self, offset: u64, len: usize) -> Result<StorageBuffer, Hdf5Error> {
        let inside = offset.checked_add(len as u64);
        if inside.is_none_or(|end| end > self.len()) {
            return Err(Hdf5Error::OffsetOutOfBounds(offset));
        }
        let read = self.file.read_at(offset, len);
        read.map(StorageBuffer::from_vec).map_err(|error| {
            let kind = error.kind();
            let mut said = self.line.0.lock().unwrap_or_else(PoisonError::into_inner);
            *said = Some(error);
            Hdf5Error::Io(kind.into())
        })
    }
}
