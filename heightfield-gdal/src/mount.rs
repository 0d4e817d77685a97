//! File systems of this crate's user, under GDAL names. Each VRT and MRF in them is checked before
//! GDAL reads it.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::file_system::{FileSystem, PREFIX, ReadAt};
use crate::libgdal::Libgdal;
use crate::{mrf, vrt};

/// A file system under GDAL names, until the last clone and the last [`Dataset`](crate::Dataset) in
/// it are dropped.
#[derive(Clone)]
pub struct Mount(pub(crate) Arc<Mounted>);

/// State shared by all clones.
pub(crate) struct Mounted {
    number: u64,
    library: Arc<Libgdal>,
    files: Box<dyn FileSystem>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    fault: Option<io::Error>,
    /// Nesting depths of VRTs, by their names.
    depths: HashMap<String, u32>,
    /// Number of threads that are waiting for a file, and the start of the first wait.
    waiting: u32,
    wait_start: Option<Instant>,
    /// Total time in which GDAL has waited for files.
    waited: Duration,
}

/// All file systems, by number.
static MOUNTED: Mutex<BTreeMap<u64, Weak<Mounted>>> = Mutex::new(BTreeMap::new());

fn mounted() -> MutexGuard<'static, BTreeMap<u64, Weak<Mounted>>> {
    // No code that panics runs while the lock is held.
    MOUNTED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the file system of a GDAL name, and the name in it.
pub(crate) fn at(name: &str) -> Option<(Arc<Mounted>, &str)> {
    let (_, rest) = name.split_once(PREFIX)?;
    let (number, name) = rest.split_once('/')?;
    let mounted = mounted().get(&number.parse().ok()?)?.upgrade()?;
    Some((mounted, name))
}

impl Mount {
    /// Returns GDAL's name of a file.
    #[must_use]
    pub fn path(&self, name: &str) -> String {
        format!("{}{name}", self.0.root())
    }

    /// Returns the reason why a file could not be read, since the last call.
    #[must_use]
    pub fn take_fault(&self) -> Option<io::Error> {
        self.0.take_fault()
    }
}

impl fmt::Debug for Mount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.root())
    }
}

impl Mounted {
    pub(crate) fn new(library: Arc<Libgdal>, files: Box<dyn FileSystem>) -> Arc<Self> {
        static NUMBERS: AtomicU64 = AtomicU64::new(1);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        let new = Arc::new(Self {
            number,
            library,
            files,
            state: Mutex::default(),
        });
        mounted().insert(number, Arc::downgrade(&new));
        new
    }

    fn root(&self) -> String {
        format!("{PREFIX}{}/", self.number)
    }

    pub(crate) fn library(&self) -> &Libgdal {
        &self.library
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // As above.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn take_fault(&self) -> Option<io::Error> {
        self.state().fault.take()
    }

    /// Returns the total time in which GDAL has waited for files, including current waits.
    pub(crate) fn waited(&self) -> Duration {
        let state = self.state();
        state.waited
            + state
                .wait_start
                .map_or(Duration::ZERO, |wait_start| wait_start.elapsed())
    }

    /// Runs a read, and records its time and its error.
    fn read<T>(&self, read: impl FnOnce() -> io::Result<T>) -> Option<T> {
        let mut state = self.state();
        state.waiting += 1;
        state.wait_start.get_or_insert_with(Instant::now);
        drop(state);
        let read = read();
        let mut state = self.state();
        state.waiting -= 1;
        if state.waiting == 0 {
            let wait_start = state.wait_start.take();
            state.waited += wait_start.map_or(Duration::ZERO, |wait_start| wait_start.elapsed());
        }
        match read {
            Ok(read) => return Some(read),
            Err(error) if is_missing(&error) => {}
            Err(error) => state.fault = Some(error),
        }
        None
    }

