//! Files that appear only when they are complete, and the partial files of killed processes.
//!
//! A file `OUT` is written as `OUT.XXXXXX.partial` beside its place, with a lock that the system
//! releases whenever the process ends. A partial file without a lock will therefore never be
//! completed.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use heightfield::regular_file;
use same_file::is_same_file;
use tempfile::TempPath;

/// An output file cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}", path.display())]
pub struct OutputError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    #[source]
    pub source: io::Error,
}

/// A file being written. If it is dropped before [`Output::finish`], no file remains, except for a
/// recording with a write error ([`Output::for_recording`]).
pub struct Output {
    path: PathBuf,
    writer: BufWriter<File>,
    /// Temporary file beside the file that it will replace; `None` for a pipe, a device and
    /// standard output, which are not replaced.
    partial: Option<TempPath>,
    /// True if a partial file remains after a write error.
    is_recording: bool,
    /// Bytes that may still be written.
    free_bytes: u64,
}

impl Output {
    /// Begins a file. `-` creates none: it stands for standard output, to which most commands write
    /// directly.
    ///
    /// # Errors
    /// When its folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |source| OutputError {
            path: path.to_owned(),
            source,
        };
        let opened = match std::fs::metadata(path) {
            _ if is_standard_output(path) => Err(io::Error::other(
                "it is standard output, where this command prints its progress",
            )),
            Ok(there) if there.is_dir() => Err(io::Error::other("it is a folder")),
            Ok(there) if !there.is_file() => {
                let file = File::options().write(true).open(path);
                file.map(|file| (file, None))
            }
            _ => temporary(path).map(|(file, place)| (file, Some(place))),
        };
        let (file, partial) = opened.map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            writer: BufWriter::with_capacity(1 << 16, file),
            partial,
            is_recording: false,
            free_bytes: u64::MAX,
        })
    }

    /// Begins a file; writes to standard output if the path is `-`.
    ///
    /// # Errors
    /// As [`Output::create`].
    pub fn create_or_standard_output(path: &Path) -> Result<Self, OutputError> {
        if !is_standard_output(path) {
            return Self::create(path);
        }
        let file = standard_output().map_err(|source| OutputError {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            path: path.to_owned(),
            writer: BufWriter::with_capacity(1 << 16, file),
            partial: None,
            is_recording: false,
            free_bytes: u64::MAX,
        })
    }

    /// Makes this the file of a recording. It cannot be repeated, so its partial file remains after
    /// a write error. Its size is limited to `max_bytes` bytes, because the device determines its
    /// growth.
    #[must_use]
    pub fn for_recording(self, max_bytes: u64) -> Self {
        Self {
            is_recording: true,
            free_bytes: max_bytes,
            ..self
        }
    }

    /// Keeps the partial file of a recording.
    fn keep_partial(&mut self) {
        if let (true, Some(partial)) = (self.is_recording, &mut self.partial) {
            partial.disable_cleanup(true);
        }
    }

    /// Returns the file's path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the partial file; `None` for a pipe, a device and standard output.
    #[must_use]
    pub fn partial(&self) -> Option<&Path> {
        self.partial.as_deref()
    }

    /// Moves the complete file to its place.
    ///
    /// # Errors
    /// When the rest cannot be written.
    pub fn finish(mut self) -> Result<(), OutputError> {
        let flushed = self.writer.flush().inspect_err(|_| self.keep_partial());
        let path = self.path;
        flushed.map_err(|source| OutputError {
            path: path.clone(),
            source,
        })?;
        let finished = self.writer.into_inner().map_err(|error| error.into_error());
        let placed = finished.and_then(|mut file| match self.partial {
            Some(partial) => partial.persist(&path).map_err(|error| error.error),
            None => file.flush(),
        });
        placed.map_err(|source| OutputError { path, source })
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self.free_bytes.checked_sub(bytes.len() as u64) {
            Some(room) => {
                self.free_bytes = room;
                self.writer.write(bytes)
            }
            None => Err(io::Error::other("it has reached its maximum size")),
        };
        written.inspect_err(|_| self.keep_partial())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

/// Returns true if a path is `-`.
fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

/// Returns standard output as a file, without the line buffer of the standard library's handle.
#[cfg(unix)]
fn standard_output() -> io::Result<File> {
    use std::os::fd::AsFd;
    Ok(File::from(io::stdout().as_fd().try_clone_to_owned()?))
}

/// Returns standard output as a file, without the line buffer of the standard library's handle.
#[cfg(windows)]
fn standard_output() -> io::Result<File> {
    use std::os::windows::io::AsHandle;
    Ok(File::from(io::stdout().as_handle().try_clone_to_owned()?))
}

/// Checks that no output is one of the inputs, also by another name or through links of either
/// kind. Call it before anything is written.
///
/// # Errors
/// [`OutputError`] names the output and the input.
pub fn check_distinct(
    outputs: &[impl AsRef<Path>],
    inputs: &[impl AsRef<Path>],
) -> Result<(), OutputError> {
    let inputs: Vec<&Path> = inputs.iter().map(AsRef::as_ref).collect();
    for output in outputs.iter().map(AsRef::as_ref) {
        // A missing file cannot be an input.
        let same = |input: &&&Path| is_same_file(output, input).unwrap_or(false);
        if let Some(input) = inputs.iter().find(same) {
            let input = input.display();
            return Err(OutputError {
                path: output.to_path_buf(),
                source: io::Error::other(format!("it is the input {input}")),
            });
        }
    }
    Ok(())
}

/// A folder for outputs, which is removed again if it is still empty.
#[derive(Debug)]
pub struct OutputFolder {
    /// The folder, if this program created it.
    created: Option<PathBuf>,
}

impl OutputFolder {
    /// Creates the folder and its parent folders.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let was_there = path.exists();
        std::fs::create_dir_all(path).map_err(|source| OutputError {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            created: (!was_there).then(|| path.to_owned()),
        })
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // The system refuses to remove a folder that is not empty.
        let _ = self.created.as_ref().map(std::fs::remove_dir);
    }
}

