//! Flash and RAM of an image, read from its ELF and compared with the budgets.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD, ProgramHeader32};
use object::read::elf::{FileHeader, ProgramHeader};

use crate::board::{Board, Memory};

/// Use of one memory by an image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Use {
    memory: Memory,
    bytes: u64,
}

/// Reads the ELF of every board, prints the table, and fails if one is over its budget.
pub(crate) fn check<'a>(images: impl Iterator<Item = (&'a Board, &'a Path)>) -> Result<()> {
    let mut over = vec![];
    println!(
        "{:<20}{:<9}{:>9}{:>9}{:>7}",
        "image", "memory", "bytes", "budget", ""
    );
    for (board, path) in images {
        let elf = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let uses = measure(&elf, board).with_context(|| path.display().to_string())?;
        for Use { memory, bytes } in uses {
            let (name, budget) = (memory.name, memory.budget);
            let percent = bytes * 100 / budget;
            println!(
                "{:<20}{name:<9}{bytes:>9}{budget:>9}{percent:>5} %",
                board.name
            );
            if bytes > budget {
                over.push(format!(
                    "{} uses {bytes} bytes of {name}, its budget is {budget}",
                    board.name
                ));
            }
        }
    }
    ensure!(
        over.is_empty(),
        "{}; budgets are in xtask/src/board.rs",
        over.join("; ")
    );
    Ok(())
}

/// Adds up the loaded segments of `elf`, memory by memory.
fn measure(elf: &[u8], board: &Board) -> Result<Vec<Use>> {
    let mut uses: Vec<_> = board
        .memories
        .iter()
        .map(|&memory| Use { memory, bytes: 0 })
        .collect();
    let mut add = |address: u64, bytes: u64| -> Result<()> {
        let end = address + bytes;
        let found = uses
            .iter_mut()
            .find(|u| bytes > 0 && u.memory.contains(address));
        match found {
            _ if bytes == 0 => {}
            Some(u) if u.memory.contains(end - 1) => u.bytes += bytes,
            _ => bail!("{bytes} bytes at {address:#x} lie in no memory of the board"),
        }
        Ok(())
    };
    let header = FileHeader32::<LittleEndian>::parse(elf).context("not a 32-bit ELF")?;
    for segment in header.program_headers(LittleEndian, elf)? {
        if segment.p_type(LittleEndian) != PT_LOAD {
            continue;
        }
        let (runs, loaded, in_file, in_memory) = addresses(segment);
        // Initialised data is stored at its load address...
        add(loaded, in_file)?;
        // ... and also needs room at its run address, if that differs.
        let runs_in_place = runs == loaded;
        add(
            runs,
            if runs_in_place {
                in_memory - in_file
            } else {
                in_memory
            },
        )?;
    }
    Ok(uses)
}

/// Returns run address, load address, bytes in the file, bytes in memory.
fn addresses(segment: &ProgramHeader32<LittleEndian>) -> (u64, u64, u64, u64) {
    let (runs, loaded) = (segment.p_vaddr(LittleEndian), segment.p_paddr(LittleEndian));
    let (in_file, in_memory) = (
        segment.p_filesz(LittleEndian),
        segment.p_memsz(LittleEndian),
    );
    (runs.into(), loaded.into(), in_file.into(), in_memory.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::BOARDS;

    /// Returns a 32-bit ARM ELF with only loaded segments: run address, load address, bytes in the
    /// file, bytes in memory.
    fn elf(segments: &[[u32; 4]]) -> Vec<u8> {
        const HEADER: u16 = 52;
        const PROGRAM_HEADER: u16 = 32;
        let mut elf = b"\x7fELF\x01\x01\x01".to_vec();
        elf.resize(16, 0);
        let count = segments.len() as u16;
        let halves = |elf: &mut Vec<u8>, values: &[u16]| {
            elf.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        };
        let words = |elf: &mut Vec<u8>, values: &[u32]| {
            elf.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        };
        halves(&mut elf, &[2, 40]); // executable, ARM
        words(&mut elf, &[1, 0, HEADER.into(), 0, 0]);
        halves(&mut elf, &[HEADER, PROGRAM_HEADER, count, 40, 0, 0]);
        for &[runs, loaded, in_file, in_memory] in segments {
            words(
                &mut elf,
                &[PT_LOAD.0, 0, runs, loaded, in_file, in_memory, 0, 4],
            );
        }
        elf
    }

    fn bytes(segments: &[[u32; 4]]) -> Vec<u64> {
        let uses = measure(&elf(segments), &BOARDS[1]).unwrap();
        uses.iter().map(|u| u.bytes).collect()
    }

    const FLASH: u32 = 0x0800_0000;
    const RAM: u32 = 0x2000_0000;

    #[test]
    fn values_take_flash_and_ram_and_zeros_only_ram() {
        let code = [FLASH, FLASH, 1000, 1000];
        let data_and_zeros = [RAM, FLASH + 1000, 40, 240];
        let never_set = [RAM + 240, RAM + 240, 0, 60];
        assert_eq!(bytes(&[code, data_and_zeros, never_set]), [1040, 300]);
    }

    #[test]
    fn bytes_outside_every_memory_are_an_error() {
        for segment in [[0x1000_0000, FLASH, 8, 8], [RAM + 0x1_FFFC, FLASH, 8, 8]] {
            assert!(
                measure(&elf(&[segment]), &BOARDS[1]).is_err(),
                "{segment:x?}"
            );
        }
    }

    #[test]
    fn image_over_budget_error_names_board_and_memory() {
        let path = std::env::temp_dir().join(format!("hapterra-size-{}.elf", std::process::id()));
        let try_size = |bytes| {
            std::fs::write(&path, elf(&[[FLASH, FLASH, bytes, bytes]])).unwrap();
            check([(&BOARDS[1], path.as_path())].into_iter())
        };
        let budget = BOARDS[1].memories[0].budget as u32;
        try_size(budget).unwrap();
        let message = try_size(budget + 1).unwrap_err().to_string();
        std::fs::remove_file(&path).unwrap();
        assert!(
            message.contains("nucleo-g474re") && message.contains("flash"),
            "{message}"
        );
    }

    #[test]
    fn non_elf_input_is_refused() {
        assert!(measure(b"not an elf", &BOARDS[1]).is_err());
    }
}
