//! The way from a map to longitude and latitude of its own datum, and back.

use std::f64::consts::{PI, TAU};

use super::Globe;
use super::transform::Transform;

/// A place that a projection gives back this much off is not one of its own, radians:
/// 60 m on the ground.
const SAME_RADIANS: f64 = 1e-5;

/// A projection and the globe that it projects, both as PROJ writes them. Its longitudes count
/// from the prime meridian of its datum.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Projection(Transform);

impl Projection {
    /// Of a text as PROJ writes it. What it says of datums is left out: shifts, and turns to
    /// Greenwich, are made between longitudes and latitudes. `None` of one that `proj4rs` does not know.
    pub(super) fn new(text: &str, globe: Globe) -> Option<Self> {
        const DATUM: [&str; 4] = ["+datum=", "+towgs84=", "+nadgrids=", "+pm="];
        const SIZE: [&str; 4] = ["+a=", "+R=", "+ellps=", "+b="];
        let is_of = |word: &str, keys: &[&str]| keys.iter().any(|key| word.starts_with(key));
        let words = text.split_whitespace();
        let mut words: Vec<_> = words.filter(|word| !is_of(word, &DATUM)).collect();
        let mut size = globe.in_proj();
        if words.contains(&"+proj=mill") {
            // As PROJ does, and so everybody who writes such maps: a sphere of the same area.
            size += " +R_A";
            words.retain(|word| !is_of(word, &SIZE) && !word.starts_with("+rf="));
        }
        if !words.iter().any(|word| is_of(word, &SIZE)) {
            words.push(&size);
        }
        let longlat = format!("+proj=longlat {size}");
        Transform::new(words.join(" "), longlat).map(Self)
    }

    /// Longitude and latitude in degrees of a place on the map.
    pub(super) fn degrees(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let (longitude, latitude) = self.0.forward(place)?;
        Some((longitude.to_degrees(), latitude.to_degrees()))
    }

    /// The place on the map of a longitude and latitude in degrees; `None` where the map
    /// does not have it.
    pub(super) fn of_degrees(&self, degrees: (f64, f64)) -> Option<(f64, f64)> {
        let place = self
            .0
            .back((degrees.0.to_radians(), degrees.1.to_radians()))?;
        // Far outside of what a projection is for its formulas give numbers all the same.
        are_same(degrees, self.degrees(place)?).then_some(place)
    }
}

/// Returns true if two places are one: at a pole all longitudes are.
fn are_same(one: (f64, f64), other: (f64, f64)) -> bool {
    let north = (other.1 - one.1).to_radians();
    let turned = (other.0 - one.0).to_radians();
    let east = ((turned + PI).rem_euclid(TAU) - PI) * one.1.to_radians().cos();
    east.hypot(north) < SAME_RADIANS
}
