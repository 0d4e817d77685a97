//! The counting image (`firmware/boards/mps2-an386-counts`) in the emulated core, with the model of
//! cycles for each block of its ticks. QEMU counts the instructions of the same image, but could
//! follow it only through a log of every block, which takes hours.
//!
//! Modelled: the two memories; the image's semihosting calls, on files in one folder; registers
//! that store written values. There is no time: only instructions are counted.

use std::cell::RefCell;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use hapterra_tests::cycles::instruction::{Instruction, decode};
use hapterra_tests::cycles::{Cycles, Tick, in_flash};
use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM, Unicorn};

use crate::elf::Image;

/// Memories and the area of the registers: address and bytes.
const CODE: (u32, u32) = (0, 0x40_0000);
const OTHER_CODE: [(u32, u32); 3] = [
    (0x2000_0000, 0x40_0000),
    (0x4000_0000, 0x10_0000),
    (0xE000_0000, 0x10_0000),
];
/// `bkpt #0xab`, a semihosting call, as in [`Image::instructions`], and `nop`.
const CALL: u32 = 0xBEAB_0000;
const NOP: [u8; 2] = [0x00, 0xBF];
/// The image's functions that are a tick, and the prefix of its own functions.
const TICKS: [&str; 2] = ["mps2_an386_counts4tick", "mps2_an386_counts4step"];
const OWN_FUNCTIONS: &str = "mps2_an386_counts";
/// Functions that take most of the time between two ticks and that no tick calls: otherwise the
/// count of instructions would differ.
const SEPARATE: [&str; 6] = [
    "FrameReader",
    "counts5files6Frames",
    "counts5files7Records",
    "terrain4tile4Tile4load",
    "terrain4tile4Tile9fill_with",
    "hapterra_core3crc",
];

type Core<'a> = Unicorn<'a, ()>;

/// Owner of a block.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// The function that is a tick.
    Tick,
    /// The image around it.
    Image,
    /// Functions that both may call.
    Shared,
}

/// Code without a branch except at its end.
struct Block {
    owner: Owner,
    /// True if an H743 has it in flash.
    in_flash: bool,
    bytes: u32,
    code: Vec<Instruction>,
}

/// State of a run.
struct Run {
    image: Image,
    /// Blocks by half of their address.
    blocks: Vec<Option<Rc<Block>>>,
    /// The present block, and the tick that it belongs to.
    now: Option<Rc<Block>>,
    tick: Option<Tick>,
    ended: Vec<Cycles>,
}

/// Runs the counting image in a folder to its end. Returns the cycles of each tick, from the entry
/// of its function until another function of the image continues.
///
/// # Panics
/// If the image fails.
#[must_use]
pub fn follow(image: &Path, folder: &Path) -> Vec<Cycles> {
    let image = Image::read(image);
    let is_separate = |name: &str| SEPARATE.iter().any(|part| name.contains(part));
    let separate = image.functions().filter(|(name, _)| is_separate(name));
    let mut separate: Vec<_> = separate.map(|(_, function)| function).collect();
    separate.sort_by_key(|function| function.address);
    let mut core = Unicorn::new(Arch::ARM, Mode::MCLASS | Mode::THUMB).expect("a core");
    core.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)
        .expect("its model");
    for (address, bytes) in OTHER_CODE.into_iter().chain([CODE]) {
        let mapped = core.mem_map(address.into(), bytes.into(), Prot::ALL);
        mapped.expect("memory");
    }
    let calls = load(&mut core, &image);
    let files = Rc::new(RefCell::new(Files::new(folder)));
    for address in calls {
        let files = Rc::clone(&files);
        let call = move |core: &mut Core<'_>, _: u64, _: u32| files.borrow_mut().call(core);
        let at = u64::from(address);
        core.add_code_hook(at, at, call).expect("a hook");
    }
    let run = Rc::new(RefCell::new(Run {
        image,
        blocks: vec![None; (CODE.1 / 2) as usize],
        now: None,
        tick: None,
        ended: vec![],
    }));
    let mut from = 0;
    for (to, next) in { separate.iter() }
        .map(|function| (function.address, function.address + function.size))
        .chain([(CODE.1, CODE.1)])
    {
        if from < u64::from(to) {
            watch(&mut core, &run, from, to);
        }
        from = next.into();
    }
    let mut vectors = [0; 8];
    core.mem_read(0, &mut vectors).expect("vectors");
    let [stack, entry] =
        [0, 4].map(|i| u32::from_le_bytes(*vectors[i..].first_chunk().expect("four")));
    core.reg_write(RegisterARM::SP, stack.into())
        .expect("a register");
    core.reg_write(RegisterARM::FPEXC, 0x4000_0000)
        .expect("a register");
    let ended = core.emu_start(entry.into(), u64::from(u32::MAX), 0, 0);
    let has_ended = files.borrow().exit == Some(0);
    assert!(has_ended, "the counting image: {ended:?}");
    let mut run = run.borrow_mut();
    std::mem::take(&mut run.ended)
}

