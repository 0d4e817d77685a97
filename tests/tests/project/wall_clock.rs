//! Only `tests/src/timeouts.rs` reads the wall clock or sleeps in tests, and explains why.

use std::fs;
use std::path::{Path, PathBuf};

use hapterra_tests::repository;

/// Names that read the wall clock or wait for it.
const CLOCKS: [&str; 10] = [
    "Instant",
    "SystemTime",
    "UNIX_EPOCH",
    "Timestamp",
    "elapsed",
    "sleep",
    "recv_timeout",
    "wait_timeout",
    "set_read_timeout",
    "set_write_timeout",
];

/// The module that does this for all tests.
const MODULE: &str = "tests/src/timeouts.rs";

/// Other permitted files, and why their tests do not depend on the machine's speed.
const ALLOWED: [(&str, &str, &[&str]); 11] = [
    (
        "host-tools/src/bringup/utc.rs",
        "a known moment, written as a date",
        &["UNIX_EPOCH"],
    ),
    (
        "host-tools/src/cli/line_limit.rs",
        "the tested type accepts instants, which the test derives from an arbitrary first one",
        &["Instant"],
    ),
    (
        "tests/src/bin/soak.rs",
        "the user sets the duration of the stress test, which prints the remaining time",
        &["Instant", "elapsed"],
    ),
    (
        "tests/src/soak/mod.rs",
        "the user sets the duration of the stress test; the tests run a fixed number of scenes",
        &["Instant", "elapsed", "sleep"],
    ),
    (
        "tests/src/socket_device.rs",
        "the pace of a device that plays a board in real time; it fails nothing",
        &["set_read_timeout"],
    ),
    (
        "tests/tests/link/hostile_device.rs",
        "the pace of a device that plays a board in real time; it fails nothing",
        &["set_read_timeout"],
    ),
    (
        "tests/urls/src/http.rs",
        "a server's latency, for an ignored test that prints figures",
        &["sleep"],
    ),
    (
        "tests/urls/src/gcs.rs",
        "a key states its expiry, as that of the real service",
        &["SystemTime", "UNIX_EPOCH"],
    ),
    (
        "tests/urls/src/azure/shared_key.rs",
        "a request states its time of signing, as to the real service",
        &["Timestamp"],
    ),
    (
        "tests/urls/src/azure/sas.rs",
        "a signature states its expiry, as that of the real service",
        &["Timestamp"],
    ),
    (
        "tests/images/src/machine/running.rs",
        "the emulated core's own sleep, in emulated time",
        &["sleep"],
    ),
];

/// Not searched: the viewer's tests drive a browser, in a workspace of their own.
const VIEWER: &str = "view";

/// Collects the Rust files under a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        let is_searched = name != "target" && name != VIEWER && !name.starts_with('.');
        if path.is_dir() && is_searched {
            sources(&path, found);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            found.push(path);
        }
    }
}

/// Returns true if a whole file is test code, or shared by tests.
fn is_of_tests(path: &Path) -> bool {
    let folders = path.parent().into_iter().flat_map(Path::components);
    let is_inside = |name: &str| folders.clone().any(|part| part.as_os_str() == name);
    let stem = path.file_stem().expect("a name").to_string_lossy();
    is_inside("tests") || stem == "tests" || stem.ends_with("_tests")
}

/// Returns the lines of a file that only tests run, with their numbers: outside test files, those
/// of modules after `#[cfg(test)]`.
fn lines_of_tests(path: &Path, text: &str) -> Vec<(usize, String)> {
    let (is_whole, mut is_test, mut is_next) = (is_of_tests(path), false, false);
    let mut lines = vec![];
    for (number, line) in (1..).zip(text.lines()) {
        is_test |= is_next && line.starts_with("mod ") && line.ends_with('{');
        is_next = line == "#[cfg(test)]" || is_next && line.starts_with("#[");
        let code = line.split("//").next().unwrap_or_default();
        if is_whole || is_test {
            lines.push((number, code.to_owned()));
        }
        is_test &= line != "}";
    }
    lines
}

/// Returns the clocks in a line of code, without those in strings.
fn clocks(code: &str) -> impl Iterator<Item = &'static str> {
    let code: String = code.split('"').step_by(2).collect();
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<String> = code.split(|c| !is_part(c)).map(str::to_owned).collect();
    CLOCKS
        .into_iter()
        .filter(move |clock| words.iter().any(|word| word == clock))
}

/// Returns the forbidden uses of the wall clock in a file with this path in the repository.
fn faults(path: &str, text: &str) -> Vec<String> {
    let allowed = ALLOWED.iter().find(|(file, ..)| *file == path);
    let allowed = allowed.map_or(&[][..], |(.., clocks)| clocks);
    let lines = lines_of_tests(Path::new(path), text);
    let uses = lines.iter().flat_map(|(number, code)| {
        let uses = clocks(code).filter(|clock| !allowed.contains(clock));
        uses.map(move |clock| format!("{path}:{number}: {clock}"))
    });
    uses.collect()
}

#[test]
fn tests_read_the_wall_clock_through_one_module_only() {
    let root = repository();
    let mut files = vec![];
    sources(root, &mut files);
    let mut found = vec![];
    let mut searched = 0;
    for path in files {
        let name = path.strip_prefix(root).expect("inside").to_string_lossy();
        let text = fs::read_to_string(&path).expect("text");
        if name != MODULE {
            found.extend(faults(&name, &text));
            searched += usize::from(!lines_of_tests(Path::new(&*name), &text).is_empty());
        }
    }
    assert!(searched > 300, "only {searched} files with tests");
    assert!(
        found.is_empty(),
        "wall clock outside of {MODULE}; wait for a condition, or count ticks:\n{}",
        found.join("\n")
    );
}

#[test]
fn allowed_uses_of_the_wall_clock_are_there() {
    for (path, why, allowed) in ALLOWED {
        let text = fs::read_to_string(repository().join(path)).expect(path);
        let lines = lines_of_tests(Path::new(path), &text);
        for clock in allowed {
            let is_there = lines
                .iter()
                .any(|(_, code)| clocks(code).any(|c| c == *clock));
            assert!(is_there, "{path} may name {clock} ({why}), and does not");
        }
    }
}

#[test]
fn wall_clock_is_found_in_tests_only() {
    let in_tests = "let began = std::time::Instant::now();\nstd::thread::sleep(time);\n";
    let found = faults("tests/tests/made_up.rs", in_tests);
    assert_eq!(
        found,
        [
            "tests/tests/made_up.rs:1: Instant",
            "tests/tests/made_up.rs:2: sleep"
        ]
    );
    let beside = [
        "fn f() { sleep(A); }",
        "#[cfg(test)]",
        "#[allow(dead_code)]",
        "mod tests {",
        "    // No Instant.",
        "    fn g() { queue.recv_timeout(A); }",
        "}",
        "fn h() { sleep(A); }",
    ];
    let beside = beside.join("\n");
    let found = faults("core/src/made_up.rs", &beside);
    assert_eq!(found, ["core/src/made_up.rs:6: recv_timeout"]);
    assert_eq!(faults("core/src/made_up_tests.rs", "x.elapsed()").len(), 1);
    assert_eq!(faults("core/src/made_up.rs", "x.elapsed()").len(), 0);
}
