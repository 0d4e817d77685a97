//! The functions of an image, their calls, and the functions in the vector table.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use super::decode::{Flow, instruction};

/// A function of the image.
#[derive(Debug)]
pub(crate) struct Function {
    /// Its first byte.
    pub(crate) address: u32,
    /// Its readable name.
    pub(crate) name: String,
    /// All its names in the linker's symbol table: identical functions may be merged.
    pub(crate) aliases: Vec<String>,
    /// Functions to which it branches, by index.
    pub(crate) callees: Vec<usize>,
    /// True if it branches through a register.
    pub(crate) has_indirect: bool,
}

/// The image's call graph.
#[derive(Debug)]
pub(crate) struct Calls {
    /// In the order of their addresses.
    pub(crate) functions: Vec<Function>,
    /// The functions in the vector table, by index, once each: exceptions and interrupts, without
    /// the start of the program.
    pub(crate) vectors: Vec<usize>,
}

/// Extent of a function.
#[derive(Debug, Clone, Copy)]
struct Extent {
    start: u32,
    end: u32,
}

/// Code of one section.
struct Code<'a> {
    start: u32,
    bytes: &'a [u8],
    /// Starts of instructions (true) and data (false), from the linker's mapping symbols.
    modes: BTreeMap<u32, bool>,
}

/// Reads the call graph from an ELF with symbols.
pub(crate) fn read(elf: &[u8]) -> Result<Calls> {
    let file = object::File::parse(elf).context("not an ELF")?;
    let code = sections(&file)?;
    let (extents, names) = functions(&file, &code);
    let mut calls = Calls {
        functions: vec![],
        vectors: vectors(&file, &extents)?,
    };
    for (extent, aliases) in extents.iter().zip(&names) {
        let (callees, has_indirect) = match bridge_target(aliases, &names) {
            Some(to) => (vec![to], false),
            None => flow_of(*extent, &code, &extents),
        };
        let (name, aliases) = (readable(aliases), aliases.clone());
        calls.functions.push(Function {
            address: extent.start,
            name,
            aliases,
            callees,
            has_indirect,
        });
    }
    Ok(calls)
}

/// Returns the functions in the vector table, without its first two words: the stack and the start
/// of the program.
fn vectors(file: &object::File<'_>, extents: &[Extent]) -> Result<Vec<usize>> {
    let table = file.section_by_name(".vector_table");
    let bytes = table.context("no section .vector_table")?.data()?;
    let words = bytes.as_chunks::<4>().0.iter();
    let addresses = words.map(|word| u32::from_le_bytes(*word)).skip(2);
    let mut vectors = vec![];
    for address in addresses.filter(|address| *address != 0) {
        let function = holder(extents, address & !1);
        let begins = |i: &usize| extents[*i].start == address & !1;
        let function = function.filter(begins);
        vectors.push(function.with_context(|| format!("no function at {address:#x}, a vector"))?);
    }
    vectors.sort_unstable();
    vectors.dedup();
    ensure!(!vectors.is_empty(), "no vector in the vector table");
    Ok(vectors)
}

fn sections<'a>(file: &object::File<'a>) -> Result<Vec<Code<'a>>> {
    let mut code = vec![];
    for section in file.sections().filter(|s| s.kind() == SectionKind::Text) {
        let modes = file
            .symbols()
            .filter(|s| s.section_index() == Some(section.index()));
        let modes = modes.filter_map(|s| {
            let mode = s.name().ok()?.get(..2)?;
            matches!(mode, "$t" | "$d").then_some((s.address() as u32, mode == "$t"))
        });
        let start = section.address() as u32;
        code.push(Code {
            start,
            bytes: section.data()?,
            modes: modes.collect(),
        });
    }
    Ok(code)
}

/// Returns the extents by rising address, each with all its names.
fn functions(file: &object::File<'_>, code: &[Code<'_>]) -> (Vec<Extent>, Vec<Vec<String>>) {
    let mut found: BTreeMap<u32, (u32, Vec<String>)> = BTreeMap::new();
    let texts = file
        .symbols()
        .filter(|s| s.kind() == SymbolKind::Text && s.is_definition());
    for symbol in texts {
        // Bit 0 of a function's address marks Thumb code.
        let start = symbol.address() as u32 & !1;
        let entry = found.entry(start).or_default();
        entry.0 = entry.0.max(symbol.size() as u32);
        entry.1.extend(symbol.name().map(String::from));
    }
    let starts: Vec<u32> = found.keys().copied().collect();
    let mut extents = vec![];
    let mut names = vec![];
    for (i, (start, (size, aliases))) in found.into_iter().enumerate() {
        // Hand-written assembly may lack a size: it ends at the next function.
        let section_end = code.iter().find_map(|c| c.contains(start).then(|| c.end()));
        let next = starts.get(i + 1).copied().unwrap_or(u32::MAX);
        let limit = next.min(section_end.unwrap_or(start));
        let end = if size == 0 { limit } else { start + size };
        extents.push(Extent { start, end });
        names.push(aliases);
    }
    (extents, names)
}

