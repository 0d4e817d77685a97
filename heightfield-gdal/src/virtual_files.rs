//! Contents of archives, through GDAL's own file systems.

use std::path::Path;

use crate::error::Error;
use crate::library::Library;
use crate::text::{list_from_c, path_to_c};

/// `SEEK_END`.
const END: i32 = 2;

impl Library {
    /// Returns the names of the files in a GDAL folder, as `/vsizip/{tiles.zip}`, and its
    /// subfolders.
    ///
    /// # Errors
    /// [`Error::Refused`], [`Error::ZeroByte`].
    pub fn entries(&self, folder: &Path) -> Result<Vec<String>, Error> {
        let path = path_to_c(folder)?;
        let functions = &self.libgdal.functions;
        // SAFETY: the path is valid during the call; the list is copied, and freed once.
        let names = unsafe {
            (functions.CPLErrorReset)();
            let list = (functions.VSIReadDirRecursive)(path.as_ptr());
            if list.is_null() {
                return Err(self.libgdal.refused("it is no archive that can be read"));
            }
            let names = list_from_c(list.cast());
            (functions.CSLDestroy)(list);
            names
        };
        let files = names.into_iter().filter(|name| !name.ends_with('/'));
        Ok(files.collect())
    }

    /// Returns the size of a file in bytes, also in an archive; `None` if it cannot be read.
    #[must_use]
    pub fn length(&self, path: &Path) -> Option<u64> {
        let path = path_to_c(path).ok()?;
        let functions = &self.libgdal.functions;
        // SAFETY: the texts are valid during the call; the file is closed once, and not used
        // afterwards.
        unsafe {
            let file = (functions.VSIFOpenL)(path.as_ptr(), c"rb".as_ptr());
            if file.is_null() {
                return None;
            }
            let found = (functions.VSIFSeekL)(file, 0, END);
            let length = (functions.VSIFTellL)(file);
            (functions.VSIFCloseL)(file);
            (found == 0).then_some(length)
        }
    }
}
