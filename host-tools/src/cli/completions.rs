//! `hapterra completions`: a shell's completion script.

use clap::CommandFactory as _;
use clap_complete::{Shell, generate};

use super::{Cli, Failure, report};

/// Arguments of `hapterra completions`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Shell; its start-up file has to run the printed script
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Prints the completion script.
///
/// # Errors
/// Standard output cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "hapterra", &mut script);
    report::put(&String::from_utf8_lossy(&script))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shell_completes_the_subcommands() {
        for shell in <Shell as clap::ValueEnum>::value_variants() {
            let mut script = Vec::new();
            generate(*shell, &mut Cli::command(), "hapterra", &mut script);
            let script = String::from_utf8(script).expect("text");
            assert!(
                script.contains("bringup") && script.contains("device"),
                "{shell}"
            );
        }
    }
}
