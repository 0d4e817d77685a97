//! A streaming reader for XML of bounded depth: GDAL's notes beside or in a file.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// Max depth of elements, and max number of attributes.
const MAX_DEPTH: usize = 16;
const MAX_ATTRIBUTES: usize = 64;

/// A closed element.
#[derive(Debug, Default)]
pub(super) struct Element {
    /// Its name.
    pub(super) name: String,
    attributes: Vec<(String, String)>,
    /// The text in it, without its children's.
    pub(super) text: String,
}

impl Element {
    /// Returns an attribute's value.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let own = self.attributes.iter().find(|(own, _)| own == name);
        own.map(|(_, value)| value.as_str())
    }
}

/// Calls `visit` at the end of each element, with the stack of open elements, the outermost first
/// and itself last.
///
/// # Errors
/// Names the part that is not XML or not supported.
pub(super) fn for_each(text: &str, mut visit: impl FnMut(&[Element])) -> Result<(), String> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Element> = Vec::new();
    let mut has_any = false;
    loop {
        match reader.read_event().map_err(|fault| fault.to_string())? {
            Event::Start(start) => open.push(element(&start)?),
            Event::Empty(start) => {
                open.push(element(&start)?);
                visit(&open);
                open.pop();
            }
            Event::End(_) => {
                visit(&open);
                open.pop();
            }
            Event::Text(more) => push(&mut open, &more),
            Event::CData(more) => push(&mut open, &more),
            Event::GeneralRef(name) => push(&mut open, &resolved(&name)?),
            Event::DocType(_) => return Err("it declares a document type".into()),
            Event::Eof if open.is_empty() && has_any => return Ok(()),
            Event::Eof => return Err("it ends too early".into()),
            _ => {}
        }
        has_any |= !open.is_empty();
        if open.len() > MAX_DEPTH {
            return Err(format!("it is deeper than {MAX_DEPTH} elements"));
        }
    }
}

fn push(open: &mut [Element], more: &str) {
    if let Some(last) = open.last_mut() {
        last.text.push_str(more);
    }
}

fn element(start: &BytesStart<'_>) -> Result<Element, String> {
    let mut attributes = Vec::new();
    for attribute in start.attributes().with_checks(false) {
        let attribute = attribute.map_err(|fault| fault.to_string())?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        let value = value.map_err(|fault| fault.to_string())?;
        attributes.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        if attributes.len() > MAX_ATTRIBUTES {
            return Err(format!(
                "an element has more than {MAX_ATTRIBUTES} attributes"
            ));
        }
    }
    Ok(Element {
        name: start.name().as_ref().to_owned(),
        attributes,
        text: String::new(),
    })
}

/// Returns the text of a reference such as `&amp;` or `&#233;`.
fn resolved(reference: &quick_xml::events::BytesRef<'_>) -> Result<String, String> {
    let unknown = || format!("it uses the unknown entity &{};", &**reference);
    if let Some(character) = reference.resolve_char_ref().map_err(|_| unknown())? {
        return Ok(character.to_string());
    }
    let known = quick_xml::escape::resolve_predefined_entity(reference);
    known.map(str::to_owned).ok_or_else(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(text: &str) -> Result<Vec<String>, String> {
        let mut paths = Vec::new();
        for_each(text, |open| {
            let names: Vec<_> = open.iter().map(|element| element.name.as_str()).collect();
            paths.push(format!(
                "{}={}",
                names.join("/"),
                open[open.len() - 1].text.trim()
            ));
        })?;
        Ok(paths)
    }

    #[test]
    fn visited_elements_include_their_ancestors() {
        let text = "<?xml version='1.0'?><a><b k='1'>x &amp; &#233;</b><c/></a>";
        assert_eq!(paths(text).expect("XML"), ["a/b=x & é", "a/c=", "a="]);
    }

    #[test]
    fn hostile_notes_are_refused() {
        let deep = "<a>".repeat(100_000);
        let attributes = format!("<a {}/>", "b='' ".repeat(100_000));
        let bomb = "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>";
        for text in [
            &deep,
            &attributes,
            bomb,
            "",
            "a",
            "<a>",
            "<a></b>",
            "<a>&x;</a>",
        ] {
            assert!(paths(text).is_err(), "{}", &text[..text.len().min(40)]);
        }
    }
}
