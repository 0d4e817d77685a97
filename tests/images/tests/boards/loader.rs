//! The start of the loader in the chip's ROM, and the return from it, in the boards' own images.
//! The ROM has a program that does nothing: the test checks the state of the chip at its start.

use std::cell::RefCell;
use std::rc::Rc;

use hapterra::link::{Bulk, BulkEndpoints, ControlSession};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_image_tests::bus::Effect;
use hapterra_image_tests::device::{Device, machines, on_each_board, rough_ground};
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_image_tests::supply::Reset;
use hapterra_tests::timeouts;
use hapterra_tests::usb::host::{ScriptedPipes, enumerate};
use nusb::descriptors::ConfigurationDescriptor;

/// The stack in the ROM's vectors.
const ROM_STACK: u32 = 0x2000_0800;
/// A branch to itself.
const HANG: [u8; 2] = [0xFE, 0xE7];

/// Returns the address of the ROM's vectors, and the bit that switches on the oscillator of USB:
/// AN2606, and the reference manuals.
fn rom(machine: &Machine) -> (u32, (u32, u32)) {
    match machine.chip.is_m7 {
        false => (0x1FFF_0000, (0x4002_1098, 1 << 0)),
        true => (0x1FF0_9800, (0x5802_4400, 1 << 12)),
    }
}

/// Puts a program into the ROM. Returns its start address.
fn fill_rom(machine: &mut Machine) -> u32 {
    let (vectors, _) = rom(machine);
    let begin = vectors + 0x100;
    let words = [ROM_STACK, begin | 1].map(u32::to_le_bytes).concat();
    machine.patch(vectors, &words);
    machine.patch(begin, &HANG);
    begin
}

fn is_at(machine: &Machine, address: u32) -> bool {
    machine.place().starts_with(&format!("{address:#x} "))
}

/// Requests over USB that a board enters its loader, and runs it until it resets itself.
fn request_loader(mut machine: Machine) -> Machine {
    let found = enumerate(&mut machine).expect("enumerated");
    let configuration = ConfigurationDescriptor::new(&found.configuration).expect("well formed");
    let endpoints = BulkEndpoints::find(&configuration).expect("the link's");
    let machine = Rc::new(RefCell::new(machine));
    let link = Bulk(ScriptedPipes::new(Rc::clone(&machine), endpoints));
    let mut control = ControlSession::open(Box::new(link), timeouts::HANG).expect("opened");
    let answer = control.request(&Request::EnterLoader).expect("an answer");
    assert_eq!(answer, Ok(()));
    drop(control);
    let mut machine = Rc::try_unwrap(machine).ok().expect("alone").into_inner();
    let _ = machine.take_effects();
    assert_eq!(machine.run_ms(200), Stop::Software);
    machine
}

/// Checks the registers that a reset sets and a program's start-up code changes.
fn assert_as_after_a_reset(machine: &Machine) {
    let board = machine.chip.board;
    assert!(!machine.is_enabled(), "{board}");
    for port in [1, 2, 5] {
        let modes = machine.bus().read(machine.chip.gpio + 0x400 * port);
        let after_reset = if port == 1 { 0xFFFF_FEBF } else { u32::MAX };
        assert_eq!(modes, after_reset, "{board}: port {port}");
    }
    assert!(!machine.bus().usb.is_attached(), "{board}");
}

/// Safety: 36.
#[test]
fn board_enters_its_loader_before_any_setup() {
    for mut machine in machines() {
        let board = machine.chip.board;
        let begin = fill_rom(&mut machine);
        let mut machine = request_loader(machine);
        assert!(!machine.is_enabled(), "{board}");
        machine.reset(Reset::Software);
        assert_eq!(machine.run_ms(5), Stop::Time, "{board}");
        assert!(is_at(&machine, begin), "{board}: {}", machine.place());
        assert_as_after_a_reset(&machine);
        let on = machine.take_effects().contains(&Effect::Enable(true));
        assert!(!on, "{board}: the amplifiers were on");
        // Only once: the next reset starts the program.
        machine.reset(Reset::Software);
        enumerate(&mut machine).expect("the program");
    }
}

#[test]
fn program_started_by_the_loader_begins_with_a_reset() {
    for mut machine in machines() {
        let board = machine.chip.board;
        let (_, (register, bit)) = rom(&machine);
        // As the loader leaves the chip.
        machine.bus().write(register, bit, u32::MAX);
        assert_eq!(machine.run_ms(5), Stop::Software, "{board}");
        machine.reset(Reset::Software);
        enumerate(&mut machine).expect("the program");
    }
}

#[test]
fn armed_board_does_not_enter_its_loader() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::arm(machine, terrain, scene);
        device.request(Request::EnterLoader);
        device.run_ms(300);
        let refused = Some((Request::EnterLoader, Err(Refusal::NotWhileArmed)));
        assert_eq!(device.answer, refused, "{board}");
        assert!(device.machine.borrow().is_enabled(), "{board}: still on");
    });
}
