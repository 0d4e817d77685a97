//! An image's segments and symbols, read from its ELF.

use std::collections::BTreeMap;
use std::path::Path;

use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD, STT_FUNC};
use object::read::elf::{FileHeader, ProgramHeader, Sym};

/// A run of bytes, with its load and run addresses.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Address it runs at.
    pub runs: u32,
    /// Address it is loaded to.
    pub loaded: u32,
    /// Bytes in memory.
    pub size: u32,
    /// Its bytes in the file; the rest of `size` is not initialised by it.
    pub bytes: Vec<u8>,
}

/// A function of the image, or another symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its first byte; for a function, without the Thumb bit.
    pub address: u32,
    /// Its length in bytes.
    pub size: u32,
}

/// An image: segments and symbols.
pub struct Image {
    /// Segments to load.
    pub segments: Vec<Segment>,
    functions: BTreeMap<String, Function>,
    symbols: BTreeMap<String, Function>,
    /// Start addresses of code (true) and data in it (false).
    mapping: BTreeMap<u32, bool>,
}

impl Image {
    /// Reads the ELF at `path`.
    ///
    /// # Panics
    /// If it is not an ELF or cannot be read: the test cannot continue.
    #[must_use]
    pub fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the image can be read");
        let header = FileHeader32::<LittleEndian>::parse(&*bytes).expect("a 32-bit ELF");
        let sections = header.sections(LittleEndian, &*bytes).expect("sections");
        let table = sections
            .symbols(LittleEndian, &*bytes, object::elf::SHT_SYMTAB)
            .expect("symbols");
        let (mut functions, mut symbols) = (BTreeMap::new(), BTreeMap::new());
        let mut mapping = BTreeMap::new();
        for symbol in table.iter() {
            let name = symbol.name(LittleEndian, table.strings()).unwrap_or(b"");
            let name = String::from_utf8_lossy(name).into_owned();
            let (address, size) = (symbol.st_value(LittleEndian), symbol.st_size(LittleEndian));
            if symbol.st_type() == STT_FUNC {
                let address = address & !1;
                functions.insert(name.clone(), Function { address, size });
            }
            match name.split('.').next() {
                Some("$t") => drop(mapping.insert(address, true)),
                Some("$d") => drop(mapping.insert(address, false)),
                _ => drop(symbols.insert(name, Function { address, size })),
            }
        }
        let segments = header
            .program_headers(LittleEndian, &*bytes)
            .expect("program headers")
            .iter()
            .filter(|p| p.p_type(LittleEndian) == PT_LOAD && p.p_memsz(LittleEndian) > 0)
            .map(|p| Segment {
                runs: p.p_vaddr(LittleEndian),
                loaded: p.p_paddr(LittleEndian),
                size: p.p_memsz(LittleEndian),
                bytes: p.data(LittleEndian, &*bytes).expect("data").to_vec(),
            })
            .collect();
        Self {
            segments,
            functions,
            symbols,
            mapping,
        }
    }

    /// Returns all functions by their (mangled) names.
    pub fn functions(&self) -> impl Iterator<Item = (&str, Function)> {
        self.functions.iter().map(|(name, f)| (name.as_str(), *f))
    }

    /// Returns the functions whose name contains all of `parts`.
    #[must_use]
    pub fn functions_like(&self, parts: &[&str]) -> Vec<Function> {
        let fits = |name: &str| parts.iter().all(|part| name.contains(part));
        let all = self.functions().filter(|(name, _)| fits(name));
        all.map(|(_, function)| function).collect()
    }

    /// Returns the first function whose name contains all of `parts`.
    ///
    /// # Panics
    /// If there is none: the test needs one.
    #[must_use]
    pub fn function_like(&self, parts: &[&str]) -> Function {
        let found = self.functions_like(parts);
        *found.first().expect("a function of its own")
    }

    /// Returns the function that the link calls for every message it sends.
    #[must_use]
    pub fn message_encoder(&self) -> Function {
        self.function_like(&["link", "tx_queue", "in_session"])
    }

    /// Returns a function of core's that panics and takes only a source location.
    #[must_use]
    pub fn panicking(&self) -> Function {
        self.function_like(&["panic_const_rem_by_zero"])
    }

    /// Returns the name of the function at `address`.
    #[must_use]
    pub fn at(&self, address: u32) -> &str {
        self.functions()
            .find(|(_, f)| (f.address..f.address + f.size.max(2)).contains(&address))
            .map_or("?", |(name, _)| name)
    }

    /// Returns the value of a symbol, as set by a linker script.
    #[must_use]
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).map(|symbol| symbol.address)
    }

    /// Returns the first symbol whose name contains all of these.
    #[must_use]
    pub fn symbol_like(&self, parts: &[&str]) -> Option<Function> {
        let fits = |name: &str| parts.iter().all(|part| name.contains(part));
        let mut all = self.symbols.iter();
        all.find_map(|(name, symbol)| fits(name).then_some(*symbol))
    }

    /// Returns every instruction with its address; a short one is in the upper half-word.
    pub fn instructions(&self) -> impl Iterator<Item = (u32, u32)> {
        let starts: Vec<_> = self.mapping.iter().map(|(a, code)| (*a, *code)).collect();
        let ends: Vec<_> = starts.iter().skip(1).map(|(a, _)| *a).collect();
        let code = starts
            .into_iter()
            .zip(ends)
            .filter(|((_, is_code), _)| *is_code);
        code.flat_map(|((start, _), end)| decode(start, &self.halves(start, end)))
    }

    fn halves(&self, start: u32, end: u32) -> Vec<u16> {
        let bytes = self.segments.iter().find_map(|s| {
            let from = start.checked_sub(s.runs)? as usize;
            s.bytes.get(from..from + (end - start) as usize)
        });
        let bytes = bytes.unwrap_or(&[]);
        let halves = bytes.as_chunks::<2>().0.iter();
        halves.map(|b| u16::from_le_bytes(*b)).collect()
    }
}

/// Cuts half-words into instructions.
fn decode(start: u32, halves: &[u16]) -> Vec<(u32, u32)> {
    let (mut found, mut at) = (vec![], 0);
    while let Some(first) = halves.get(at) {
        let address = start + 2 * at as u32;
        let is_long = first >> 11 >= 0b11101;
        let second = if is_long { halves.get(at + 1) } else { None };
        found.push((
            address,
            u32::from(*first) << 16 | second.map_or(0, |s| (*s).into()),
        ));
        at += if is_long { 2 } else { 1 };
    }
    found
}
