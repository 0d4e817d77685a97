//! The reference system of a code or a text: a code from `definition`, a text without a known code
//! from libgdal (`by_gdal`).

use std::sync::{Mutex, PoisonError};

use super::datum::Datum;
use super::system::ReferenceSystem;
use super::unit::Unit;
use super::wkt::Node;
use super::{Vertical, by_gdal, definition};

/// Max cached texts: tiles of one terrain have the same text, and libgdal is slow to identify it.
const MAX_REMEMBERED: usize = 16;
static REMEMBERED: Mutex<Vec<(String, Option<ReferenceSystem>)>> = Mutex::new(Vec::new());

impl ReferenceSystem {
    /// Returns the system with an EPSG code; `None` if the code is unknown.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        definition::of_code(code)
    }

    /// Reads the system that a text describes, and the vertical system that may follow it. A code
    /// in the text overrides its parameters, which other programs round. Without a code, the
    /// projection comes from libgdal, if it is installed.
    pub(crate) fn from_wkt(text: &str) -> (Option<Self>, Option<Vertical>) {
        let text = text.trim().trim_end_matches('\0');
        let Some((root, second)) = Node::parse_both(text) else {
            return (None, None);
        };
        let up = second.as_ref().and_then(Vertical::of);
        (
            root.horizontal().and_then(|node| Self::of_node(node, text)),
            up.or_else(|| Vertical::of_compound(&root)),
        )
    }

    fn of_node(node: &Node, text: &str) -> Option<Self> {
        let by_code = node.epsg().and_then(Self::from_code);
        // A unit beside a code overrides the code's, as in GDAL.
        let by_code = by_code.map(|system| match (node.is_projected(), node.unit()) {
            (true, Some(metres)) => system.in_units_of(metres),
            _ => system,
        });
        by_code.or_else(|| Self::by_gdal(text)).or_else(|| {
            let unit = node.unit_of_places().unwrap_or(Unit::Angle(1.0));
            Some(Self::new(node.name()?, unit, Datum::of(node.base(), None)))
        })
    }

    /// Returns the system of a text by libgdal: by its code, if libgdal finds a supported one.
    fn by_gdal(text: &str) -> Option<Self> {
        let remembered = || REMEMBERED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, system)) = remembered().iter().find(|(known, _)| known == text) {
            return system.clone();
        }
        let system = by_gdal::of_text(text)
            .and_then(|found| found.code.and_then(Self::from_code).or(found.described));
        let mut remembered = remembered();
        remembered.truncate(MAX_REMEMBERED - 1);
        remembered.insert(0, (text.to_owned(), system.clone()));
        system
    }
}
