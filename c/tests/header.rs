//! Check that the header equals the one that cbindgen generates from the sources.

use std::fs;
use std::path::Path;

#[test]
fn header_matches_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("settings");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["status", "surface_params", "terrain", "contact", "memory"] {
        builder = builder.with_src(folder.join(format!("src/{file}.rs")));
    }
    let mut made = vec![];
    builder.generate().expect("a header").write(&mut made);
    let made = String::from_utf8(made).expect("text");
    let path = folder.join("include/hapterra.h");
    if std::env::var_os("HAPTERRA_WRITE").is_some() {
        fs::write(&path, &made).expect("written");
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == made,
        "{} differs from the sources: run HAPTERRA_WRITE=1 cargo test -p hapterra-c --test header",
        path.display()
    );
}
