//! Many files as one terrain, compared with GDAL: the single file that `gdalwarp`, or
//! `gdal_translate` of a VRT, makes of them has the same samples as the folder, the pattern and the
//! VRT, which libgdal reads. Without GDAL's programs it is skipped, with a message.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::{hapterra_binary, memory_limit};
use heightfield::{OpenOptions, Raster, Wait, files_read_with, gdal};

fn has_gdal() -> bool {
    let runs = Command::new("gdalbuildvrt").arg("--version").output();
    let runs = runs.is_ok_and(|output| output.status.success());
    if !runs {
        eprintln!("skipped: no gdalbuildvrt is installed");
    }
    runs
}

/// Returns a file of the shared collection, if it exists and GDAL is installed.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/dem");
    let path = path.join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    has_gdal().then_some(path)
}

/// Runs shell commands in a folder.
fn shell(folder: &Path, commands: &str) {
    let output = Command::new("sh")
        .args(["-e", "-c", commands])
        .current_dir(folder)
        .output();
    let output = output.expect("a shell");
    assert!(output.status.success(), "{commands}: {output:?}");
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn open(path: impl AsRef<Path>) -> Raster {
    let path = path.as_ref();
    let raster = Raster::open(path, &OpenOptions::default());
    raster.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn refused(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    // Some of them are read by GDAL.
    let options = OpenOptions {
        gdal: false,
        ..OpenOptions::default()
    };
    match Raster::open(path, &options) {
        Ok(_) => panic!("{} opens", path.display()),
        Err(error) => error.to_string(),
    }
}

fn info(path: &Path) -> Output {
    let output = Command::new(hapterra_binary())
        .arg("info")
        .arg(path)
        .output();
    output.expect("it runs")
}

fn output_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checks that all samples of levels 0 to 6 are equal. Returns the number of heights among them.
fn assert_same(many: &Raster, one: &Raster) -> usize {
    assert_eq!((many.columns(), many.rows()), (one.columns(), one.rows()));
    let mut rows = [(); 2].map(|()| vec![0.0; one.columns() as usize]);
    let mut heights = 0;
    for level in 0..=6 {
        for row in 0..one.rows() >> level {
            assert!(
                many.read_row(level, row, 0, &mut rows[0], Wait::UntilRead)
                    .is_complete()
            );
            assert!(
                one.read_row(level, row, 0, &mut rows[1], Wait::UntilRead)
                    .is_complete()
            );
            for (column, (many, one)) in rows[0].iter().zip(&rows[1]).enumerate() {
                let same = many == one || (many.is_nan() && one.is_nan());
                assert!(
                    same,
                    "level {level}, row {row}, column {column}: {many}, not {one}"
                );
            }
            if level == 0 {
                heights += rows[0].iter().filter(|height| !height.is_nan()).count();
            }
        }
    }
    let edges = |raster: &Raster| {
        let bounds = raster.bounds().expect("a place");
        [bounds.west, bounds.south, bounds.east, bounds.north]
    };
    let cell = one.cell().expect("a cell").east;
    for (many, one) in edges(many).into_iter().zip(edges(one)) {
        assert!((many - one).abs() < 0.05 * cell, "{many} {one}");
    }
    heights
}

/// Packings of the tiles of [`tiles`].
const PACKINGS: [&str; 6] = [
    "-co COMPRESS=NONE",
    "-co COMPRESS=LZW -co PREDICTOR=2",
    "-co COMPRESS=DEFLATE -co TILED=YES -co BLOCKXSIZE=64 -co BLOCKYSIZE=64",
    "-co COMPRESS=ZSTD -co TILED=YES",
    "-co COMPRESS=PACKBITS -co ENDIANNESS=BIG",
    "-co COMPRESS=DEFLATE -co BIGTIFF=YES",
];

/// Cuts a mountain range into tiles that overlap by 16 samples, each a metre higher than the one
/// before, so that overlaps show the order. One tile is left out.
fn tiles(folder: &Path, from: &Path) {
    for number in 0..12 {
        if number == 7 {
            continue;
        }
        let (column, row) = (number % 4 * 300, number / 4 * 210);
        let (columns, rows) = ((1197 - column).min(316), (643 - row).min(226));
        let packing = PACKINGS[number % PACKINGS.len()];
        shell(
            folder,
            &format!(
                "gdal_translate -q {packing} -srcwin {column} {row} {columns} {rows} \
                 -scale 0 1000 {number} {} '{}' t{number:02}.tif",
                number + 1000,
                from.display()
            ),
        );
    }
}

#[test]
fn folder_pattern_and_vrt_have_the_samples_of_gdals_merge() {
    let Some(range) = shared("real/bigtujunga.tif") else {
        return;
    };
    let place = folder();
    let at = place.path();
    std::fs::create_dir(at.join("tiles")).expect("a folder");
    tiles(&at.join("tiles"), &range);
    std::fs::write(at.join("tiles/README.txt"), "ncols of cabbage").expect("written");
    std::fs::write(at.join("tiles/t00.tif.aux.xml"), "<x").expect("written");
    shell(
        at,
        "gdalbuildvrt -q tiles/all.vrt tiles/*.tif; gdal_translate -q tiles/all.vrt one.tif; \
         gdalwarp -q -r near tiles/*.tif warped.tif",
    );
    let one = open(at.join("one.tif"));
    let many = open(at.join("tiles"));
    let heights = assert_same(&many, &one);
    // The missing tile is no-data, and others have heights.
    let all = (one.columns() * one.rows()) as usize;
    assert!(
        heights > all / 2 && heights < all - 50_000,
        "{heights} of {all}"
    );
    assert_same(&many, &open(at.join("warped.tif")));
    assert_same(&open(at.join("tiles/t*.tif")), &one);
    assert_same(&open(at.join("tiles/all.vrt")), &one);
    assert!(many.format().contains("11 files"), "{}", many.format());
    // The sidecar of the first tile is read with it.
    assert_eq!(files_read_with(&at.join("tiles")).len(), 12);
    assert_eq!(files_read_with(&at.join("tiles/all.vrt")).len(), 13);
}

#[test]
fn files_of_different_types_and_formats_are_one_terrain() {
    let Some(range) = shared("real/bigtujunga.tif") else {
        return;
    };
    let place = folder();
    let at = place.path();
    let range = range.display();
    std::fs::create_dir(at.join("tiles")).expect("a folder");
    shell(
        at,
        &format!(
            "gdal_translate -q -srcwin 0 0 300 200 -ot Float32 '{range}' tiles/a.tif
             gdal_translate -q -srcwin 300 0 200 200 -of AAIGrid '{range}' tiles/b.asc
             gdal_translate -q -srcwin 0 200 300 150 -ot Float64 -scale 0 3 0 1 -a_nodata nan '{range}' tiles/c.tif
             gdal_translate -q -srcwin 300 200 200 150 -of EHdr '{range}' tiles/d.bil
             gdalwarp -q -r near -ot Float64 -dstnodata nan tiles/a.tif tiles/b.asc tiles/c.tif tiles/d.bil one.tif"
        ),
    );
    let heights = assert_same(&open(at.join("tiles")), &open(at.join("one.tif")));
    assert!(heights > 150_000, "{heights}");
}

/// SRTM's tiles repeat the samples at their borders: neighbours lie on one grid, without a seam, on
/// both sides of the equator, of Greenwich and of the 180th meridian.
#[test]
fn neighbouring_srtm_tiles_join_without_a_seam() {
    let Some(globe) = shared("large/globe_g10g_10800x6000_i16_cog.tif") else {
        return;
    };
    let globe = globe.display();
    for (west, names) in [
        (-1, ["N00W001", "N00E000", "S01W001", "S01E000"]),
        (179, ["N00E179", "N00W180", "S01E179", "S01W180"]),
    ] {
        let place = folder();
        let at = place.path();
        std::fs::create_dir(at.join("tiles")).expect("a folder");
        // 2401 samples; the first and last lie on whole degrees.
        let half = 0.5 / 1200.0;
        let (left, right) = (f64::from(west) - half, f64::from(west) + 2.0 + half);
        let (top, bottom) = (1.0 + half, -1.0 - half);
        shell(
            at,
            &format!(
                "gdal_translate -q -srcwin 8200 2400 2401 2401 -a_srs EPSG:4326 \
                 -a_ullr {left} {top} {right} {bottom} '{globe}' one.tif"
            ),
        );
        for (number, name) in names.iter().enumerate() {
            let (column, row) = (number % 2 * 1200, number / 2 * 1200);
            let (west, north) = (
                [west, if west == 179 { -180 } else { 0 }][number % 2],
                1 - number as i32 / 2,
            );
            let (left, top) = (f64::from(west) - half, f64::from(north) + half);
            let (right, bottom) = (left + 1.0 + 2.0 * half, top - 1.0 - 2.0 * half);
            shell(
                at,
                &format!(
                    "gdal_translate -q -of SRTMHGT -srcwin {column} {row} 1201 1201 \
                     -a_ullr {left} {top} {right} {bottom} one.tif tiles/{name}.hgt"
                ),
            );
        }
        let many = open(at.join("tiles"));
        assert_eq!((many.columns(), many.rows()), (2401, 2401), "{west}");
        let heights = assert_same(&many, &open(at.join("one.tif")));
        assert!(heights == 2401 * 2401, "{heights}");
    }
}

#[test]
fn vrts_of_gdals_programs_have_the_samples_that_gdal_reads() {
    let Some(range) = shared("real/bigtujunga.tif") else {
        return;
    };
    let place = folder();
    let at = place.path();
    let range = range.display();
    shell(
        at,
        &format!(
            "gdal_translate -q -srcwin 0 0 400 300 '{range}' a.tif
             gdal_translate -q -srcwin 300 100 400 300 '{range}' b.tif
             gdal_translate -q -srcwin 500 0 200 100 -outsize 50% 50% '{range}' coarse.tif
             gdal_translate -q -srcwin 0 0 700 400 -a_nodata none -ot Float32 '{range}' plain.tif
             gdal_translate -q -srcwin 0 0 400 300 -a_nodata none '{range}' opaque.tif
             gdal_translate -q -of VRT '{range}' whole.vrt
             gdal_translate -q -of VRT -srcwin 35 41 500 300 '{range}' part.vrt
             gdal_translate -q -of VRT -scale 0 1000 -10 490 -ot Float32 '{range}' scaled.vrt
             gdal_translate -q -of VRT -scale 0 1000 0 333 '{range}' rounded.vrt
             gdalbuildvrt -q two.vrt a.tif b.tif
             gdalbuildvrt -q other.vrt b.tif a.tif
             gdalbuildvrt -q nodata.vrt -srcnodata 700 -vrtnodata -5 a.tif b.tif
             gdalbuildvrt -q fine.vrt -resolution highest a.tif coarse.tif
             gdalbuildvrt -q coarser.vrt -resolution lowest a.tif coarse.tif
             gdalbuildvrt -q user.vrt -resolution user -tr 60 60 a.tif b.tif
             gdalbuildvrt -q odd.vrt -resolution user -tr 45 45 a.tif b.tif
             gdalbuildvrt -q extent.vrt -te 384000 3797000 402000 3808000 a.tif b.tif
             gdalbuildvrt -q opaque.vrt -vrtnodata -7 b.tif opaque.tif
             gdal_translate -q -of VRT plain.tif plain.vrt
             for file in *.vrt; do gdal_translate -q $file ${{file%.vrt}}-one.tif; done"
        ),
    );
    for name in [
        "whole", "part", "scaled", "rounded", "two", "other", "nodata", "fine", "coarser", "user",
        "extent", "opaque", "plain",
    ] {
        let many = open(at.join(format!("{name}.vrt")));
        let one = open(at.join(format!("{name}-one.tif")));
        eprintln!("{name}: {}", many.format());
        let heights = assert_same(&many, &one);
        assert!(heights > 25_000, "{name}: {heights}");
    }
}

/// Writes a field as two tiles of plain ASCII, `gap` columns apart.
fn two_tiles(folder: &Path, gap: u32) {
    let tile = |west: u32, height: u32| {
        let row = format!("{height} {height} {height} {height}\n").repeat(3);
        format!("ncols 4\nnrows 3\nxllcorner {west}\nyllcorner 0\ncellsize 1\n{row}")
    };
    std::fs::write(folder.join("a.asc"), tile(0, 5)).expect("written");
    std::fs::write(folder.join("b.asc"), tile(4 + gap, 9)).expect("written");
}

/// Writes a VRT of 8 × 3 samples whose band contains `inside`.
fn vrt(folder: &Path, name: &str, inside: &str) -> PathBuf {
    let text = format!(
        "<VRTDataset rasterXSize=\"8\" rasterYSize=\"3\"><GeoTransform>0, 1, 0, 3, 0, -1</GeoTransform>\
         <VRTRasterBand dataType=\"Float32\" band=\"1\">{inside}</VRTRasterBand></VRTDataset>"
    );
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path
}

/// Returns a source of 4 × 3 samples at a position of a VRT.
fn source(file: &str, at: &str) -> String {
    format!(
        "<SimpleSource><SourceFilename relativeToVRT=\"1\">{file}</SourceFilename>\
         <SrcRect xOff=\"0\" yOff=\"0\" xSize=\"4\" ySize=\"3\"/><DstRect {at}/></SimpleSource>"
    )
}

#[test]
fn gaps_are_no_data_and_parts_outside_are_cut() {
    let place = folder();
    let at = place.path();
    two_tiles(at, 2);
    let many = open(at);
    assert_eq!((many.columns(), many.rows()), (10, 3));
    let row: Vec<f64> = (0..10).map(|column| many.height(column, 1)).collect();
    assert!(row[..4].iter().all(|height| *height == 5.0), "{row:?}");
    assert!(row[4..6].iter().all(|height| height.is_nan()), "{row:?}");
    assert!(row[6..].iter().all(|height| *height == 9.0), "{row:?}");
    if gdal().is_err() {
        eprintln!("skipped: there is no libgdal for a VRT");
        return;
    }
    let cut = source("a.asc", "xOff=\"-2\" yOff=\"1\" xSize=\"4\" ySize=\"3\"");
    let none = "<NoDataValue>-1</NoDataValue>".to_owned();
    let one = open(vrt(at, "cut.vrt", &(none + &cut)));
    let found = |column, row| one.height(column, row);
    // Row 2 is the northernmost; the source begins below it.
    assert!(found(0, 2).is_nan() && found(2, 0).is_nan());
    assert_eq!([found(0, 0), found(1, 1)], [5.0, 5.0]);
}

/// One bad file is no-data with a single warning that names it, and the others are rendered; a
/// fault in the index's data is an error.
#[test]
fn unreadable_file_is_no_data_with_one_warning() {
    let place = folder();
    let at = place.path();
    two_tiles(at, 0);
    let text = std::fs::read_to_string(at.join("b.asc")).expect("text");
    std::fs::write(at.join("b.asc"), &text[..text.len() - 8]).expect("cut");
    let many = open(at);
    assert_eq!(many.height(3, 1), 5.0);
    assert!(many.height(4, 1).is_nan());
    let output = info(at);
    assert!(output.status.success(), "{output:?}");
    let warnings = output_text(&output);
    assert_eq!(warnings.matches("b.asc").count(), 1, "{warnings}");
    assert!(warnings.contains("counts as no data"), "{warnings}");
    // Deleted during rendering, when only the header had been read.
    two_tiles(at, 2000);
    let many = open(at);
    std::fs::remove_file(at.join("a.asc")).expect("removed");
    assert_eq!(many.height(2005, 1), 9.0);
    // Its header is needed.
    std::fs::write(at.join("c.asc"), "ncols x\n").expect("written");
    let why = refused(at);
    assert!(
        why.contains("c.asc") && why.contains("not a number"),
        "{why}"
    );
}

#[test]
fn mismatched_file_is_refused_with_its_name_and_reason() {
    let place = folder();
    let at = place.path();
    for (other, why) in [
        (
            "xllcorner 4.5\nyllcorner 0\ncellsize 1",
            "0.50 cells beside",
        ),
        ("xllcorner 4\nyllcorner 0\ncellsize 2", "2 × 2 units"),
        ("xllcorner 4e12\nyllcorner 0\ncellsize 1", "too far away"),
        ("cellsize 1", "does not state its place"),
    ] {
        two_tiles(at, 0);
        let text = format!("ncols 2\nnrows 2\n{other}\n1 2 3 4\n");
        std::fs::write(at.join("b.asc"), text).expect("written");
        let found = refused(at);
        assert!(found.contains("b.asc") && found.contains(why), "{found}");
        let output = info(at);
        assert!(output_text(&output).contains("hint: "), "{output:?}");
    }
    // 2³² columns away, but on the grid.
    two_tiles(at, 0);
    let text = "ncols 2\nnrows 2\nxllcorner 2e9\nyllcorner -2e9\ncellsize 1\n1 2 3 4\n";
    std::fs::write(at.join("b.asc"), text).expect("written");
    assert_eq!(open(at).columns(), 2_000_000_002);
    for file in ["a.asc", "b.asc"] {
        std::fs::remove_file(at.join(file)).expect("removed");
    }
    assert!(refused(at).contains("no file in this folder"));
    std::fs::write(at.join("README.txt"), "ncols 3").expect("written");
    assert!(refused(at).contains("no file in this folder"));
    assert!(refused(at.join("*.tif")).contains("no terrain file matches"));
    assert!(refused(at.join("[")).contains("pattern"));
}

/// Any VRT results in a terrain or an error with a hint, within the memory for a terrain.
#[test]
fn malformed_vrts_end_in_bounded_memory() {
    let place = folder();
    let at = place.path();
    two_tiles(at, 0);
    let whole = "xOff=\"0\" yOff=\"0\" xSize=\"4\" ySize=\"3\"";
    let entities: String = (1..30)
        .map(|level| format!("<!ENTITY e{level} \"&e{0};&e{0};&e{0};&e{0};\">", level - 1))
        .collect();
    let bands = [
        ("self", source("self.vrt", whole)),
        (
            "nan",
            source("a.asc", "xOff=\"nan\" yOff=\"0\" xSize=\"4\" ySize=\"3\""),
        ),
        (
            "giant",
            source("a.asc", "xOff=\"0\" yOff=\"0\" xSize=\"1e300\" ySize=\"3\""),
        ),
        ("none", source("gone.tif", whole)),
        ("empty", String::new()),
        (
            "function",
            "<PixelFunctionType>sum</PixelFunctionType>".into(),
        ),
        ("unnamed", "<SimpleSource/>".into()),
        ("deep", "<a>".repeat(100_000)),
        (
            "wide",
            format!("<SimpleSource>{}</SimpleSource>", "<x/>".repeat(200_000)),
        ),
        ("unclosed", "<Description>".into()),
    ];
    let mut files: Vec<_> = bands
        .map(|(name, inside)| vrt(at, &format!("{name}.vrt"), &inside))
        .into();
    for (name, text) in [
        (
            "bomb",
            format!("<!DOCTYPE V [<!ENTITY e0 \"x\">{entities}]><VRTDataset>&e29;</VRTDataset>"),
        ),
        (
            "sizes",
            "<VRTDataset rasterXSize=\"99999999999\" rasterYSize=\"2\"/>".into(),
        ),
        ("no", "<VRTDataset/>".into()),
        (
            "cut",
            "<VRTDataset rasterXSize=\"8\" rasterYSize=\"2\"><VRTRasterBand>".into(),
        ),
        ("large", format!("<VRTDataset>{}", " ".repeat(33 << 20))),
    ] {
        let path = at.join(format!("{name}.vrt"));
        std::fs::write(&path, text).expect("written");
        files.push(path);
    }
    for path in files {
        let output = memory_limit::info(&path, &[]);
        let printed = output_text(&output);
        match output.status.code() {
            Some(0) => {}
            Some(1) => assert!(
                printed.contains("error: ") && printed.contains("hint: "),
                "{printed}"
            ),
            code => panic!("{}: {code:?} {printed}", path.display()),
        }
    }
}

/// The command in the hint, run unchanged, makes one terrain of files that do not match.
#[test]
fn hint_merges_files_that_do_not_match() {
    let Some(range) = shared("real/bigtujunga.tif") else {
        return;
    };
    let place = folder();
    let at = place.path();
    std::fs::create_dir(at.join("my tiles")).expect("a folder");
    shell(
        &at.join("my tiles"),
        &format!(
            "gdal_translate -q -srcwin 0 0 300 200 '{0}' a.tif
             gdal_translate -q -srcwin 250 0 300 200 -outsize 130% 130% '{0}' b.tif",
            range.display()
        ),
    );
    let printed = output_text(&info(&at.join("my tiles")));
    assert!(printed.contains("b.tif its cells are"), "{printed}");
    let (_, command) = printed.split_once("to one grid: ").expect("a command");
    shell(at, command.trim());
    let one = open(at.join("one.tif"));
    assert!(one.columns() > 500 && one.summary().no_data < 200_000);
}

/// A damaged block of a TIFF is no-data, and the warning names the file.
#[test]
fn damaged_block_is_no_data_and_its_file_is_named() {
    let Some(range) = shared("real/bigtujunga.tif") else {
        return;
    };
    let place = folder();
    let at = place.path();
    shell(
        at,
        &format!(
            "gdal_translate -q -co COMPRESS=DEFLATE -co TILED=YES -srcwin 0 0 600 512 '{0}' a.tif
             gdal_translate -q -co COMPRESS=DEFLATE -co TILED=YES -srcwin 600 0 512 512 '{0}' b.tif
             mkdir tiles; cp a.tif b.tif tiles",
            range.display()
        ),
    );
    let path = at.join("tiles/b.tif");
    let mut bytes = std::fs::read(&path).expect("bytes");
    let end = bytes.len();
    bytes[end - 40_000..end - 100].fill(0);
    std::fs::write(&path, bytes).expect("written");
    let (many, whole) = (open(at.join("tiles")), open(at.join("*.tif")));
    assert_eq!(many.columns(), 1112);
    let lost = (0..512)
        .filter(|row| many.height(1100, *row).is_nan() && !whole.height(1100, *row).is_nan());
    assert!(lost.count() >= 200);
    assert!(
        (0..512).all(|row| many.height(590, row).to_bits() == whole.height(590, row).to_bits())
    );
    let printed = output_text(&info(&at.join("tiles")));
    assert!(
        printed.contains("b.tif cannot be read and count as no data"),
        "{printed}"
    );
}
