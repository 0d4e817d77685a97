//! STAC items. GDAL's driver STACIT reads a collection of items that state the places of all their
//! files. Items that it cannot read are rejected with the command that makes a VRT of the files
//! themselves. So is a collection whose item contradicts the place of its file.

use std::collections::HashSet;
use std::path::Path;

use glob::Pattern;
use heightfield_gdal::{Dataset, Library};
use serde_json::Value;

use super::place::Place;
use crate::input::FileBytes;
use crate::remote::{is_url, without_query};
use crate::{OpenOptions, RasterError, file_name};

/// Max size of a document, bytes. In memory it takes fifty times as much.
const MAX_BYTES: u64 = 4 << 20;
/// Max difference of the places of a file and its item, in cells.
const TOLERANCE: f64 = 0.05;
/// Media types of files that may contain heights.
const MEDIA: [&str; 3] = ["tif", "jp2", "netcdf"];

/// An item, with those of its assets that may be heights.
struct Item {
    id: String,
    /// Names and files.
    assets: Vec<(String, String)>,
    /// Columns and rows, and x and y of a sample's corner, as stated.
    georeference: Option<([u32; 2], [f64; 6])>,
}

/// Returns the reason why a document of items cannot be read; `None` if the file is something else.
pub(super) fn refused(
    place: &Place,
    options: &OpenOptions,
) -> Result<Option<RasterError>, RasterError> {
    let items = items(&place.source, options)?;
    items
        .map(|items| to_build("GDAL does not open it as items of a STAC", &items))
        .transpose()
}

/// Checks that files lie at the places in their items, and that GDAL has found the same files.
///
/// # Errors
/// [`RasterError::NeedsVrt`] if one does not.
pub(super) fn check_places(
    library: &Library,
    opened: &Dataset,
    place: &Place,
    options: &OpenOptions,
) -> Result<(), RasterError> {
    let Some(items) = items(&place.source, options)? else {
        return Ok(());
    };
    let full = |path: &Path| std::fs::canonicalize(path).ok();
    let files: HashSet<_> = opened
        .files()
        .iter()
        .filter_map(|file| full(file))
        .collect();
    for item in &items {
        let [(_, file)] = &item.assets[..] else {
            continue;
        };
        if file.starts_with("/vsi") {
            continue;
        }
        let is_found = full(Path::new(file)).is_some_and(|file| files.contains(&file));
        let dataset = library.open(Path::new(file), &[]);
        let is_at_its_place = dataset.is_ok_and(|dataset| item.is_place_of(&dataset));
        if !(is_found && is_at_its_place) {
            let why = format!(
                "the place of the item {} differs from that of its file {file}",
                item.id
            );
            return Err(to_build(&why, &items)?);
        }
    }
    Ok(())
}

/// Returns the error that names the files for a VRT.
fn to_build(why: &str, items: &[Item]) -> Result<RasterError, RasterError> {
    let mut files = Vec::new();
    for item in items {
        match &item.assets[..] {
            [(_, file)] => files.push(file.clone()),
            assets => {
                return Err(RasterError::AmbiguousAssets {
                    why: match assets {
                        [] => format!(
                            "the item {} has no asset of that name, or no raster",
                            item.id
                        ),
                        _ => format!("several assets of the item {} may be the heights", item.id),
                    },
                    names: assets.iter().map(|(name, _)| name.clone()).collect(),
                });
            }
        }
    }
    Ok(RasterError::NeedsVrt {
        why: why.to_owned(),
        files,
    })
}

/// Returns the items of a document; `None` if it is something else.
fn items(path: &Path, options: &OpenOptions) -> Result<Option<Vec<Item>>, RasterError> {
    let url = path.to_str().filter(|path| is_url(path));
    let named = url.map_or(path, |url| Path::new(file_name(url)));
    let is_named = named
        .extension()
        .is_some_and(|end| end == "json" || end == "geojson");
    if !is_named || path.is_dir() {
        return Ok(None);
    }
    let input = FileBytes::open(path, &options.fetcher)?;
    if input.len() > MAX_BYTES {
        return Err(RasterError::AbsurdSize(format!(
            "a JSON document of {} bytes",
            input.len()
        )));
    }
    let text = input.head(MAX_BYTES)?;
    let document: Value = serde_json::from_slice(&text)
        .map_err(|error| RasterError::Damaged(format!("it is no JSON: {error}")))?;
    let requested = match &options.variable {
        Some(name) => Some(Pattern::new(name).map_err(|error| RasterError::NoSuchPart {
            requested: format!("variable {name}"),
            available: format!("it is no pattern: {error}"),
        })?),
        None => None,
    };
    let features = match &document["features"] {
        Value::Array(features) => features.iter().collect(),
        _ if document["assets"].is_object() => vec![&document],
        _ => return Ok(None),
    };
    // Also for a URL, without its query.
    let named = url.map_or(path, |url| Path::new(without_query(url)));
    let folder = named.parent().unwrap_or(Path::new(""));
    let items = features
        .into_iter()
        .map(|item| Item::of(item, requested.as_ref(), folder));
    Ok(Some(items.collect()))
}

