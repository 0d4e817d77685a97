//! A reference system that brings its way to WGS 84 along: `BOUNDCRS` of WKT 2.

use super::wkt::Node;

/// EPSG's codes of the parameters of a shift, in PROJ's order, and how they are called.
const PARAMETERS: [(u16, &str); 7] = [
    (8605, "x-axis translation"),
    (8606, "y-axis translation"),
    (8607, "z-axis translation"),
    (8608, "x-axis rotation"),
    (8609, "y-axis rotation"),
    (8610, "z-axis rotation"),
    (8611, "scale difference"),
];
/// EPSG's codes of the methods that turn the axes, and not the place, so that rotations count
/// the other way.
const TURNS_AXES: [u16; 3] = [1032, 1038, 9607];
/// Radians in a second of arc.
const SECOND: f64 = std::f64::consts::PI / 648_000.0;

/// The text of the system inside of a bound one, and the numbers of its shift to WGS 84 in
/// PROJ's order: metres, seconds of arc, parts in a million. There are none where the way is
/// another one, as a grid, or goes elsewhere. `None` where nothing is bound.
pub(super) fn parts<'t>(root: &Node, text: &'t str) -> Option<(&'t str, Vec<f64>)> {
    let bound = match root.is(&["BOUNDCRS"]) {
        true => root,
        false => root.child(&["BOUNDCRS"])?,
    };
    bound.child(&["SOURCECRS"])?;
    let numbers = shift(bound).unwrap_or_default();
    Some((inside(text, "SOURCECRS")?, numbers))
}

fn shift(bound: &Node) -> Option<Vec<f64>> {
    let target = bound.child(&["TARGETCRS"])?;
    let target = target.child(&["GEOGCRS", "GEODCRS", "GEOGRAPHICCRS", "GEODETICCRS"])?;
    let is_wgs84 = target.epsg() == Some(4326) || target.name()?.starts_with("WGS 84");
    let way = bound
        .child(&["ABRIDGEDTRANSFORMATION"])
        .filter(|_| is_wgs84)?;
    let method = way.child(&["METHOD"])?;
    let turns_axes = match method.epsg() {
        Some(code) => TURNS_AXES.contains(&code),
        None => method
            .name()?
            .to_ascii_lowercase()
            .contains("coordinate frame"),
    };
    let mut numbers: Vec<f64> = (0..7).map_while(|index| parameter(way, index)).collect();
    if numbers.len() != 7 {
        // Three translations, or no such shift at all.
        numbers.truncate(3);
        return Some(numbers);
    }
    for rotation in &mut numbers[3..6] {
        *rotation = if turns_axes { -*rotation } else { *rotation };
    }
    Some(numbers)
}

/// One of the parameters in PROJ's unit.
fn parameter(way: &Node, index: usize) -> Option<f64> {
    let (code, name) = PARAMETERS[index];
    let mut all = way.all(&["PARAMETER"]);
    let is_it = |node: &&Node| match node.epsg() {
        Some(of_node) => of_node == code,
        None => node
            .name()
            .is_some_and(|of_node| of_node.eq_ignore_ascii_case(name)),
    };
    let node = all.find(is_it)?;
    let (number, unit) = (node.number(1)?, node.unit());
    Some(match index {
        0..3 => number * unit.unwrap_or(1.0),
        3..6 => number * unit.map_or(1.0, |unit| unit / SECOND),
        _ => match unit {
            // WKT 2 has a ratio there, 1.000004, where it states no unit.
            None => (number - 1.0) * 1e6,
            Some(unit) => number * unit / 1e-6,
        },
    })
}

