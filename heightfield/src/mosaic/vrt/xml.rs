//! XML read piece by piece: of a long document one piece at a time is in memory.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::super::super::BadRaster;
use super::super::super::input::FileBytes;

/// No piece of a VRT is deeper or has more elements.
const DEEPEST: u32 = 16;
const MOST_ELEMENTS: usize = 100_000;
/// No element of a VRT has more attributes.
const MOST_ATTRIBUTES: usize = 64;

/// An element with what is in it.
#[derive(Clone, Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    attributes: Vec<(String, String)>,
    /// All text in it, but that of its children.
    pub(super) text: String,
    pub(super) children: Vec<Element>,
    /// Nothing is in it, and no end of its own follows.
    pub(super) is_empty: bool,
}

impl Element {
    /// An attribute's value.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let mut all = self.attributes.iter();
        all.find(|(own, _)| own == name)
            .map(|(_, value)| value.as_str())
    }

    /// The first child of a name.
    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// The text of the first child of a name, without white space around it.
    pub(super) fn text_of(&self, name: &str) -> Option<&str> {
        self.child(name).map(|child| child.text.trim())
    }
}

/// A document that is read from its beginning to its end.
pub(super) struct Xml<'t> {
    reader: Reader<&'t [u8]>,
}

impl<'t> Xml<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self {
            reader: Reader::from_str(text),
        }
    }

    /// The start of the next element inside of the one that was entered last; `None` at
    /// that one's end.
    pub(super) fn next(&mut self) -> Result<Option<Element>, BadRaster> {
        loop {
            match self.event()? {
                Event::Start(start) => return element(&start, false).map(Some),
                Event::Empty(start) => return element(&start, true).map(Some),
                Event::End(_) => return Ok(None),
                Event::Eof => return Err(BadRaster::Truncated("VRT: it ends too early".into())),
                _ => {}
            }
        }
    }

    /// Reads the rest of an element whose start was read.
    pub(super) fn whole(&mut self, mut element: Element) -> Result<Element, BadRaster> {
        let mut elements = 0;
        if !element.is_empty {
            self.fill(&mut element, 0, &mut elements)?;
        }
        Ok(element)
    }

    fn fill(
        &mut self,
        into: &mut Element,
        depth: u32,
        elements: &mut usize,
    ) -> Result<(), BadRaster> {
        *elements += 1;
        loop {
            if depth > DEEPEST || *elements > MOST_ELEMENTS {
                return Err(BadRaster::damaged(format!(
                    "VRT: its element {} is too large or too deep",
                    into.name
                )));
            }
            match self.event()? {
                Event::Start(start) => {
                    let mut child = element(&start, false)?;
                    self.fill(&mut child, depth + 1, elements)?;
                    into.children.push(child);
                }
                Event::Empty(start) => {
                    *elements += 1;
                    into.children.push(element(&start, true)?);
                }
                Event::Text(text) => into.text.push_str(&text),
                Event::CData(text) => into.text.push_str(&text),
                Event::GeneralRef(name) => into.text.push_str(&resolved(&name)?),
                Event::End(_) => return Ok(()),
                Event::Eof => {
                    return Err(BadRaster::Truncated(format!(
                        "VRT: it ends in {}",
                        into.name
                    )));
                }
                _ => {}
            }
        }
    }

    fn event(&mut self) -> Result<Event<'t>, BadRaster> {
        match self.reader.read_event() {
            Ok(Event::DocType(_)) => Err(BadRaster::damaged(
                "VRT: it declares a document type, which no VRT does",
            )),
            Ok(event) => Ok(event),
            Err(fault) => {
                let at = self.reader.error_position();
                Err(BadRaster::damaged(format!("VRT: at byte {at}: {fault}")))
            }
        }
    }
}

fn element(start: &BytesStart<'_>, is_empty: bool) -> Result<Element, BadRaster> {
    let wrong = |what: String| BadRaster::damaged(format!("VRT: {what}"));
    let mut attributes = Vec::new();
    for attribute in start.attributes().with_checks(false) {
        let attribute = attribute.map_err(|fault| wrong(fault.to_string()))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        let value = value.map_err(|fault| wrong(fault.to_string()))?;
        attributes.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        if attributes.len() > MOST_ATTRIBUTES {
            return Err(wrong(format!(
                "an element has more than {MOST_ATTRIBUTES} attributes"
            )));
        }
    }
    Ok(Element {
        name: start.name().as_ref().to_owned(),
        attributes,
        is_empty,
        ..Element::default()
    })
}

/// The text that a reference as `&amp;` or `&#233;` stands for.
fn resolved(reference: &quick_xml::events::BytesRef<'_>) -> Result<String, BadRaster> {
    let unknown = || {
        BadRaster::damaged(format!(
            "VRT: it uses the unknown entity &{};",
            &**reference
        ))
    };
    if let Some(character) = reference.resolve_char_ref().map_err(|_| unknown())? {
        return Ok(character.to_string());
    }
    let known = quick_xml::escape::resolve_predefined_entity(reference);
    known.map(str::to_owned).ok_or_else(unknown)
}

/// Whether a file is a VRT: nothing else begins like one.
pub(crate) fn is_vrt(input: &FileBytes) -> Result<bool, BadRaster> {
    let head = input.head(256)?;
    let head = String::from_utf8_lossy(&head);
    let head = head.trim_start_matches('\u{feff}').trim_start();
    Ok(head.starts_with("<VRTDataset") || (input.extension() == "vrt" && head.starts_with('<')))
}

/// A number, also NaN.
pub(super) fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    text.parse().ok()
}
