//! File names in a VRT.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::file_system::PREFIX;
use crate::libgdal::Libgdal;
use crate::settings;
use crate::xml::{self, Text};

/// Max nesting depth of VRTs.
pub(crate) const MAX_NESTING: u32 = 16;
/// Max size of a VRT, bytes; one of 40,000 files has half as many.
pub(crate) const MAX_BYTES: u64 = 32 << 20;
/// Max number of files that a VRT references, directly or through others.
pub(crate) const MAX_FILES: usize = 1 << 17;
/// GDAL recognises a VRT by this number of first bytes.
pub(crate) const HEAD_BYTES: u64 = 1024;
/// Max length of a file name, bytes.
const MAX_NAME: usize = 4096;
const SIGN: &str = "<VRTDataset";
/// Separators in names for drivers and virtual file systems, as in `NETCDF:"ocean.nc":depth`.
const DIVIDERS: [char; 7] = [':', '"', ',', '?', '&', '{', '}'];
/// GDAL's file systems on servers.
const SERVERS: [&str; 9] = [
    "/vsicurl",
    "/vsis3",
    "/vsigs",
    "/vsiaz",
    "/vsiadls",
    "/vsioss",
    "/vsiswift",
    "/vsihdfs",
    "/vsiwebhdfs",
];
/// File systems that no file may reference: standard input, and this crate's own.
const REFUSED: [&str; 2] = ["/vsistdin", PREFIX];

/// Returns true if a file's first bytes are a VRT's.
pub(crate) fn begins(head: &[u8]) -> bool {
    head.windows(SIGN.len()).any(|part| part == SIGN.as_bytes())
}

pub(crate) fn too_large() -> String {
    format!("a VRT of more than {MAX_BYTES} bytes")
}

pub(crate) fn too_deep(depth: u32) -> String {
    format!("VRTs are nested {depth} deep")
}

/// Returns all texts in a VRT that may be file names, also in embedded VRTs. Most others are
/// numbers.
///
/// # Errors
/// [`Error::Refused`], [`Error::ZeroByte`].
pub(crate) fn names(library: &Libgdal, text: &str) -> Result<Vec<Text>, Error> {
    // GDAL also stops at a zero byte.
    let mut texts = vec![text.replace('\0', " ")];
    let mut names = Vec::new();
    while let Some(text) = texts.pop() {
        for named in xml::texts(library, &text)? {
            if named.value.trim_start().starts_with(SIGN) {
                texts.push(named.value);
            } else if named.may_be_name() {
                names.push(named);
            }
        }
    }
    Ok(names)
}

impl Text {
    fn is_file_name(&self) -> bool {
        let node = self.node.to_ascii_lowercase();
        ["filename", "dataset", "dem"]
            .iter()
            .any(|end| node.ends_with(end))
    }

    fn may_be_name(&self) -> bool {
        self.value.len() <= MAX_NAME && (self.is_file_name() || self.value.parse::<f64>().is_err())
    }

    /// Returns the parts that may be file names.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &str> {
        let value = self.value.as_str();
        let parts = value.split(DIVIDERS).chain([value]);
        parts.filter(|part| !part.is_empty())
    }

    /// Checks, for a VRT on disk, that the text references no server.
    ///
    /// # Errors
    /// The referenced file, and a remedy.
    pub(crate) fn check_here(&self) -> Result<(), String> {
        let shown = self.shown();
        let is_refused = |part: &str| REFUSED.iter().any(|refused| part.starts_with(refused));
        if self.parts().any(is_refused) {
            return Err(format!("it names {shown}, which is no file"));
        }
        match self.is_address() && !settings::is_fetching_allowed() {
            true => Err(format!(
                "it names {shown}, and nothing is fetched: copy that file beside it, or open its URL"
            )),
            false => Ok(()),
        }
    }

    /// Returns the name of a file on the same server, relative to the VRT or with the root as
    /// prefix; `None` if the text is not a file name.
    ///
    /// # Errors
    /// The file on another server or computer, and a remedy.
    pub(crate) fn at_server(&self, root: &str) -> Result<Option<&str>, String> {
        let value = self.value.as_str();
        if value.starts_with(root) {
            return Ok(Some(value));
        }
        self.check_here()?;
        let is_neighbour = self.is_relative && !value.starts_with(['/', '\\']);
        let is_here = |part: &str| {
            let is_absolute = part.starts_with(['/', '\\']) || Path::new(part).is_absolute();
            (is_absolute || !is_neighbour) && fs::metadata(part).is_ok()
        };
        if self.is_file_name() && !is_neighbour || self.parts().any(is_here) {
            return Err(format!(
                "it names {} on this computer: name files relative to it (relativeToVRT=\"1\")",
                self.shown()
            ));
        }
        Ok(Some(value).filter(|_| self.is_file_name()))
    }

    /// Returns true if a driver would contact a server for it.
    fn is_address(&self) -> bool {
        let is_of_gdal = ["/vsi", "vrt://"]
            .iter()
            .any(|gdals| self.value.starts_with(gdals));
        let is_url = self.value.contains("://") && !is_of_gdal;
        let is_at_server = SERVERS.iter().any(|server| self.value.contains(server));
        self.is_file_name() && (is_url || is_at_server)
    }

    /// Returns the value without a URL's query, which may be a key.
    fn shown(&self) -> &str {
        self.value.split('?').next().unwrap_or_default()
    }
}
