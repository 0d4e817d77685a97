//! Files that appear only when they are complete.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

/// An output file cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}", path.display())]
pub struct OutputError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    #[source]
    pub source: io::Error,
}

/// A file being written. Dropped before [`Output::finish`], it leaves nothing
/// behind.
pub struct Output {
    path: PathBuf,
    writer: BufWriter<File>,
    /// Where it is written, beside the file that it will replace; none for a
    /// pipe or device, where there is nothing to replace.
    beside: Option<TempPath>,
}

impl Output {
    /// Begins a file.
    ///
    /// # Errors
    /// When its folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |source| OutputError {
            path: path.to_owned(),
            source,
        };
        let opened = match std::fs::metadata(path) {
            Ok(there) if there.is_dir() => Err(io::Error::other("it is a folder")),
            Ok(there) if !there.is_file() => {
                let file = File::options().write(true).open(path);
                file.map(|file| (file, None))
            }
            _ => temporary(path).map(|(file, place)| (file, Some(place))),
        };
        let (file, beside) = opened.map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            writer: BufWriter::with_capacity(1 << 16, file),
            beside,
        })
    }

    /// The file's path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Puts the complete file in its place.
    ///
    /// # Errors
    /// When it cannot be written to the end.
    pub fn finish(self) -> Result<(), OutputError> {
        let path = self.path;
        let finished = self.writer.into_inner().map_err(|error| error.into_error());
        let placed = finished.and_then(|mut file| match self.beside {
            Some(beside) => beside.persist(&path).map_err(|error| error.error),
            None => file.flush(),
        });
        placed.map_err(|source| OutputError { path, source })
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
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

/// The folder that a file lies in, or will.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn temporary(path: &Path) -> io::Result<(File, TempPath)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".hapterra-").suffix(".partial");
    // Readable by whom the user's mask says, as any other file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
        .tempfile_in(folder_of(path))
        .map(tempfile::NamedTempFile::into_parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn appears_whole_or_not_at_all() {
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

    #[test]
    fn an_impossible_place_is_an_error_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(Output::create(&folder.path().join("no/such/out.csv")).is_err());
        let error = Output::create(folder.path()).err().expect("a folder");
        assert!(error.to_string().contains("cannot write"));
    }
}
