//! Places and bounds as text for the user.

use super::coordinates::Coordinates;
use heightfield::{Georeference, LonLat, Sides, System, around};

/// Returns the bounds of a terrain in its own coordinates and, if known, in longitude and latitude.
#[must_use]
pub fn bounds_in_words(file: &Georeference<'_>) -> String {
    let [west, south, east, north] = file.bounds();
    let [x, y] = names(file);
    let digits = Digits::of(file);
    let [w, s, e, n] = [west, south, east, north].map(|value| digits.format(value));
    let own = format!("{x} {w} to {e}, {y} {s} to {n} ({})", system_in_words(file));
    if file.counts_lonlat() {
        return own + &kind_in_words(file.lonlat());
    }
    let corners = [[west, south], [east, south], [west, north], [east, north]];
    let lonlat: Option<Vec<_>> = corners
        .iter()
        .map(|corner| file.to_lonlat(*corner))
        .collect();
    match lonlat {
        Some(corners) => {
            let [west, south, east, north] = around(corners);
            format!(
                "{own}, which is longitude {west:.5} to {east:.5}, latitude {south:.5} to {north:.5}{}",
                kind_in_words(file.lonlat())
            )
        }
        None => own,
    }
}

/// Returns a place in the file's coordinates and, if known, in longitude and latitude.
#[must_use]
pub fn place_in_words(file: &Georeference<'_>, ground: [f64; 2]) -> String {
    let own = place_as_given(file, ground, Coordinates::Own);
    let kind = kind_in_words(file.lonlat());
    match file.to_lonlat(ground) {
        Some(_) if file.counts_lonlat() => own + &kind,
        Some([longitude, latitude]) => {
            format!("{own}, which is longitude {longitude:.6}, latitude {latitude:.6}{kind}")
        }
        None => own,
    }
}

/// Returns the kind of longitudes and latitudes, if they differ from WGS 84.
fn kind_in_words(kind: LonLat<'_>) -> String {
    /// Distance below which no remark is needed, m.
    const CLOSE_M: f64 = 5.0;
    match kind {
        LonLat::Unstated | LonLat::Wgs84 => String::new(),
        LonLat::ShiftedToWgs84 { within_m } if within_m < CLOSE_M => String::new(),
        LonLat::ShiftedToWgs84 { within_m } => {
            format!(" of WGS 84, usually within {within_m} m")
        }
        LonLat::OfOwnDatum { name } => {
            format!(" of its own datum ({name}), whose conversion to WGS 84 is not supported")
        }
        LonLat::OfBody { name, radius_m } => {
            let kilometres = radius_m / 1000.0;
            format!(" on a body of {kilometres} km radius, not the Earth ({name})")
        }
    }
}

/// Returns two coordinates without their names, for the corners of a map.
#[must_use]
pub fn coordinates_in_words(file: &Georeference<'_>, ground: [f64; 2]) -> String {
    let digits = Digits::of(file);
    ground.map(|value| digits.format(value)).join(", ")
}

/// Returns a place in the user's coordinates.
pub(super) fn place_as_given(
    file: &Georeference<'_>,
    [a, b]: [f64; 2],
    coordinates: Coordinates,
) -> String {
    match coordinates.of(file) {
        Coordinates::LonLat => format!("longitude {a}, latitude {b}"),
        Coordinates::Epsg(code) => format!("x {a}, y {b} (EPSG:{code})"),
        Coordinates::Own => {
            let ([x, y], digits) = (names(file), Digits::of(file));
            let [a, b] = [a, b].map(|value| digits.format(value));
            format!("{x} {a}, {y} {b} ({})", system_in_words(file))
        }
    }
}

/// Returns a box in the file's own coordinates, in the form of the option.
pub(super) fn own_box_in_words(file: &Georeference<'_>, sides: Sides) -> String {
    let digits = Digits::of(file);
    sides.map(|side| digits.format(side)).join(",")
}

/// Returns a box in the form of the option.
pub(super) fn box_in_words(sides: Sides) -> String {
    sides.map(|side| side.to_string()).join(",")
}

/// Returns a short name of the file's reference system.
pub(super) fn system_in_words(file: &Georeference<'_>) -> String {
    match file.system() {
        System::Cells => "cells from the south-west sample".into(),
        System::Unstated => "the file's own coordinates".into(),
        System::Geographic { .. } | System::Projected => match file.reference() {
            Some(system) => {
                let code = system.code().map(|code| format!("EPSG:{code}"));
                let name = code.unwrap_or_else(|| system.name().into());
                name + angle_in_words(file.system())
            }
            None => "degrees".into(),
        },
    }
}

/// Returns the unit of angles that are not degrees.
fn angle_in_words(system: System) -> &'static str {
    match system {
        System::Geographic { degrees: 1.0 } | System::Projected => "",
        System::Geographic { degrees: 0.9 } => ", grads",
        _ => ", angles that are not degrees",
    }
}

/// Returns the names of a file's two coordinates; longitude and latitude only if options accept
/// them as such.
fn names(file: &Georeference<'_>) -> [&'static str; 2] {
    match file.system() {
        System::Cells => ["column", "row"],
        System::Geographic { .. } if file.counts_lonlat() => ["longitude", "latitude"],
        _ => ["x", "y"],
    }
}

/// Number of decimals that resolve hundredths of a sample.
struct Digits(usize);

impl Digits {
    fn of(file: &Georeference<'_>) -> Self {
        let [x, y] = file.transform().column_step();
        let decimals = 2.0 - x.hypot(y).log10().floor();
        Self(decimals.clamp(0.0, 9.0) as usize)
    }

    fn format(&self, value: f64) -> String {
        let text = format!("{value:.*}", self.0);
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    }
}
