//! File names for GDAL, and the resources that must exist while it reads.

use std::path::{Path, PathBuf};

use heightfield_gdal::{Dataset, Error, Library, Mount};
use tempfile::TempDir;

use super::at_url::{self, ServedFiles, download, needs_download};
use super::fault;
use crate::RasterError;
use crate::remote::{RemoteFetcher, is_url, without_key};

/// A file on disk or at a URL.
pub(super) struct Place {
    library: Library,
    /// The user's name for it.
    pub(super) source: PathBuf,
    /// GDAL's name for it.
    pub(super) path: PathBuf,
    served: Option<(ServedFiles, Mount)>,
    /// A copy of a remote file, or a link to an archive.
    _folder: Option<TempDir>,
}

impl Place {
    /// Returns the place of a file with some first bytes.
    pub(super) fn of(
        library: &Library,
        source: &Path,
        head: &[u8],
        fetcher: &RemoteFetcher,
    ) -> Result<Self, RasterError> {
        let here = Self {
            library: library.clone(),
            source: source.to_owned(),
            path: source.to_owned(),
            served: None,
            _folder: None,
        };
        let Some(url) = source.to_str().filter(|source| is_url(source)) else {
            return Ok(here);
        };
        if needs_download(head) {
            let (folder, name) = download(url, fetcher)?;
            return Ok(Self {
                path: folder.path().join(name),
                _folder: Some(folder),
                ..here
            });
        }
        let (served, name) = ServedFiles::of(url, fetcher);
        let mount = library.mount(Box::new(served.clone())).map_err(fault)?;
        Ok(Self {
            path: mount.path(&name).into(),
            served: Some((served, mount)),
            ..here
        })
    }

    /// Links the archive under a new name. GDAL caches the files of an archive by name, and reads
    /// beyond their end if another archive has replaced it (3.6 crashes).
    #[cfg(unix)]
    pub(super) fn with_new_name(self) -> Result<Self, RasterError> {
        if self.served.is_some() || self._folder.is_some() {
            return Ok(self);
        }
        let unreadable = RasterError::Unreadable;
        let folder = tempfile::tempdir().map_err(unreadable)?;
        let target = std::path::absolute(&self.path).map_err(unreadable)?;
        let path = folder
            .path()
            .join(self.path.file_name().unwrap_or_default());
        std::os::unix::fs::symlink(target, &path).map_err(unreadable)?;
        Ok(Self {
            path,
            _folder: Some(folder),
            ..self
        })
    }

    /// Returns the archive under its own name, because links need a privilege on this system.
    #[cfg(not(unix))]
    pub(super) fn with_new_name(self) -> Result<Self, RasterError> {
        Ok(self)
    }

    /// Returns true if GDAL reads the file through this program.
    pub(super) const fn is_served(&self) -> bool {
        self.served.is_some()
    }

    /// Removes the file's folder from GDAL's message: the user named it, or it is a temporary one.
    pub(super) fn in_words(&self, refusal: RasterError) -> RasterError {
        let folder = self
            .path
            .parent()
            .map(|folder| folder.display().to_string());
        match (refusal, folder.filter(|folder| !folder.is_empty())) {
            (RasterError::ByGdal(Error::Refused(words)), Some(folder)) => {
                let words = words.replace(&format!("{folder}/"), "");
                RasterError::ByGdal(Error::Refused(words))
            }
            (RasterError::ByGdal(Error::Slow { seconds, .. }), _) => {
                let path = without_key(&self.source).into();
                RasterError::ByGdal(Error::Slow { path, seconds })
            }
            (refusal, _) => refusal,
        }
    }

    /// Checks that a file at a URL, with some first bytes, references no file of this computer.
    ///
    /// # Errors
    /// The referenced file, and a remedy.
    pub(super) fn check_files(&self, dataset: &Dataset, head: &[u8]) -> Result<(), RasterError> {
        let root = match (&self.served, &self._folder) {
            (Some((_, mount)), _) => mount.path(""),
            (None, Some(folder)) if self.source.to_str().is_some_and(is_url) => {
                folder.path().display().to_string()
            }
            _ => return Ok(()),
        };
        let driver = dataset.driver();
        let signs = [("VRT", "<VRTDataset"), ("MRF", "<MRF_META")];
        let has = |sign: &str| head.windows(sign.len()).any(|part| part == sign.as_bytes());
        let is_listed = |(name, sign)| name == driver && has(sign);
        if self.served.is_some() && signs.into_iter().any(is_listed) {
            // Its mount checks every name.
            return Ok(());
        }
        let mut names = dataset
            .files()
            .into_iter()
            .map(|it| it.display().to_string());
        let what = match names.find(|name| !name.contains(&root)) {
            Some(name) => format!("it names {name}"),
            // GDAL does not list an MRF's sample files.
            None if driver == "MRF" => "an MRF in an archive may name files".into(),
            None => return Ok(()),
        };
        let why = format!("{what} on this computer: get the file, and open it here");
        let path = without_key(&self.source).into();
        Err(fault(Error::NotOpened { path, why }))
    }

    /// Returns the reason why something on the server could not be read.
    pub(super) fn take_fault(&self) -> Option<std::io::Error> {
        let (_, mount) = self.served.as_ref()?;
        mount.take_fault()
    }

    /// Reopens a part of the file after a failed read, which GDAL caches.
    pub(super) fn reopen(&self, name: &str, options: &[&str]) -> Result<Dataset, RasterError> {
        let Some((served, mount)) = &self.served else {
            return self.library.open_part(name, options).map_err(fault);
        };
        let new = self
            .library
            .mount(Box::new(served.clone()))
            .map_err(fault)?;
        let name = name.replace(&mount.path(""), &new.path(""));
        let opened = self.library.open_part(&name, options).map_err(fault);
        match new.take_fault() {
            Some(error) => Err(at_url::fault(error)),
            None => opened,
        }
    }
}
