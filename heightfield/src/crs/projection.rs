//! The way from a map to longitude and latitude of its own datum, and back.

use std::f64::consts::{PI, TAU};

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::Globe;

/// A place that a projection gives back this much off is not one of its own, radians:
/// 60 m on the ground.
const SAME_RADIANS: f64 = 1e-5;

/// A projection and the globe that it projects, both as PROJ writes them. Its longitudes count
/// from Greenwich.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Projection {
    words: String,
    globe: String,
}

impl Projection {
    /// Of a text as PROJ writes it. What it says of datums is left out: shifts are made
    /// between longitudes and latitudes.
    pub(super) fn new(text: &str, globe: Globe) -> Self {
        const DATUM: [&str; 3] = ["+datum=", "+towgs84=", "+nadgrids="];
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
        Self {
            words: words.join(" "),
            globe: size,
        }
    }

    /// Degrees east of Greenwich at which the longitudes of such a text begin.
    pub(super) fn meridian_of(text: &str) -> f64 {
        let mut words = text.split_whitespace();
        let stated = words.find_map(|word| word.strip_prefix("+pm=")?.parse().ok());
        stated
            .filter(|degrees: &f64| degrees.is_finite())
            .unwrap_or(0.0)
    }

    /// Longitude and latitude in degrees of a place on the map.
    pub(super) fn degrees(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let mut place = (x, y, 0.0);
        transform(&self.map()?, &self.longlat()?, &mut place).ok()?;
        finite((place.0.to_degrees(), place.1.to_degrees()))
    }

    /// The place on the map of a longitude and latitude in degrees; `None` where the map
    /// does not have it.
    pub(super) fn of_degrees(&self, degrees: (f64, f64)) -> Option<(f64, f64)> {
        let mut place = (degrees.0.to_radians(), degrees.1.to_radians(), 0.0);
        transform(&self.longlat()?, &self.map()?, &mut place).ok()?;
        let place = finite((place.0, place.1))?;
        // Far outside of what a projection is for its formulas give numbers all the same.
        let back = self.degrees(place)?;
        are_same(degrees, back).then_some(place)
    }

    fn map(&self) -> Option<Proj> {
        Proj::from_proj_string(&self.words).ok()
    }

    fn longlat(&self) -> Option<Proj> {
        Proj::from_proj_string(&format!("+proj=longlat {}", self.globe)).ok()
    }
}

/// Whether two places are one: at a pole all longitudes are.
fn are_same(one: (f64, f64), other: (f64, f64)) -> bool {
    let north = (other.1 - one.1).to_radians();
    let turned = (other.0 - one.0).to_radians();
    let east = ((turned + PI).rem_euclid(TAU) - PI) * one.1.to_radians().cos();
    east.hypot(north) < SAME_RADIANS
}

fn finite(place: (f64, f64)) -> Option<(f64, f64)> {
    (place.0.is_finite() && place.1.is_finite()).then_some(place)
}
