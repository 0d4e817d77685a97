//! Content of archives, as files of GDAL's own file systems, and the texts of XML.

use std::path::Path;

use crate::error::Error;
use crate::functions::XmlNode;
use crate::library::Library;
use crate::text::{from_c, list_from_c, path_to_c, to_c};
use crate::vrt::Named;

/// `SEEK_END`.
const END: i32 = 2;
/// `CXT_Text` and `CXT_Attribute`.
const TEXT: i32 = 1;
const ATTRIBUTE: i32 = 2;
const RELATIVE: &str = "relativeToVRT";

impl Library {
    /// Names of the files in a folder of GDAL's, as `/vsizip/{tiles.zip}`, and in those in it.
    ///
    /// # Errors
    /// [`Error::Refused`], [`Error::ZeroByte`].
    pub fn entries(&self, folder: &Path) -> Result<Vec<String>, Error> {
        let path = path_to_c(folder)?;
        let functions = &self.loaded.functions;
        // SAFETY: the path stays for the call; the list is copied, and given back once.
        let names = unsafe {
            (functions.CPLErrorReset)();
            let list = (functions.VSIReadDirRecursive)(path.as_ptr());
            if list.is_null() {
                return Err(self.loaded.refused("it is no archive that can be read"));
            }
            let names = list_from_c(list.cast());
            (functions.CSLDestroy)(list);
            names
        };
        let files = names.into_iter().filter(|name| !name.ends_with('/'));
        Ok(files.collect())
    }

    /// Bytes of a file, also of one in an archive; none where it cannot be read.
    #[must_use]
    pub fn length(&self, path: &Path) -> Option<u64> {
        let path = path_to_c(path).ok()?;
        let functions = &self.loaded.functions;
        // SAFETY: the texts stay for the call; the file is closed once, and not used afterwards.
        unsafe {
            let file = (functions.VSIFOpenL)(path.as_ptr(), c"rb".as_ptr());
            if file.is_null() {
                return None;
            }
            let found = (functions.VSIFSeekL)(file, 0, END);
            let length = (functions.VSIFTellL)(file);
            (functions.VSIFCloseL)(file);
            (found == 0).then_some(length)
        }
    }

    /// The texts of XML, each with the name of the element or attribute that it is in.
    ///
    /// # Errors
    /// [`Error::Refused`], [`Error::ZeroByte`].
    pub(crate) fn xml_texts(&self, xml: &str) -> Result<Vec<Named>, Error> {
        let xml = to_c(xml)?;
        let functions = &self.loaded.functions;
        let mut texts = Vec::new();
        // SAFETY: the nodes are GDAL's until they are given back, once; none is changed.
        unsafe {
            (functions.CPLErrorReset)();
            let root = (functions.CPLParseXMLString)(xml.as_ptr());
            if root.is_null() {
                return Err(self.loaded.refused("it is no XML"));
            }
            let mut open: Vec<(*const XmlNode, String, bool)> = vec![(root, String::new(), false)];
            while let Some((node, inside, is_relative)) = open.pop() {
                let Some(node) = node.as_ref() else {
                    continue;
                };
                let value = from_c(node.value).unwrap_or_default();
                open.push((node.next, inside.clone(), is_relative));
                match node.kind {
                    TEXT => texts.push(Named {
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
}

/// Returns true if an element has the attribute with which a VRT says that a name is one beside it.
///
/// # Safety
/// The node is GDAL's.
unsafe fn is_relative_to_vrt(element: &XmlNode) -> bool {
    // SAFETY: by the caller.
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
