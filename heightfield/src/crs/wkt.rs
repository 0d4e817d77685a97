//! Reference systems as text (WKT 1 of OGC, GDAL and Esri, WKT 2), as a tree.

use super::unit::Unit;

/// Max size of a text that may describe a reference system, bytes.
const MAX_BYTES: usize = 1 << 16;
/// Max depth of brackets; real systems nest to about 8.
const MAX_LEVELS: usize = 32;
/// Max number of nodes; real systems have some hundred.
const MAX_NODES: usize = 512;

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 5] = [
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEODCRS",
    "GEODETICCRS",
];
/// Keywords of the geographic system in a projected one.
const BASES: [&str; 6] = [
    "GEOGCS",
    "BASEGEOGCRS",
    "BASEGEODCRS",
    "GEOGCRS",
    "GEODCRS",
    "GEODETICCRS",
];

/// A node, as `UNIT["metre", 1]`.
#[derive(Debug)]
pub(super) struct Node {
    keyword: String,
    /// Quoted texts and numbers, in order.
    values: Vec<String>,
    children: Vec<Node>,
}

/// A parser that consumes a text.
struct Reader<'t> {
    remaining: &'t str,
    /// Number of nodes that may still be read.
    nodes: usize,
}

impl<'t> Reader<'t> {
    /// Reads a node, with at most `levels` nested in it.
    fn node(&mut self, levels: usize) -> Option<Node> {
        let keyword = self.word();
        self.nodes = self.nodes.checked_sub(1)?;
        if keyword.is_empty() || !self.skip(&['[', '(']) {
            return None;
        }
        let mut node = Node {
            keyword: keyword.to_ascii_uppercase(),
            values: Vec::new(),
            children: Vec::new(),
        };
        loop {
            let before = self.remaining;
            if self.skip(&['"']) {
                node.values.push(self.quoted()?);
            } else {
                let word = self.word();
                if self.remaining.starts_with(['[', '(']) {
                    self.remaining = before;
                    node.children.push(self.node(levels.checked_sub(1)?)?);
                } else if !word.is_empty() {
                    node.values.push(word.to_owned());
                }
            }
            if self.skip(&[']', ')']) {
                let is_empty = node.values.is_empty() && node.children.is_empty();
                return (!is_empty).then_some(node);
            }
            if !self.skip(&[',']) {
                return None;
            }
        }
    }

    /// Consumes one of some characters, after spaces.
    fn skip(&mut self, characters: &[char]) -> bool {
        let left = self.remaining.trim_start();
        let remaining = left.strip_prefix(characters);
        self.remaining = remaining.unwrap_or(left);
        remaining.is_some()
    }

    /// Consumes a keyword or a number.
    fn word(&mut self) -> &'t str {
        let left = self.remaining.trim_start();
        let end = left.find(['[', ']', '(', ')', ',', '"']);
        let (word, remaining) = left.split_at(end.unwrap_or(left.len()));
        self.remaining = remaining;
        word.trim_end()
    }

    /// Consumes a quoted text after its opening quote; two quotes in a row mean one.
    fn quoted(&mut self) -> Option<String> {
        let mut text = String::new();
        loop {
            let (part, remaining) = self.remaining.split_once('"')?;
            text += part;
            self.remaining = remaining;
            match remaining.strip_prefix('"') {
                Some(remaining) => self.remaining = remaining,
                None => return Some(text),
            }
            text.push('"');
        }
    }
}

impl Node {
    /// Returns the tree of a text; `None` if it is not WKT.
    pub(super) fn parse(text: &str) -> Option<Self> {
        Self::parse_both(text).map(|(first, _)| first)
    }

    /// Returns the trees of a text: Esri's programs write a vertical system after the horizontal
    /// one, after a comma.
    pub(super) fn parse_both(text: &str) -> Option<(Self, Option<Self>)> {
        let mut reader = Reader {
            remaining: text,
            nodes: MAX_NODES,
        };
        if text.len() > MAX_BYTES {
            return None;
        }
        let first = reader.node(MAX_LEVELS)?;
        let second = reader.skip(&[',']).then(|| reader.node(MAX_LEVELS));
        Some((first, second.flatten()))
    }

