//! Conversion between map coordinates and longitude and latitude of the map's own datum.

use std::f64::consts::{PI, TAU};

use super::Globe;
use super::transform::Transform;

/// Max difference after conversion there and back, radians: 60 m on the ground. A larger one means
/// that the position is outside the projection.
const SAME_RADIANS: f64 = 1e-5;

/// A projection and its globe, both in PROJ's syntax. Longitudes count from the datum's prime
/// meridian.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Projection(Transform);

impl Projection {
    /// Creates a projection from a text in PROJ's syntax. Its datum is ignored: shifts, and turns
    /// to Greenwich, are applied to longitudes and latitudes. `None` if `proj4rs` does not support
    /// it.
    pub(super) fn new(text: &str, globe: Globe) -> Option<Self> {
        const DATUM: [&str; 4] = ["+datum=", "+towgs84=", "+nadgrids=", "+pm="];
        const SIZE: [&str; 4] = ["+a=", "+R=", "+ellps=", "+b="];
        let is_of = |word: &str, keys: &[&str]| keys.iter().any(|key| word.starts_with(key));
        let words = text.split_whitespace();
        let mut words: Vec<_> = words.filter(|word| !is_of(word, &DATUM)).collect();
        let mut size = globe.in_proj();
        if words.contains(&"+proj=mill") {
            // As PROJ, and so all programs based on it: a sphere of the same area.
            size += " +R_A";
            words.retain(|word| !is_of(word, &SIZE) && !word.starts_with("+rf="));
        }
        if !words.iter().any(|word| is_of(word, &SIZE)) {
            words.push(&size);
        }
        let longlat = format!("+proj=longlat {size}");
        Transform::new(words.join(" "), longlat).map(Self)
    }

    /// Returns longitude and latitude in degrees of a position on the map.
    pub(super) fn degrees(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let (longitude, latitude) = self.0.forward(place)?;
        Some((longitude.to_degrees(), latitude.to_degrees()))
    }

    /// Returns the position on the map of a longitude and latitude in degrees; `None` if it is
    /// outside the projection.
    pub(super) fn of_degrees(&self, degrees: (f64, f64)) -> Option<(f64, f64)> {
        let place = self
            .0
            .inverse((degrees.0.to_radians(), degrees.1.to_radians()))?;
        // Far outside their range, a projection's formulas still return numbers.
        are_same(degrees, self.degrees(place)?).then_some(place)
    }
}

/// Returns true if two positions are the same: at a pole, any longitudes are.
fn are_same(one: (f64, f64), other: (f64, f64)) -> bool {
    let north = (other.1 - one.1).to_radians();
    let turned = (other.0 - one.0).to_radians();
    let east = ((turned + PI).rem_euclid(TAU) - PI) * one.1.to_radians().cos();
    east.hypot(north) < SAME_RADIANS
}
