//! The size and shape of a reference system's body.

/// An ellipsoid of revolution: the Earth's, or another body's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Globe {
    /// Semi-major axis, m.
    radius_m: f64,
    /// Eccentricity squared.
    e2: f64,
}

/// Semi-major axes of ellipsoids and spheres that represent the Earth, m.
const EARTHS: std::ops::RangeInclusive<f64> = 6.3e6..=6.4e6;

impl Globe {
    /// The ellipsoid of WGS 84.
    pub const EARTH: Self = Self {
        radius_m: 6_378_137.0,
        e2: 0.006_694_379_990_141_316,
    };

    /// Returns the globe with a semi-major axis in metres and an inverse flattening; zero
    /// flattening is a sphere, written as an inverse of zero or infinity. `None` for impossible
    /// values.
    pub(super) fn new(radius_m: f64, inverse_flattening: f64) -> Option<Self> {
        let flattening = match inverse_flattening {
            0.0 => 0.0,
            inverse => 1.0 / inverse,
        };
        let is_body = (1.0..1e12).contains(&radius_m) && (0.0..0.7).contains(&flattening);
        let e2 = flattening * (2.0 - flattening);
        is_body.then_some(Self { radius_m, e2 })
    }

    /// Returns the globe with both axes in metres.
    pub(super) fn from_axes(major_m: f64, minor_m: f64) -> Option<Self> {
        match major_m == minor_m {
            true => Self::new(major_m, 0.0),
            false => Self::new(major_m, major_m / (major_m - minor_m)),
        }
    }

    /// Returns the semi-major axis, m.
    #[must_use]
    pub const fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Returns true if it represents the Earth, not another body.
    #[must_use]
    pub fn is_earth(&self) -> bool {
        EARTHS.contains(&self.radius_m)
    }

    /// Returns true if it is the ellipsoid of WGS 84 or GRS 80, which differ by 0.1 mm.
    pub(super) fn is_wgs84(&self) -> bool {
        let same_size = (self.radius_m - Self::EARTH.radius_m).abs() < 1e-3;
        same_size && (self.e2 - Self::EARTH.e2).abs() < 1e-9
    }

    /// Returns the metres in a degree of longitude and of latitude at a latitude in degrees, by the
    /// radii of curvature of the ellipsoid.
    #[must_use]
    pub fn metres_per_degree(&self, latitude: f64) -> [f64; 2] {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let w = (1.0 - self.e2 * sin * sin).sqrt();
        let north = self.radius_m * (1.0 - self.e2) / (w * w * w);
        [self.radius_m * cos / w, north].map(f64::to_radians)
    }

    /// Returns the point on the surface at a longitude and latitude in degrees, m from the centre.
    pub(super) fn surface(&self, (longitude, latitude): (f64, f64)) -> [f64; 3] {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let (east, out) = longitude.to_radians().sin_cos();
        let radius = self.radius_m / (1.0 - self.e2 * sin * sin).sqrt();
        [
            radius * cos * out,
            radius * cos * east,
            radius * (1.0 - self.e2) * sin,
        ]
    }

    /// Returns the parameters for PROJ.
    pub(super) fn in_proj(&self) -> String {
        // PROJ cannot represent the inverse of a zero flattening.
        match self.e2 {
            0.0 => format!("+R={}", self.radius_m),
            e2 => format!(
                "+a={} +b={}",
                self.radius_m,
                self.radius_m * (1.0 - e2).sqrt()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against PROJ's `geod` with each body's axes.
    #[test]
    fn degree_has_the_length_of_its_own_body() {
        let moon = Globe::new(1_737_400.0, 0.0).expect("a sphere");
        let mars = Globe::from_axes(3_396_190.0, 3_376_200.0).expect("an ellipsoid");
        for (globe, latitude, expected) in [
            (Globe::EARTH, 0.0, [111_319.491, 110_574.276]),
            (Globe::EARTH, 60.0, [55_800.0, 111_412.2]),
            (moon, 60.0, [15_161.676, 30_323.351]),
            (mars, 0.0, [59_274.697, 58_579.0]),
        ] {
            let found = globe.metres_per_degree(latitude);
            for axis in 0..2 {
                let error = found[axis] / expected[axis] - 1.0;
                assert!(error.abs() < 1e-5, "{globe:?}: {found:?} for {expected:?}");
            }
        }
        assert!(Globe::EARTH.is_earth() && !moon.is_earth() && !mars.is_earth());
    }

    #[test]
    fn globe_rejects_invalid_radius_and_flattening() {
        for (radius, inverse) in [(0.0, 298.0), (f64::NAN, 298.0), (6e6, 0.5), (6e6, -1.0)] {
            assert_eq!(Globe::new(radius, inverse), None, "{radius} {inverse}");
        }
    }
}
