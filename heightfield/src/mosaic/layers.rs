//! Finds the heights among several rasters at one place, by their names, then by their types.
//!
//! Providers add layers on the same samples to a terrain: counts of scenes, masks, errors. A
//! layer's name is the heights' name with another word (`_dem` and `_num`), or an additional one
//! (`_dem` and `_dem_count`).

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::SampleType;

/// Words in names of files with heights.
const HEIGHTS: [&str; 22] = [
    "dem",
    "dsm",
    "dtm",
    "dhm",
    "dgm",
    "dom",
    "mnt",
    "mns",
    "mde",
    "mdt",
    "mds",
    "hgt",
    "elv",
    "elev",
    "elevation",
    "height",
    "heights",
    "topo",
    "topography",
    "bathy",
    "bathymetry",
    "z",
];
/// Words in names of layers beside heights: of ASTER, AW3D30, Copernicus, ArcticDEM, TanDEM-X,
/// NASADEM, MERIT, GEBCO, and of GDAL's derived products.
const LAYERS: [&str; 53] = [
    "num",
    "att",
    "msk",
    "stk",
    "edm",
    "wbm",
    "flm",
    "hem",
    "acm",
    "count",
    "mad",
    "matchtag",
    "bitmask",
    "datamask",
    "mindate",
    "maxdate",
    "browse",
    "am2",
    "amp",
    "cov",
    "com",
    "int",
    "lsm",
    "wam",
    "swb",
    "swbd",
    "dir",
    "upa",
    "wth",
    "hnd",
    "tid",
    "mask",
    "qa",
    "quality",
    "qual",
    "err",
    "error",
    "rmse",
    "std",
    "stddev",
    "sigma",
    "uncertainty",
    "confidence",
    "slope",
    "aspect",
    "hillshade",
    "shade",
    "shaded",
    "relief",
    "roughness",
    "tri",
    "tpi",
    "source",
];

/// Returns the words of a file's name, in lower case.
fn words(path: &Path) -> Vec<String> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let words = stem.split(|c: char| !c.is_alphanumeric());
    let words = words.filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// Returns folder and name without one of its words.
fn without(path: &Path, words: &[String], omitted: usize) -> (PathBuf, String) {
    let others = words.iter().enumerate().filter(|(at, _)| *at != omitted);
    let others: Vec<&str> = others.map(|(_, word)| word.as_str()).collect();
    (
        path.parent().unwrap_or(Path::new("")).to_owned(),
        others.join(" "),
    )
}

/// Returns the positions of a list's words in a name.
fn places(words: &[String], list: &[&str]) -> Vec<usize> {
    let is_listed = |word: &String| list.contains(&word.as_str());
    (0..words.len())
        .filter(|at| is_listed(&words[*at]))
        .collect()
}

/// Splits files by name into heights, and layers beside them.
pub(super) fn split_by_name(files: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let mut heights = HashSet::new();
    for file in &files {
        let words = words(file);
        heights.insert(without(file, &words, usize::MAX));
        for at in places(&words, &HEIGHTS) {
            heights.insert(without(file, &words, at));
        }
    }
    files.into_iter().partition(|file| {
        let words = words(file);
        let mut layers = places(&words, &LAYERS).into_iter();
        !layers.any(|at| heights.contains(&without(file, &words, at)))
    })
}

/// Finds the heights among several rasters on the same samples: if the names differ, the only one
/// named as heights, else the only one with more than a byte per sample. `None` if there is no such
/// one.
pub(super) fn heights_among(files: &[(&Path, SampleType)]) -> Option<usize> {
    let all: Vec<Vec<String>> = files.iter().map(|(path, _)| words(path)).collect();
    let is_shared = |word: &String| all.iter().all(|words| words.contains(word));
    let only = |accepts: &dyn Fn(usize) -> bool| {
        let mut found = (0..files.len()).filter(|index| accepts(*index));
        found.next().filter(|_| found.next().is_none())
    };
    let is_named = |index: usize| {
        let own = all[index].iter().filter(|word| !is_shared(word));
        own.into_iter().any(|word| HEIGHTS.contains(&word.as_str()))
    };
    let is_wide = |index: usize| !matches!(files[index].1, SampleType::U8 | SampleType::I8);
    only(&is_named).or_else(|| only(&is_wide))
}

