//! Reading of files by GDAL through this crate's user.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex};

use heightfield_gdal::{Error, FileSystem, Library, Mount, ReadAt, Settings, Window};

/// Files in memory, with injected faults.
#[derive(Clone, Default)]
struct Files {
    by_name: Arc<BTreeMap<String, Vec<u8>>>,
    /// Names for which the server does not respond.
    silent: Arc<Mutex<Vec<String>>>,
    opened: Arc<Mutex<Vec<String>>>,
    roots: Vec<String>,
}

struct Bytes(Vec<u8>);

impl ReadAt for Bytes {
    fn bytes(&self) -> u64 {
        self.0.len() as u64
    }

    fn read_at(&self, at: u64, count: usize) -> io::Result<Vec<u8>> {
        Ok(self.0[at as usize..][..count].to_vec())
    }
}

impl FileSystem for Files {
    fn open(&self, name: &str) -> io::Result<Box<dyn ReadAt>> {
        self.opened.lock().expect("no panic").push(name.to_owned());
        if self
            .silent
            .lock()
            .expect("no panic")
            .iter()
            .any(|it| it == name)
        {
            return Err(ErrorKind::ConnectionAborted.into());
        }
        assert_ne!(name, "panic.dat", "a panic that must not reach C");
        let file = self.by_name.get(name).ok_or(ErrorKind::NotFound)?;
        Ok(Box::new(Bytes(file.clone())))
    }

    fn neighbours(&self, name: &str) -> io::Result<Vec<String>> {
        let header = name.replace(".dat", ".hdr");
        let own = name.rsplit('/').next().unwrap_or_default();
        let header_name = header.rsplit('/').next().unwrap_or_default().to_owned();
        let is_there = header_name != own && self.by_name.contains_key(&header);
        Ok(is_there.then_some(header_name).into_iter().collect())
    }

    fn roots(&self) -> &[String] {
        &self.roots
    }
}

/// Returns 12 of ENVI's raw samples, from `first` on, with their header.
fn field(first: u32) -> [Vec<u8>; 2] {
    let samples = (0..12).map(|at| (first + at) as f32);
    let header = "ENVI\nsamples = 4\nlines = 3\nbands = 1\ndata type = 4\ninterleave = bsq\n\
                  byte order = 0\nheader offset = 0\n";
    [samples.flat_map(f32::to_le_bytes).collect(), header.into()]
}

fn vrt(source: &str, is_relative: bool) -> Vec<u8> {
    let relative = u8::from(is_relative);
    format!(
        "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><VRTRasterBand dataType=\"Float32\" band=\"1\">\
         <SimpleSource><SourceFilename relativeToVRT=\"{relative}\">{source}</SourceFilename>\
         </SimpleSource></VRTRasterBand></VRTDataset>"
    )
    .into_bytes()
}

fn mounted(vrts: &[(&str, Vec<u8>)]) -> Option<(Library, Mount, Files)> {
    let gdal = Library::load(Settings::default())
        .inspect_err(|why| eprintln!("skipped: {why}; {}", Error::how_to_install()))
        .ok()?;
    let mut by_name = BTreeMap::new();
    for (folder, first) in [("a/west", 0), ("a/east", 100), ("a/panic", 0)] {
        let [samples, header] = field(first);
        by_name.insert(format!("{folder}.dat"), samples);
        by_name.insert(format!("{folder}.hdr"), header);
    }
    let vrts = vrts
        .iter()
        .map(|(name, text)| ((*name).to_owned(), text.clone()));
    by_name.extend(vrts);
    let files = Files {
        by_name: Arc::new(by_name),
        roots: vec!["/vsicurl/http://h/".into(), "http://h/".into()],
        ..Files::default()
    };
    let mount = gdal.mount(Box::new(files.clone())).expect("mounted");
    Some((gdal, mount, files))
}

/// Returns the last sample of a raster.
fn last(gdal: &Library, name: &str) -> Result<f64, Error> {
    let dataset = gdal.open(name.as_ref(), &[])?;
    let window = Window {
        column: 3,
        row: 2,
        columns: 1,
        rows: 1,
    };
    let mut sample = [0.0];
    dataset.band(1)?.read(window, &mut sample)?;
    Ok(sample[0])
}

