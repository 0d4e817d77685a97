//! Reference systems by EPSG code: most are in `crs-definitions`, newer projected ones and vertical
//! ones in the two tables beside this file, and the rest in libgdal, if it is installed.

use super::datum::Datum;
use super::shift::Shift;
use super::system::ReferenceSystem;
use super::unit::Unit;
use super::wkt::Node;
use super::{Vertical, by_gdal};
use crate::globe::Globe;

/// Vertical systems: code, metres in the unit, 1 for depths, name.
const VERTICAL: &str = include_str!("vertical.txt");
/// Projected systems missing in `crs-definitions`: code, metres in the unit, code of the geographic
/// system, its ellipsoid and datum, the projection in PROJ's syntax, name.
const PROJECTED: &str = include_str!("projected.txt");

/// Systems whose definition in `crs-definitions` differs from EPSG's: other axes, another unit,
/// another meridian. libgdal provides them.
const DEFINED_OTHERWISE: [u16; 5] = [2065, 3167, 5513, 26591, 26592];
/// Systems whose projection differs between `proj4rs` and PROJ by more than 50 m; it is treated as
/// unknown. All other projected codes, of 5,608, agree within 1 m, except 2062, with 48 m
/// (`tests/data/epsg_places.py`).
const COMPUTED_OTHERWISE: [u16; 8] = [3973, 3974, 3975, 6200, 6996, 6997, 8044, 8045];

/// Returns the system with a code; `None` if it is unknown, or not horizontal.
pub(super) fn of_code(code: u16) -> Option<ReferenceSystem> {
    let here = || defined(code).or_else(|| newer(code));
    let of_gdal = || by_gdal::of_code(code);
    let system = match DEFINED_OTHERWISE.contains(&code) {
        true => of_gdal(),
        false => here().or_else(of_gdal),
    };
    system.map(|system| match COMPUTED_OTHERWISE.contains(&code) {
        true => system.without_projection(),
        false => system,
    })
}

/// Returns the vertical system with a code.
pub(crate) fn vertical(code: u16) -> Option<Vertical> {
    let [metres, down, name] = row(VERTICAL, code)?;
    Some(Vertical {
        code: Some(code),
        name: name.to_owned(),
        metres: metres.parse().ok()?,
        is_depth: down == "1",
    })
}

/// Returns the vertical part of a compound system with a code.
pub(crate) fn vertical_of_compound(code: u16) -> Option<Vertical> {
    let root = Node::parse(crs_definitions::from_code(code)?.wkt)?;
    Vertical::of_compound(&root)
}

fn defined(code: u16) -> Option<ReferenceSystem> {
    let definition = crs_definitions::from_code(code)?;
    let root = Node::parse(definition.wkt)?;
    let node = root.horizontal()?;
    let base = node.base();
    let code_of_base = base.epsg().unwrap_or(code);
    let datum = Datum::of(base, Shift::of_code(code_of_base));
    let system = ReferenceSystem::new(node.name()?, node.unit_of_places()?, datum);
    Some(system.with_code(code).with_projection(definition.proj4))
}

fn newer(code: u16) -> Option<ReferenceSystem> {
    let [metres, base, major, inverse, datum, projection, name] = row(PROJECTED, code)?;
    let globe = Globe::new(major.parse().ok()?, inverse.parse().ok()?)?;
    let shift = base.parse().ok().and_then(Shift::of_code);
    let datum = Datum::new(datum.to_owned(), globe, 0.0, shift);
    let unit = Unit::Length(metres.parse().ok());
    let system = ReferenceSystem::new(name, unit, Some(datum));
    Some(system.with_code(code).with_projection(projection))
}

/// Returns the row of a code in a table.
fn row<const N: usize>(table: &'static str, code: u16) -> Option<[&'static str; N]> {
    let code = code.to_string();
    let mut rows = table.lines().map(|line| line.split('|'));
    let row = rows.find_map(|mut row| (row.next() == Some(&code)).then_some(row))?;
    row.collect::<Vec<_>>().try_into().ok()
}
