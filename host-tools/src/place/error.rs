//! Reasons for which a terrain cannot be placed in front of the arm as requested.

use crate::terrain::ScaleError;

/// Reason for which a place or a scale is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Longitude and latitude of a file whose reference system is not known.
    #[error(
        "the file states no reference system, so it is not known where a longitude and latitude are in it; it covers {bounds}"
    )]
    NoSystem {
        /// Bounds of the terrain, in its own coordinates.
        bounds: String,
    },
    /// Longitude and latitude of a file whose projection is not known.
    #[error(
        "the projection of the file's reference system ({system}) is not known here, so it is not known where a longitude and latitude are in it; it covers {bounds}"
    )]
    NoProjection {
        /// Its name.
        system: String,
        /// Bounds of the terrain, in its own coordinates.
        bounds: String,
    },
    /// A longitude and latitude that the projection does not have.
    #[error(
        "longitude {}, latitude {} is no place of the file's map ({system}); it covers {bounds}", .lonlat[0], .lonlat[1]
    )]
    NotOnMap {
        /// As asked for, degrees.
        lonlat: [f64; 2],
        /// The file's reference system.
        system: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A code without a reference system.
    #[error("no reference system EPSG:{0} is known here")]
    UnknownCode(u16),
    /// A reference system without a transformation to that of the file.
    #[error("EPSG:{code} and the file's reference system ({system}) have no datum in common")]
    OtherDatum {
        /// The code.
        code: u16,
        /// The file's reference system.
        system: String,
    },
    /// A place that its reference system does not have.
    #[error("{},{} is no place of EPSG:{code}", .place[0], .place[1])]
    NotInSystem {
        /// The code.
        code: u16,
        /// As asked for, x and y.
        place: [f64; 2],
    },
    /// A latitude and longitude in the place of a longitude and latitude.
    #[error(
        "{},{} is not in the terrain, {},{} is: longitude comes first", .0[0], .0[1], .0[1], .0[0]
    )]
    LatitudeFirst([f64; 2]),
    /// A place beyond the samples.
    #[error("{place} is outside of the terrain, which covers {bounds}")]
    Outside {
        /// As asked for.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A place without a height.
    #[error("there is no data at {place}; the terrain covers {bounds}")]
    Hole {
        /// As asked for.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// Heights that cannot be read at present: they are no holes.
    #[error("the heights at {place} cannot be read at present")]
    Unread {
        /// As asked for.
        place: String,
    },
    /// A box whose sides are in the wrong order.
    #[error("a box is west,south,east,north: {0} is not")]
    NoBox(String),
    /// A box whose west lies east of its east, of a terrain that is not around the globe.
    #[error(
        "a box is west,south,east,north: {} is east of {}, and the terrain does not go around the globe", .0[0], .0[2]
    )]
    WestInTheEast([f64; 4]),
    /// A box beyond the samples.
    #[error("the box {place} is outside of the terrain, which covers {bounds}")]
    BoxOutside {
        /// As asked for.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box around nothing but holes.
    #[error("there is no data in the box {place}; the terrain covers {bounds}")]
    BoxOfHoles {
        /// As asked for.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box that holds no patch.
    #[error("the box {place} is smaller than a cell of the terrain, which covers {bounds}")]
    BoxTooSmall {
        /// As asked for.
        place: String,
        /// Bounds of the terrain.
        bounds: String,
    },
    /// A box of longitude and latitude that a map does not hold in one piece.
    #[error("the box {place} lies across the seam of the file's map ({system})")]
    BoxAcrossSeam {
        /// As asked for.
        place: String,
        /// The file's reference system.
        system: String,
    },
    /// A box across the end of a field that goes around the globe.
    #[error(
        "the box {place} lies across the end of the terrain, which goes around the globe: its parts are --bbox {} and --bbox {}, ask for one of them", .parts[0], .parts[1]
    )]
    BoxInTwoParts {
        /// As asked for.
        place: String,
        /// Both parts in the file's own coordinates.
        parts: [String; 2],
    },
    /// Ground metres, of a file without a size.
    #[error("the file does not state its cell size on the ground")]
    NoGroundSize,
    /// A scale that is none.
    #[error("{0} ground metres a device millimetre: it must be above zero, and finite")]
    GroundScale(f64),
    /// An exaggeration that is none.
    #[error("heights × {0}: it must be finite and not zero")]
    Exaggeration(f64),
    /// Heights that the arm does not reach, however small the terrain is.
    #[error("the relief is {relief_mm:.0} mm high in the hand; the arm reaches {reach_mm:.0} mm")]
    TooTall {
        /// Of the terrain in the hand.
        relief_mm: f64,
        /// From the lowest to the highest point that the arm gets to.
        reach_mm: f64,
    },
    /// A home position that is farther out than can be addressed.
    #[error("the place under the home position, ({:.0}, {:.0}, {:.0}) mm, is too far from the origin", .0[0], .0[1], .0[2])]
    FarAway([f64; 3]),
    /// A calibration whose stops leave no room.
    #[error("the calibration leaves the arm no room to lay a terrain into")]
    NoReach,
    /// Numbers that no terrain can be scaled with.
    #[error(transparent)]
    Scale(#[from] ScaleError),
}
