//! Places and bounds as they are said to the user.

use super::target::Coordinates;
use crate::raster::{Georeference, Sides, System};

/// What a terrain covers, in its own coordinates and, where they are known, in longitude
/// and latitude.
#[must_use]
pub fn bounds_in_words(file: &Georeference<'_>) -> String {
    let [west, south, east, north] = file.bounds();
    let [x, y] = names(file);
    let digits = Digits::of(file);
    let [w, s, e, n] = [west, south, east, north].map(|value| digits.say(value));
    let own = format!("{x} {w} to {e}, {y} {s} to {n} ({})", system_in_words(file));
    if !matches!(file.system(), System::Projected) {
        return own;
    }
    let corners = [[west, south], [east, south], [west, north], [east, north]];
    let lonlat: Option<Vec<_>> = corners
        .iter()
        .map(|corner| file.to_lonlat(*corner))
        .collect();
    match lonlat {
        Some(corners) => {
            let [west, south, east, north] = super::ground::around(&corners);
            format!(
                "{own}, which is longitude {west:.5} to {east:.5}, latitude {south:.5} to {north:.5}"
            )
        }
        None => own,
    }
}

/// A place in the file's coordinates and, where it is known, in longitude and latitude.
#[must_use]
pub fn place_in_words(file: &Georeference<'_>, ground: [f64; 2]) -> String {
    let own = asked_in_words(file, ground, Coordinates::Own);
    match (file.system(), file.to_lonlat(ground)) {
        (System::Projected, Some([longitude, latitude])) => {
            format!("{own}, which is longitude {longitude:.6}, latitude {latitude:.6}")
        }
        _ => own,
    }
}

/// Two coordinates without their names, as a map has them at its corners.
#[must_use]
pub fn coordinates_in_words(file: &Georeference<'_>, ground: [f64; 2]) -> String {
    let digits = Digits::of(file);
    ground.map(|value| digits.say(value)).join(", ")
}

/// A place as it was asked for.
pub(super) fn asked_in_words(
    file: &Georeference<'_>,
    [a, b]: [f64; 2],
    coordinates: Coordinates,
) -> String {
    match coordinates {
        Coordinates::LonLat => format!("longitude {a}, latitude {b}"),
        Coordinates::Own => {
            let ([x, y], digits) = (names(file), Digits::of(file));
            let [a, b] = [a, b].map(|value| digits.say(value));
            format!("{x} {a}, {y} {b} ({})", system_in_words(file))
        }
    }
}

/// A box as it was asked for.
pub(super) fn box_in_words(sides: Sides) -> String {
    sides.map(|side| side.to_string()).join(",")
}

/// The file's reference system in a word or two.
pub(super) fn system_in_words(file: &Georeference<'_>) -> String {
    match file.system() {
        System::Cells => "cells from the south-west sample".into(),
        System::Unstated => "the file's own coordinates".into(),
        System::Geographic { .. } | System::Projected => match file.reference() {
            Some(system) => {
                (system.code()).map_or(system.name().into(), |code| format!("EPSG:{code}"))
            }
            None => "degrees".into(),
        },
    }
}

/// What a file's two coordinates are called.
fn names(file: &Georeference<'_>) -> [&'static str; 2] {
    match file.system() {
        System::Cells => ["column", "row"],
        System::Unstated | System::Projected => ["x", "y"],
        System::Geographic { .. } => ["longitude", "latitude"],
    }
}

/// As many decimals as tell hundredths of a sample apart.
struct Digits(usize);

impl Digits {
    fn of(file: &Georeference<'_>) -> Self {
        let [x, y] = file.transform().column_step();
        let decimals = 2.0 - x.hypot(y).log10().floor();
        Self(decimals.clamp(0.0, 9.0) as usize)
    }

    fn say(&self, value: f64) -> String {
        let text = format!("{value:.*}", self.0);
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    }
}
