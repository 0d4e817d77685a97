//! Whole updates with a scripted loader, without faults and with each fault.

use super::scripted::{Faults, FlashOperation, G474, H743, Rom, Scripted, State, TRANSFER};
use super::{ControlPipe, Loader, Plan, Step, UpdateError, UpdateFailure, request, update};
use crate::board::image::Part;
use crate::board::{Board, Image, Memories};

const FLASH: u64 = 0x0800_0000;
/// The chips whose loaders are simulated.
static ROMS: [&Rom; 2] = [&G474, &H743];
/// Length, type, attributes, time-out, bytes of a transfer, version 1.1a.
const FUNCTIONAL: [u8; 9] = [9, 0x21, 0x0B, 0xFF, 0, 0, (TRANSFER / 256) as u8, 0x1A, 1];
/// Bytes of a program.
const PROGRAM: usize = 11_000;
/// Offsets of the program's parts. An H743's are behind the first sector and in the second bank,
/// because a program that fills these takes long to write.
const G474_PIECES: [u64; 3] = [0, 472, 4_000];
const H743_PIECES: [u64; 3] = [0, 128 * 1024 + 480, 1024 * 1024];

fn board(rom: &Rom) -> &'static Board {
    Board::named(rom.board).expect("known")
}

fn memories(rom: &Rom) -> Memories {
    match rom.page {
        2048 => Memories::G474,
        _ => Memories::H743,
    }
}

/// A program: on a G474 it fills five pages and part of a sixth, on an H743 it has a part in each
/// of three sectors.
fn image(rom: &Rom) -> Image {
    let bytes: Vec<u8> = (0..PROGRAM as u32).map(|i| (i * 7 % 251) as u8).collect();
    let starts = match rom.page {
        2048 => G474_PIECES,
        _ => H743_PIECES,
    };
    let cuts = [0, 472, 4_000, PROGRAM];
    let parts = starts
        .into_iter()
        .zip(cuts.windows(2))
        .map(|(start, cut)| Part {
            address: FLASH + start,
            bytes: bytes[cut[0]..cut[1]].to_vec(),
        });
    Image {
        memories: memories(rom),
        // The parts are in reverse, not in the order in which they are written.
        parts: parts.rev().collect(),
        placed: vec![],
    }
}

/// First addresses of the pages that the image uses.
fn touched(rom: &Rom) -> Vec<u64> {
    let page = rom.page as u64;
    let ends = image(rom).parts.into_iter().flat_map(|part| {
        let end = part.address + part.bytes.len() as u64 - 1;
        part.address / page..=end / page
    });
    let mut pages: Vec<u64> = ends.map(|number| number * page).collect();
    pages.sort_unstable();
    pages.dedup();
    pages
}

fn try_update(device: Scripted, image: &Image) -> (Scripted, Result<usize, UpdateFailure>) {
    let mut pipe = device;
    let rom = pipe.rom;
    let mut loader = match Loader::open(&mut pipe, rom.words, &FUNCTIONAL) {
        Ok(loader) => loader,
        Err(error) => {
            let erased = false;
            return (pipe, Err(UpdateFailure { error, erased }));
        }
    };
    let done = update(&mut loader, board(rom), image, &mut |_| {});
    (pipe, done)
}

impl ControlPipe for &mut Scripted {
    fn read(&mut self, request: u8, value: u16, length: u16) -> std::io::Result<Vec<u8>> {
        (**self).read(request, value, length)
    }

    fn write(&mut self, request: u8, value: u16, bytes: &[u8]) -> std::io::Result<()> {
        (**self).write(request, value, bytes)
    }

    fn wait(&mut self, time: std::time::Duration) {
        (**self).wait(time);
    }
}

/// Returns true if all of the image is in flash.
fn is_whole(device: &Scripted, image: &Image) -> bool {
    image.parts.iter().all(|part| {
        let at = (part.address - FLASH) as usize;
        device.flash[at..at + part.bytes.len()] == part.bytes
    })
}

fn hint(failure: &UpdateFailure) -> String {
    crate::cli::failure::Hint::hint(failure)
}

#[test]
fn update_writes_and_starts_image_and_erases_no_other_page() {
    for rom in ROMS {
        let image = image(rom);
        let (device, done) = try_update(Scripted::new(rom, Faults::default()), &image);
        // The number of bytes is rounded up to whole words of flash.
        let written = done.expect("done");
        assert!(written.is_multiple_of(rom.word), "{}: {written}", rom.board);
        assert!(is_whole(&device, &image), "{}", rom.board);
        let touched = touched(rom);
        let of = |at: usize| FLASH + (at / rom.page * rom.page) as u64;
        let mut cells = device.flash.iter().enumerate();
        let stray = cells.find(|(at, byte)| **byte != 0xA5 && !touched.contains(&of(*at)));
        assert_eq!(stray, None, "{}", rom.board);
        let erased = |operation: &FlashOperation| match operation {
            FlashOperation::Erased(page) => Some(*page),
            _ => None,
        };
        let erased: Vec<u64> = device.operations.iter().filter_map(erased).collect();
        assert_eq!(erased, touched, "{}", rom.board);
        assert_eq!(
            device.operations.last(),
            Some(&FlashOperation::Started(FLASH))
        );
    }
}

