//! Which asset of an item holds the heights.

use std::path::Path;

use super::super::super::BadRaster;
use super::super::names::is_tile;
use super::document::{Asset, Feature};
use crate::remote::file_name;

/// Roles of heights.
const HEIGHTS: [&str; 5] = ["dem", "elevation", "height", "dsm", "dtm"];
/// What people call an asset with heights.
const NAMES: [&str; 9] = [
    "dem",
    "dsm",
    "dtm",
    "elevation",
    "elev",
    "height",
    "heights",
    "data",
    "map",
];
/// Roles of what is beside the data.
const BESIDE: [&str; 8] = [
    "thumbnail",
    "overview",
    "visual",
    "metadata",
    "mask",
    "data-mask",
    "hillshade",
    "browse",
];

/// The asset with the heights, and its name: the one that was asked for; else of those that are
/// rasters and no pictures the one with a role of heights, the one with the role `data`, or the
/// only one; of several the one that is named as heights are.
///
/// # Errors
/// [`BadRaster::NoSuchPart`] where the one that was asked for is not there;
/// [`BadRaster::WhichAsset`] where none or several could be it.
pub(super) fn chosen<'f>(
    item: &'f Feature,
    id: &str,
    asked: Option<&str>,
) -> Result<&'f Asset, BadRaster> {
    let all = &item.assets.0;
    let names = |assets: &[&(String, Asset)]| -> Vec<String> {
        assets.iter().map(|(name, _)| name.clone()).collect()
    };
    if let Some(asked) = asked {
        let found = all.iter().find(|(name, _)| name == asked);
        return found.map(|(_, asset)| asset).ok_or_else(|| {
            let all: Vec<_> = all.iter().collect();
            BadRaster::NoSuchPart {
                asked: format!("asset {asked}"),
                there: format!("the item {id} has {}", listed(&names(&all))),
            }
        });
    }
    let rasters: Vec<_> = all.iter().filter(|(_, asset)| is_raster(asset)).collect();
    let with_role = |roles: &[&str]| -> Vec<&'f (String, Asset)> {
        let rasters = rasters.iter().copied();
        rasters
            .filter(|(_, asset)| has_role(asset, roles))
            .collect()
    };
    let ranks = [with_role(&HEIGHTS), with_role(&["data"]), rasters.clone()];
    let Some(best) = ranks.into_iter().find(|rank| !rank.is_empty()) else {
        let all: Vec<_> = all.iter().collect();
        return Err(BadRaster::WhichAsset {
            why: format!("of the item {id} no asset is a raster of heights"),
            names: names(&all),
        });
    };
    let named: Vec<_> = NAMES
        .iter()
        .filter_map(|name| best.iter().find(|(own, _)| own.eq_ignore_ascii_case(name)))
        .collect();
    match (best.as_slice(), named.as_slice()) {
        ([only], _) => Ok(&only.1),
        (_, [first, ..]) => Ok(&first.1),
        _ => Err(BadRaster::WhichAsset {
            why: format!("of the item {id} several assets could be heights"),
            names: names(&best),
        }),
    }
}

fn listed(names: &[String]) -> String {
    match names.is_empty() {
        true => "no assets".into(),
        false => format!("the assets {}", names.join(", ")),
    }
}

fn has_role(asset: &Asset, roles: &[&str]) -> bool {
    let own = asset.roles.iter().flat_map(|own| &own.0);
    own.into_iter()
        .any(|own| roles.iter().any(|role| own.0.eq_ignore_ascii_case(role)))
}

/// Whether an asset is a TIFF by its media type, or no picture, and by its name a file that
/// holds a terrain and its place.
fn is_raster(asset: &Asset) -> bool {
    if has_role(asset, &BESIDE) {
        return false;
    }
    let media = asset.media.as_ref();
    let media = media.map_or(String::new(), |media| media.0.to_ascii_lowercase());
    match media.starts_with("image/") {
        true => media.starts_with("image/tiff"),
        false => is_tile(Path::new(file_name(asset.href()))),
    }
}
