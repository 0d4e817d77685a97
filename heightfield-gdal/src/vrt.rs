//! Names in a VRT.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::file_system::PREFIX;
use crate::loaded::Loaded;
use crate::settings;
use crate::xml::{self, Text};

/// VRTs inside VRTs.
pub(crate) const MAX_NESTING: u32 = 16;
/// A VRT of 40,000 files has half as many bytes.
pub(crate) const MAX_BYTES: u64 = 32 << 20;
/// Files that a VRT names, directly or by another VRT.
pub(crate) const MAX_FILES: usize = 1 << 17;
/// GDAL tells a VRT by its first bytes.
pub(crate) const HEAD_BYTES: u64 = 1024;
/// A longer text is no name of a file.
const MAX_NAME: usize = 4096;
const SIGN: &str = "<VRTDataset";
/// Signs that divide a name of a driver's or of a virtual file system's, as in
/// `NETCDF:"ocean.nc":depth`.
const DIVIDERS: [char; 7] = [':', '"', ',', '?', '&', '{', '}'];
/// File systems of GDAL's that ask a server.
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
/// File systems that no file may name: standard input, and those of another file.
const REFUSED: [&str; 2] = ["/vsistdin", PREFIX];

/// Returns true if a file is a VRT, by its beginning.
pub(crate) fn begins(head: &[u8]) -> bool {
    head.windows(SIGN.len()).any(|part| part == SIGN.as_bytes())
}

pub(crate) fn too_large() -> String {
    format!("a VRT of more than {MAX_BYTES} bytes")
}

pub(crate) fn too_deep(depth: u32) -> String {
    format!("VRTs lie in each other {depth} deep")
}

/// All texts of a VRT that may name files, also of VRTs in their place. Most others are numbers.
///
/// # Errors
/// [`Error::Refused`], [`Error::ZeroByte`].
pub(crate) fn names(library: &Loaded, text: &str) -> Result<Vec<Text>, Error> {
    // GDAL stops at a zero byte, too.
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

    /// The parts that may be names of files.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &str> {
        let whole = self.value.as_str();
        let parts = whole.split(DIVIDERS).chain([whole]);
        parts.filter(|part| !part.is_empty())
    }

    /// Checks that it names nothing that is elsewhere, for a VRT on disk.
    ///
    /// # Errors
    /// The named file, and what to do.
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

    /// The name of a file at the same server, relative to the VRT or with the root before it; none
    /// of a text that is no name.
    ///
    /// # Errors
    /// The other named file, and what to do.
    pub(crate) fn at_server(&self, root: &str) -> Result<Option<&str>, String> {
        let value = self.value.as_str();
        if value.starts_with(root) {
            return Ok(Some(value));
        }
        self.check_here()?;
        let is_beside = self.is_relative && !value.starts_with(['/', '\\']);
        let is_here = |part: &str| {
            let is_absolute = part.starts_with(['/', '\\']) || Path::new(part).is_absolute();
            (is_absolute || !is_beside) && fs::metadata(part).is_ok()
        };
        if self.is_file_name() && !is_beside || self.parts().any(is_here) {
            return Err(format!(
                "it names {} on this computer: name what lies beside it (relativeToVRT=\"1\")",
                self.shown()
            ));
        }
        Ok(Some(value).filter(|_| self.is_file_name()))
    }

    /// Returns true if it names what a driver would ask a server for.
    fn is_address(&self) -> bool {
        let is_of_gdal = ["/vsi", "vrt://"]
            .iter()
            .any(|gdals| self.value.starts_with(gdals));
        let is_url = self.value.contains("://") && !is_of_gdal;
        let is_at_server = SERVERS.iter().any(|server| self.value.contains(server));
        self.is_file_name() && (is_url || is_at_server)
    }

    /// The value without what follows a URL, which may be a key.
    fn shown(&self) -> &str {
        self.value.split('?').next().unwrap_or_default()
    }
}