#[test]
fn vectors_are_erased_first_and_written_last() {
    for rom in ROMS {
        let (device, _) = try_update(Scripted::new(rom, Faults::default()), &image(rom));
        assert_eq!(
            device.operations.first(),
            Some(&FlashOperation::Erased(FLASH))
        );
        let writes = device
            .operations
            .iter()
            .filter_map(|operation| match operation {
                FlashOperation::Wrote(address, bytes) => {
                    Some((*address < FLASH + rom.word as u64, *bytes))
                }
                _ => None,
            });
        let writes: Vec<(bool, usize)> = writes.collect();
        let [others @ .., last] = &writes[..] else {
            panic!("nothing was written");
        };
        assert_eq!(*last, (true, rom.word), "{}", rom.board);
        let early = others.iter().any(|(is_vectors, _)| *is_vectors);
        assert!(!early, "{}: {writes:?}", rom.board);
    }
}

#[test]
fn update_succeeds_with_loader_left_mid_transfer_or_in_error() {
    for state in [
        State::Error,
        State::DownloadSync,
        State::DownloadIdle,
        State::UploadIdle,
    ] {
        for rom in ROMS {
            let mut device = Scripted::new(rom, Faults::default());
            device.state = state;
            let image = image(rom);
            let (device, done) = try_update(device, &image);
            assert!(done.is_ok() && is_whole(&device, &image), "{state:?}");
        }
    }
}

/// Safety: 36.
#[test]
fn lost_loader_leaves_no_half_program_and_can_be_retried() {
    for rom in ROMS {
        let image = image(rom);
        let (whole, _) = try_update(Scripted::new(rom, Faults::default()), &image);
        let all = whole.requests();
        for disconnected_after in 0..all {
            check_disconnect(rom, &image, disconnected_after, all);
        }
    }
}

/// Runs an update whose loader disconnects after `disconnected_after` of `all` requests, and then another.
fn check_disconnect(rom: &'static Rom, image: &Image, disconnected_after: usize, all: usize) {
    let faults = Faults {
        disconnected_after: Some(disconnected_after),
        ..Faults::default()
    };
    let at = format!("{}: {disconnected_after} of {all}", rom.board);
    let (device, done) = try_update(Scripted::new(rom, faults), image);
    let Err(failure) = done else {
        // Only the loader's last reply is optional.
        assert!(disconnected_after + 1 == all, "{at}");
        return;
    };
    let is_disconnected = matches!(failure.error, UpdateError::Disconnected { .. });
    assert!(is_disconnected, "{at}: {failure:?}");
    let erased = !device.operations.is_empty();
    assert!(failure.erased || !erased, "{at}: it was touched");
    let vectors = &device.flash[..rom.word];
    let all_are = |byte: u8| vectors.iter().all(|found| *found == byte);
    assert!(
        (all_are(0xA5) && !erased) || all_are(0xFF) || is_whole(&device, image),
        "{at}: half a program"
    );
    let hint = hint(&failure);
    assert_eq!(hint.contains("BOOT0"), failure.erased, "{hint}");
    let (device, done) = try_update(device.reset(), image);
    assert!(done.is_ok() && is_whole(&device, image), "{at}: again");
}

/// Safety: 36.
#[test]
fn image_that_fails_verification_is_not_started() {
    for rom in ROMS {
        let image = image(rom);
        let ends = image.parts.iter().flat_map(|part| {
            let last = part.address + part.bytes.len() as u64 - 1;
            [part.address, part.address + 5, last]
        });
        for bad in ends {
            let faults = Faults {
                bad_cell: Some(bad),
                ..Faults::default()
            };
            let (device, done) = try_update(Scripted::new(rom, faults), &image);
            let failure = done.expect_err("found");
            assert!(matches!(failure.error, UpdateError::Differs(at) if at == bad));
            assert!(failure.erased);
            let started =
                |operation: &FlashOperation| matches!(operation, FlashOperation::Started(_));
            assert!(!device.operations.iter().any(started));
            let is_vectors = bad < FLASH + rom.word as u64;
            let mut vectors = device.flash[..rom.word].iter();
            let none = vectors.all(|byte| *byte == 0xFF);
            assert!(is_vectors || none, "{}: no vectors", rom.board);
        }
    }
}

#[test]
fn loader_failure_aborts_update_and_names_the_reason() {
    let refused = |faults| {
        let (_, done) = try_update(Scripted::new(&G474, faults), &image(&G474));
        done.expect_err("refused").error.to_string()
    };
    let message = refused(Faults {
        stuck_page: Some(FLASH + 4096),
        ..Faults::default()
    });
    assert!(
        message.contains("erase a page") && message.contains("cannot be erased"),
        "{message}"
    );
    let message = refused(Faults {
        protected: true,
        ..Faults::default()
    });
    assert!(
        message.contains("read back") && message.contains("protected"),
        "{message}"
    );
    let message = refused(Faults {
        always_busy: true,
        ..Faults::default()
    });
    assert!(message.contains("did not finish"), "{message}");
}

