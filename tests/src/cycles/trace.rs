//! The log of an emulated run (`-d in_asm,exec,nochain`), read as it comes: blocks of code once,
//! then a line for each block that is executed.
//!
//! ```text
//! IN: Reset
//! 0x00000052:  c004       stm      r0!, {r2}
//! 0x00000054:  e7fb       b        #0x4e
//!
//! Trace 0: 0x7f8c74000740 [00800408/00000052/00000110/ff000200] Reset
//! ```

use std::collections::HashMap;
use std::io::{BufRead, Result};
use std::rc::Rc;

use super::instruction::{Instruction, decode};
use super::{Cycles, Tick, in_flash};

/// Whose a block is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Owner {
    /// The function that is a tick.
    Tick,
    /// The image around it.
    Image,
    /// What both may call.
    Shared,
}

/// Code without a branch before its end.
struct Block {
    owner: Owner,
    /// Whether an H743 has it in flash.
    in_flash: bool,
    code: Vec<Instruction>,
}

/// Reads a log to its end, and returns what each tick in it took: from the entry of a function
/// whose name has one of `ticks` in it, until another function of `image` goes on.
///
/// # Errors
/// If the log cannot be read.
///
/// # Panics
/// If the log executes what it did not list.
pub fn ticks(mut log: impl BufRead, image: &str, ticks: &[&str]) -> Result<Vec<Cycles>> {
    let mut run = Run::default();
    let mut line = Vec::new();
    while log.read_until(b'\n', &mut line)? > 0 {
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_end();
        if let Some(at) = text.strip_prefix("Trace ") {
            let pc = at.split('/').nth(1).and_then(hexadecimal);
            run.execute(pc.expect("a block's address"));
        } else if let Some(name) = text.strip_prefix("IN: ") {
            let owner = match name {
                _ if ticks.iter().any(|tick| name.contains(tick)) => Owner::Tick,
                _ if name.contains(image) => Owner::Image,
                _ => Owner::Shared,
            };
            run.listed = Some(Block {
                owner,
                in_flash: in_flash::is_left(name),
                code: vec![],
            });
        } else if let Some(block) = &mut run.listed
            && let Some(instruction) = listed(text)
        {
            block.code.push(instruction);
        }
        line.clear();
    }
    Ok(run.ended)
}

/// An instruction of a listing.
fn listed(text: &str) -> Option<Instruction> {
    let (address, rest) = text.strip_prefix("0x")?.split_once(':')?;
    let mut halves = rest.split_whitespace();
    let first = halves.next().and_then(hexadecimal)?;
    let wide = first >> 11 >= 0b11101;
    let second = if wide {
        halves.next().and_then(hexadecimal)?
    } else {
        0
    };
    Some(decode(hexadecimal(address)?, first as u16, second as u16))
}

fn hexadecimal(text: &str) -> Option<u32> {
    u32::from_str_radix(text, 16).ok()
}

/// A run, as far as it was read.
#[derive(Default)]
struct Run {
    /// A block that is being listed: the next one executed.
    listed: Option<Block>,
    blocks: HashMap<u32, Rc<Block>>,
    /// The block that is executed, and the tick that it belongs to.
    now: Option<Rc<Block>>,
    tick: Option<Tick>,
    ended: Vec<Cycles>,
}

impl Run {
    fn execute(&mut self, pc: u32) {
        if let Some(block) = self.listed.take() {
            self.blocks.insert(pc, Rc::new(block));
        }
        let next = Rc::clone(self.blocks.get(&pc).expect("listed before"));
        if let (Some(tick), Some(block)) = (&mut self.tick, &self.now) {
            let behind = block.code.iter().skip(1).map(|i| i.address).chain([pc]);
            for (instruction, next) in block.code.iter().zip(behind) {
                tick.execute(instruction, next, block.in_flash);
            }
        }
        match next.owner {
            Owner::Image => self
                .ended
                .extend(self.tick.take().map(|tick| tick.cycles())),
            Owner::Tick => drop(self.tick.get_or_insert_default()),
            Owner::Shared => {}
        }
        self.now = Some(next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_is_all_that_it_calls_and_nothing_else() {
        const LOG: &str = "----------------\n\
            IN: image::main\n0x00000000:  f000 f806  bl       #0x10\n\n\
            Trace 0: 0x7f [00800408/00000000/00000110/ff000200] image::main\n\
            ----------------\n\
            IN: image::tick\n0x00000010:  b580       push     {r7, lr}\n\
            0x00000012:  f000 f805  bl       #0x20\n\n\
            Trace 0: 0x7f [00800408/00000010/00000110/ff000200] image::tick\n\
            IN: memcpy\n0x00000020:  4770       bx       lr\n\n\
            Trace 0: 0x7f [00800408/00000020/00000110/ff000200] memcpy\n\
            IN: image::tick\n0x00000016:  bd80       pop      {r7, pc}\n\n\
            Trace 0: 0x7f [00800408/00000016/00000110/ff000200] image::tick\n\
            IN: image::main\n0x00000004:  f000 f80c  bl       #0x20\n\n\
            Trace 0: 0x7f [00800408/00000004/00000110/ff000200] image::main\n\
            Trace 0: 0x7f [00800408/00000020/00000110/ff000200] memcpy\n\
            Trace 0: 0x7f [00800408/00000000/00000110/ff000200] image::main\n\
            Trace 0: 0x7f [00800408/00000010/00000110/ff000200] image::tick\n";
        let found = ticks(LOG.as_bytes(), "image::", &["image::tick"]).expect("read");
        assert_eq!(found.len(), 1, "the second does not end");
        // push, bl, bx lr, pop
        assert_eq!(found[0].instructions, 4);
        // An M4 without wait states: 3, 1 + 3, 1 + 3, 3 + 3. The flash: 5 for the first line, and
        // 5 with what is left of a read behind for each jump.
        let least = 3 + 4 + 4 + 6;
        assert!(found[0].g474 >= least + 15, "{found:?}");
        assert!(found[0].g474 <= least + 15 + 15, "{found:?}");
    }
}
