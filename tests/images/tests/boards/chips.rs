//! Loaded and reserved segments lie in the chip's memories, as listed in probe-rs's registry.

use std::ops::Range;

use hapterra_image_tests::device::machines;
use hapterra_image_tests::machine::Machine;
use hapterra_tests::repository;
use probe_rs::config::{MemoryRegion, Registry, Target};

fn target(machine: &Machine) -> Target {
    let registry = Registry::from_builtin_families();
    let found = registry.get_target_by_name(machine.chip.chip);
    found.expect("probe-rs knows the chip")
}

/// Returns the ranges of RAM, with neighbours joined.
fn ram(target: &Target) -> Vec<Range<u64>> {
    joined(target, |region| match region {
        MemoryRegion::Ram(ram) => Some(ram.range.clone()),
        _ => None,
    })
}

fn flash(target: &Target) -> Vec<Range<u64>> {
    joined(target, |region| match region {
        MemoryRegion::Nvm(nvm) => Some(nvm.range.clone()),
        _ => None,
    })
}

fn joined(target: &Target, pick: fn(&MemoryRegion) -> Option<Range<u64>>) -> Vec<Range<u64>> {
    let mut all: Vec<_> = target.memory_map.iter().filter_map(pick).collect();
    all.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<u64>> = vec![];
    for range in all {
        match joined.last_mut() {
            Some(last) if last.end >= range.start => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

fn holds(memories: &[Range<u64>], start: u32, bytes: usize) -> bool {
    let (start, end) = (u64::from(start), u64::from(start) + bytes as u64);
    memories.iter().any(|m| m.start <= start && end <= m.end)
}

#[test]
fn segments_lie_in_the_chips_memory() {
    for machine in machines() {
        let (chip, target) = (machine.chip, target(&machine));
        let (ram, flash) = (ram(&target), flash(&target));
        let mut loader = target.flash_loader();
        for segment in &machine.image.segments {
            let what = format!(
                "{}: {:#x} at {:#x}",
                chip.board, segment.loaded, segment.runs
            );
            if !segment.bytes.is_empty() {
                assert!(holds(&flash, segment.loaded, segment.bytes.len()), "{what}");
                let added = loader.add_data(segment.loaded.into(), &segment.bytes);
                added.expect("probe-rs would flash it");
            }
            let in_place =
                segment.runs == segment.loaded && segment.bytes.len() as u32 == segment.size;
            let runs_in = if in_place { &flash } else { &ram };
            assert!(
                holds(runs_in, segment.runs, segment.size as usize),
                "{what}"
            );
        }
    }
}

/// Safety: 41.
#[test]
fn stack_is_lowest_in_ram_and_overlaps_no_segment() {
    for machine in machines() {
        let (chip, target) = (machine.chip, target(&machine));
        let top = machine.word(chip.memories[0].0);
        let end = machine.image.symbol("_stack_end").expect("the stack's end");
        // The real depth of the stack is measured elsewhere.
        assert!(end + 8192 <= top, "{}: {end:#x} to {top:#x}", chip.board);
        assert!(holds(&ram(&target), end, (top - end) as usize));
        // Below the stack there is no RAM, so an overrun cannot write anywhere.
        assert!(!holds(&ram(&target), end - 4, 4), "{}", chip.board);
        for segment in &machine.image.segments {
            assert!(
                segment.runs >= top || segment.runs + segment.size <= end,
                "{}: {:#x} is in the stack",
                chip.board,
                segment.runs
            );
        }
    }
}

#[test]
fn emulated_chip_has_the_memories_of_the_real_one() {
    for machine in machines() {
        let target = target(&machine);
        let real: Vec<_> = [flash(&target), ram(&target)].concat();
        for (start, bytes) in machine.chip.memories {
            // System memory is not for programs: the registry may omit it.
            let system = (0x1FF0_0000..0x2000_0000).contains(start);
            let there = system || holds(&real, *start, *bytes as usize);
            assert!(there, "{}: {start:#x}", machine.chip.board);
        }
    }
}

#[test]
fn board_pages_state_the_size_of_the_tiles() {
    for machine in machines() {
        let board = machine.chip.board;
        let page = board.trim_end_matches("-spi");
        let path = repository().join(format!("docs/reference/boards/{page}.md"));
        let page = std::fs::read_to_string(path).expect("the page");
        let tiles = machine
            .image
            .symbol_like(&["TILES"])
            .expect("the tiles")
            .size;
        let statement = format!("take {},{:03} bytes of RAM", tiles / 1000, tiles % 1000);
        assert!(page.contains(&statement), "{board}: {statement}");
    }
}

#[test]
fn images_contain_no_build_paths() {
    for machine in machines() {
        for segment in &machine.image.segments {
            let text = String::from_utf8_lossy(&segment.bytes);
            let registry_path = text.find("/registry/src/");
            assert_eq!(registry_path, None, "{}", machine.chip.board);
        }
    }
}
