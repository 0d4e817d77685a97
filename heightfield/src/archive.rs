//! Terrain packed in a ZIP or gzip file, as SRTM tiles are handed out.

use std::io::Read;

use flate2::bufread::GzDecoder;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use super::BadRaster;
use super::format::{Claim, starts_with_any};
use super::input::{DEFLATE_RATIO, FileBytes, ReadSeek};

/// No packed terrain is unpacked past this: unpacking is in memory.
const LARGEST_UNPACKED: u64 = 1 << 30;

/// Whether a file begins like a ZIP archive, be it an empty one.
pub(super) fn is_zip(head: &[u8]) -> bool {
    starts_with_any(head, &[b"PK\x03\x04", b"PK\x05\x06"])
}

/// Whether a file begins like a gzip file.
pub(super) fn is_gzip(head: &[u8]) -> bool {
    head.starts_with(b"\x1f\x8b")
}

/// A ZIP archive.
pub(super) struct Zip<'i> {
    archive: ZipArchive<Box<dyn ReadSeek + 'i>>,
    /// Names of its entries, with their folders.
    pub(super) names: Vec<String>,
}

impl<'i> Zip<'i> {
    /// Reads the list of entries.
    pub(super) fn open(input: &'i FileBytes) -> Result<Self, BadRaster> {
        let archive = ZipArchive::new(input.reader()?).map_err(|error| fault(&error))?;
        let names = archive.file_names().filter_map(Result::ok);
        let names = names.map(|name| name.into_owned()).collect();
        Ok(Self { archive, names })
    }

    /// Whether it is a NumPy `.npz`, by the file's extension or by what is inside.
    pub(super) fn is_numpy(&self, extension: &str) -> bool {
        extension == "npz" || self.names.iter().any(|name| name.ends_with(".npy"))
    }

    /// Unpacks the one entry whose name `claims` to be a terrain's. A weak claim, as that
    /// of a `readme.txt`, counts where there is no other.
    pub(super) fn only_entry(
        &mut self,
        claims: fn(&str) -> Option<Claim>,
    ) -> Result<FileBytes, BadRaster> {
        let entries = self.names.iter().filter(|name| !is_hidden(name));
        let claimed: Vec<(&String, Claim)> = entries
            .filter_map(|name| Some((name, claims(name)?)))
            .collect();
        let strong = |claim: &Claim| *claim != Claim::Suggests;
        let any_strong = claimed.iter().any(|(_, claim)| strong(claim));
        let terrain: Vec<&String> = claimed
            .iter()
            .filter(|(_, claim)| strong(claim) || !any_strong)
            .map(|(name, _)| *name)
            .collect();
        let refused = match terrain.as_slice() {
            [name] => {
                let name = (*name).clone();
                return Ok(FileBytes::unpacked(&name, self.unpack(&name)?));
            }
            [] => "the archive holds no terrain file".to_owned(),
            [first, second, ..] => {
                format!("the archive holds several terrain files, {first} and {second} among them")
            }
        };
        Err(BadRaster::NotAHeightField(refused))
    }

    /// Unpacks an entry into memory, never more than its packed size can hold.
    pub(super) fn unpack(&mut self, name: &str) -> Result<Vec<u8>, BadRaster> {
        let mut entry = self.archive.by_name(name).map_err(|error| fault(&error))?;
        let method = entry.compression();
        if !matches!(
            method,
            CompressionMethod::Stored | CompressionMethod::Deflated
        ) {
            return Err(BadRaster::Unsupported {
                format: "ZIP",
                feature: format!("compression by {method}"),
            });
        }
        let packed = entry.compressed_size();
        let limit = LARGEST_UNPACKED.min(packed.saturating_mul(DEFLATE_RATIO));
        if entry.size() > limit {
            return Err(BadRaster::AbsurdSize(format!(
                "{} unpacked bytes from {packed} packed ones in {name}",
                entry.size()
            )));
        }
        read_limited(&mut entry, limit)
    }
}

/// Unpacks a gzip file; the name of what is in it is the file's without `.gz`.
pub(super) fn unpack_gzip(input: &FileBytes) -> Result<FileBytes, BadRaster> {
    let name = match input.extension() {
        "gz" => &input.name()[..input.name().len() - ".gz".len()],
        _ => input.name(),
    };
    let limit = LARGEST_UNPACKED.min(input.len().saturating_mul(DEFLATE_RATIO));
    let bytes = read_limited(&mut GzDecoder::new(input.reader()?), limit)?;
    Ok(FileBytes::unpacked(name, bytes))
}

fn read_limited(reader: &mut dyn Read, limit: u64) -> Result<Vec<u8>, BadRaster> {
    let mut bytes = Vec::new();
    reader
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| BadRaster::from_io(error, "the packed data"))?;
    if bytes.len() as u64 > limit {
        return Err(BadRaster::AbsurdSize(format!(
            "more than {limit} unpacked bytes"
        )));
    }
    Ok(bytes)
}

/// Whether an entry is what a file system notes beside the files.
fn is_hidden(name: &str) -> bool {
    name.starts_with("__MACOSX/")
        || name
            .rsplit('/')
            .next()
            .is_some_and(|name| name.starts_with('.'))
}

fn fault(error: &ZipError) -> BadRaster {
    match error {
        ZipError::UnsupportedArchive(what) => BadRaster::Unsupported {
            format: "ZIP",
            feature: (*what).to_string(),
        },
        _ => BadRaster::damaged(format!("ZIP: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Write};

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use crate::{BadRaster, OpenOptions, Raster};

    const GRID: &str = "ncols 2\nnrows 2\ncellsize 1\n1 2 3 4";

    /// Opens an archive of these entries.
    fn open(entries: &[(&str, &str)]) -> Result<Raster, String> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in entries {
            let started = writer.start_file(*name, SimpleFileOptions::default());
            started.expect("an entry");
            writer.write_all(text.as_bytes()).expect("its bytes");
        }
        let bytes = writer.finish().expect("an archive").into_inner();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("terrain.zip");
        std::fs::write(&path, bytes).expect("written");
        Raster::open(&path, &OpenOptions::default()).map_err(|error| match error.fault() {
            BadRaster::NotAHeightField(_) => error.to_string(),
            other => panic!("{other}"),
        })
    }

    #[test]
    fn a_grid_with_its_readme_opens() {
        let beside = [
            ("data/README.txt", "how it was made"),
            ("data/dem.asc", GRID),
            ("data/dem.prj", "GEOGCS[]"),
            ("__MACOSX/data/._dem.asc", "\0\0"),
        ];
        assert_eq!(open(&beside).expect("the grid").height(0, 1), 1.0);
        assert_eq!(
            open(&[("dem.txt", GRID)]).expect("a grid").height(1, 0),
            4.0
        );
    }

    #[test]
    fn none_and_several_are_told() {
        let several = [("a.asc", GRID), ("b.asc", GRID)];
        assert!(open(&several).expect_err("two").contains("a.asc and b.asc"));
        assert!(
            open(&[("a.pdf", "")])
                .expect_err("none")
                .contains("no terrain file")
        );
    }
}
