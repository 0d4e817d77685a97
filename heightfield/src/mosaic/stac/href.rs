//! Where the files are that a document names.

use std::path::{Path, PathBuf};

use super::super::super::BadRaster;
use super::super::vrt::gdal_url;
use crate::remote::{beside, is_url};

/// The place of an href of a document: a URL, or beside the document where it is relative.
///
/// # Errors
/// An href that leads nowhere; one of a document at a URL that leads to this machine's files.
pub(super) fn resolved(href: &str, document: &Path) -> Result<PathBuf, BadRaster> {
    let href = href.trim();
    if href.is_empty() {
        return Err(BadRaster::damaged("STAC: an asset or a link has no href"));
    }
    let base = document.to_str().filter(|path| is_url(path));
    if let Some(local) = href.strip_prefix("file://") {
        return match base {
            None => Ok(local.strip_prefix("localhost").unwrap_or(local).into()),
            Some(_) => Err(BadRaster::damaged(format!(
                "STAC: it names a file of this machine ({href})"
            ))),
        };
    }
    if let Some(url) = gdal_url(href) {
        return Ok(url.into());
    }
    if href.starts_with("/vsi") {
        return Err(BadRaster::Unsupported {
            format: super::STAC,
            feature: format!("an href that only GDAL finds ({href})"),
        });
    }
    Ok(match base {
        Some(base) => match (href.strip_prefix('/'), base.split_once("://")) {
            (Some(path), Some((scheme, rest))) => {
                let host = rest.split(['/', '?', '#']).next().unwrap_or_default();
                beside(&format!("{scheme}://{host}/"), path).into()
            }
            _ => beside(base, href).into(),
        },
        None => match document.parent() {
            Some(folder) => folder.join(href),
            None => href.into(),
        },
    })
}
