//! Foreign images in the emulator: they cannot change its files or control its terminal.
//!
//! The images are a few instructions each, assembled here.

use std::fs;
use std::path::Path;

use hapterra::link::{Emulator, Transport};
use hapterra_tests::emulation::qemu;
use hapterra_tests::timeouts::HANG;

const UART0: u32 = 0x4000_4000;
const UART2: u32 = 0x4000_6000;
/// Application interrupt and reset control register, and the value for a reset.
const AIRCR: u32 = 0xE000_ED0C;
const RESET: u32 = 0x05FA_0004;

/// Returns stores that enable a UART and send these bytes.
fn send(uart: u32, bytes: &[u8]) -> Vec<(u32, u32)> {
    let on = [(uart + 0x10, 16), (uart + 0x08, 1)];
    let data = bytes.iter().map(|byte| (uart, u32::from(*byte)));
    on.into_iter().chain(data).collect()
}

/// Start of the code, after the vectors.
const CODE: usize = 0x40;
/// Bytes of the code of one store: three instructions, a branch over its literals, and two
/// literals.
const STORE: usize = 16;

/// Returns a `str` of each value to its address, then a branch to itself; begins at a multiple of
/// four.
fn store_all(stores: &[(u32, u32)]) -> Vec<u8> {
    let each = stores.iter().flat_map(|(address, value)| {
        // ldr r0, address; ldr r1, value; str r1, [r0]; b past the literals
        let code = [0x4801_u16, 0x4902, 0x6001, 0xE003];
        let code = code.into_iter().flat_map(u16::to_le_bytes);
        let literals = [*address, *value].into_iter().flat_map(u32::to_le_bytes);
        code.chain(literals).collect::<Vec<_>>()
    });
    let stop = 0xE7FE_u16.to_le_bytes(); // b .
    each.chain(stop).chain([0; 2]).collect()
}

/// Returns a program that starts with `first`, then does the stores `then`, or `fault` in a fault.
fn image(first: &[u8], then: &[(u32, u32)], fault: &[(u32, u32)], data: &[u8]) -> Vec<u8> {
    assert_eq!(first.len() % 4, 0, "the literals are aligned");
    let [then, fault] = [then, fault].map(store_all);
    let handler = CODE + first.len() + then.len();
    let mut vectors = [handler as u32 | 1; 16];
    vectors[0] = 0x2000_1000;
    vectors[1] = CODE as u32 | 1;
    let vectors = vectors.into_iter().flat_map(u32::to_le_bytes);
    let program: Vec<u8> = vectors.chain(first.iter().copied()).collect();
    elf(&[program, then, fault, data.to_vec()].concat())
}

/// Returns an ELF file that loads a program at address zero.
fn elf(program: &[u8]) -> Vec<u8> {
    const HEADERS: u32 = 52 + 32;
    let length = program.len() as u32;
    let mut file = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let halves =
        |file: &mut Vec<u8>, all: &[u16]| file.extend(all.iter().flat_map(|h| h.to_le_bytes()));
    let write_words =
        |file: &mut Vec<u8>, all: &[u32]| file.extend(all.iter().flat_map(|w| w.to_le_bytes()));
    halves(&mut file, &[2, 40]); // executable, ARM
    write_words(&mut file, &[1, CODE as u32 | 1, 52, 0, 0x0500_0000]);
    halves(&mut file, &[52, 32, 1, 0, 0, 0]);
    write_words(&mut file, &[1, HEADERS, 0, 0, length, length, 5, 4]);
    file.extend(program);
    file
}

/// Returns an image that creates the file at `path` through semihosting and sends the result: R if
/// the call returned, F if it faulted.
fn writes_a_file(path: &Path) -> Vec<u8> {
    let path = path.to_str().expect("text").as_bytes();
    let reported = |what: u8| send(UART0, &[what]);
    let code = |block: u32| {
        // ldr r1, block; movs r0, #1 (SYS_OPEN); bkpt 0xAB; b past the literal; block
        let code = [0x4901_u16, 0x2001, 0xBEAB, 0xE001];
        let code = code.into_iter().flat_map(u16::to_le_bytes);
        code.chain(block.to_le_bytes()).collect::<Vec<_>>()
    };
    let stores = 2 * (reported(0).len() * STORE + 4);
    let block = (CODE + code(0).len() + stores) as u32;
    let arguments = [block + 12, 4, path.len() as u32]; // mode "w"
    let data: Vec<u8> = arguments.into_iter().flat_map(u32::to_le_bytes).collect();
    let data = [&data, path, &[0]].concat();
    image(&code(block), &reported(b'R'), &reported(b'F'), &data)
}

/// Safety: images.
#[test]
fn emulated_image_cannot_access_host_files() {
    let Some(qemu) = qemu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (target, path) = (folder.path().join("taken"), folder.path().join("image.elf"));
    fs::write(&path, writes_a_file(&target)).expect("written");
    let (emulator, mut lines) = Emulator::start(&qemu, &path).expect("started");
    let mut reported = [0];
    let n = lines.link.receive(&mut reported, HANG).expect("stands");
    assert_eq!(n, 1, "no reply");
    assert!(!target.exists(), "the image made a file");
    assert_eq!(reported, *b"F", "the call was let through");
    drop(emulator);
}

#[test]
fn image_output_is_escaped_for_the_terminal() {
    let Some(qemu) = qemu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("image.elf");
    let mut stores = send(UART2, b"\x1b[2Jall is well\x07");
    stores.push((AIRCR, RESET));
    fs::write(&path, image(&[], &stores, &[], &[])).expect("written");
    // It may end before its lines are connected.
    let message = match Emulator::start(&qemu, &path) {
        Ok((emulator, _)) => emulator.finish().expect_err("it failed").to_string(),
        Err(error) => error.to_string(),
    };
    assert!(message.contains("\\u{1b}[2Jall is well\\u{7}"), "{message}");
}