#[test]
fn files_and_their_neighbours_are_read_by_name() {
    let vrts = [
        ("a/beside.vrt", vrt("./b/../west.dat", true)),
        ("a/by_root.vrt", vrt("http://h/a/east.dat", false)),
        (
            "a/by_gdals_root.vrt",
            vrt("/vsicurl/http://h/a/east.dat", false),
        ),
        ("a/outer.vrt", vrt("by_root.vrt", true)),
    ];
    let Some((gdal, mount, _)) = mounted(&vrts) else {
        return;
    };
    for (name, expected) in [
        ("a/west.dat", 11.0),
        ("a/beside.vrt", 11.0),
        ("a/by_root.vrt", 111.0),
        ("a/by_gdals_root.vrt", 111.0),
        ("a/outer.vrt", 111.0),
    ] {
        assert_eq!(last(&gdal, &mount.path(name)), Ok(expected), "{name}");
        assert!(mount.take_fault().is_none(), "{name}");
    }
}

#[test]
fn vrt_references_outside_the_mount_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let [samples, header] = field(0);
    let local = folder.path().join("west.dat");
    std::fs::write(&local, samples).expect("written");
    std::fs::write(local.with_extension("hdr"), header).expect("written");
    let local = local.display().to_string();
    let vrts = [
        ("a/absolute.vrt", vrt(&local, true)),
        ("a/working_folder.vrt", vrt("Cargo.toml", false)),
        (
            "a/driver.vrt",
            vrt(&format!("NETCDF:&quot;{local}&quot;:z"), true),
        ),
        ("a/input.vrt", vrt("/vsistdin/", false)),
        ("a/other_server.vrt", vrt("http://other/a/west.dat", false)),
        (
            "a/archive.vrt",
            vrt("/vsizip//vsicurl/http://other/a.zip/west.dat", true),
        ),
        (
            "a/other_files.vrt",
            vrt("/vsiheightfield/999999/a.dat", false),
        ),
    ];
    let Some((gdal, mount, _)) = mounted(&vrts) else {
        return;
    };
    let here = "on this computer";
    let words = [
        here,
        here,
        here,
        "no file",
        "nothing is fetched",
        "nothing is fetched",
        "no file",
    ];
    for ((name, _), words) in vrts.iter().zip(words) {
        assert!(last(&gdal, &mount.path(name)).is_err(), "{name}");
        let why = mount.take_fault().map(|fault| fault.to_string());
        let why = why.unwrap_or_default();
        assert!(
            why.contains("it names") && why.contains(words),
            "{name}: {why}"
        );
    }
}

/// Returns an uncompressed MRF of 4 × 3 floats in one tile.
fn mrf(more: &str) -> Vec<u8> {
    format!(
        "<MRF_META><Raster><Size x=\"4\" y=\"3\" c=\"1\"/><PageSize x=\"4\" y=\"3\" c=\"1\"/>\
         <Compression>NONE</Compression><DataType>Float32</DataType>{more}</Raster></MRF_META>"
    )
    .into_bytes()
}

/// Returns the index of one tile of 12 floats.
fn index() -> Vec<u8> {
    [0_u64, 48].into_iter().flat_map(u64::to_be_bytes).collect()
}

