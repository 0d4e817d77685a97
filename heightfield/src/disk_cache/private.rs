//! Check that a folder is the user's own: anyone else with write access could put records there that
//! would be rendered, or a link by which other files would be deleted.

use std::fs;
use std::io::{Error, Result};
use std::path::Path;

/// Makes a folder, and those above it, in which other users may not look: a file of a server may have
/// been opened with a key.
pub(super) fn make(folder: &Path) -> Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Checks that a folder is the user's own, is no link, and that other users may not write in it.
///
/// # Errors
/// There is none ([`std::io::ErrorKind::NotFound`]), or what is wrong with it and what to do.
pub(super) fn check(folder: &Path) -> Result<()> {
    let metadata = fs::symlink_metadata(folder)?;
    let wrong = |why: &str| {
        let folder = folder.display();
        Err(Error::other(format!(
            "{folder} {why}, or name another with --cache"
        )))
    };
    if metadata.is_symlink() {
        return wrong("is a link: name the folder itself");
    }
    if !metadata.is_dir() {
        return wrong("is no folder: remove it");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        if metadata.uid() != rustix::process::geteuid().as_raw() {
            return wrong("is another user's: remove it");
        }
        if metadata.mode() & 0o022 != 0 {
            return wrong("may be written by other users: `chmod go-w` it");
        }
    }
    Ok(())
}
