//! Opens and reads regular files only. Opening a pipe waits for a writer, and opening a device may
//! start it, so the kind is checked before the file is opened.

use std::fs::{File, FileType, Metadata};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// The file is missing, reading is denied, or it is of another kind, which the error names.
pub fn open(path: &Path) -> Result<File> {
    check(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    // The file may have been replaced in between.
    check(&file.metadata()?)?;
    Ok(file)
}

/// Reads a regular file of `max_bytes` at most.
///
/// # Errors
/// As [`open`], or that it is larger.
pub fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(max_bytes + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > max_bytes {
        true => Err(Error::new(
            ErrorKind::InvalidData,
            format!("it is larger than {max_bytes} bytes, so it is a file of another kind"),
        )),
        false => Ok(bytes),
    }
}

/// As [`read`], for UTF-8 text.
///
/// # Errors
/// As [`read`], or that it is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64) -> Result<String> {
    let bytes = read(path, max_bytes)?;
    String::from_utf8(bytes).map_err(|_| Error::new(ErrorKind::InvalidData, "it is not UTF-8 text"))
}

/// Checks that the metadata describes a regular file.
fn check(metadata: &Metadata) -> Result<()> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(match metadata.is_dir() {
        true => Error::new(ErrorKind::IsADirectory, "it is a folder"),
        false => Error::other(format!(
            "it is {}, not a regular file",
            kind(metadata.file_type())
        )),
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_file_is_refused_before_it_is_read_whole() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        file.as_file().set_len(1 << 40).expect("a length");
        let why = read(file.path(), 1 << 10).expect_err("a terabyte");
        assert!(why.to_string().contains("larger than 1024"), "{why}");
        file.as_file().set_len(1 << 10).expect("a length");
        assert_eq!(read(file.path(), 1 << 10).expect("read").len(), 1 << 10);
        std::fs::write(file.path(), b"\xff").expect("written");
        let why = read_text(file.path(), 1 << 10).expect_err("no text");
        assert!(why.to_string().contains("UTF-8"), "{why}");
    }

    #[cfg(unix)]
    #[test]
    fn pipe_device_and_folder_are_named_and_not_opened() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR, 0).expect("a pipe");
        // If it were opened, this test would wait indefinitely.
        for (path, what) in [
            (&*pipe, "a pipe (FIFO)"),
            (Path::new("/dev/zero"), "a character device"),
            (folder.path(), "a folder"),
        ] {
            let why = open(path).expect_err("refused").to_string();
            assert!(why.contains(what), "{why}");
        }
    }
}
