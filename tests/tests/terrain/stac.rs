//! A STAC as one terrain: items that GDAL reads, and the command for items that it does not read.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::tiffs::{DATA, floats_in_a_strip, placed, tiff};
use hapterra_tests::{hapterra_binary, memory_limit};
use heightfield::{OpenOptions, Raster, gdal};
use serde_json::{Value, json};

/// Side of a tile in samples, and of a cell in metres.
const SIDE: u32 = 40;
const CELL: f64 = 30.0;

/// Returns a GeoTIFF of single floats in a UTM zone, its first sample's outer corner at `corner`.
fn geotiff(corner: [f64; 2], zone: u16, height: impl Fn(u32, u32) -> f32) -> Vec<u8> {
    let places = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    let data = places.flat_map(|(column, row)| height(column, row).to_le_bytes());
    let mut image = floats_in_a_strip([SIDE; 2], DATA);
    image.extend(placed(corner, CELL, zone));
    tiff(&data.collect::<Vec<_>>(), &[image])
}

/// Returns the corner of a tile in the square of tiles, counted from the north-west.
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

/// Writes two adjacent tiles. Returns their items, which name them by `href`.
fn tiles(folder: &Path, href: impl Fn(&str) -> String) -> Vec<Value> {
    let each = [0, 1].map(|across| {
        let name = format!("tiles/{across}.tif");
        let height = |column: u32, row: u32| ((across * SIDE + column) * 7 + row * 3) as f32;
        fs::write(
            folder.join(&name),
            geotiff(corner(across, 0), 32611, height),
        )
        .expect("written");
        let id = format!("tile-{across}");
        let mut item = item(&id, &href(&name), corner(across, 0), "2021-04-22T00:00:00Z");
        // The form for old versions of GDAL.
        item["stac_extensions"] =
            json!(["https://stac-extensions.github.io/projection/v1.0.0/schema.json"]);
        item["collection"] = json!("tiles");
        item["properties"]["proj:epsg"] = json!(32611);
        item
    });
    each.into()
}

/// Same as `tiles`, with absolute names, which all versions of GDAL find.
fn absolute(folder: &Path) -> Vec<Value> {
    tiles(folder, |name| folder.join(name).display().to_string())
}

fn open(path: &Path) -> Raster {
    let raster = Raster::open(path, &OpenOptions::default());
    raster.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn info(path: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(hapterra_binary());
    let output = command.arg("info").arg(path).args(more).output();
    output.expect("it runs")
}

fn output_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs the command that a refusal names, and opens its output.
fn built(folder: &Path, refusal: &Output) -> Raster {
    let printed = output_text(refusal);
    assert_eq!(refusal.status.code(), Some(1), "{printed}");
    let (_, command) = printed.split_once("gdalbuildvrt ").expect("a command");
    let (command, _) = command.split_once(';').expect("an end");
    let made = Command::new("sh")
        .args(["-c", &format!("gdalbuildvrt {command}")])
        .current_dir(folder)
        .output()
        .expect("a shell");
    assert!(made.status.success(), "{command}: {made:?}");
    let files = fs::read_dir(folder).expect("listed");
    let files = files.map(|file| file.expect("an entry").path());
    let mut vrts = files.filter(|file| file.extension().is_some_and(|end| end == "vrt"));
    open(&vrts.next().expect("a VRT"))
}

fn assert_is_both(raster: &Raster) {
    assert_eq!((raster.columns(), raster.rows()), (2 * SIDE, SIDE));
    for column in 0..2 * SIDE {
        assert_eq!(raster.height(column, SIDE - 1), f64::from(7 * column));
    }
}

fn has_gdal() -> bool {
    gdal()
        .inspect_err(|why| eprintln!("skipped: {why}"))
        .is_ok()
}

#[test]
fn items_with_absolute_paths_form_one_terrain() {
    if !has_gdal() {
        return;
    }
    let place = folder();
    let items = absolute(place.path());
    assert_is_both(&open(&write(place.path(), "all.json", &collection(&items))));
}

#[test]
fn item_placed_elsewhere_than_its_file_is_named() {
    if !has_gdal() {
        return;
    }
    let place = folder();
    let mut items = absolute(place.path());
    items[1]["properties"]["proj:transform"][2] = json!(corner(1, 0)[0] + 4.0 * CELL);
    let document = write(place.path(), "all.json", &collection(&items));
    let output = info(&document, &[]);
    assert!(
        output_text(&output).contains("item tile-1"),
        "{}",
        output_text(&output)
    );
    assert_is_both(&built(place.path(), &output));
}

/// File names relative to the document, and items without a place.
#[test]
fn unsupported_items_are_refused_with_a_working_command() {
    if !has_gdal() {
        return;
    }
    for without in ["proj:transform", "stac_extensions"] {
        let place = folder();
        let mut items = tiles(place.path(), |name| format!("./{name}"));
        for item in &mut items {
            item.as_object_mut().expect("an item").remove(without);
            let properties = item["properties"].as_object_mut();
            properties.expect("properties").remove(without);
        }
        let document = write(place.path(), "all.json", &collection(&items));
        assert_is_both(&built(place.path(), &info(&document, &[])));
    }
}

#[test]
fn assets_whose_names_differ_are_chosen_by_a_pattern() {
    if !has_gdal() {
        return;
    }
    let place = folder();
    let mut items = tiles(place.path(), |name| name.to_owned());
    for (number, item) in items.iter_mut().enumerate() {
        let fine = item["assets"]["data"].clone();
        item["assets"] = json!({
            format!("dem_{number}_0.5"): fine,
            format!("dem_{number}_2"): fine,
            "thumbnail": {"href": "x.png", "type": "image/png"},
        });
    }
    let document = write(place.path(), "all.json", &collection(&items));
    let output = info(&document, &[]);
    let arguments = output_text(&output);
    assert!(
        arguments.contains("--input variable=dem_0_0.5|dem_0_2"),
        "{arguments}"
    );
    assert_is_both(&built(
        place.path(),
        &info(&document, &["--input", "variable=dem_*_2"]),
    ));
    let arguments = output_text(&info(&document, &["--input", "variable=dsm_*"]));
    assert!(arguments.contains("no asset of that name"), "{arguments}");
}

/// A document of any size is an error, within the program's own address space.
#[test]
fn oversized_or_deep_documents_fail_in_bounded_memory() {
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
    let many = vec!["{\"assets\":{\"a\":{\"href\":\"a.tif\"}}}"; 300_000].join(",");
    let many = write("many.json", &format!("{{\"features\":[{many}]}}"));
    for path in [&huge, &deep, &many] {
        let output = memory_limit::info(path, &[]);
        let printed = output_text(&output);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(
            printed.starts_with("error: ") && printed.contains("hint: "),
            "{printed}"
        );
    }
}
