//! The output formats.

use std::path::Path;

/// Format of a written terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WrittenFormat {
    GeoTiff,
    EsriAscii,
    Png,
}

impl WrittenFormat {
    /// Returns the format of the path's extension.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        match extension.as_str() {
            "tif" | "tiff" => Some(Self::GeoTiff),
            "asc" => Some(Self::EsriAscii),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}
