//! A STAC document, read piece by piece: an item of many is handed over before the next is read,
//! lists and texts are bounded, and what is not asked for is skipped.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{DeserializeSeed, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::super::super::BadRaster;
use super::super::super::input::FileBytes;

/// No text is longer, bytes: URLs with a key behind them have some hundreds.
const LONGEST_TEXT: usize = 8192;
/// No item has more assets.
const MOST_ASSETS: usize = 512;
/// No document has more links that lead to items, catalogs or pages.
const MOST_LINKS: usize = super::MOST_ITEMS;

/// What a document says beside the items of a collection, which were handed over.
#[derive(Default)]
pub(super) struct Document {
    /// `Feature`, `FeatureCollection`, `Catalog` or `Collection`.
    pub(super) kind: String,
    /// The item that it is, where it is one.
    pub(super) item: Feature,
    /// Links to items, catalogs and further pages.
    pub(super) links: Vec<Link>,
    /// Whether it is a collection of items.
    pub(super) has_features: bool,
}

/// An item.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Feature {
    pub(super) id: Option<Text>,
    pub(super) properties: Option<Properties>,
    pub(super) assets: Assets,
}

/// What is asked of an item's properties.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Properties {
    pub(super) datetime: Option<Text>,
    pub(super) start_datetime: Option<Text>,
    pub(super) end_datetime: Option<Text>,
    #[serde(rename = "proj:code")]
    code: Option<Text>,
    #[serde(rename = "proj:epsg")]
    epsg: Option<u32>,
    #[serde(rename = "proj:shape")]
    shape: Option<Few<f64, 2>>,
    #[serde(rename = "proj:transform")]
    transform: Option<Few<f64, 9>>,
}

/// A file of an item.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    href: Text,
    #[serde(rename = "type")]
    pub(super) media: Option<Text>,
    pub(super) roles: Option<Few<Text, 32>>,
    #[serde(rename = "proj:code")]
    code: Option<Text>,
    #[serde(rename = "proj:epsg")]
    epsg: Option<u32>,
    #[serde(rename = "proj:shape")]
    shape: Option<Few<f64, 2>>,
    #[serde(rename = "proj:transform")]
    transform: Option<Few<f64, 9>>,
}

/// The projection extension's fields, of an asset where it has them, else of its item.
pub(super) struct Projection<'f> {
    pub(super) code: Option<&'f str>,
    pub(super) epsg: Option<u32>,
    /// Rows and columns.
    pub(super) shape: Option<&'f [f64]>,
    pub(super) transform: Option<&'f [f64]>,
}

impl Asset {
    pub(super) fn href(&self) -> &str {
        &self.href.0
    }

    pub(super) fn projection<'f>(&'f self, item: Option<&'f Properties>) -> Projection<'f> {
        let has_own = self.code.is_some() || self.epsg.is_some();
        let of_item = item.filter(|_| !has_own);
        let text = |text: &'f Option<Text>| text.as_ref().map(|text| text.0.as_str());
        let shape = self
            .shape
            .as_ref()
            .or(item.and_then(|it| it.shape.as_ref()));
        let transform = self.transform.as_ref();
        let transform = transform.or(item.and_then(|it| it.transform.as_ref()));
        Projection {
            code: text(&self.code).or(of_item.and_then(|it| text(&it.code))),
            epsg: self.epsg.or(of_item.and_then(|it| it.epsg)),
            shape: shape.map(|shape| shape.0.as_slice()),
            transform: transform.map(|transform| transform.0.as_slice()),
        }
    }
}

/// A link.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Link {
    href: Text,
    rel: Text,
}

impl Link {
    pub(super) fn href(&self) -> &str {
        &self.href.0
    }

    pub(super) fn relation(&self) -> &str {
        &self.rel.0
    }
}

/// Reads a document, and hands over the items of a collection as they come.
pub(super) fn read(
    input: &FileBytes,
    take: &mut dyn FnMut(Feature) -> Result<(), BadRaster>,
) -> Result<Document, BadRaster> {
    let mut reader = input.reader()?;
    skip_mark(&mut reader)?;
    let mut refused = None;
    let mut json = serde_json::Deserializer::from_reader(reader);
    let seed = Whole {
        take,
        refused: &mut refused,
    };
    let read = seed.deserialize(&mut json);
    let read = read.and_then(|document| json.end().map(|()| document));
    match (refused, read) {
        (Some(fault), _) => Err(fault),
        (None, Ok(document)) => Ok(document),
        (None, Err(error)) if error.is_io() => Err(BadRaster::from_io(error.into(), "its text")),
        (None, Err(error)) if error.is_eof() => Err(BadRaster::Truncated(format!("STAC: {error}"))),
        (None, Err(error)) => Err(BadRaster::damaged(format!("STAC: {error}"))),
    }
}

