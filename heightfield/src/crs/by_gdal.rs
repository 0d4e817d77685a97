//! Reference systems that this crate does not have, from libgdal's PROJ, if it is installed.

use heightfield_gdal::{AxisUnit, SpatialReference};

use super::datum::Datum;
use super::shift::Shift;
use super::system::ReferenceSystem;
use super::unit::Unit;
use crate::gdal;
use crate::globe::Globe;

/// Returns the system with an EPSG code.
pub(super) fn of_code(code: u16) -> Option<ReferenceSystem> {
    let found = gdal().ok()?.reference_of_epsg(code).ok()?;
    described(&found).map(|system| system.with_code(code))
}

/// A text's system in libgdal.
pub(super) struct ByText {
    /// EPSG's code of the same system, if PROJ finds one.
    pub(super) code: Option<u16>,
    /// The system as the text describes it.
    pub(super) described: Option<ReferenceSystem>,
}

/// Returns the system of a text; `None` if libgdal is missing or does not understand it. PROJ takes
/// half a second to compare a text with all EPSG systems.
pub(super) fn of_text(text: &str) -> Option<ByText> {
    let found = gdal().ok()?.reference_of_text(text).ok()?;
    Some(ByText {
        code: found.epsg.and_then(|code| u16::try_from(code).ok()),
        described: described(&found),
    })
}

fn described(found: &SpatialReference) -> Option<ReferenceSystem> {
    let unit = match found.unit {
        AxisUnit::Radians(radians) => Unit::of_radians(radians),
        AxisUnit::Metres(metres) => Unit::Length(Some(metres)),
    };
    let [major, inverse] = found.ellipsoid;
    let globe = Globe::new(major, inverse)?;
    let own = found.to_wgs84.map(|numbers| match numbers[3..] {
        [0.0, 0.0, 0.0, 0.0] => numbers[..3].to_vec(),
        _ => numbers.to_vec(),
    });
    let own = own.and_then(|numbers| Shift::of_numbers(&globe, &numbers));
    let base = found.base_epsg.and_then(|code| u16::try_from(code).ok());
    let shift = own.or_else(|| base.and_then(Shift::of_code));
    let datum = found.datum.clone().unwrap_or_default();
    let datum = Datum::new(datum, globe, found.meridian, shift);
    let named = |name: &str| ReferenceSystem::new(name, unit, Some(datum.clone()));
    let system = match &found.proj {
        Some(projection) => named(&found.name).with_projection(projection),
        None => named(&found.name),
    };
    // "unknown" does not explain why it cannot be placed, but the method does.
    match &found.method {
        Some(method) if !system.has_lonlat() && found.name == "unknown" => {
            Some(named(&method.replace('_', " ")))
        }
        _ => Some(system),
    }
}
