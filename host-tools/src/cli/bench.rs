//! `hapterra bench`: hands over to `hapterra-bench`, which is a program of its
//! own so that the opponents it links are not part of the product.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::failure::{Failure, OrHint};

/// Arguments of `hapterra bench`.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub struct Args {
    /// Handed on as they are; see hapterra bench --help
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<OsString>,
}

/// The program's name.
const PROGRAM: &str = "hapterra-bench";

/// Runs the program that lies beside this one; under `cargo run`, which builds
/// no other program than the one it was asked for, builds it first.
///
/// # Errors
/// When it is not there or fails.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut command = match (beside_this_program(), std::env::var_os("CARGO")) {
        (Some(program), _) => Command::new(program),
        (None, Some(cargo)) => {
            let mut command = Command::new(cargo);
            let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
            command.args(["run", "--release", "--package", PROGRAM, "--bin", PROGRAM]);
            command.arg("--manifest-path").arg(manifest);
            if cfg!(feature = "remote") {
                // A build with URLs measures them, too.
                command.args(["--features", "remote"]);
            }
            command.arg("--");
            command
        }
        (None, None) if asks_for_help(&args.arguments) => {
            print!(
                "{ABOUT}\n{PROGRAM} does it, and tells its options; it is not beside this program: {HINT}\n"
            );
            return Ok(());
        }
        (None, None) => {
            return Err(format!("{PROGRAM} is not beside this program")).or_hint(HINT);
        }
    };
    let status = command
        .args(&args.arguments)
        .status()
        .map_err(|error| format!("cannot run {PROGRAM}: {error}"))
        .or_hint(HINT)?;
    if status.success() {
        return Ok(());
    }
    // It has said what is wrong, in the same words as every subcommand.
    std::process::exit(status.code().unwrap_or(1));
}

/// What is told of the program where it is missing.
const ABOUT: &str = "Measure the contact beside other ways to render a height field: time for a \
                     tick, error against the exact closest point, largest jump of the force; or what \
                     streaming costs (--streaming)\n";

fn asks_for_help(arguments: &[OsString]) -> bool {
    let ways = ["--help", "-h", "help"];
    arguments
        .iter()
        .any(|word| ways.iter().any(|way| word == way))
}

const HINT: &str = "install it in the same place: cargo install --path bench --bin hapterra-bench";

fn beside_this_program() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let program = own.with_file_name(name);
    program.is_file().then_some(program)
}