    /// Opens a file; `None` if it does not exist or cannot be read.
    pub(crate) fn open(&self, name: &str) -> Option<Box<dyn ReadAt>> {
        let name = plain(name)?;
        self.read(|| {
            let file = self.files.open(&name)?;
            let head = file.bytes().min(vrt::HEAD_BYTES);
            let head = file.read_at(0, head as usize)?;
            if vrt::begins(&head) {
                return Ok(Box::new(self.own_vrt(&name, &*file)?) as Box<dyn ReadAt>);
            }
            if mrf::begins(&head) {
                self.check_mrf(&name, &*file)?;
            }
            Ok(file)
        })
    }

    /// Checks that an MRF references only files of this file system.
    fn check_mrf(&self, name: &str, file: &dyn ReadAt) -> io::Result<()> {
        if file.bytes() > mrf::MAX_BYTES {
            return Err(not_opened(name, mrf::too_large()));
        }
        let bytes = file.read_at(0, file.bytes() as usize)?;
        let header = String::from_utf8_lossy(&bytes);
        let checked = mrf::check(&self.library, &header).map_err(io::Error::other)?;
        checked.map_err(|why| not_opened(name, why))
    }

    /// Returns the text of a VRT if it references only files of this file system.
    fn own_vrt(&self, name: &str, file: &dyn ReadAt) -> io::Result<Text> {
        let refused = |why: String| not_opened(name, why);
        if file.bytes() > vrt::MAX_BYTES {
            return Err(refused(vrt::too_large()));
        }
        let bytes = file.read_at(0, file.bytes() as usize)?;
        let mut text = String::from_utf8_lossy(&bytes).into_owned();
        let root = self.root();
        for of_server in self.files.roots() {
            text = text.replace(of_server, &root);
        }
        let depth = self.state().depths.get(name).copied().unwrap_or(0);
        if depth > vrt::MAX_NESTING {
            return Err(refused(vrt::too_deep(depth)));
        }
        let named = vrt::names(&self.library, &text).map_err(io::Error::other)?;
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut inner = Vec::new();
        for named in &named {
            let neighbour = named.at_server(&root).map_err(refused)?;
            inner.extend(
                neighbour.and_then(|neighbour| match neighbour.strip_prefix(&root) {
                    Some(absolute) => plain(absolute),
                    None => plain(&format!("{folder}/{neighbour}")),
                }),
            );
        }
        let mut state = self.state();
        for name in inner.into_iter().take(vrt::MAX_FILES) {
            state.depths.entry(name).or_insert(depth + 1);
        }
        Ok(Text(text.into_bytes()))
    }

    /// Returns the names of the files beside a file, if they were listed.
    pub(crate) fn neighbours(&self, name: &str) -> Option<Vec<String>> {
        let name = plain(name)?;
        self.read(|| self.files.neighbours(&name))
    }

    /// Reads bytes of an open file.
    pub(crate) fn read_at(&self, file: &dyn ReadAt, at: u64, count: usize) -> Option<Vec<u8>> {
        let read = self.read(|| file.read_at(at, count));
        read.filter(|bytes| bytes.len() == count)
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        mounted().remove(&self.number);
    }
}

/// A file in memory.
struct Text(Vec<u8>);

impl ReadAt for Text {
    fn bytes(&self) -> u64 {
        self.0.len() as u64
    }

    fn read_at(&self, at: u64, count: usize) -> io::Result<Vec<u8>> {
        let rest = usize::try_from(at).ok().and_then(|at| self.0.get(at..));
        let bytes = rest.and_then(|rest| rest.get(..count));
        bytes
            .map(<[u8]>::to_vec)
            .ok_or(io::ErrorKind::UnexpectedEof.into())
    }
}

/// Returns the error for a rejected file.
fn not_opened(name: &str, why: String) -> io::Error {
    let path = name.into();
    io::Error::other(Error::NotOpened { path, why })
}

/// Returns true if the file does not exist.
fn is_missing(error: &io::Error) -> bool {
    use io::ErrorKind::{NotFound, PermissionDenied};
    matches!(error.kind(), NotFound | PermissionDenied)
}

/// Normalises a name: removes `.` and `..`. `None` for a folder, or outside the root.
fn plain(name: &str) -> Option<String> {
    let mut parts = Vec::new();
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    let is_file = !parts.is_empty() && !name.ends_with('/');
    is_file.then(|| parts.join("/"))
}