/// Adds the blocks that start in an address range to the run.
fn watch(core: &mut Core<'_>, run: &Rc<RefCell<Run>>, from: u64, to: u32) {
    let into = Rc::clone(run);
    let executes = move |core: &mut Core<'_>, address: u64, bytes: u32| {
        into.borrow_mut().execute(core, address as u32, bytes);
    };
    let hook = core.add_block_hook(from, u64::from(to) - 1, executes);
    hook.expect("a hook");
}

/// Loads the image. Returns the addresses of its semihosting calls.
fn load(core: &mut Core<'_>, image: &Image) -> Vec<u32> {
    for segment in image.segments.iter().filter(|s| !s.bytes.is_empty()) {
        let loaded = core.mem_write(segment.loaded.into(), &segment.bytes);
        loaded.expect("in a memory");
    }
    let calls = image.instructions().filter(|(_, code)| *code == CALL);
    let calls: Vec<u32> = calls.map(|(address, _)| address).collect();
    for address in &calls {
        // A hook calls the host before this instruction.
        core.mem_write(u64::from(*address), &NOP).expect("code");
    }
    calls
}

impl Run {
    fn execute(&mut self, core: &Core<'_>, address: u32, bytes: u32) {
        let cached = self.blocks[(address / 2) as usize].clone();
        let cached = cached.filter(|block| block.bytes == bytes);
        let next = cached.unwrap_or_else(|| self.read(core, address, bytes));
        if let (Some(tick), Some(block)) = (&mut self.tick, &self.now) {
            let after = block.code.iter().skip(1).map(|i| i.address);
            for (instruction, next) in block.code.iter().zip(after.chain([address])) {
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

    /// Decodes a block at its first execution.
    fn read(&mut self, core: &Core<'_>, address: u32, bytes: u32) -> Rc<Block> {
        let code = core.mem_read_as_vec(address.into(), bytes as usize + 2);
        let code = code.expect("code");
        let half = |at: u32| u16::from_le_bytes([code[at as usize], code[at as usize + 1]]);
        let (mut instructions, mut at) = (vec![], 0);
        while at < bytes {
            let instruction = decode(address + at, half(at), half(at + 2));
            at += instruction.length;
            instructions.push(instruction);
        }
        let name = self.image.at(address);
        let owner = match name {
            _ if TICKS.iter().any(|tick| name.contains(tick)) => Owner::Tick,
            _ if name.contains(OWN_FUNCTIONS) => Owner::Image,
            _ => Owner::Shared,
        };
        let block = Rc::new(Block {
            owner,
            in_flash: in_flash::is_in_flash(name),
            bytes,
            code: instructions,
        });
        self.blocks[(address / 2) as usize] = Some(Rc::clone(&block));
        block
    }
}

/// The host's files for the image.
struct Files {
    folder: PathBuf,
    /// By handle, from 1.
    open: Vec<File>,
    exit: Option<u32>,
}

impl Files {
    fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            open: vec![],
            exit: None,
        }
    }

    /// Performs a semihosting call (Arm's "Semihosting for AArch32 and AArch64", 2025Q1): an
    /// operation in R0, with a block of words at R1.
    fn call(&mut self, core: &mut Core<'_>) {
        let register = |register| core.reg_read(register).expect("a register") as u32;
        let (operation, block) = (register(RegisterARM::R0), register(RegisterARM::R1));
        let word = |core: &Core<'_>, i: u32| {
            let mut bytes = [0; 4];
            core.mem_read(u64::from(block + 4 * i), &mut bytes)
                .expect("words");
            u32::from_le_bytes(bytes)
        };
        let words = |core: &Core<'_>| [0, 1, 2].map(|i| word(core, i));
        let result = match operation {
            // SYS_OPEN: name, mode, length of the name. Modes from 4 write.
            0x01 => {
                let [name, mode, length] = words(core);
                let name = core
                    .mem_read_as_vec(name.into(), length as usize)
                    .expect("a name");
                let path = self.folder.join(String::from_utf8_lossy(&name).as_ref());
                let file = if mode < 4 {
                    File::open(path)
                } else {
                    File::create(path)
                };
                self.open.push(file.expect("the file opens"));
                self.open.len() as u32
            }
            // SYS_CLOSE
            0x02 => 0,
            // SYS_WRITE and SYS_READ: handle, buffer, length. They return the number of bytes left.
            0x05 => {
                let [handle, from, length] = words(core);
                let bytes = core
                    .mem_read_as_vec(from.into(), length as usize)
                    .expect("bytes");
                self.file(handle).write_all(&bytes).expect("written");
                0
            }
            0x06 => {
                let [handle, to, length] = words(core);
                let mut bytes = vec![0; length as usize];
                let read = self.file(handle).read(&mut bytes).expect("readable");
                core.mem_write(to.into(), &bytes[..read]).expect("memory");
                length - read as u32
            }
            // SYS_EXIT_EXTENDED: reason and code.
            0x20 => {
                self.exit = Some(word(core, 1));
                core.emu_stop().expect("stops");
                0
            }
            _ => panic!("the counting image asks the host for {operation:#x}"),
        };
        core.reg_write(RegisterARM::R0, result.into())
            .expect("a register");
    }

    fn file(&mut self, handle: u32) -> &mut File {
        let index = (handle as usize).checked_sub(1);
        let file = index.and_then(|index| self.open.get_mut(index));
        file.expect("a file that is open")
    }
}
