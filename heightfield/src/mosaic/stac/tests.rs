//! What is taken from a document, and what bounds there are.

use std::path::{Path, PathBuf};

use super::super::super::input::FileBytes;
use super::super::super::{BadRaster, OpenOptions};
use super::document::{self, Feature};
use super::{asset, decode, href, is_json, item, sources};

fn bytes(text: &str) -> FileBytes {
    FileBytes::unpacked("items.json", text.as_bytes().to_vec())
}

fn feature(text: &str) -> Feature {
    let document = document::read(&bytes(text), &mut |_| Ok(()));
    document.expect("a document").item
}

/// The href of the chosen asset, or the error.
fn chosen(assets: &str, asked: Option<&str>) -> Result<String, String> {
    let item = feature(&format!(r#"{{"type":"Feature","assets":{{{assets}}}}}"#));
    let chosen = asset::chosen(&item, "x1", asked);
    chosen
        .map(|asset| asset.href().to_owned())
        .map_err(|fault| fault.to_string())
}

#[test]
fn the_asset_with_heights_is_told_by_role_media_type_and_name() {
    let tiff = |name: &str, roles: &str| {
        format!(
            r#""{name}":{{"href":"{name}.tif","type":"image/tiff; application=geotiff","roles":[{roles}]}}"#
        )
    };
    let picture = r#""thumbnail":{"href":"t.png","type":"image/png","roles":["thumbnail"]}"#;
    let of = |assets: &[&str]| chosen(&assets.join(","), None);
    let only = tiff("a", r#""data""#);
    assert_eq!(of(&[picture, &only]).as_deref(), Ok("a.tif"));
    // Without roles, and without a type.
    assert_eq!(
        of(&[picture, r#""x":{"href":"x.TIF?k=1"}"#]).as_deref(),
        Ok("x.TIF?k=1")
    );
    assert_eq!(
        of(&[r#""x":{"href":"N44W072.hgt","type":"application/octet-stream"}"#]).as_deref(),
        Ok("N44W072.hgt")
    );
    // A role of heights before others, a name of heights among equals.
    let elevation = tiff("b", r#""data","Elevation""#);
    assert_eq!(of(&[&only, &elevation]).as_deref(), Ok("b.tif"));
    let (dem, flags) = (tiff("dem", r#""data""#), tiff("matchtag", r#""data""#));
    assert_eq!(of(&[&flags, &dem]).as_deref(), Ok("dem.tif"));
    let shade = tiff("hillshade", r#""visual""#);
    assert_eq!(of(&[&shade, &tiff("z", "")]).as_deref(), Ok("z.tif"));
    // Several, none, and the one that was asked for.
    let error = of(&[&only, &flags]).expect_err("two");
    assert!(
        error.contains("x1 several") && error.contains("a, matchtag"),
        "{error}"
    );
    let error = of(&[picture, &shade]).expect_err("none");
    assert!(
        error.contains("x1 no asset") && error.contains("hillshade"),
        "{error}"
    );
    assert_eq!(
        chosen(&shade, Some("hillshade")).as_deref(),
        Ok("hillshade.tif")
    );
    let error = chosen(&shade, Some("dem")).expect_err("not there");
    assert!(
        error.contains("asset dem") && error.contains("hillshade"),
        "{error}"
    );
}

#[test]
fn an_href_leads_to_a_place_beside_its_document() {
    let of = |href: &str, document: &str| {
        href::resolved(href, Path::new(document)).map_err(|fault| fault.to_string())
    };
    for (href, document, there) in [
        ("a.tif", "/d/items.json", "/d/a.tif"),
        ("./t/a.tif", "items.json", "./t/a.tif"),
        ("/e/a.tif", "/d/items.json", "/e/a.tif"),
        ("file:///e/a.tif", "/d/items.json", "/e/a.tif"),
        (
            "https://h/a.tif?k=1",
            "/d/items.json",
            "https://h/a.tif?k=1",
        ),
        ("s3://b/a.tif", "https://h/d/items.json", "s3://b/a.tif"),
        ("/vsis3/b/a.tif", "/d/items.json", "s3://b/a.tif"),
        ("../a.tif", "https://h/d/e/items.json", "https://h/d/a.tif"),
        ("/a.tif", "https://h/d/e/items.json", "https://h/a.tif"),
        (
            "a.tif",
            "https://h/d/items.json?key=1",
            "https://h/d/a.tif?key=1",
        ),
    ] {
        assert_eq!(
            of(href, document),
            Ok(PathBuf::from(there)),
            "{href} of {document}"
        );
    }
    for (href, document) in [
        ("", "/d/items.json"),
        (" ", "/d/items.json"),
        ("/vsizip/a.zip/a.tif", "/d/items.json"),
        ("file:///etc/a.tif", "https://h/items.json"),
    ] {
        assert!(of(href, document).is_err(), "{href} of {document}");
    }
}

#[test]
fn times_are_compared_as_times() {
    let when = |properties: &str| {
        let text = format!(
            r#"{{"type":"Feature","id":"x","properties":{{{properties}}},"assets":{{"a":{{"href":"a.tif"}}}}}}"#
        );
        let item = item::listed(feature(&text), Path::new("items.json"), None);
        item.expect("an item").when
    };
    let early = when(r#""datetime":"2021-01-01T00:30:00+02:00""#);
    let late = when(r#""datetime":"2020-12-31T23:00:00.5Z""#);
    assert!(early.is_some() && early < late);
    let range = when(
        r#""datetime":null,"start_datetime":"2019-01-01T00:00:00Z","end_datetime":"2021-06-01T00:00:00Z""#,
    );
    assert!(range > late);
    assert_eq!(when(r#""datetime":"yesterday""#), None);
    assert!(when(r#""title":"x""#) < early);
}

/// Deep, long and endless documents are errors, and take no memory.
#[test]
fn a_document_is_bounded_in_every_way() {
    let item = |inside: &str| format!(r#"{{"type":"Feature","id":"x",{inside}}}"#);
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    let long = "x".repeat(10_000);
    let numbers = "1,".repeat(100_000) + "1";
    let assets: Vec<_> = (0..1000).map(|n| format!(r#""{n}":{{}}"#)).collect();
    let cases = [
        // What is not asked for is skipped, however deep it is.
        (item(&format!(r#""geometry":{deep}"#)), "no asset"),
        (
            item(&format!(r#""assets":{{"a":{{"href":"{long}"}}}}"#)),
            "10000 bytes",
        ),
        (
            item(&format!(r#""properties":{{"proj:transform":[{numbers}]}}"#)),
            "more than 9",
        ),
        (
            item(&format!(r#""assets":{{{}}}"#, assets.join(","))),
            "512 assets",
        ),
        (item(&format!(r#""assets":{deep}"#)), "damaged"),
        (item(r#""assets":"none""#), "damaged"),
        (item(r#""assets":{}"#)[..20].to_owned(), "truncated"),
        (
            r#"{"type":"FeatureCollection","features":[7]}"#.to_owned(),
            "damaged",
        ),
        (
            r#"{"type":"FeatureCollection","features":{}}"#.to_owned(),
            "damaged",
        ),
        (
            r#"{"type":"FeatureCollection","features":[]}"#.to_owned(),
            "no items",
        ),
        (r#"{"type":"Catalog","links":[]}"#.to_owned(), "no items"),
        (
            r#"{"type":"Catalog","links":[{"rel":"child","href":"sub/catalog.json"}]}"#.to_owned(),
            "sub/catalog.json",
        ),
        (r#"{"hello":"world"}"#.to_owned(), "no STAC"),
        (
            r#"{"type":"Feature","geometry":null}"#.to_owned(),
            "no asset",
        ),
    ];
    for (text, words) in cases {
        let input = bytes(&text);
        assert!(is_json(&input).expect("readable"));
        let error = decode(&input, Path::new("items.json"), &OpenOptions::default());
        let error = error.expect_err(words).to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn a_million_items_are_refused_before_they_are_held() {
    const ITEM: &str = r#"{"assets":{"a":{"href":"a.tif"}}}"#;
    let items = vec![ITEM; 1_000_000].join(",");
    let input = bytes(&format!(
        r#"{{"type":"FeatureCollection","features":[{items}]}}"#
    ));
    let error = decode(&input, Path::new("items.json"), &OpenOptions::default());
    match error {
        Err(BadRaster::NoTiles(why)) => assert!(why.contains("more than 131072 items"), "{why}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn all_assets_of_all_items_are_inputs() {
    let text = r#"{"features":[
        {"assets":{"a":{"href":"a.tif"},"b":{"href":"sub/b.png"}}},
        {"assets":{"a":{"href":"a.tif"},"c":{"href":"https://h/c.tif"}}}]}"#;
    let files = sources(&bytes(text), Path::new("/d/items.json")).expect("files");
    let expected = [
        "/d/a.tif",
        "/d/items.json",
        "/d/sub/b.png",
        "https://h/c.tif",
    ];
    assert_eq!(files, expected.map(PathBuf::from));
}
