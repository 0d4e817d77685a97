//! A STAC as one terrain: what its items say is the index, and the files are those of a folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::tiffs::{DATA, floats_in_a_strip, placed, tiff};
use hapterra_tests::{bounded, hapterra_binary};
use heightfield::{OpenOptions, Raster};
use serde_json::{Value, json};

/// Samples of a tile each way, and the side of a cell, metres.
const SIDE: u32 = 40;
const CELL: f64 = 30.0;

/// A GeoTIFF of single floats in a UTM zone, its first sample's outer corner at `corner`.
fn geotiff(corner: [f64; 2], zone: u16, height: impl Fn(u32, u32) -> f32) -> Vec<u8> {
    let places = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    let data = places.flat_map(|(column, row)| height(column, row).to_le_bytes());
    let mut image = floats_in_a_strip([SIDE; 2], DATA);
    image.extend(placed(corner, CELL, zone));
    tiff(&data.collect::<Vec<_>>(), &[image])
}

/// The corner of the tile at a place of the square of tiles, from the north-west.
fn corner(across: u32, down: u32) -> [f64; 2] {
    let side = f64::from(SIDE) * CELL;
    [
        400_000.0 + f64::from(across) * side,
        3_800_000.0 - f64::from(down) * side,
    ]
}

fn item(id: &str, href: &str, [x, y]: [f64; 2], datetime: &str) -> Value {
    json!({
        "type": "Feature", "stac_version": "1.0.0", "id": id, "geometry": null,
        "properties": {
            "datetime": datetime, "proj:code": "EPSG:32611", "proj:shape": [SIDE, SIDE],
            "proj:transform": [CELL, 0.0, x, 0.0, -CELL, y, 0, 0, 1],
        },
        "links": [{"rel": "self", "href": "x.json"}],
        "assets": {
            "thumbnail": {"href": "x.png", "type": "image/png", "roles": ["thumbnail"]},
            "data": {
                "href": href, "roles": ["data"],
                "type": "image/tiff; application=geotiff; profile=cloud-optimized",
            },
        },
    })
}

fn collection(items: &[Value]) -> Value {
    json!({"type": "FeatureCollection", "features": items})
}

fn write(folder: &Path, name: &str, document: &Value) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, document.to_string()).expect("written");
    path
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("tiles")).expect("a folder inside");
    folder
}

const PLACES: [(u32, u32); 4] = [(0, 0), (1, 0), (0, 1), (2, 2)];

/// Four tiles with gaps between, and their items.
fn tiles(folder: &Path) -> Vec<Value> {
    let each = PLACES.iter().map(|&(across, down)| {
        let name = format!("tiles/{across}{down}.tif");
        let height = |column: u32, row: u32| {
            ((across * SIDE + column) * 7 + (down * SIDE + row) * 3) as f32 * 0.25
        };
        let corner = corner(across, down);
        fs::write(folder.join(&name), geotiff(corner, 32611, height)).expect("written");
        let id = format!("tile-{across}{down}");
        item(&id, &format!("./{name}"), corner, "2021-04-22T00:00:00Z")
    });
    each.collect()
}

