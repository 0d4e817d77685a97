//! Check that the code of an interrupt is in the memory without wait states.
//!
//! Its linker script defines two areas: that memory, and the functions that stay in flash. A
//! function in neither area is an error.

use std::ops::Range;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol};

use super::calls::Calls;
use super::{reached, short};
use crate::board::Board;

/// The areas that the linker script defines.
#[derive(Debug, Clone)]
pub(crate) struct Areas {
    /// The part of the memory without wait states that contains code.
    fast: Range<u32>,
    /// Functions that stay in flash.
    in_flash: Range<u32>,
}

/// Reads the areas from an ELF with symbols. No constants may be in the flash.
pub(crate) fn areas(elf: &[u8]) -> Result<Areas> {
    let file = object::File::parse(elf).context("not an ELF")?;
    let symbol = |name: &str| {
        let mut symbols = file.symbols();
        let found = symbols.find(|symbol| symbol.name() == Ok(name));
        found
            .map(|symbol| symbol.address() as u32)
            .with_context(|| format!("no symbol {name}"))
    };
    let constants = file.section_by_name(".rodata").map_or(0, |s| s.size());
    ensure!(constants == 0, "{constants} bytes of constants in flash");
    Ok(Areas {
        fast: symbol("_tick_start")?..symbol("_tick_end")?,
        in_flash: symbol("_tick_in_flash_start")?..symbol("_tick_in_flash_end")?,
    })
}

/// Returns a sentence about all functions that `interrupt` reaches, or an error if one of them is
/// in neither area.
pub(crate) fn check(
    calls: &Calls,
    board: &Board,
    interrupt: &str,
    areas: &Areas,
) -> Result<String> {
    let functions = &calls.functions;
    let is_it = |i: &&usize| functions[**i].aliases.iter().any(|name| name == interrupt);
    let root = calls.vectors.iter().find(is_it);
    let root = *root.with_context(|| format!("no interrupt {interrupt}"))?;
    let found = reached(calls, board, root);
    let all: Vec<usize> = found.all().filter(|&i| !functions[i].is_bridge()).collect();
    let is_fast = |i: &usize| areas.fast.contains(&functions[*i].address);
    let is_named = |i: &usize| areas.in_flash.contains(&functions[*i].address);
    let forgotten = all.iter().filter(|i| !is_fast(i) && !is_named(i));
    let forgotten: Vec<String> = forgotten.map(|i| short(&functions[*i].name)).collect();
    ensure!(
        forgotten.is_empty(),
        "{interrupt} reaches what is neither in ITCM nor named to stay in flash \
         (firmware/memory):\n    {}",
        forgotten.join("\n    ")
    );
    ensure!(is_fast(&root), "{interrupt} itself is not in ITCM");
    let fast = all.iter().filter(|i| is_fast(i)).count();
    let (all, bytes) = (all.len(), areas.fast.len());
    Ok(format!(
        "{fast} of the {all} functions that {interrupt} reaches lie in ITCM ({bytes} bytes), \
         and the others where they are named"
    ))
}

#[cfg(test)]
mod tests {
    use super::super::calls::Function;
    use super::*;
    use crate::board::EMULATED;

    fn function(name: &str, address: u32, callees: &[usize]) -> Function {
        Function {
            address,
            name: name.into(),
            aliases: vec![name.into()],
            callees: callees.to_vec(),
            has_indirect: false,
        }
    }

    fn checked(placed: [u32; 4]) -> Result<String> {
        let [tick, bridge, rare, leaf] = placed;
        let calls = Calls {
            functions: vec![
                function("TIM7", tick, &[1, 3]),
                function("__Thumbv7ABSLongThunk_rare", bridge, &[2]),
                function("rare", rare, &[3]),
                function("leaf", leaf, &[]),
                function("elsewhere", 0x0800_1000, &[2]),
            ],
            vectors: vec![0],
        };
        let areas = Areas {
            fast: 0x20..0x100,
            in_flash: 0x0800_0000..0x0800_0100,
        };
        check(&calls, EMULATED, "TIM7", &areas)
    }

    #[test]
    fn reached_functions_lie_in_fast_memory_or_named_flash() {
        let reported = checked([0x20, 0x40, 0x0800_0000, 0x80]).expect("all are placed");
        assert!(reported.starts_with("2 of the 3 functions"), "{reported}");
        // A bridge may be anywhere.
        assert!(checked([0x20, 0x0800_2000, 0x0800_0000, 0x80]).is_ok());
    }

    #[test]
    fn function_outside_fast_memory_is_named() {
        for placed in [
            [0x20, 0x40, 0x0800_0000, 0x0800_0100],
            [0x20, 0x40, 0x0800_0100, 0x80],
            [0x0800_0200, 0x40, 0x0800_0000, 0x80],
        ] {
            let message = checked(placed).expect_err("one is elsewhere").to_string();
            let outside = ["leaf", "rare", "TIM7"];
            let found = outside
                .iter()
                .filter(|name| message.contains(&format!("\n    {name}")));
            assert_eq!(found.count(), 1, "{message}");
        }
        let message = checked([0x0800_0000, 0x40, 0x0800_0000, 0x80]);
        let message = message.expect_err("the root in flash").to_string();
        assert!(message.contains("itself"), "{message}");
    }
}
