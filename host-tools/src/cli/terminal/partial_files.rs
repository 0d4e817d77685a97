//! Partial files of killed commands.

use std::path::Path;

use crate::output::partial_files;

/// Reports on standard error the partial files of killed commands, and how to keep them. No other
/// part of the program touches these.
pub fn report<'p>(files: impl IntoIterator<Item = &'p Path>) {
    for line in files.into_iter().flat_map(lines) {
        eprintln!("{line}");
    }
}

/// Returns two lines for each partial file of `file`.
fn lines(file: &Path) -> Vec<String> {
    let found = partial_files(file).into_iter().flat_map(|partial| {
        let (path, bytes) = (partial.path.display(), partial.bytes);
        [
            format!(
                "note: {path} ({bytes} bytes) is the unfinished output of a killed command, meant for {}",
                file.display()
            ),
            "  to keep it, rename it (its last line may be cut); it stays until you delete it"
                .to_owned(),
        ]
    });
    found.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_file_is_named_with_size_and_remedy() {
        let folder = tempfile::tempdir().expect("a folder");
        let partial = folder.path().join("out.csv.a1B2c3.partial");
        std::fs::write(&partial, "t_s,x_mm").expect("written");
        let text = lines(&folder.path().join("out.csv")).join("\n");
        for part in [&*partial.to_string_lossy(), "(8 bytes)", "rename it"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert_eq!(lines(&folder.path().join("new.csv")), [""; 0]);
    }
}
