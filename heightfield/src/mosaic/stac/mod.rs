//! STAC, the SpatioTemporal Asset Catalog, as an index of files: an item, a collection of items
//! as servers answer with, or a static catalog that links to items.
//!
//! Of each item one asset is taken for its heights (`asset`). What an item says of the place
//! and size of that asset (`item`) is believed, so that its file is opened no sooner than it is touched.
//! A document is read piece by piece (`document`), and of an item little is kept.

mod asset;
mod document;
mod href;
mod item;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use super::super::input::FileBytes;
use super::super::{BadRaster, Decoded, Elsewhere, OpenOptions};
use super::index;
use document::{Document, Feature, Link};

/// Name of the format in messages.
const STAC: &str = "STAC";
/// No document is larger, bytes: one of 26,000 items has some 100 MB.
const LARGEST: u64 = 128 << 20;
/// The document of one item is never larger, bytes.
const LARGEST_ITEM: u64 = 4 << 20;
/// No terrain has more items: the 30 m tiles of all the Earth's land are 26,450.
const MOST_ITEMS: usize = 1 << 17;

/// Whether a file is JSON, which no format of terrain is.
pub(crate) fn is_json(input: &FileBytes) -> Result<bool, BadRaster> {
    let head = input.head(1024)?;
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    Ok(text.trim_ascii_start().starts_with(b"{"))
}

/// The terrain of the items that a document names: where they overlap the newest counts, and
/// among equally new ones the last by its name.
pub(crate) fn decode(
    input: &FileBytes,
    path: &Path,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    let asked = options.asset.as_deref();
    let mut items = Vec::new();
    let remarks = walk(input, path, &mut |feature, base| {
        if items.len() == MOST_ITEMS {
            return Err(BadRaster::NoTiles(format!(
                "more than {MOST_ITEMS} items are not read as one terrain"
            )));
        }
        items.push(item::listed(feature, base, asked)?);
        Ok(())
    })?;
    if items.is_empty() {
        return Err(BadRaster::NoTiles("the STAC document has no items".into()));
    }
    items.sort_by(|one, other| (one.when, &one.id).cmp(&(other.when, &other.id)));
    let files = items.into_iter().map(item::Item::into_file).collect();
    let tiles = OpenOptions {
        asset: None,
        ..options.clone()
    };
    let mut decoded = index::decoded(files, &tiles)?;
    decoded.format = format!("{STAC}, {}", decoded.format);
    decoded.remarks.extend(remarks);
    Ok(decoded)
}

/// The files that a document names, whichever of their assets are taken.
pub(crate) fn sources(input: &FileBytes, path: &Path) -> Result<Vec<PathBuf>, BadRaster> {
    let mut files = Vec::new();
    walk(input, path, &mut |feature, base| {
        files.push(base.to_owned());
        let assets = feature.assets.0.iter();
        files.extend(assets.filter_map(|(_, asset)| href::resolved(asset.href(), base).ok()));
        Ok(())
    })?;
    files.sort();
    files.dedup();
    Ok(files)
}

/// Hands each item over, with the place of the document that it is in. Returns what the
/// user should know.
fn walk(
    input: &FileBytes,
    path: &Path,
    take: &mut dyn FnMut(Feature, &Path) -> Result<(), BadRaster>,
) -> Result<Vec<String>, BadRaster> {
    check_size(input, LARGEST)?;
    let document = document::read(input, &mut |feature| take(feature, path))?;
    let mut remarks = Vec::new();
    let links = |relation: &'static str| {
        let all = document.links.iter();
        all.filter(move |link| link.relation() == relation)
    };
    match document.kind.as_str() {
        _ if document.has_features => {
            if links("next").next().is_some() {
                remarks.push(
                    "it is one page of a list of items: those of the next pages are not in it"
                        .into(),
                );
            }
        }
        "Feature" => take(document.item, path)?,
        "Catalog" | "Collection" => {
            let mut count = 0;
            for link in links("item") {
                linked_item(link, path, input.elsewhere(), take)?;
                count += 1;
            }
            if count == 0 {
                return Err(no_items(&document));
            }
            if links("child").next().is_some() {
                remarks.push("items of the catalogs in it are not in it".into());
            }
        }
        _ => {
            return Err(BadRaster::NoTiles(
                "it is JSON, but no STAC item, collection of items or catalog".into(),
            ));
        }
    }
    Ok(remarks)
}

/// A catalog without items of its own.
fn no_items(document: &Document) -> BadRaster {
    const MOST_NAMES: usize = 8;
    let children = document.links.iter();
    let children = children.filter(|link| link.relation() == "child");
    let names: Vec<_> = children.map(Link::href).take(MOST_NAMES).collect();
    BadRaster::NoTiles(match names.is_empty() {
        true => "the STAC catalog links to no items".into(),
        false => format!(
            "the STAC catalog links to no items, but to catalogs: name one of them ({})",
            names.join(", ")
        ),
    })
}

/// The item that a link of a catalog leads to.
fn linked_item(
    link: &Link,
    path: &Path,
    elsewhere: &Elsewhere,
    take: &mut dyn FnMut(Feature, &Path) -> Result<(), BadRaster>,
) -> Result<(), BadRaster> {
    let there = href::resolved(link.href(), path)?;
    let mut read = || {
        let input = FileBytes::open(&there, elsewhere)?;
        check_size(&input, LARGEST_ITEM)?;
        let document = document::read(&input, &mut |_| Ok(()))?;
        match document.kind.as_str() {
            "Feature" => take(document.item, &there),
            _ => Err(BadRaster::damaged(
                "STAC: a catalog links to it as to an item",
            )),
        }
    };
    read().map_err(|fault| BadRaster::in_tile(&there, fault))
}

fn check_size(input: &FileBytes, most: u64) -> Result<(), BadRaster> {
    match input.len() <= most {
        true => Ok(()),
        false => Err(BadRaster::AbsurdSize(format!(
            "a STAC document of {} bytes, of which at most {most} are read",
            input.len()
        ))),
    }
}
