//! What is kept of an item: its file, and what it says of that.

use std::path::{Path, PathBuf};

use jiff::Timestamp;

use super::super::super::BadRaster;
use super::super::super::ground_map::GroundMap;
use super::super::index::{File, Stated};
use super::asset;
use super::document::{Feature, Projection, Properties, Text};
use super::href;

/// An item of a terrain.
pub(super) struct Item {
    /// Its name.
    pub(super) id: String,
    /// When what it shows was seen, or the end of that time; `None` where it does not say so.
    pub(super) when: Option<Timestamp>,
    path: PathBuf,
    stated: Option<Stated>,
}

impl Item {
    /// The same for the index.
    pub(super) fn into_file(self) -> File {
        File {
            path: self.path,
            item: Some(self.id),
            stated: self.stated,
        }
    }
}

/// What is kept of an item of a document; `asked` is the asset that the user named.
pub(super) fn listed(
    feature: Feature,
    document: &Path,
    asked: Option<&str>,
) -> Result<Item, BadRaster> {
    let id = feature.id.as_ref().map_or("without a name", |id| &id.0);
    let asset = asset::chosen(&feature, id, asked)?;
    let properties = feature.properties.as_ref();
    Ok(Item {
        path: href::resolved(asset.href(), document)?,
        stated: stated(&asset.projection(properties)),
        when: properties.and_then(when),
        id: id.to_owned(),
    })
}

fn when(properties: &Properties) -> Option<Timestamp> {
    let time = |text: &Option<Text>| text.as_ref()?.0.trim().parse::<Timestamp>().ok();
    time(&properties.datetime)
        .or_else(|| time(&properties.end_datetime))
        .or_else(|| time(&properties.start_datetime))
}

/// Place and size of the file, where the item states all of it.
fn stated(projection: &Projection<'_>) -> Option<Stated> {
    let code = match projection.code {
        Some(code) => code.strip_prefix("EPSG:")?.parse().ok()?,
        None => u16::try_from(projection.epsg?).ok()?,
    };
    let &[rows, columns] = projection.shape? else {
        return None;
    };
    let side = |count: f64| {
        let is_count = count.fract() == 0.0 && (1.0..=f64::from(i32::MAX)).contains(&count);
        is_count.then_some(count as u32)
    };
    let (&[east, row_east, x, north_by_column, north, y], rest) =
        projection.transform?.split_first_chunk::<6>()?;
    // The last row of a matrix says nothing.
    let is_affine = rest.is_empty() || rest == [0.0, 0.0, 1.0];
    let map = GroundMap::new([x, east, row_east], [y, north_by_column, north]);
    Some(Stated {
        size: (side(columns)?, side(rows)?),
        map: map.filter(|_| is_affine)?,
        code,
    })
}
