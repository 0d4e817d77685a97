//! Check that no interrupt of an image reaches a panic.
//!
//! The finished ELF is checked, not the source, because link-time optimisation removes most bounds
//! checks. The check covers all functions in the vector table: every exception and every interrupt,
//! enabled or not. It follows every direct branch of every function that one of them can reach. A
//! call through a register cannot be followed, so it is an error unless it is in the board's table;
//! the walk then continues at the callees in the table. So the walk is complete without guesses
//! about pointers.

mod calls;
mod decode;
mod fast_memory;
mod reach;

use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::board::{Board, Exception};
use crate::run::report;
use calls::{Calls, Function};
use reach::Reached;

/// Fails if an interrupt of the image at `path` can reach a panic.
pub(crate) fn check(board: &Board, path: &Path) -> Result<()> {
    let elf = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let calls = calls::read(&elf).with_context(|| path.display().to_string())?;
    let checked = check_vectors(&calls, board).with_context(|| format!("image {}", board.name))?;
    let (name, list) = (board.name, checked.join(", "));
    report(format!("{name}: no panic can be reached from {list}"));
    if let Some(interrupt) = board.fast_interrupt {
        let areas = fast_memory::areas(&elf)?;
        let reported = fast_memory::check(&calls, board, interrupt, &areas);
        let reported = reported.with_context(|| format!("image {name}"))?;
        report(format!("{name}: {reported}"));
    }
    Ok(())
}

/// Returns the names of all vectors with the number of functions that each reaches, or an error if
/// one of these panics.
fn check_vectors(calls: &Calls, board: &Board) -> Result<Vec<String>> {
    let functions = &calls.functions;
    // An image without any panic means that the searched names are wrong.
    ensure!(
        functions.iter().any(|f| panics(&f.name)),
        "no panic function in the whole image: was it stripped?"
    );
    ensure!(!calls.vectors.is_empty(), "no vectors");
    let runs_tasks = |f: &Function| f.aliases.iter().any(|a| board.runs_tasks.contains(&&**a));
    let (mut checked, mut violations) = (vec![], vec![]);
    for &root in &calls.vectors {
        if runs_tasks(&functions[root]) {
            continue;
        }
        let found = reached(calls, board, root);
        let inner = || found.all().filter(|&i| !panics(&functions[i].name));
        for i in inner() {
            violations.extend(violations_of(calls, board, &found, i));
        }
        checked.push(format!("{} ({})", functions[root].name, inner().count()));
    }
    // A function that several interrupts reach is reported once.
    violations.sort_unstable();
    violations.dedup();
    ensure!(violations.is_empty(), "{}", violations.join("\n"));
    Ok(checked)
}

/// Returns all functions that a vector reaches. The walk ends at a panic, because its callees add
/// nothing, and at the exceptions of the table.
fn reached(calls: &Calls, board: &Board, root: usize) -> Reached {
    let functions = &calls.functions;
    reach::from(root, |i| {
        let caller = &functions[i];
        if panics(&caller.name) {
            return vec![];
        }
        let unknown =
            |c: &usize| find_exception(board.allowed_calls, caller, &functions[*c].name).is_none();
        let direct = caller.callees.iter().copied().filter(unknown);
        let targets =
            find_exception(board.allowed_indirect, caller, "").map_or(&[][..], |e| e.targets);
        let is_target = |i: &usize| targets.iter().any(|to| functions[*i].name.contains(to));
        let through_register = (0..functions.len()).filter(|i| caller.has_indirect && is_target(i));
        direct.chain(through_register).collect()
    })
}

/// Returns the faults of a reached function, each with the path to it.
fn violations_of(calls: &Calls, board: &Board, found: &Reached, i: usize) -> Vec<String> {
    let functions = &calls.functions;
    let caller = &functions[i];
    let names = found
        .chain(i)
        .into_iter()
        .map(|j| short(&functions[j].name));
    let chain = names.collect::<Vec<_>>().join("\n    -> ");
    let mut violations = vec![];
    for callee in caller.callees.iter().map(|&c| &functions[c].name) {
        if panics(callee) && find_exception(board.allowed_calls, caller, callee).is_none() {
            violations.push(format!("can panic:\n    {chain}\n    -> {callee}"));
        }
    }
    if !caller.has_indirect {
        return violations;
    }
    match find_exception(board.allowed_indirect, caller, "") {
        None => violations.push(format!(
            "calls through a register, which cannot be followed:\n    {chain}"
        )),
        Some(entry) => {
            let is_there = |to: &&&str| !functions.iter().any(|f| f.name.contains(**to));
            if let Some(to) = entry.targets.iter().find(is_there) {
                violations.push(format!(
                    "no function {to}, which the table names for:\n    {chain}"
                ));
            }
        }
    }
    violations
}

