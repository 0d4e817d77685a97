//! The texts in XML, by GDAL's own parser.

use crate::error::Error;
use crate::functions::XmlNode;
use crate::libgdal::Libgdal;
use crate::text::{from_c, to_c};

/// `CXT_Text` and `CXT_Attribute`.
const TEXT: i32 = 1;
const ATTRIBUTE: i32 = 2;
const RELATIVE: &str = "relativeToVRT";

/// A text of a VRT, which may name a file.
#[derive(Debug)]
pub(crate) struct Text {
    /// Its element or attribute.
    pub(crate) node: String,
    pub(crate) value: String,
    /// True if it is a name relative to the VRT.
    pub(crate) is_relative: bool,
}

/// Returns the texts in XML, each with the name of its element or attribute.
///
/// # Errors
/// [`Error::Refused`], [`Error::ZeroByte`].
pub(crate) fn texts(library: &Libgdal, xml: &str) -> Result<Vec<Text>, Error> {
    let xml = to_c(xml)?;
    let functions = &library.functions;
    let mut texts = Vec::new();
    // SAFETY: GDAL owns the nodes until they are freed, once; none is changed.
    unsafe {
        (functions.CPLErrorReset)();
        let root = (functions.CPLParseXMLString)(xml.as_ptr());
        if root.is_null() {
            return Err(library.refused("it is no XML"));
        }
        let mut open: Vec<(*const XmlNode, String, bool)> = vec![(root, String::new(), false)];
        while let Some((node, inside, is_relative)) = open.pop() {
            let Some(node) = node.as_ref() else {
                continue;
            };
            let value = from_c(node.value).unwrap_or_default();
            open.push((node.next, inside.clone(), is_relative));
            match node.kind {
                TEXT => texts.push(Text {
                    node: inside,
                    value,
                    is_relative,
                }),
                _ => open.push((node.child, value, is_relative_to_vrt(node))),
            }
        }
        (functions.CPLDestroyXMLNode)(root);
    }
    Ok(texts)
}

/// Returns true if an element has the attribute that marks a name as relative to the VRT.
///
/// # Safety
/// The node is GDAL's.
unsafe fn is_relative_to_vrt(element: &XmlNode) -> bool {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let mut child = element.child.as_ref();
        while let Some(node) = child {
            let is_it = node.kind == ATTRIBUTE
                && from_c(node.value).is_some_and(|name| name.eq_ignore_ascii_case(RELATIVE));
            if is_it {
                let text = node.child.as_ref().and_then(|text| from_c(text.value));
                return text.is_some_and(|text| text.trim().parse().unwrap_or(0) != 0);
            }
            child = node.next.as_ref();
        }
    }
    false
}