/// Name of the linker's bridges: a branch reaches 16 MiB, and memories may be farther apart.
const BRIDGE: &str = "__Thumbv7ABSLongThunk_";

impl Function {
    /// Returns true if it is a bridge of the linker to another function.
    pub(crate) fn is_bridge(&self) -> bool {
        self.aliases.iter().any(|name| name.starts_with(BRIDGE))
    }
}

/// Returns the function that is the target of a bridge with these names.
fn bridge_target(aliases: &[String], names: &[Vec<String>]) -> Option<usize> {
    let to = aliases.iter().find_map(|name| name.strip_prefix(BRIDGE))?;
    names.iter().position(|n| n.iter().any(|name| name == to))
}

/// Returns the functions to which the one at `extent` branches, and true if it branches through a
/// register.
fn flow_of(extent: Extent, code: &[Code<'_>], extents: &[Extent]) -> (Vec<usize>, bool) {
    let mut callees = vec![];
    let mut has_indirect = false;
    let Some(code) = code.iter().find(|c| c.contains(extent.start)) else {
        return (callees, has_indirect);
    };
    let mut at = extent.start;
    while at < extent.end {
        let (length, flow) = match code.is_instruction(at) {
            true => instruction(at, code.half_word(at), code.half_word(at + 2)),
            false => (2, Flow::Next),
        };
        match flow {
            Flow::To(to) => match holder(extents, to) {
                Some(callee) if extents[callee].start == extent.start => {}
                Some(callee) => callees.push(callee),
                // Code without a symbol cannot be followed either.
                None => has_indirect = true,
            },
            Flow::Indirect => has_indirect = true,
            Flow::Next => {}
        }
        at += length;
    }
    callees.sort_unstable();
    callees.dedup();
    (callees, has_indirect)
}

/// Returns the function that contains `address`.
fn holder(extents: &[Extent], address: u32) -> Option<usize> {
    let after = extents.partition_point(|e| e.start <= address);
    let i = after.checked_sub(1)?;
    (address < extents[i].end).then_some(i)
}

impl Code<'_> {
    fn end(&self) -> u32 {
        self.start + self.bytes.len() as u32
    }

    fn contains(&self, address: u32) -> bool {
        (self.start..self.end()).contains(&address)
    }

    fn is_instruction(&self, address: u32) -> bool {
        self.modes
            .range(..=address)
            .next_back()
            .is_none_or(|(_, mode)| *mode)
    }

    fn half_word(&self, address: u32) -> u16 {
        let at = (address - self.start) as usize;
        match self.bytes.get(at..at + 2) {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => 0,
        }
    }
}

/// Returns the first name, without mangling and without the compiler's hash.
fn readable(aliases: &[String]) -> String {
    let name = aliases.first().map_or("?", String::as_str);
    format!("{:#}", rustc_demangle::demangle(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_between_instructions_is_not_read_as_code() {
        // bl 0x100, then a literal that would read as another call, then bx lr.
        let bytes = [0x00, 0xF0, 0x7E, 0xF8, 0x00, 0xF0, 0x7E, 0xF8, 0x70, 0x47];
        let modes = BTreeMap::from([(0, true), (4, false), (8, true)]);
        let code = [Code {
            start: 0,
            bytes: &bytes,
            modes,
        }];
        let extents = [(0, 10), (0x100, 0x102), (0x104, 0x106)];
        let extents = extents.map(|(start, end)| Extent { start, end });
        assert_eq!(flow_of(extents[0], &code, &extents), (vec![1], false));
    }

    #[test]
    fn branch_into_a_function_finds_that_function() {
        let extents = [(0, 10), (16, 32)].map(|(start, end)| Extent { start, end });
        assert_eq!(holder(&extents, 20), Some(1));
        assert_eq!(holder(&extents, 12), None);
    }

    #[test]
    fn names_are_readable() {
        let mangled = ["_ZN4core9panicking9panic_fmt17h0123456789abcdefE".to_string()];
        assert_eq!(readable(&mangled), "core::panicking::panic_fmt");
        assert_eq!(readable(&["TIMER0".to_string()]), "TIMER0");
    }
}
