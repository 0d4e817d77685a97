use std::fs;

use clap::Parser as _;

use super::*;

/// The words of a command with a settings file.
fn completed(text: &str, line: &str) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("s.toml");
    fs::write(&file, text).expect("written");
    let file = file.display().to_string();
    let words = format!("hapterra {line} --settings {file}");
    let words = words.split_whitespace().map(OsString::from).collect();
    let completed = complete(&Cli::command(), words).map_err(|failure| failure.text())?;
    assert_eq!(completed.line, Some(format!("settings       {file}")));
    let parsed = Cli::try_parse_from(&completed.words);
    parsed.map_err(|error| error.render().to_string())?;
    let words = completed.words.iter().map(|word| word.to_string_lossy());
    let without = words.map(|word| word.replace(&file, "FILE"));
    Ok(without.filter(|word| word.starts_with("--")).collect())
}

#[test]
fn settings_stand_before_the_words_of_the_user() {
    let text = "scale = \"5m/mm\"\ntip = 2\nsurface = \"sand\"\ninput = [\"band=2\", \"cell=30m\"]\nview = true\n";
    let words = completed(text, "run t.tif").expect("settings");
    assert_eq!(
        words,
        [
            "--input=band=2",
            "--input=cell=30m",
            "--scale=5m/mm",
            "--surface=sand",
            "--tip=2",
            "--view",
            "--settings"
        ]
    );
    let words = completed("view = false\n", "run t.tif").expect("settings");
    assert_eq!(words, ["--settings"]);
}

#[test]
fn command_line_wins() {
    let text =
        "scale = \"5m/mm\"\ninput = [\"band=2\", \"cell=30m\"]\nat = \"1,2\"\ncrs = \"lonlat\"\n";
    let words = completed(text, "run t.tif --scale 1mm/cell --input band=1").expect("settings");
    assert_eq!(
        words,
        [
            "--at=1,2",
            "--crs=lonlat",
            "--input=cell=30m",
            "--scale",
            "--input",
            "--settings"
        ]
    );
    // A box is fitted: it goes with neither a place nor a scale.
    let words = completed(text, "run t.tif --bbox 1,2,3,4").expect("settings");
    assert_eq!(
        words,
        [
            "--crs=lonlat",
            "--input=band=2",
            "--input=cell=30m",
            "--bbox",
            "--settings"
        ]
    );
}

#[test]
fn keys_of_other_commands_are_left_alone() {
    let text = "rounds = 3\nsilence = \"30s\"\nrows-are-ticks = true\n";
    let words = completed(text, "demo t.tif").expect("settings");
    assert_eq!(words, ["--rounds=3", "--settings"]);
    let words = completed(text, "run t.tif").expect("settings");
    assert_eq!(words, ["--silence=30s", "--settings"]);
}

#[test]
fn surface_may_stand_in_the_file() {
    let text = "device = \"native\"\n[surface.default]\nfriction = 0.4\n";
    let words = completed(text, "run t.tif").expect("settings");
    assert_eq!(words, ["--device=native", "--surface=FILE", "--settings"]);
}

#[test]
fn errors_name_file_and_line() {
    for (text, wanted) in [
        (
            "tip = 2\nscales = 3\n",
            "line 2: no command has an option --scales",
        ),
        ("settings = \"a.toml\"\n", "line 1: no command has"),
        ("\ntip = \"2m\"\n", "line 2: invalid value '2m' for '--tip"),
        ("view = 1\n", "line 1: view is true or false"),
        ("view = \"yes\"\n", "line 1: view is true or false"),
        ("[tip]\nx = 1\n", "line 1: tip is a text, a number"),
        ("tip = 2\ntip = 3\n", "duplicate"),
        ("tip\n", "s.toml"),
        ("at = \"1,2\"\nbbox = \"1,2,3,4\"\n", "cannot be used with"),
    ] {
        let why = completed(text, "run t.tif").expect_err(text);
        assert!(why.contains(wanted), "{text}: {why}");
    }
}

#[test]
fn no_settings_are_read_where_none_are_wanted() {
    let words =
        |line: &str| -> Vec<OsString> { line.split_whitespace().map(OsString::from).collect() };
    for line in [
        "hapterra run t.tif --settings none",
        "hapterra info t.tif",
        "hapterra run --help",
        "hapterra",
        "hapterra run t.tif --nonsense",
    ] {
        let completed = complete(&Cli::command(), words(line)).map_err(|failure| failure.text());
        let completed = completed.expect(line);
        assert_eq!((completed.words, completed.line), (words(line), None));
    }
    let missing = complete(
        &Cli::command(),
        words("hapterra run t.tif --settings no.toml"),
    );
    assert!(missing.is_err());
}