/// Asserts that nothing was erased or written.
fn assert_untouched(device: &Scripted) {
    assert_eq!(device.operations, []);
    assert!(device.flash.iter().all(|byte| *byte == 0xA5));
}

/// Safety: 36.
#[test]
fn foreign_loader_or_image_is_refused_before_erasing() {
    for (rom, other) in [(&G474, &H743), (&H743, &G474)] {
        let mut device = Scripted::new(rom, Faults::default());
        let mut loader = Loader::open(&mut device, other.words, &FUNCTIONAL).expect("a loader");
        let refused = update(&mut loader, board(rom), &image(rom), &mut |_| {});
        let failure = refused.expect_err("refused");
        assert!(matches!(failure.error, UpdateError::OtherChip { .. }) && !failure.erased);
        assert_untouched(&device);
        let mut image = image(rom);
        image.parts.push(Part {
            address: FLASH + image.memories.image_bytes,
            bytes: vec![0; 8],
        });
        let (device, done) = try_update(device, &image);
        let failure = done.expect_err("refused");
        assert!(matches!(failure.error, UpdateError::Calibrations { .. }) && !failure.erased);
        assert!(hint(&failure).contains("nothing was erased"));
        assert_untouched(&device);
    }
}

#[test]
fn unsuitable_loader_descriptor_or_layout_is_refused() {
    let open = |words: &str, functional: &[u8]| {
        let mut device = Scripted::new(&G474, Faults::default());
        let opened = Loader::open(&mut device, words, functional).map(|_| ());
        assert_untouched(&device);
        opened
    };
    let with = |at: usize, byte: u8| {
        let mut functional = FUNCTIONAL;
        functional[at] = byte;
        functional
    };
    assert!(open(G474.words, &FUNCTIONAL).is_ok());
    for functional in [
        with(1, 0x24),
        with(2, 0),
        with(2, 1),
        with(2, 2),
        with(6, 0),
    ] {
        let opened = open(G474.words, &functional);
        assert!(
            matches!(opened, Err(UpdateError::Cannot(_))),
            "{functional:?}"
        );
    }
    assert!(matches!(
        open(G474.words, &FUNCTIONAL[..6]),
        Err(UpdateError::Cannot(_))
    ));
    let other = open("@Option Bytes  /0x1FFF7800/01*048 e", &FUNCTIONAL);
    assert!(matches!(other, Err(UpdateError::Layout(_))));
}

#[test]
fn update_progress_reaches_its_announced_totals() {
    for rom in ROMS {
        let mut device = Scripted::new(rom, Faults::default());
        let mut loader = Loader::open(&mut device, rom.words, &FUNCTIONAL).expect("a loader");
        let image = image(rom);
        let plan = Plan::new(board(rom), &image, loader.layout()).expect("fits");
        let mut steps = vec![];
        update(&mut loader, board(rom), &image, &mut |step| {
            steps.push(step);
        })
        .expect("done");
        let (pages, bytes) = (plan.erased.len(), plan.bytes());
        for last in [
            Step::Erased(pages, pages),
            Step::Written(bytes, bytes),
            Step::Compared(bytes, bytes),
        ] {
            assert!(steps.contains(&last), "{}: {last:?}", rom.board);
        }
    }
}

#[test]
fn scripted_loader_rejects_protocol_violations() {
    let mut device = Scripted::new(&G474, Faults::default());
    // The second status request is too early.
    device
        .write(request::DNLOAD, 0, &[0x41, 0, 0, 0, 8])
        .expect("taken");
    device.read(request::GETSTATUS, 0, 6).expect("busy");
    assert!(device.read(request::GETSTATUS, 0, 6).is_err());
    // A page that is not erased, and a write while the loader reads.
    let mut device = Scripted::new(&G474, Faults::default());
    device
        .read(request::UPLOAD, 2, TRANSFER as u16)
        .expect("read");
    assert!(device.write(request::DNLOAD, 2, &[0; 8]).is_err());
    let mut device = Scripted::new(&G474, Faults::default());
    let mut loader = Loader::open(&mut device, G474.words, &FUNCTIONAL).expect("a loader");
    assert!(loader.write(FLASH, &[0; 8]).is_err());
    // Half a word of an H743's flash.
    let mut device = Scripted::new(&H743, Faults::default());
    let mut loader = Loader::open(&mut device, H743.words, &FUNCTIONAL).expect("a loader");
    loader.erase(FLASH).expect("erased");
    assert!(loader.write(FLASH, &[0; 16]).is_err());
    let mut device = Scripted::new(&H743, Faults::default());
    let mut loader = Loader::open(&mut device, H743.words, &FUNCTIONAL).expect("a loader");
    loader.erase(FLASH).expect("erased");
    assert!(loader.write(FLASH + 16, &[0; 32]).is_err());
}