#[test]
fn mrf_may_name_only_its_neighbours() {
    let folder = tempfile::tempdir().expect("a folder");
    let [samples, _] = field(0);
    let (data, idx) = (folder.path().join("x.dat"), folder.path().join("x.idx"));
    std::fs::write(&data, &samples).expect("written");
    std::fs::write(&idx, index()).expect("written");
    let both = format!(
        "<DataFile>{}</DataFile><IndexFile>{}</IndexFile>",
        data.display(),
        idx.display()
    );
    let own = "<DataFile>west.dat</DataFile><IndexFile>west.idx</IndexFile>";
    let copied = format!(
        "</Raster><CachedSource><Source>{}</Source></CachedSource><Raster>",
        data.display()
    );
    let files = [
        ("a/own.mrf", mrf(own)),
        ("a/west.idx", index()),
        ("a/absolute.mrf", mrf(&both)),
        (
            "a/escaped.mrf",
            mrf(&both.replace('/', "&#47;").replace("<&#47;", "</")),
        ),
        ("a/up.mrf", mrf("<DataFile>../../x.dat</DataFile>")),
        (
            "a/working_folder.mrf",
            mrf("<DataFile>./Cargo.toml</DataFile>"),
        ),
        ("a/copied.mrf", mrf(&copied)),
    ];
    let Some((gdal, mount, _)) = mounted(&files) else {
        return;
    };
    let local = folder.path().join("here.mrf");
    std::fs::write(&local, mrf(&both)).expect("written");
    let local = local.display().to_string();
    assert_eq!(last(&gdal, &local), Ok(11.0), "here it is read");
    assert_eq!(last(&gdal, &mount.path("a/own.mrf")), Ok(11.0));
    assert!(mount.take_fault().is_none());
    for (name, _) in &files[2..] {
        assert!(last(&gdal, &mount.path(name)).is_err(), "{name}");
        let why = mount.take_fault().map(|fault| fault.to_string());
        let why = why.unwrap_or_default();
        assert!(
            why.contains("it names") && why.contains("beside it"),
            "{name}: {why}"
        );
    }
}

#[test]
fn circular_vrts_end_at_the_nesting_limit() {
    let number = |at: u32| format!("a/{at}.vrt");
    let vrts: Vec<_> = (0..40)
        .map(|at| (number(at), vrt(&format!("{}.vrt", (at + 1) % 40), true)))
        .collect();
    let vrts: Vec<_> = vrts
        .iter()
        .map(|(name, text)| (name.as_str(), text.clone()))
        .collect();
    let Some((gdal, mount, files)) = mounted(&vrts) else {
        return;
    };
    assert!(last(&gdal, &mount.path("a/0.vrt")).is_err());
    let fault = mount.take_fault().map(|fault| fault.to_string());
    assert!(fault.is_some_and(|fault| fault.contains("deep")));
    let opened = files.opened.lock().expect("no panic").clone();
    assert!(!opened.contains(&number(20)), "{opened:?}");
}

#[test]
fn unreadable_file_is_a_fault_but_missing_file_is_not() {
    let vrts = [
        ("a/both.vrt", vrt("east.dat", true)),
        ("a/gone.vrt", vrt("gone.dat", true)),
    ];
    let Some((gdal, mount, files)) = mounted(&vrts) else {
        return;
    };
    files
        .silent
        .lock()
        .expect("no panic")
        .push("a/east.dat".into());
    assert!(last(&gdal, &mount.path("a/both.vrt")).is_err());
    let fault = mount.take_fault().map(|fault| fault.kind());
    assert_eq!(fault, Some(ErrorKind::ConnectionAborted));
    assert!(last(&gdal, &mount.path("a/gone.vrt")).is_err());
    assert!(mount.take_fault().is_none());
    // Names outside the root, and panics, only cause errors.
    for name in ["../a/west.dat", "", "a/", "a/../../x.dat", "panic.dat"] {
        assert!(last(&gdal, &mount.path(name)).is_err(), "{name}");
    }
    let unmounted = mount.path("a/west.dat");
    drop(mount);
    assert!(
        last(&gdal, &unmounted).is_err(),
        "nothing is mounted any more"
    );
}

#[test]
fn dataset_keeps_its_files_after_its_mount_is_dropped() {
    let Some((gdal, mount, _)) = mounted(&[]) else {
        return;
    };
    let dataset = gdal
        .open(mount.path("a/west.dat").as_ref(), &[])
        .expect("opened");
    drop(mount);
    let window = Window {
        column: 0,
        row: 2,
        columns: 4,
        rows: 1,
    };
    let mut row = [0.0_f32; 4];
    let band = dataset.band(1).expect("there");
    band.read(window, &mut row).expect("read");
    assert_eq!(row, [8.0, 9.0, 10.0, 11.0]);
    assert!(dataset.take_fault().is_none());
}
