//! Reference systems as text (WKT 1 of OGC, GDAL and Esri, WKT 2), as the tree that
//! `proj4wkt`'s parser finds.

use proj4wkt::parser::{Attribute, Processor, parse};

/// Texts that are longer than this describe no reference system.
const LONGEST: usize = 1 << 16;
/// Real systems nest to about 8 brackets; the parser calls itself for each.
const DEEPEST: usize = 32;
/// Real systems have some hundred brackets. However a text hides how deep it nests, a
/// thread's stack is enough for the parser to call itself so often.
const MOST: usize = 512;

/// A node, as `UNIT["metre", 1]`.
#[derive(Debug)]
pub(super) struct Node {
    keyword: String,
    /// Quoted texts and numbers, in order.
    values: Vec<String>,
    children: Vec<Node>,
}

/// Puts the parser's nodes together.
struct Tree;

impl<'a> Processor<'a> for Tree {
    // One of the kinds that the parser takes; there is no error here.
    type Err = std::io::Error;
    type Output = Node;

    fn process<I>(&self, key: &'a str, _: usize, attributes: I) -> std::io::Result<Node>
    where
        I: Iterator<Item = Attribute<'a, Node>>,
    {
        let mut node = Node {
            keyword: key.to_ascii_uppercase(),
            values: Vec::new(),
            children: Vec::new(),
        };
        for attribute in attributes {
            match attribute {
                Attribute::Quoted(text) | Attribute::Number(text) | Attribute::Label(text) => {
                    node.values.push(text.to_owned());
                }
                Attribute::Keyword(_, child) => node.children.push(child),
            }
        }
        Ok(node)
    }
}

impl Node {
    /// The tree of a text; `None` where it is no such text.
    pub(super) fn parse(text: &str) -> Option<Self> {
        is_sensible(text).then(|| parse(text, &Tree).ok()).flatten()
    }

    /// Whether its keyword is one of some.
    pub(super) fn is(&self, keywords: &[&str]) -> bool {
        keywords.contains(&self.keyword.as_str())
    }

    /// The first node directly below it with one of some keywords.
    pub(super) fn child(&self, keywords: &[&str]) -> Option<&Self> {
        self.children.iter().find(|child| child.is(keywords))
    }

    /// The nodes directly below it with one of some keywords.
    pub(super) fn all<'n>(&'n self, keywords: &'n [&str]) -> impl Iterator<Item = &'n Self> {
        self.children.iter().filter(|child| child.is(keywords))
    }

    /// Its name: the first of its values.
    pub(super) fn name(&self) -> Option<&str> {
        let name = self.values.first()?.trim();
        (!name.is_empty()).then_some(name)
    }

    /// EPSG's code for it, where it names one.
    pub(super) fn epsg(&self) -> Option<u16> {
        let authority = self.child(&["AUTHORITY", "ID"])?;
        let is_epsg = authority.name()?.eq_ignore_ascii_case("EPSG");
        authority.values.get(1)?.parse().ok().filter(|_| is_epsg)
    }

    /// One of its values, as a number.
    pub(super) fn number(&self, index: usize) -> Option<f64> {
        let number: f64 = self.values.get(index)?.parse().ok()?;
        number.is_finite().then_some(number)
    }

    /// Those of its values that are numbers.
    pub(super) fn numbers(&self) -> Vec<f64> {
        (self.values.iter())
            .filter_map(|value| value.parse().ok())
            .collect()
    }

    /// Size of its unit in metres or radians, by a node of its own or of an axis.
    pub(super) fn unit(&self) -> Option<f64> {
        const UNITS: [&str; 4] = ["UNIT", "LENGTHUNIT", "ANGLEUNIT", "SCALEUNIT"];
        let of_axis = || self.child(&["AXIS"])?.child(&UNITS);
        let unit = self.child(&UNITS).or_else(of_axis)?;
        let size: f64 = unit.values.get(1)?.parse().ok()?;
        (size.is_finite() && size > 0.0).then_some(size)
    }

    /// Whether one of its axes points that way.
    pub(super) fn has_axis(&self, direction: &str) -> bool {
        let axes = self.children.iter().filter(|child| child.is(&["AXIS"]));
        let mut ends = axes.filter_map(|axis| axis.values.get(1));
        ends.any(|end| end.eq_ignore_ascii_case(direction))
    }
}

/// Returns true if the parser may read a text: it is short, has brackets, and these nest
/// as those of real systems do. What stands in quotes is no bracket.
fn is_sensible(text: &str) -> bool {
    let (mut opened, mut depth, mut deepest) = (0_usize, 0_usize, 0);
    let mut is_quoted = false;
    for byte in text.bytes() {
        match byte {
            b'"' => is_quoted = !is_quoted,
            b'[' | b'(' if !is_quoted => (opened, depth) = (opened + 1, depth + 1),
            b']' | b')' if !is_quoted => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    text.len() <= LONGEST && (1..=MOST).contains(&opened) && deepest <= DEEPEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_no_reference_system_is_none() {
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
        assert!(
            Node::parse(&deep).is_none(),
            "too deep for the stack of a thread"
        );
        // Brackets in quotes close nothing.
        let hidden = "A[\"]\",".repeat(40) + "\"x\"" + &"]".repeat(40);
        assert!(Node::parse(&hidden).is_none(), "deep");
        let wide = format!("A[\"x\"{}]", ",B[1]".repeat(MOST));
        assert!(Node::parse(&wide).is_none(), "wide");
    }

    #[test]
    fn the_code_is_that_of_the_system_and_not_of_its_parts() {
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