/// Returns the folder of a file, which need not exist yet.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Partial file of a killed process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartialFile {
    /// Its path.
    pub path: PathBuf,
    /// Its length, bytes.
    pub bytes: u64,
}

/// Returns the partial files that killed processes left beside `path`, by name. They are only
/// listed.
#[must_use]
pub fn partial_files(path: &Path) -> Vec<PartialFile> {
    let beginning = beginning_of_partial(path);
    let partial = folder_of(path).read_dir().into_iter().flatten().flatten();
    let partial = partial.filter(|entry| is_partial(&beginning, &entry.file_name()));
    let mut found: Vec<_> = partial
        .map(|entry| entry.path())
        .filter(|path| is_abandoned(path))
        .filter_map(|path| {
            let bytes = path.metadata().ok()?.len();
            Some(PartialFile { path, bytes })
        })
        .collect();
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// Letters and digits between a file's name and the suffix.
const RANDOM: usize = 6;
const SUFFIX: &str = ".partial";

/// Max bytes of a file's own name in the name of its partial file: file systems limit names to 255.
const OWN_NAME: usize = 200;

/// Returns the beginning of the name of a partial file of `path`.
fn beginning_of_partial(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let cut = name.floor_char_boundary(OWN_NAME);
    format!("{}.", name.get(..cut).unwrap_or_default())
}

/// Returns true if a name with this beginning is a partial file's.
fn is_partial(beginning: &str, name: &OsStr) -> bool {
    let random = name
        .to_str()
        .and_then(|name| name.strip_prefix(beginning)?.strip_suffix(SUFFIX));
    random.is_some_and(|r| r.len() == RANDOM && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Returns true if no process is writing a partial file.
fn is_abandoned(path: &Path) -> bool {
    let file = regular_file::open(path);
    file.is_ok_and(|file| !matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

fn temporary(path: &Path) -> io::Result<(File, TempPath)> {
    let prefix = beginning_of_partial(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    // The user's mask limits the permissions, as for any other file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let (file, place) = builder.tempfile_in(folder_of(path))?.into_parts();
    // On a file system without locks, all partial files look abandoned; they are only listed.
    let _ = file.try_lock();
    Ok((file, place))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_appears_complete_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.csv");
        let mut output = Output::create(&path).expect("created");
        output.write_all(b"half").expect("written");
        drop(output);
        let entries = || std::fs::read_dir(folder.path()).expect("listed").count();
        assert_eq!(entries(), 0);
        let mut output = Output::create(&path).expect("created");
        output.write_all(b"all").expect("written");
        assert!(!path.exists());
        output.finish().expect("finished");
        assert_eq!(std::fs::read(&path).expect("there"), b"all");
        assert_eq!(entries(), 1);
    }

    /// Safety: 27.
    #[test]
    fn recording_that_cannot_grow_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("felt.csv");
        let begin = || Output::create(&path).expect("created").for_recording(12);
        let mut output = begin();
        output.write_all(b"eight by").expect("written");
        drop(output);
        assert_eq!(partial_files(&path), [], "it was not wanted");
        let mut output = begin();
        output.write_all(b"eight by").expect("written");
        assert!(output.write_all(b"eight by").is_err(), "too many");
        drop(output);
        let [left] = &partial_files(&path)[..] else {
            panic!("none, or several");
        };
        assert_eq!(left.bytes, 8);
    }

    #[test]
    fn abandoned_partial_files_are_found_and_active_ones_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.csv");
        let mut alive = Output::create(&path).expect("created");
        alive.write_all(b"half").expect("written");
        alive.flush().expect("written");
        assert_eq!(partial_files(&path), []);
        let dead = folder.path().join("out.csv.a1B2c3.partial");
        std::fs::write(&dead, "t_s,x_mm").expect("written");
        // Partial files of other files, or files with other names.
        for other in [
            "out.csv.b.csv.a1B2c3.partial",
            "out.csv.partial",
            "other.csv.a1B2c3.partial",
            "out.csv",
        ] {
            std::fs::write(folder.path().join(other), "x").expect("written");
        }
        let found = PartialFile {
            path: dead.clone(),
            bytes: 8,
        };
        assert_eq!(partial_files(&path), [found]);
        alive.finish().expect("finished");
        assert_eq!(std::fs::read(&dead).expect("kept"), b"t_s,x_mm");
    }

    #[test]
    fn output_over_an_input_is_refused_under_every_path() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("terrain.tif"), "heights").expect("written");
        std::fs::write(at("other.tif"), "heights").expect("written");
        std::fs::hard_link(at("terrain.tif"), at("hard.csv")).expect("linked");
        let mut names = vec![at("terrain.tif"), at("./terrain.tif"), at("hard.csv")];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("terrain.tif", at("soft.csv")).expect("linked");
            std::os::unix::fs::symlink(".", at("here")).expect("linked");
            names.extend([at("soft.csv"), at("here/terrain.tif")]);
        }
        let (new, other, terrain) = (at("new.csv"), at("other.tif"), at("terrain.tif"));
        for name in names {
            let wrong = check_distinct(&[&new, &name], &[&terrain]).expect_err("the input");
            let cause = std::error::Error::source(&wrong).map(ToString::to_string);
            assert!(cause.is_some_and(|cause| cause.contains("terrain.tif")));
            assert_eq!(wrong.path, name);
        }
        assert!(check_distinct(&[&new, &other], &[&terrain]).is_ok());
    }

    #[test]
    fn new_output_folder_is_removed_if_it_stays_empty() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out");
        drop(OutputFolder::create(&path).expect("made"));
        assert!(!path.exists());
        let created = OutputFolder::create(&path).expect("made");
        std::fs::write(path.join("kept"), "").expect("written");
        drop(created);
        assert!(path.join("kept").exists());
        std::fs::remove_file(path.join("kept")).expect("removed");
        drop(OutputFolder::create(&path).expect("there"));
        assert!(path.exists(), "it was there before");
    }

    #[test]
    fn unwritable_path_fails_at_creation() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(Output::create(&folder.path().join("no/such/out.csv")).is_err());
        assert!(Output::create(Path::new("-")).is_err());
        let error = Output::create(folder.path()).err().expect("a folder");
        assert!(error.to_string().contains("cannot write"));
    }
}
