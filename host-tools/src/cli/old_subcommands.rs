//! Subcommands of earlier versions, and their replacements.

use clap::error::{ContextKind, ContextValue};

/// Subcommands moved to `hapterra-lab`, and their names there.
const IN_LAB: [(&str, &str); 3] = [
    ("bench", "contact"),
    ("stability", "stability"),
    ("synth", "synth"),
];

/// Returns a hint with the replacement if the error is a subcommand of earlier versions.
pub(super) fn hint(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else {
        return None;
    };
    let (old, new) = IN_LAB.iter().find(|(old, _)| old == word)?;
    Some(format!(
        "\nhint: hapterra {old} is now hapterra-lab {new}: in a clone, cargo run -r -p hapterra-lab -- {new}\n"
    ))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn each_moved_subcommand_is_named_with_its_new_place() {
        for (old, new) in IN_LAB {
            let error = Cli::try_parse_from(["hapterra", old, "--help"]).expect_err("moved");
            let hint = hint(&error).expect("a hint");
            assert!(hint.contains(&format!("hapterra-lab {new}")), "{hint}");
            assert_eq!(error.exit_code(), 2);
        }
        let error = Cli::try_parse_from(["hapterra", "sing"]).expect_err("no command");
        assert_eq!(hint(&error), None);
    }
}
