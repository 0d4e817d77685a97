//! The examples and wrong calls, built with the machine's compilers against the static and the
//! shared library. Tests without a compiler or valgrind on the machine are skipped, with a message.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const STRICT: [&str; 4] = ["-Wall", "-Wextra", "-Werror", "-pedantic"];

struct Program {
    compiler: &'static str,
    standard: &'static str,
    source: &'static str,
}

const PROGRAMS: [Program; 3] = [
    Program {
        compiler: "cc",
        standard: "-std=c99",
        source: "examples/mountain.c",
    },
    Program {
        compiler: "c++",
        standard: "-std=c++11",
        source: "examples/chai.cpp",
    },
    Program {
        compiler: "cc",
        standard: "-std=c99",
        source: "tests/misuse.c",
    },
];

/// Returns the folder with both libraries, built once: cargo builds neither for a test.
fn libraries() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let test = std::env::current_exe().expect("this program");
        // target/PROFILE/deps/TEST
        let target = test.ancestors().nth(3).expect("a target folder");
        let mut cargo = Command::new(env!("CARGO"));
        cargo
            .args([
                "build",
                "--offline",
                "--package",
                "hapterra-c",
                "--target-dir",
            ])
            .arg(target);
        runs(&mut cargo);
        target.join("debug")
    })
}

fn has(program: &str) -> bool {
    let has = Command::new(program).arg("--version").output().is_ok();
    if !has {
        eprintln!("skipped: there is no {program} on this machine");
    }
    has
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr].concat()).into_owned()
}

fn runs(command: &mut Command) -> String {
    let output = command.output().expect("started");
    assert!(output.status.success(), "{command:?}: {}", text(&output));
    text(&output)
}

/// Builds a program against the static or the shared library, runs it, and returns its output.
fn built_and_run(program: &Program, is_static: bool, under: &[&str]) -> String {
    let (home, libraries) = (Path::new(env!("CARGO_MANIFEST_DIR")), libraries());
    let folder = libraries.join(format!("hapterra-c/{}-{is_static}", under.len()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let binary = folder.join(program.source.replace(['/', '.'], "_"));
    let mut compile = Command::new(program.compiler);
    compile
        .args(STRICT)
        .args([program.standard, "-g", "-o"])
        .arg(&binary)
        .arg("-I")
        .arg(home.join("include"))
        .arg(home.join(program.source));
    match is_static {
        true => compile.arg(libraries.join("libhapterra_c.a")),
        false => compile.arg("-L").arg(libraries).arg("-lhapterra_c"),
    };
    runs(compile.args(["-lm", "-lpthread", "-ldl"]));
    let command = [under, &[binary.to_str().expect("a name")]].concat();
    let (name, words) = command.split_first().expect("a program");
    let mut run = Command::new(name);
    runs(run.args(words).env("LD_LIBRARY_PATH", libraries))
}

#[cfg(unix)]
#[test]
fn programs_run_with_the_static_and_the_shared_library() {
    for program in PROGRAMS.iter().filter(|program| has(program.compiler)) {
        let printed = [true, false].map(|is_static| built_and_run(program, is_static, &[]));
        assert_eq!(printed[0], printed[1], "{}", program.source);
    }
}

#[cfg(unix)]
#[test]
fn valgrind_finds_no_invalid_access_and_no_leak() {
    if !has("valgrind") {
        return;
    }
    let valgrind = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full"];
    for program in PROGRAMS.iter().filter(|program| has(program.compiler)) {
        built_and_run(program, true, &valgrind);
    }
}
