//! `hapterra man`: the manual pages.

use std::path::PathBuf;

use clap::{CommandFactory as _, ValueHint};

use super::failure::{Failure, OrHint};
use super::{Cli, report};

/// Arguments of `hapterra man`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for the pages, one for each subcommand
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
}

/// Writes the pages.
///
/// # Errors
/// The folder cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let folder = args.out.display();
    std::fs::create_dir_all(&args.out)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), &args.out))
        .map_err(|error| format!("cannot write manual pages to {folder}: {error}"))
        .or_hint("name a folder in which you may write with --out")?;
    report::put(&format!(
        "wrote the manual pages; to read one: man {folder}/hapterra-run.1\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_subcommand_has_a_page() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("new/man");
        run(&Args { out: out.clone() }).expect("written");
        for command in Cli::command().get_subcommands() {
            let page = out.join(format!("hapterra-{}.1", command.get_name()));
            let text = std::fs::read_to_string(&page).expect("a page");
            assert!(text.contains(".SH SYNOPSIS"), "{}", page.display());
        }
    }

    #[test]
    fn folder_that_cannot_be_made_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("file");
        std::fs::write(&out, "").expect("written");
        let failure = run(&Args { out }).expect_err("no folder");
        let text = failure.text();
        assert!(text.contains("file: ") && text.contains("--out"), "{text}");
    }
}