/// Some programs write a byte order mark before their text.
fn skip_mark(reader: &mut dyn std::io::BufRead) -> Result<(), BadRaster> {
    let begins = reader.fill_buf();
    let begins = begins.map_err(|error| BadRaster::from_io(error, "its text"))?;
    if begins.starts_with(b"\xef\xbb\xbf") {
        reader.consume(3);
    }
    Ok(())
}

/// A document as a whole.
struct Whole<'t> {
    take: &'t mut dyn FnMut(Feature) -> Result<(), BadRaster>,
    /// Why an item was not taken.
    refused: &'t mut Option<BadRaster>,
}

impl<'de> DeserializeSeed<'de> for Whole<'_> {
    type Value = Document;

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<Document, D::Error> {
        json.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Whole<'_> {
    type Value = Document;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a STAC document")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Document, A::Error> {
        let mut document = Document::default();
        while let Some(Text(key)) = map.next_key()? {
            match key.as_str() {
                "type" => document.kind = map.next_value::<Option<Text>>()?.unwrap_or_default().0,
                "id" => document.item.id = map.next_value()?,
                "properties" => document.item.properties = map.next_value()?,
                // Those of a collection are no item's, and any other document may have any.
                "assets" => document.item.assets = map.next_value()?,
                "links" => {
                    document.links = map.next_value::<Option<Links>>()?.unwrap_or_default().0;
                }
                "features" => {
                    document.has_features = true;
                    map.next_value_seed(Features {
                        take: &mut *self.take,
                        refused: &mut *self.refused,
                    })?;
                }
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        Ok(document)
    }
}

/// The items of a collection.
struct Features<'t> {
    take: &'t mut dyn FnMut(Feature) -> Result<(), BadRaster>,
    refused: &'t mut Option<BadRaster>,
}

impl<'de> DeserializeSeed<'de> for Features<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Features<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of items")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while let Some(feature) = list.next_element()? {
            if let Err(fault) = (self.take)(feature) {
                *self.refused = Some(fault);
                return Err(A::Error::custom("an item was not taken"));
            }
        }
        Ok(())
    }
}

/// A text of a bounded length.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Text(pub(super) String);

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        struct OfText;
        impl Visitor<'_> for OfText {
            type Value = Text;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a text")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Text, E> {
                match text.len() <= LONGEST_TEXT {
                    true => Ok(Text(text.to_owned())),
                    false => Err(E::custom(format!("a text of {} bytes", text.len()))),
                }
            }
        }
        json.deserialize_str(OfText)
    }
}

/// A list of at most so many.
#[derive(Clone, Debug, Default)]
pub(super) struct Few<T, const MOST: usize>(pub(super) Vec<T>);

impl<'de, T: Deserialize<'de>, const MOST: usize> Deserialize<'de> for Few<T, MOST> {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        struct OfFew<T, const MOST: usize>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for OfFew<T, MOST> {
            type Value = Few<T, MOST>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of at most {MOST}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut few = Vec::new();
                while let Some(one) = list.next_element()? {
                    if few.len() == MOST {
                        return Err(A::Error::custom(format!("a list of more than {MOST}")));
                    }
                    few.push(one);
                }
                Ok(Few(few))
            }
        }
        json.deserialize_seq(OfFew(PhantomData))
    }
}

/// Assets by their names.
#[derive(Default)]
pub(super) struct Assets(pub(super) Vec<(String, Asset)>);

impl<'de> Deserialize<'de> for Assets {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        struct OfAssets;
        impl<'de> Visitor<'de> for OfAssets {
            type Value = Assets;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("assets by their names")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Assets, A::Error> {
                let mut assets = Vec::new();
                while let Some((Text(name), asset)) = map.next_entry()? {
                    if assets.len() == MOST_ASSETS {
                        return Err(A::Error::custom(format!("more than {MOST_ASSETS} assets")));
                    }
                    assets.push((name, asset));
                }
                Ok(Assets(assets))
            }
        }
        json.deserialize_map(OfAssets)
    }
}

/// Links that lead on.
#[derive(Default)]
struct Links(Vec<Link>);

impl<'de> Deserialize<'de> for Links {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        struct OfLinks;
        impl<'de> Visitor<'de> for OfLinks {
            type Value = Links;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of links")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Links, A::Error> {
                let mut links = Vec::new();
                while let Some(link) = list.next_element::<Link>()? {
                    if !["item", "child", "next"].contains(&link.relation()) {
                        continue;
                    }
                    if links.len() == MOST_LINKS {
                        return Err(A::Error::custom(format!("more than {MOST_LINKS} links")));
                    }
                    links.push(link);
                }
                Ok(Links(links))
            }
        }
        json.deserialize_seq(OfLinks)
    }
}