/// What stands in the brackets of the first node with a keyword, without its quoted texts
/// being looked at.
fn inside<'t>(text: &'t str, keyword: &str) -> Option<&'t str> {
    let upper = text.to_ascii_uppercase();
    let from = upper.find(keyword)? + keyword.len();
    let (mut depth, mut quoted, mut begin) = (0_u32, false, None);
    for (at, byte) in text.bytes().enumerate().skip(from) {
        match byte {
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'[' | b'(' => {
                depth += 1;
                begin = begin.or(Some(at + 1));
            }
            b']' | b')' => {
                depth = depth.checked_sub(1)?;
                if depth == 0 {
                    return text.get(begin?..at).map(str::trim);
                }
            }
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crs::ReferenceSystem;

    const SOURCE: &str = r#"GEOGCRS["old [1900]",DATUM["mine",ELLIPSOID["Bessel 1841",6377397.155,299.1528128]],CS[ellipsoidal,2],AXIS["longitude",east],AXIS["latitude",north],ANGLEUNIT["degree",0.0174532925199433]]"#;
    const NAMES: [&str; 7] = [
        "X-axis translation",
        "Y-axis translation",
        "Z-axis translation",
        "X-axis rotation",
        "Y-axis rotation",
        "Z-axis rotation",
        "Scale difference",
    ];

    fn bound(target: &str, method: &str, numbers: &[&str]) -> String {
        let parameters = NAMES.iter().zip(numbers);
        let parameters: String = parameters
            .map(|(name, number)| format!(r#",PARAMETER["{name}",{number}]"#))
            .collect();
        format!(
            r#"BOUNDCRS[SOURCECRS[{SOURCE}],TARGETCRS[GEOGCRS["{target}",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],ANGLEUNIT["degree",0.0174532925199433]]],ABRIDGEDTRANSFORMATION["way",METHOD["{method}"]{parameters}]]"#
        )
    }

    fn found(text: &str) -> Vec<f64> {
        let root = Node::parse(text).expect("a tree");
        let (source, numbers) = parts(&root, text).expect("bound");
        assert_eq!(source, SOURCE);
        numbers
    }

    fn are_close(found: &[f64], wanted: &[f64]) -> bool {
        found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6)
    }

    #[test]
    fn the_shift_is_found_in_projs_units_and_signs() {
        let seven = ["1", "-2", "3", "0.4", "-0.5", "0.6", "1.000007"];
        let wanted = [1.0, -2.0, 3.0, 0.4, -0.5, 0.6, 7.0];
        let position = bound("WGS 84", "Position Vector transformation", &seven);
        assert!(are_close(&found(&position), &wanted));
        let turned = [1.0, -2.0, 3.0, -0.4, 0.5, -0.6, 7.0];
        let frame = bound("WGS 84", "Coordinate Frame rotation", &seven);
        assert!(are_close(&found(&frame), &turned));
        let by_code = position.replace(
            r#"METHOD["Position Vector transformation"]"#,
            r#"METHOD["x",ID["EPSG",9607]]"#,
        );
        assert!(are_close(&found(&by_code), &turned));
        let in_units = [
            "1",
            "-2",
            "3",
            r#"400,ANGLEUNIT["milliarc-second",4.84813681109536E-09]"#,
            "-0.5",
            "0.6",
            r#"7,SCALEUNIT["parts per million",1E-06]"#,
        ];
        let in_units = bound("WGS 84", "Position Vector transformation", &in_units);
        assert!(are_close(&found(&in_units), &wanted));
        let lengths = [r#"0.001,LENGTHUNIT["kilometre",1000]"#, "-2", "3"];
        let lengths = bound("WGS 84", "Geocentric translations", &lengths);
        assert!(are_close(&found(&lengths), &wanted[..3]));
        let three = bound("WGS 84", "Geocentric translations", &seven[..3]);
        assert!(are_close(&found(&three), &wanted[..3]));
    }

    #[test]
    fn a_way_that_is_no_shift_to_wgs84_leaves_the_system_as_it_is() {
        let elsewhere = bound("ETRS89", "Geocentric translations", &["1", "2", "3"]);
        let grid = bound("WGS 84", "NTv2", &[]);
        for text in [&elsewhere, &grid] {
            assert!(found(text).len() < 3);
            let (system, _) = ReferenceSystem::from_wkt(text);
            assert_eq!(system, ReferenceSystem::from_wkt(SOURCE).0);
        }
        for text in [SOURCE, "BOUNDCRS[\"x\"]", "BOUNDCRS[SOURCECRS[\"x\"]"] {
            let root = Node::parse(text);
            assert!(root.is_none_or(|root| parts(&root, text).is_none()));
        }
    }

    #[test]
    fn a_bound_part_of_a_compound_system_keeps_its_heights() {
        let across = bound("WGS 84", "Geocentric translations", &["100", "0", "0"]);
        let up =
            r#"VERTCRS["up",VDATUM["sea"],CS[vertical,1],AXIS["up",up],LENGTHUNIT["foot",0.3048]]"#;
        let text = format!(r#"COMPOUNDCRS["both",{across},{up}]"#);
        let (system, vertical) = ReferenceSystem::from_wkt(&text);
        let system = system.expect("a system");
        assert_eq!(vertical.map(|up| up.metres), Some(0.3048));
        let plain = ReferenceSystem::from_wkt(SOURCE).0.expect("a system");
        let shifted = system.to_lonlat((90.0, 0.0)).expect("on the globe");
        let own = plain.to_lonlat((90.0, 0.0)).expect("on the globe");
        // 100 m away from the meridian's plane.
        assert!((own.0 - shifted.0 - 100.0 / 111_320.0).abs() < 1e-5);
    }
}