/// Returns the remark on ignored layers.
pub(super) fn remark_ignored(layers: &[PathBuf]) -> Option<String> {
    const MAX_NAMED: usize = 4;
    let name = |path: &PathBuf| {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let named: Vec<String> = layers.iter().take(MAX_NAMED).map(name).collect();
    let more = match layers.len().saturating_sub(MAX_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!layers.is_empty()).then(|| {
        format!(
            "layers beside the heights are left out, by name and type of samples: {}{more}",
            named.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(names: &[&str]) -> (Vec<String>, Vec<String>) {
        let (heights, layers) = split_by_name(names.iter().map(PathBuf::from).collect());
        let text = |paths: Vec<PathBuf>| {
            let names = paths
                .into_iter()
                .map(|path| path.to_string_lossy().into_owned());
            names.collect::<Vec<_>>()
        };
        (text(heights), text(layers))
    }

    #[test]
    fn provider_layers_are_separated_from_heights() {
        for (heights, layers) in [
            (
                "ASTGTMV003_N38E050_dem.tif",
                &["ASTGTMV003_N38E050_num.tif"][..],
            ),
            (
                "ALPSMLC30_N038E050_DSM.tif",
                &["ALPSMLC30_N038E050_MSK.tif", "ALPSMLC30_N038E050_STK.tif"],
            ),
            (
                "Copernicus_DSM_10_N38_00_E050_00_DEM.tif",
                &[
                    "Copernicus_DSM_10_N38_00_E050_00_EDM.tif",
                    "Copernicus_DSM_10_N38_00_E050_00_FLM.tif",
                    "Copernicus_DSM_10_N38_00_E050_00_HEM.tif",
                    "Copernicus_DSM_10_N38_00_E050_00_WBM.tif",
                ],
            ),
            (
                "12_34_1_1_2m_v4.1_dem.tif",
                &[
                    "12_34_1_1_2m_v4.1_count.tif",
                    "12_34_1_1_2m_v4.1_dem_mad.tif",
                ],
            ),
            ("gebco_2023_n39.tif", &["gebco_2023_tid_n39.tif"]),
        ] {
            let names: Vec<&str> = [heights]
                .into_iter()
                .chain(layers.iter().copied())
                .collect();
            let expected = (
                vec![heights.to_owned()],
                layers.iter().map(|it| it.to_string()).collect(),
            );
            assert_eq!(split(&names), expected);
        }
    }

    #[test]
    fn layers_without_heights_beside_them_are_terrains() {
        let names = ["n38_count.tif", "n39_count.tif", "n40_dem.tif"];
        assert_eq!(split(&names).1, Vec::<String>::new());
    }

    #[test]
    fn heights_are_chosen_by_name_and_then_by_sample_type() {
        use SampleType::{F32, I16, U8};
        let among = |files: &[(&str, SampleType)]| {
            let files: Vec<_> = files
                .iter()
                .map(|(name, it)| (Path::new(name), *it))
                .collect();
            heights_among(&files)
        };
        assert_eq!(among(&[("a_foo.tif", F32), ("a_dtm.tif", F32)]), Some(1));
        assert_eq!(among(&[("a_1.tif", I16), ("a_2.tif", U8)]), Some(0));
        assert_eq!(among(&[("a_dsm.tif", F32), ("a_dtm.tif", F32)]), None);
        assert_eq!(among(&[("a_2019.tif", F32), ("a_2020.tif", F32)]), None);
    }
}