    /// Returns the geographic or projected system: itself, or a part of a compound or bound one.
    pub(super) fn horizontal(&self) -> Option<&Self> {
        match self.keyword.as_str() {
            "BOUNDCRS" => self.child(&["SOURCECRS"])?.children.first()?.horizontal(),
            "COMPD_CS" | "COMPOUNDCRS" => {
                let mut parts = self.children.iter();
                parts.find_map(Self::horizontal)
            }
            _ => (self.is_projected() || self.is(&GEOGRAPHIC)).then_some(self),
        }
    }

    /// Returns true for a projected system.
    pub(super) fn is_projected(&self) -> bool {
        self.is(&PROJECTED)
    }

    /// Returns the geographic system of a projected one, or itself.
    pub(super) fn base(&self) -> &Self {
        self.child(&BASES).unwrap_or(self)
    }

    /// Returns the unit of coordinates; `None` for an angle without a stated unit.
    pub(super) fn unit_of_places(&self) -> Option<Unit> {
        match self.is_projected() {
            true => Some(Unit::Length(self.unit())),
            false => self.unit().map(Unit::of_radians),
        }
    }

    /// Returns true if its keyword is in a list.
    pub(super) fn is(&self, keywords: &[&str]) -> bool {
        keywords.contains(&self.keyword.as_str())
    }

    /// Returns its first child with one of some keywords.
    pub(super) fn child(&self, keywords: &[&str]) -> Option<&Self> {
        self.children.iter().find(|child| child.is(keywords))
    }

    /// Returns its name: the first of its values.
    pub(super) fn name(&self) -> Option<&str> {
        let name = self.values.first()?.trim();
        (!name.is_empty()).then_some(name)
    }

    /// Returns its EPSG code, if stated.
    pub(super) fn epsg(&self) -> Option<u16> {
        let authority = self.child(&["AUTHORITY", "ID"])?;
        let is_epsg = authority.name()?.eq_ignore_ascii_case("EPSG");
        authority.values.get(1)?.parse().ok().filter(|_| is_epsg)
    }

    /// Returns one of its values as a number.
    pub(super) fn number(&self, index: usize) -> Option<f64> {
        let number: f64 = self.values.get(index)?.parse().ok()?;
        number.is_finite().then_some(number)
    }

    /// Returns its unit in metres or radians, from its own node or an axis.
    pub(super) fn unit(&self) -> Option<f64> {
        const UNITS: [&str; 4] = ["UNIT", "LENGTHUNIT", "ANGLEUNIT", "SCALEUNIT"];
        let of_axis = || self.child(&["AXIS"])?.child(&UNITS);
        let unit = self.child(&UNITS).or_else(of_axis)?;
        let size: f64 = unit.values.get(1)?.parse().ok()?;
        (size.is_finite() && size > 0.0).then_some(size)
    }

    /// Returns true if one of its axes has this direction.
    pub(super) fn has_axis(&self, direction: &str) -> bool {
        let axes = self.children.iter().filter(|child| child.is(&["AXIS"]));
        let mut ends = axes.filter_map(|axis| axis.values.get(1));
        ends.any(|end| end.eq_ignore_ascii_case(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Safety: 29.
    #[test]
    fn invalid_wkt_is_no_reference_system() {
        for text in [
            "",
            "metres",
            "PROJCS[",
            "PROJCS[]",
            "[[",
            &"A[".repeat(100_000),
        ] {
            assert!(Node::parse(text).is_none(), "{text:.20}");
        }
        assert!(Node::parse(&format!("{}\"x\"{}", "A[".repeat(20), "]".repeat(20))).is_some());
        let deep = format!("{}\"x\"{}", "A[".repeat(40), "]".repeat(40));
        assert!(Node::parse(&deep).is_none(), "too deep");
        // Brackets in quotes do not close a node.
        let hidden = "A[\"]\",".repeat(40) + "\"x\"" + &"]".repeat(40);
        assert!(Node::parse(&hidden).is_none(), "deep");
        let wide = format!("A[\"x\"{}]", ",B[1]".repeat(MAX_NODES));
        assert!(Node::parse(&wide).is_none(), "wide");
    }

    #[test]
    fn code_is_that_of_the_system_not_of_its_parts() {
        let text = r#"PROJCS["mine",GEOGCS["b",AUTHORITY["EPSG","4326"]],UNIT["foot",0.3048]]"#;
        let node = Node::parse(text).expect("a tree");
        assert_eq!(
            (node.name(), node.epsg(), node.unit()),
            (Some("mine"), None, Some(0.3048))
        );
        let base = node.child(&["GEOGCS"]).expect("its base");
        assert_eq!(base.epsg(), Some(4326));
    }
}
