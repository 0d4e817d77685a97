//! Whether the haptic interrupt of an image can reach a panic.
//!
//! The finished ELF is judged, not the source: link-time optimisation removes
//! most bounds checks, and what it left is what runs. Every direct branch of
//! every function that the interrupt can reach is followed. A call through a
//! register cannot be followed, so it is an error unless the board's table says
//! what it is; the walk is complete without guesses about pointers.

mod calls;
mod decode;
mod reach;

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::board::{Board, Exception};
use crate::run::say;
use calls::{Calls, Function};

/// Fails if the tick's interrupt in the image at `path` can reach a panic.
pub(crate) fn check(board: &Board, path: &Path) -> Result<()> {
    let elf = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let calls = calls::read(&elf).with_context(|| path.display().to_string())?;
    let reached = judge(&calls, board).with_context(|| format!("image {}", board.name))?;
    let (name, root) = (board.name, board.tick_interrupt);
    say(format!(
        "{name}: none of the {reached} functions under {root} can panic"
    ));
    Ok(())
}

/// How many functions the interrupt reaches, if none of them panics.
fn judge(calls: &Calls, board: &Board) -> Result<usize> {
    let functions = &calls.functions;
    // In an image without any panic, the names looked for are not the real ones.
    ensure!(
        functions.iter().any(|f| panics(&f.name)),
        "no panic function in the whole image: was it stripped?"
    );
    let root = board.tick_interrupt;
    let Some(root) = functions
        .iter()
        .position(|f| f.aliases.iter().any(|a| a == root))
    else {
        bail!("no function {root}: the tick's interrupt is named in xtask/src/board.rs");
    };
    // What a panic does in turn says nothing new: the walk ends there.
    // It does not follow what the table knows either.
    let found = reach::from(root, |i| {
        let callees = match panics(&functions[i].name) {
            true => &[],
            false => functions[i].callees.as_slice(),
        };
        let unknown =
            |c: &&usize| !is_known(board.known_calls, &functions[i], &functions[**c].name);
        callees.iter().filter(unknown).copied().collect()
    });
    let way_to = |i| {
        let names = found
            .chain(i)
            .into_iter()
            .map(|j| short(&functions[j].name));
        names.collect::<Vec<_>>().join("\n    -> ")
    };
    let mut wrong = vec![];
    let inner = found.all().filter(|&i| !panics(&functions[i].name));
    for i in inner.clone() {
        let caller = &functions[i];
        for callee in caller.callees.iter().map(|&c| &functions[c].name) {
            if panics(callee) && !is_known(board.known_calls, caller, callee) {
                wrong.push(format!("can panic:\n    {}\n    -> {callee}", way_to(i)));
            }
        }
        if caller.has_indirect && !is_known(board.known_indirect, caller, "") {
            wrong.push(format!(
                "calls through a register, which cannot be followed:\n    {}",
                way_to(i)
            ));
        }
    }
    ensure!(wrong.is_empty(), "{}", wrong.join("\n"));
    Ok(inner.count())
}

/// A name without what makes generic ones fill the screen.
fn short(name: &str) -> String {
    const SHOWN: usize = 120;
    match name.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.to_string(),
    }
}

/// Whether the table of exceptions has this caller and callee, each by part of its name.
fn is_known(table: &[Exception], caller: &Function, callee: &str) -> bool {
    let is_caller = |parts: &[&str]| {
        let mut names = caller.aliases.iter().chain([&caller.name]);
        names.any(|name| parts.iter().all(|part| name.contains(part)))
    };
    table
        .iter()
        .any(|e| is_caller(e.caller) && callee.contains(e.callee))
}

/// Whether a function of this name is a panic or what all panics end in.
fn panics(name: &str) -> bool {
    name.starts_with("core::panicking::")
        || name.ends_with("rust_begin_unwind")
        || name.contains("defmt_panic")
        || name.contains("defmt_default_panic")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::EMULATED;

    fn function(name: &str, callees: &[usize], has_indirect: bool) -> Function {
        Function {
            name: name.into(),
            aliases: vec![name.into()],
            callees: callees.to_vec(),
            has_indirect,
        }
    }

    fn image(tick_calls: &[usize]) -> Calls {
        let functions = vec![
            function(EMULATED.tick_interrupt, &[1], false),
            function("hapterra_core::tick", tick_calls, false),
            function("core::slice::index::slice_index_fail", &[3], false),
            function("core::panicking::panic_fmt", &[4], false),
            function("__rustc::rust_begin_unwind", &[], true),
            function("hapterra_core::surface", &[], false),
            function("<dyn Waker>::wake", &[], true),
        ];
        Calls { functions }
    }

    #[test]
    fn a_panic_two_calls_away_is_found_with_its_way() {
        let message = judge(&image(&[2, 5]), EMULATED).unwrap_err().to_string();
        assert!(
            message.contains("slice_index_fail\n    -> core::panicking::panic_fmt"),
            "{message}"
        );
        assert_eq!(message.matches("can panic").count(), 1, "{message}");
        assert!(!message.contains("register"), "{message}");
    }

    #[test]
    fn a_panic_elsewhere_in_the_image_is_no_matter() {
        assert_eq!(judge(&image(&[5]), EMULATED).unwrap(), 3);
    }

    #[test]
    fn a_call_that_cannot_be_followed_must_be_known() {
        let message = judge(&image(&[6]), EMULATED).unwrap_err().to_string();
        assert!(message.contains("register"), "{message}");
        let known = &[Exception {
            caller: &["Waker>::wake"],
            callee: "",
            because: "test",
        }];
        let board = Board {
            known_indirect: known,
            ..*EMULATED
        };
        assert_eq!(judge(&image(&[6]), &board).unwrap(), 3);
    }

    #[test]
    fn a_known_panic_is_known_for_one_caller_only() {
        let known = &[
            Exception {
                caller: &["elsewhere"],
                callee: "panic_fmt",
                because: "test",
            },
            Exception {
                caller: &["slice_index_fail"],
                callee: "panic_fmt",
                because: "test",
            },
        ];
        let board = Board {
            known_calls: known,
            ..*EMULATED
        };
        assert_eq!(judge(&image(&[2]), &board).unwrap(), 3);
        let message = judge(&image(&[2, 3]), &board).unwrap_err().to_string();
        assert!(
            message.contains("tick\n    -> core::panicking"),
            "{message}"
        );
    }

    #[test]
    fn nothing_is_judged_where_nothing_could_be_found() {
        let mut stripped = image(&[5]);
        stripped.functions.truncate(2);
        stripped.functions[1].callees.clear();
        assert!(judge(&stripped, EMULATED).is_err());
        let board = Board {
            tick_interrupt: "TIMER9",
            ..*EMULATED
        };
        assert!(judge(&image(&[5]), &board).is_err());
    }
}