fn open(path: &Path) -> Raster {
    let raster = Raster::open(path, &OpenOptions::default());
    raster.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn refused(path: &Path) -> String {
    match Raster::open(path, &OpenOptions::default()) {
        Ok(_) => panic!("{} opens", path.display()),
        Err(error) => error.to_string(),
    }
}

fn info(path: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(hapterra_binary());
    let output = command.arg("info").arg(path).args(more).output();
    output.expect("it runs")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn assert_same(one: &Raster, other: &Raster) {
    assert_eq!((one.columns(), one.rows()), (other.columns(), other.rows()));
    for level in 0..=4 {
        for row in 0..one.rows() >> level {
            let mut rows = [(); 2].map(|()| vec![0.0; (one.columns() >> level) as usize]);
            one.copy_row(level, row, 0, &mut rows[0]);
            other.copy_row(level, row, 0, &mut rows[1]);
            let [first, second] = rows.map(|row| {
                let bits = |height: f64| {
                    if height.is_nan() {
                        u64::MAX
                    } else {
                        height.to_bits()
                    }
                };
                row.into_iter().map(bits).collect::<Vec<_>>()
            });
            assert_eq!(first, second, "level {level}, row {row}");
        }
    }
}

fn edges(raster: &Raster) -> [f64; 4] {
    let bounds = raster.bounds().expect("a place");
    [bounds.west, bounds.south, bounds.east, bounds.north]
}

#[test]
fn the_items_of_a_stac_are_the_terrain_that_their_folder_is() {
    let place = folder();
    let items = tiles(place.path());
    let in_folder = open(&place.path().join("tiles"));
    let mut without = items.clone();
    for item in &mut without {
        item["properties"] = json!({"datetime": null});
    }
    // As older items have it.
    let mut older = items.clone();
    for item in &mut older {
        let properties = item["properties"].as_object_mut().expect("an object");
        properties.remove("proj:code");
        properties.insert("proj:epsg".into(), json!(32611));
        let shape = properties.remove("proj:shape").expect("a shape");
        item["assets"]["data"]["proj:shape"] = shape;
    }
    for (name, items) in [
        ("a.json", &items),
        ("b.geojson", &without),
        ("c.json", &older),
    ] {
        let raster = open(&write(place.path(), name, &collection(items)));
        assert_same(&raster, &in_folder);
        assert_eq!(edges(&raster), edges(&in_folder), "{name}");
        assert_eq!(
            raster.reference_system(),
            in_folder.reference_system(),
            "{name}"
        );
        assert_eq!(raster.cell(), in_folder.cell(), "{name}");
        assert!(
            raster.format().starts_with("STAC, 4 files as one"),
            "{}",
            raster.format()
        );
        let holes = (0..raster.rows()).flat_map(|row| (0..raster.columns()).map(move |c| (c, row)));
        let holes = holes
            .filter(|&(column, row)| raster.height(column, row).is_nan())
            .count();
        assert_eq!(holes, 5 * (SIDE * SIDE) as usize, "gaps are holes");
        assert!(raster.memory_bytes() <= 256 << 20);
    }
    // One item, and a catalog that links to items in another folder.
    let one = open(&write(place.path(), "one.json", &items[0]));
    assert_same(&one, &open(&place.path().join("tiles/00.tif")));
    fs::create_dir(place.path().join("items")).expect("a folder");
    let links = items.iter().enumerate().map(|(number, item)| {
        let mut item = item.clone();
        let href = item["assets"]["data"]["href"]
            .as_str()
            .expect("a text")
            .to_owned();
        item["assets"]["data"]["href"] = json!(format!("../{href}"));
        write(place.path(), &format!("items/{number}.json"), &item);
        json!({"rel": "item", "href": format!("./items/{number}.json")})
    });
    let catalog = json!({"type": "Catalog", "id": "all", "links": links.collect::<Vec<_>>()});
    let catalog = write(place.path(), "catalog.json", &catalog);
    assert_same(&open(&catalog), &in_folder);
    fs::write(place.path().join("items/2.json"), "{\"type\":\"Catalog\"}").expect("written");
    assert!(refused(&catalog).contains("2.json"));
}

#[test]
fn what_the_items_say_is_the_index_and_no_other_header_is_read() {
    let place = folder();
    let items = tiles(place.path());
    for name in ["10.tif", "01.tif"] {
        fs::write(place.path().join("tiles").join(name), b"gone").expect("written");
    }
    let document = write(place.path(), "all.json", &collection(&items));
    let raster = open(&document);
    assert_eq!((raster.columns(), raster.rows()), (3 * SIDE, 3 * SIDE));
    // Touched, they are holes, and each is warned of once.
    let output = info(&document, &[]);
    let told = told(&output);
    assert!(output.status.success(), "{told}");
    assert_eq!(told.matches("is a hole").count(), 2, "{told}");
    assert!(told.contains("10.tif") && told.contains("01.tif"), "{told}");
    // Without these words the header has to tell.
    let mut items = items;
    items[1]["properties"] = json!({});
    let error = refused(&write(place.path(), "all.json", &collection(&items)));
    assert!(error.contains("10.tif"), "{error}");
}

#[test]
fn where_items_overlap_the_newest_counts_and_then_the_last_by_name() {
    let place = folder();
    let mut items = Vec::new();
    for (id, height, datetime) in [
        ("c", 3.0, "2020-06-01T00:00:00Z"),
        // A later day by its own clock, an earlier time.
        ("d", 4.0, "2021-01-01T01:00:00+09:00"),
        ("a", 1.0, "2020-12-31T20:00:00Z"),
        ("b", 2.0, "2020-12-31T20:00:00Z"),
    ] {
        let name = format!("tiles/{id}.tif");
        // Each has a hole that the ones above it do not fill.
        let hole = u32::from(id.as_bytes()[0] - b'a');
        let tile = geotiff(corner(0, 0), 32611, |column, _| {
            if column < hole + 1 { f32::NAN } else { height }
        });
        fs::write(place.path().join(&name), tile).expect("written");
        items.push(item(id, &name, corner(0, 0), datetime));
    }
    for turn in 0..4 {
        items.rotate_left(turn);
        let raster = open(&write(place.path(), "all.json", &collection(&items)));
        let row: Vec<f64> = (0..4).map(|column| raster.height(column, 5)).collect();
        // On top b, below it a, below that d, and c.
        assert!(row[0].is_nan(), "{row:?}");
        assert_eq!(row[1..], [1.0, 2.0, 2.0]);
        assert_eq!(raster.height(SIDE - 1, 0), 2.0);
    }
}

#[test]
fn an_item_that_does_not_fit_is_named_with_the_command_that_mends_it() {
    let place = folder();
    let good = tiles(place.path());
    let refused_with = |change: &dyn Fn(&mut Value)| {
        let mut items = good.clone();
        change(&mut items[2]);
        let document = write(place.path(), "all.json", &collection(&items));
        let output = info(&document, &[]);
        assert_eq!(output.status.code(), Some(1));
        told(&output)
    };
    let transform = |cell: f64, x: f64| json!([cell, 0.0, x, 0.0, -cell, 3_798_800.0]);
    let told = refused_with(&|item| item["properties"]["proj:code"] = json!("EPSG:32612"));
    assert!(
        told.contains("STAC item tile-01") && told.contains("EPSG:32612"),
        "{told}"
    );
    assert!(
        told.contains("hint: ") && told.contains("gdalwarp") && told.contains("01.tif"),
        "{told}"
    );
    let told = refused_with(&|item| {
        item["properties"]["proj:transform"] = transform(10.0, 400_000.0);
    });
    assert!(
        told.contains("STAC item tile-01") && told.contains("its cells are 10 × 10"),
        "{told}"
    );
    let told = refused_with(&|item| {
        item["properties"]["proj:transform"] = transform(30.0, 400_011.0);
    });
    assert!(
        told.contains("STAC item tile-01") && told.contains("beside the common grid"),
        "{told}"
    );
    let told = refused_with(&|item| item["assets"] = json!({"x": {"href": "x.jpg"}}));
    assert!(
        told.contains("item tile-01 no asset") && told.contains("--asset x"),
        "{told}"
    );
    let told = refused_with(&|item| item["assets"] = json!({}));
    assert!(
        told.contains("no asset") && told.contains("hint: take a STAC"),
        "{told}"
    );
    // The first file is looked into: what its item says has to be so.
    let mut items = good.clone();
    items[0]["properties"]["proj:transform"][2] = json!(400_030.0);
    let error = refused(&write(place.path(), "all.json", &collection(&items)));
    assert!(
        error.contains("does not lie where its STAC item says"),
        "{error}"
    );
    // Another of another size than its item says is a hole, with a warning.
    let mut items = good.clone();
    items[1]["properties"]["proj:shape"] = json!([SIDE, SIDE - 1]);
    let document = write(place.path(), "all.json", &collection(&items));
    let output = info(&document, &[]);
    let told = self::told(&output);
    assert!(
        output.status.success() && told.contains("it had 39 × 40 samples"),
        "{told}"
    );
    assert!(open(&document).height(SIDE + 3, 2 * SIDE + 3).is_nan());
}

#[test]
fn an_asset_is_chosen_by_its_name_and_pages_are_told_of() {
    let place = folder();
    let mut items = tiles(place.path());
    for item in &mut items {
        let mut data = item["assets"]["data"].clone();
        data["roles"] = json!([]);
        item["assets"] = json!({"first": {"href": "no.tif"}, "second": data});
    }
    let document = write(place.path(), "all.json", &collection(&items));
    let error = refused(&document);
    assert!(
        error.contains("no.tif") || error.contains("several"),
        "{error}"
    );
    let output = info(&document, &["--asset", "second"]);
    assert!(output.status.success(), "{}", told(&output));
    let output = info(&document, &["--asset", "third"]);
    let words = told(&output);
    assert!(
        words.contains("no asset third") && words.contains("first, second"),
        "{words}"
    );
    let output = info(&place.path().join("tiles/00.tif"), &["--asset", "second"]);
    assert!(
        told(&output).contains("only a STAC has assets"),
        "{}",
        told(&output)
    );
    let mut page = collection(&tiles(place.path()));
    page["links"] = json!([{"rel": "next", "href": "https://h/search?page=2"}]);
    let raster = open(&write(place.path(), "page.json", &page));
    let remarks = raster.remarks();
    assert!(
        remarks.iter().any(|remark| remark.contains("one page")),
        "{remarks:?}"
    );
}

/// A document of any size ends in an error, in as much address space as the program itself needs.
#[test]
fn documents_that_are_too_large_or_too_deep_end_in_bounded_memory() {
    let place = folder();
    let write = |name: &str, text: &str| {
        let path = place.path().join(name);
        fs::write(&path, text).expect("written");
        path
    };
    let huge = write(
        "huge.json",
        "{\"type\":\"FeatureCollection\",\"features\":[",
    );
    let file = fs::OpenOptions::new()
        .write(true)
        .open(&huge)
        .expect("there");
    file.set_len(1 << 40).expect("a sparse file");
    let deep = write("deep.json", &format!("{{\"x\":{}", "[".repeat(1 << 20)));
    let many = vec!["{\"assets\":{\"a\":{\"href\":\"a.tif\"}}}"; 1_000_000].join(",");
    let many = write("many.json", &format!("{{\"features\":[{many}]}}"));
    let long = "x".repeat(60 << 20);
    let long = write(
        "long.json",
        &format!("{{\"type\":\"Feature\",\"id\":\"{long}\"}}"),
    );
    for (path, words) in [
        (&huge, "of 1099511627776 bytes"),
        (&deep, "truncated"),
        (&many, "more than 131072 items"),
        (&long, "a text of"),
    ] {
        let output = bounded::info(path, &[]);
        let told = told(&output);
        assert_eq!(output.status.code(), Some(1), "{told}");
        assert!(
            told.starts_with("error: ") && told.contains(words),
            "{told}"
        );
        assert!(told.contains("hint: "), "{told}");
    }
}