/// Returns a name without the long parts of generic ones.
fn short(name: &str) -> String {
    const MAX_CHARS: usize = 120;
    match name.char_indices().nth(MAX_CHARS) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.to_string(),
    }
}

/// Returns the entry for this caller and callee in a table of exceptions, each by part of its name.
fn find_exception<'t>(
    table: &'t [Exception],
    caller: &Function,
    callee: &str,
) -> Option<&'t Exception> {
    let is_caller = |parts: &[&str]| {
        let mut names = caller.aliases.iter().chain([&caller.name]);
        names.any(|name| parts.iter().all(|part| name.contains(part)))
    };
    table
        .iter()
        .find(|e| is_caller(e.caller) && callee.contains(e.callee))
}

/// Returns true if a function of this name is a panic or the common end of all panics.
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
            address: 0,
            name: name.into(),
            aliases: vec![name.into()],
            callees: callees.to_vec(),
            has_indirect,
        }
    }

    /// Returns an image of two vectors: the tick, which makes the given calls, and the supply's.
    fn image(tick_calls: &[usize]) -> Calls {
        let functions = vec![
            function("HapticTick", &[1], false),
            function("hapterra_core::tick", tick_calls, false),
            function("core::slice::index::slice_index_fail", &[3], false),
            function("core::panicking::panic_fmt", &[4], false),
            function("__rustc::rust_begin_unwind", &[], true),
            function("hapterra_core::surface", &[], false),
            function("<dyn Waker>::wake", &[], true),
            function("executor::wake_task", &[], false),
            function("SupplyLow", &[5], false),
        ];
        let vectors = vec![0, 8];
        Calls { functions, vectors }
    }

    fn complaint(calls: &Calls, board: &Board) -> String {
        check_vectors(calls, board).unwrap_err().to_string()
    }

    #[test]
    fn panic_two_calls_away_is_found_with_its_call_chain() {
        let message = complaint(&image(&[2, 5]), EMULATED);
        assert!(
            message.contains("slice_index_fail\n    -> core::panicking::panic_fmt"),
            "{message}"
        );
        assert_eq!(message.matches("can panic").count(), 1, "{message}");
        assert!(!message.contains("register"), "{message}");
    }

    #[test]
    fn panic_outside_the_interrupts_is_allowed() {
        let checked = check_vectors(&image(&[5]), EMULATED).unwrap();
        assert_eq!(checked, ["HapticTick (3)", "SupplyLow (2)"]);
    }

    #[test]
    fn panic_in_any_vector_without_tasks_is_found() {
        let mut calls = image(&[5]);
        calls.functions[8].callees.push(3);
        let message = complaint(&calls, EMULATED);
        assert!(
            message.contains("SupplyLow\n    -> core::panicking::panic_fmt"),
            "{message}"
        );
        let board = Board {
            runs_tasks: &["SupplyLow"],
            ..*EMULATED
        };
        assert_eq!(check_vectors(&calls, &board).unwrap(), ["HapticTick (3)"]);
    }

    #[test]
    fn unlisted_indirect_call_is_reported_and_listed_one_followed() {
        let message = complaint(&image(&[6]), EMULATED);
        assert!(message.contains("register"), "{message}");
        let known = &[Exception {
            caller: &["Waker>::wake"],
            callee: "",
            targets: &["wake_task"],
            because: "test",
        }];
        let board = Board {
            allowed_indirect: known,
            ..*EMULATED
        };
        let mut calls = image(&[6]);
        assert_eq!(check_vectors(&calls, &board).unwrap()[0], "HapticTick (4)");
        calls.functions[7].callees.push(3);
        let message = complaint(&calls, &board);
        assert!(message.contains("wake_task\n    -> core"), "{message}");
        calls.functions[7].name = "something else".into();
        let message = complaint(&calls, &board);
        assert!(message.contains("no function wake_task"), "{message}");
    }

    #[test]
    fn panic_exception_applies_to_one_caller_only() {
        let allowed = |caller| Exception {
            caller,
            callee: "panic_fmt",
            targets: &[],
            because: "test",
        };
        let table: &[Exception] = &[allowed(&["elsewhere"]), allowed(&["slice_index_fail"])];
        let board = Board {
            allowed_calls: Box::leak(table.to_vec().into_boxed_slice()),
            ..*EMULATED
        };
        assert!(check_vectors(&image(&[2]), &board).is_ok());
        let message = complaint(&image(&[2, 3]), &board);
        assert!(
            message.contains("tick\n    -> core::panicking"),
            "{message}"
        );
    }

    #[test]
    fn image_without_symbols_or_vectors_is_an_error() {
        let mut stripped = image(&[5]);
        stripped.functions.truncate(2);
        stripped.functions[1].callees.clear();
        stripped.vectors.truncate(1);
        assert!(check_vectors(&stripped, EMULATED).is_err());
        let mut without = image(&[5]);
        without.vectors.clear();
        assert!(check_vectors(&without, EMULATED).is_err());
    }
}
