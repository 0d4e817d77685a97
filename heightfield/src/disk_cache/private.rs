//! Check that a folder is the user's own: another user with write access could place records there,
//! which would be rendered, or a link that causes other files to be deleted.

use std::fs;
use std::io::{Error, Result};
use std::path::Path;

/// Creates a folder and its parents, unreadable for other users: a server's file may have needed a
/// key.
pub(super) fn create(folder: &Path) -> Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Checks that a folder is the user's own and not a link, and that other users may not write in it.
///
/// # Errors
/// It does not exist ([`std::io::ErrorKind::NotFound`]), or the fault and its remedy.
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
            return wrong("is writable by other users: `chmod go-w` it");
        }
    }
    Ok(())
}
