//! File systems of callers under names of GDAL's. Each VRT and MRF in them is looked at before GDAL
//! reads it.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::file_system::{FileSystem, PREFIX, ReadAt};
use crate::loaded::Loaded;
use crate::{mrf, vrt};

/// A file system under names of GDAL's, until the last clone and the last
/// [`Dataset`](crate::Dataset) in it are dropped.
#[derive(Clone)]
pub struct Mount(pub(crate) Arc<Mounted>);

/// State that all clones share.
pub(crate) struct Mounted {
    number: u64,
    library: Arc<Loaded>,
    files: Box<dyn FileSystem>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    fault: Option<io::Error>,
    /// Depths of VRTs in others, by their names.
    depths: HashMap<String, u32>,
    /// Threads that wait for a file now, and the time of the first of them.
    waiting: u32,
    begun: Option<Instant>,
    /// Time for which GDAL has waited for files.
    waited: Duration,
}

/// All file systems by their numbers.
static MOUNTED: Mutex<BTreeMap<u64, Weak<Mounted>>> = Mutex::new(BTreeMap::new());

fn mounted() -> MutexGuard<'static, BTreeMap<u64, Weak<Mounted>>> {
    // Nothing that panics runs while this is held.
    MOUNTED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The file system that a name of GDAL's leads to, and the name there.
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

    /// Takes the reason for which a file could not be read since the last call.
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
    pub(crate) fn new(library: Arc<Loaded>, files: Box<dyn FileSystem>) -> Arc<Self> {
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

    pub(crate) fn library(&self) -> &Loaded {
        &self.library
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The same.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn take_fault(&self) -> Option<io::Error> {
        self.state().fault.take()
    }

    /// Returns the time for which GDAL has waited for files, until now.
    pub(crate) fn waited(&self) -> Duration {
        let state = self.state();
        state.waited + state.begun.map_or(Duration::ZERO, |begun| begun.elapsed())
    }

    /// Reads, and notes how long that takes and what goes wrong.
    fn read<T>(&self, read: impl FnOnce() -> io::Result<T>) -> Option<T> {
        let mut state = self.state();
        state.waiting += 1;
        state.begun.get_or_insert_with(Instant::now);
        drop(state);
        let read = read();
        let mut state = self.state();
        state.waiting -= 1;
        if state.waiting == 0 {
            let begun = state.begun.take();
            state.waited += begun.map_or(Duration::ZERO, |begun| begun.elapsed());
        }
        match read {
            Ok(read) => return Some(read),
            Err(error) if is_missing(&error) => {}
            Err(error) => state.fault = Some(error),
        }
        None
    }

    /// The file of a name; none where there is none, or it cannot be read.
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

    /// Checks that an MRF names files of this file system only.
    fn check_mrf(&self, name: &str, file: &dyn ReadAt) -> io::Result<()> {
        if file.bytes() > mrf::MAX_BYTES {
            return Err(not_opened(name, mrf::too_large()));
        }
        let bytes = file.read_at(0, file.bytes() as usize)?;
        let header = String::from_utf8_lossy(&bytes);
        let checked = mrf::check(&self.library, &header).map_err(io::Error::other)?;
        checked.map_err(|why| not_opened(name, why))
    }

    /// A VRT that names files of this file system only.
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
            let beside = named.at_server(&root).map_err(refused)?;
            inner.extend(beside.and_then(|beside| match beside.strip_prefix(&root) {
                Some(absolute) => plain(absolute),
                None => plain(&format!("{folder}/{beside}")),
            }));
        }
        let mut state = self.state();
        for name in inner.into_iter().take(vrt::MAX_FILES) {
            state.depths.entry(name).or_insert(depth + 1);
        }
        Ok(Text(text.into_bytes()))
    }

    /// The names of the files beside one, if they are known.
    pub(crate) fn beside(&self, name: &str) -> Option<Vec<String>> {
        let name = plain(name)?;
        self.read(|| self.files.beside(&name))
    }

    /// Bytes of a file that is open.
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

/// The refusal of a file.
fn not_opened(name: &str, why: String) -> io::Error {
    let path = name.into();
    io::Error::other(Error::NotOpened { path, why })
}

/// Returns true if an error says that there is no such file.
fn is_missing(error: &io::Error) -> bool {
    use io::ErrorKind::{NotFound, PermissionDenied};
    matches!(error.kind(), NotFound | PermissionDenied)
}

/// A name without `.` and `..`; none of a folder, and of what lies outside of the root.
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
