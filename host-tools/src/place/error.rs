//! Reasons why a terrain cannot be placed in front of the arm as requested.

use crate::terrain::ScaleError;

/// Reason why a place or a scale is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Longitude and latitude, in a file with an unknown reference system.
    #[error(
        "the file states no reference system, so a longitude and latitude cannot be located in it; it covers {bounds}"
    )]
    NoSystem {
        /// Bounds of the terrain, in its own coordinates.
        bounds: String,
    },
    /// Longitude and latitude, in a file with an unknown projection.
    #[error(
        "the projection of the file's reference system ({system}) is not supported, so a longitude and latitude cannot be located in it; it covers {bounds}"
    )]
    NoProjection {
        /// Its name.
        system: String,
        /// Bounds of the terrain, in its own coordinates.
        bounds: String,
    },
    /// A longitude and latitude outside the projection.
    #[error(
        "longitude {}, latitude {} is no place of the file's map ({system}); it covers {bounds}", .lonlat[0], .lonlat[1]
    )]
    NotOnMap {
        /// The requested ones, degrees.
        lonlat: [f64; 2],
        /// The file's reference system.
        system: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A code without a reference system.
    #[error("the reference system EPSG:{0} is not supported")]
    UnknownCode(u16),
    /// A reference system without a transformation to the file's.
    #[error("EPSG:{code} and the file's reference system ({system}) have no datum in common")]
    OtherDatum {
        /// The code.
        code: u16,
        /// The file's reference system.
        system: String,
    },
    /// A place outside its reference system.
    #[error("{},{} is no place of EPSG:{code}", .place[0], .place[1])]
    NotInSystem {
        /// The code.
        code: u16,
        /// The requested place, x and y.
        place: [f64; 2],
    },
    /// Probably latitude and longitude in exchanged order.
    #[error(
        "{},{} is not in the terrain, {},{} is: longitude comes first", .0[0], .0[1], .0[1], .0[0]
    )]
    LatitudeFirst([f64; 2]),
    /// A place beyond the samples.
    #[error("{place} is outside of the terrain, which covers {bounds}")]
    Outside {
        /// The requested place.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A place without a height.
    #[error("there is no data at {place}; the terrain covers {bounds}")]
    NoData {
        /// The requested place.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// Heights that cannot be read at present: they are not no-data.
    #[error("the heights at {place} cannot be read at present")]
    Unread {
        /// The requested place.
        place: String,
    },
    /// A box whose sides are in the wrong order.
    #[error("a box is west,south,east,north: {0} is not")]
    NoBox(String),
    /// A box whose west lies east of its east, in a terrain that does not go around the globe.
    #[error(
        "a box is west,south,east,north: {} is east of {}, and the terrain does not go around the globe", .0[0], .0[2]
    )]
    WestInTheEast([f64; 4]),
    /// A box beyond the samples.
    #[error("the box {place} is outside of the terrain, which covers {bounds}")]
    BoxOutside {
        /// The requested box.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box with nothing but no-data.
    #[error("there is no data in the box {place}; the terrain covers {bounds}")]
    BoxOfHoles {
        /// The requested box.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box without a whole patch.
    #[error("the box {place} is smaller than a cell of the terrain, which covers {bounds}")]
    BoxTooSmall {
        /// The requested box.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box of longitude and latitude that is not in one piece on the map.
    #[error("the box {place} lies across the seam of the file's map ({system})")]
    BoxAcrossSeam {
        /// The requested box.
        place: String,
        /// The file's reference system.
        system: String,
    },
    /// A box across the border of a raster that goes around the globe.
    #[error(
        "the box {place} lies across the end of the terrain, which goes around the globe: its parts are --bbox {} and --bbox {}, choose one of them", .parts[0], .parts[1]
    )]
    BoxInTwoParts {
        /// The requested box.
        place: String,
        /// Both parts in the file's own coordinates.
        parts: [String; 2],
    },
    /// A scale in ground metres, for a file without a size.
    #[error("the file does not state its cell size on the ground")]
    NoGroundSize,
    /// An invalid scale.
    #[error("{0} ground metres per device millimetre: it must be above zero, and finite")]
    GroundScale(f64),
    /// An invalid exaggeration.
    #[error("heights × {0}: it must be finite and not zero")]
    Exaggeration(f64),
    /// Heights beyond the arm's reach at any size of the terrain.
    #[error("the relief is {relief_mm:.0} mm high in the hand; the arm reaches {reach_mm:.0} mm")]
    TooTall {
        /// Relief of the terrain, device millimetres.
        relief_mm: f64,
        /// Height of the arm's workspace, mm.
        reach_mm: f64,
    },
    /// A home position too far from the origin for its coordinates.
    #[error("the place under the home position, ({:.0}, {:.0}, {:.0}) mm, is too far from the origin", .0[0], .0[1], .0[2])]
    FarAway([f64; 3]),
    /// A calibration whose stops leave no workspace.
    #[error("the calibration leaves no workspace to fit a terrain to")]
    NoReach,
    /// Numbers that are no valid scale.
    #[error(transparent)]
    Scale(#[from] ScaleError),
}