impl Item {
    fn of(item: &Value, requested: Option<&Pattern>, folder: &Path) -> Self {
        let empty = serde_json::Map::new();
        let assets = item["assets"].as_object().unwrap_or(&empty);
        let is_requested = |(name, asset): &(&String, &Value)| match requested {
            Some(requested) => requested.matches(name),
            None => is_raster(asset),
        };
        let of_item = |key: &str| {
            let own = assets.iter().filter(|asset| is_requested(asset));
            let mut values = own
                .map(|(_, asset)| &asset[key])
                .chain([&item["properties"][key]]);
            values.find(|value| value.is_array())
        };
        let numbers = |key: &str| -> Option<Vec<f64>> {
            of_item(key)?
                .as_array()?
                .iter()
                .map(Value::as_f64)
                .collect()
        };
        let place = || {
            let (shape, map) = (numbers("proj:shape")?, numbers("proj:transform")?);
            let &[rows, columns] = &shape[..] else {
                return None;
            };
            let [x_column, x_row, x, y_column, y_row, y] = *map.first_chunk::<6>()?;
            Some((
                [columns as u32, rows as u32],
                [x, x_column, x_row, y, y_column, y_row],
            ))
        };
        let named = assets.iter().filter(is_requested);
        let files = named.filter_map(|(name, asset)| {
            Some((name.clone(), file(asset["href"].as_str()?, folder)))
        });
        Self {
            id: item["id"].as_str().unwrap_or("without a name").to_owned(),
            assets: files.collect(),
            georeference: place(),
        }
    }
}

impl Item {
    /// Returns true if the file's place matches the item's, or the item states none.
    fn is_place_of(&self, file: &Dataset) -> bool {
        let Some((size, georeference)) = self.georeference else {
            return true;
        };
        let has_size = file.band(1).is_ok_and(|band| band.size() == size);
        let place = file.geo_transform();
        has_size
            && place.is_some_and(|found| {
                let cell = found[1].abs().max(found[5].abs());
                let [columns, rows] = size.map(f64::from);
                // The two far corners show whether the cell size is as stated.
                let corner = |of: [f64; 6], column: f64, row: f64| {
                    [0, 3].map(|at| of[at] + of[at + 1] * column + of[at + 2] * row)
                };
                let is_near = |column: f64, row: f64| {
                    let both = corner(found, column, row).into_iter().zip(corner(
                        georeference,
                        column,
                        row,
                    ));
                    both.into_iter()
                        .all(|(a, b)| (a - b).abs() <= TOLERANCE * cell)
                };
                is_near(0.0, 0.0) && is_near(columns, 0.0) && is_near(0.0, rows)
            })
    }
}

fn is_raster(asset: &Value) -> bool {
    let is_one_of = |key: &str| {
        let text = asset[key].as_str().unwrap_or_default().to_lowercase();
        MEDIA.iter().any(|media| text.contains(media))
    };
    is_one_of("type") || (asset["type"].is_null() && is_one_of("href"))
}

/// Returns GDAL's name of a file that an item references.
fn file(href: &str, folder: &Path) -> String {
    match href.split_once("://") {
        Some(("s3", rest)) => format!("/vsis3/{rest}"),
        Some(("gs", rest)) => format!("/vsigs/{rest}"),
        Some(("file", rest)) => rest.to_owned(),
        Some(_) => format!("/vsicurl/{href}"),
        None => {
            let joined = folder.join(href.trim_start_matches("./"));
            let joined = joined.display().to_string();
            match is_url(&joined) {
                true => file(&joined, Path::new("")),
                false => joined,
            }
        }
    }
}
