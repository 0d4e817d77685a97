//! Whole updates of a scripted loader, honest and with each fault.

use super::scripted::{Deed, Faults, Scripted, State, TRANSFER};
use super::{ControlPipe, Loader, Plan, Step, UpdateError, UpdateFailure, request, update};
use crate::board::image::Part;
use crate::board::{Board, Image, Memories};

const FLASH: u64 = 0x0800_0000;
const WORDS: &str = "@Internal Flash   /0x08000000/256*02Kg";
/// Length, type, what it can, time-out, bytes of a transfer, version 1.1a.
const FUNCTIONAL: [u8; 9] = [9, 0x21, 0x0B, 0xFF, 0, 0, (TRANSFER / 256) as u8, 0x1A, 1];
/// Pages of the calibrations.
const CALIBRATIONS: usize = 508 * 1024;

fn board() -> &'static Board {
    Board::named("nucleo-g474re").expect("known")
}

/// A program of five pages and a bit.
fn image() -> Image {
    let bytes: Vec<u8> = (0..11_000_u32).map(|i| (i * 7 % 251) as u8).collect();
    let (vectors, code) = bytes.split_at(472);
    let part = |address, bytes: &[u8]| Part {
        address,
        bytes: bytes.to_vec(),
    };
    Image {
        memories: Memories::G474,
        parts: vec![part(FLASH + 472, code), part(FLASH, vectors)],
        placed: vec![],
    }
}

fn try_update(device: Scripted, image: &Image) -> (Scripted, Result<usize, UpdateFailure>) {
    let mut pipe = device;
    let mut loader = match Loader::open(&mut pipe, WORDS, &FUNCTIONAL) {
        Ok(loader) => loader,
        Err(error) => {
            let erased = false;
            return (pipe, Err(UpdateFailure { error, erased }));
        }
    };
    let done = update(&mut loader, board(), image, &mut |_| {});
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

/// Whether all of the image is in flash.
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
fn an_image_is_written_read_back_and_started_and_nothing_else_is_touched() {
    let image = image();
    let (device, done) = try_update(Scripted::new(Faults::default()), &image);
    assert_eq!(done.ok(), Some(11_000));
    assert!(is_whole(&device, &image));
    let untouched = &device.flash[6 * 2048..];
    assert!(untouched.iter().all(|byte| *byte == 0xA5));
    assert!(untouched.len() > device.flash.len() - CALIBRATIONS);
    assert_eq!(device.deeds.last(), Some(&Deed::Started(FLASH)));
}

#[test]
fn the_vectors_are_erased_first_and_written_last() {
    let (device, _) = try_update(Scripted::new(Faults::default()), &image());
    assert_eq!(device.deeds.first(), Some(&Deed::Erased(FLASH)));
    let writes = device.deeds.iter().filter_map(|deed| match deed {
        Deed::Wrote(address, _) => Some(*address < FLASH + 8),
        _ => None,
    });
    let writes: Vec<bool> = writes.collect();
    let [others @ .., last] = &writes[..] else {
        panic!("nothing was written");
    };
    assert!(*last && !others.contains(&true), "{writes:?}");
}

#[test]
fn a_loader_that_something_else_has_left_in_the_middle_is_brought_to_rest() {
    for state in [
        State::Error,
        State::DownloadSync,
        State::DownloadIdle,
        State::UploadIdle,
    ] {
        let mut device = Scripted::new(Faults::default());
        device.state = state;
        let image = image();
        let (device, done) = try_update(device, &image);
        assert!(done.is_ok() && is_whole(&device, &image), "{state:?}");
    }
}

#[test]
fn a_loader_that_goes_away_at_any_moment_leaves_no_half_of_a_program_and_can_be_tried_again() {
    let image = image();
    let (whole, _) = try_update(Scripted::new(Faults::default()), &image);
    let all = whole.requests();
    for gone_after in 0..all {
        let faults = Faults {
            gone_after: Some(gone_after),
            ..Faults::default()
        };
        let (device, done) = try_update(Scripted::new(faults), &image);
        let Err(failure) = done else {
            // Its last answer is the one that it need not give.
            assert!(gone_after + 1 == all, "{gone_after} of {all}");
            continue;
        };
        let gone = matches!(failure.error, UpdateError::Gone { .. });
        assert!(gone, "{gone_after}: {failure:?}");
        let erased = !device.deeds.is_empty();
        assert!(failure.erased || !erased, "{gone_after}: it was touched");
        let vectors = &device.flash[..8];
        let (old, none) = (vectors == [0xA5; 8], vectors == [0xFF; 8]);
        assert!(
            (old && !erased) || none || is_whole(&device, &image),
            "{gone_after}: half a program"
        );
        let hint = hint(&failure);
        assert_eq!(hint.contains("BOOT0"), failure.erased, "{hint}");
        let (device, done) = try_update(device.again(), &image);
        assert!(
            done.is_ok() && is_whole(&device, &image),
            "{gone_after}: again"
        );
    }
}

#[test]
fn what_does_not_read_back_is_not_started() {
    for bad in [FLASH, FLASH + 471, FLASH + 5000, FLASH + 10_999] {
        let faults = Faults {
            bad_cell: Some(bad),
            ..Faults::default()
        };
        let (device, done) = try_update(Scripted::new(faults), &image());
        let failure = done.expect_err("found");
        assert!(matches!(failure.error, UpdateError::Differs(at) if at == bad));
        assert!(failure.erased);
        let started = |deed: &Deed| matches!(deed, Deed::Started(_));
        assert!(!device.deeds.iter().any(started));
        let elsewhere = bad >= FLASH + 8;
        assert!(!elsewhere || device.flash[..8] == [0xFF; 8], "no vectors");
    }
}

#[test]
fn what_the_loader_refuses_is_told_in_words_and_ends() {
    let refused = |faults| {
        let (_, done) = try_update(Scripted::new(faults), &image());
        done.expect_err("refused").error.to_string()
    };
    let said = refused(Faults {
        stuck_page: Some(FLASH + 4096),
        ..Faults::default()
    });
    assert!(
        said.contains("erase a page") && said.contains("cannot be erased"),
        "{said}"
    );
    let said = refused(Faults {
        protected: true,
        ..Faults::default()
    });
    assert!(
        said.contains("read back") && said.contains("protected"),
        "{said}"
    );
    let said = refused(Faults {
        never_done: true,
        ..Faults::default()
    });
    assert!(said.contains("does not come to an end"), "{said}");
}

/// Nothing was erased or written.
fn assert_untouched(device: &Scripted) {
    assert_eq!(device.deeds, []);
    assert!(device.flash.iter().all(|byte| *byte == 0xA5));
}

#[test]
fn another_chips_loader_or_an_image_that_does_not_belong_there_is_refused_before_anything_is_erased()
 {
    let mut device = Scripted::new(Faults::default());
    let words = "@Internal Flash   /0x08000000/16*128Kg";
    let mut loader = Loader::open(&mut device, words, &FUNCTIONAL).expect("a loader");
    let refused = update(&mut loader, board(), &image(), &mut |_| {});
    let failure = refused.expect_err("refused");
    assert!(matches!(failure.error, UpdateError::OtherChip { .. }) && !failure.erased);
    assert_untouched(&device);
    let mut image = image();
    image.parts.push(Part {
        address: FLASH + CALIBRATIONS as u64,
        bytes: vec![0; 8],
    });
    let (device, done) = try_update(device, &image);
    let failure = done.expect_err("refused");
    assert!(matches!(failure.error, UpdateError::Calibrations { .. }) && !failure.erased);
    assert!(hint(&failure).contains("nothing was erased"));
    assert_untouched(&device);
}

#[test]
fn what_is_no_loader_of_that_kind_is_refused() {
    let open = |words: &str, functional: &[u8]| {
        let mut device = Scripted::new(Faults::default());
        let opened = Loader::open(&mut device, words, functional).map(|_| ());
        assert_untouched(&device);
        opened
    };
    let with = |at: usize, byte: u8| {
        let mut functional = FUNCTIONAL;
        functional[at] = byte;
        functional
    };
    assert!(open(WORDS, &FUNCTIONAL).is_ok());
    for functional in [
        with(1, 0x24),
        with(2, 0),
        with(2, 1),
        with(2, 2),
        with(6, 0),
    ] {
        let opened = open(WORDS, &functional);
        assert!(
            matches!(opened, Err(UpdateError::Cannot(_))),
            "{functional:?}"
        );
    }
    assert!(matches!(
        open(WORDS, &FUNCTIONAL[..6]),
        Err(UpdateError::Cannot(_))
    ));
    let other = open("@Option Bytes  /0x1FFF7800/01*048 e", &FUNCTIONAL);
    assert!(matches!(other, Err(UpdateError::Layout(_))));
}

#[test]
fn progress_ends_where_it_said_it_would() {
    let mut device = Scripted::new(Faults::default());
    let mut loader = Loader::open(&mut device, WORDS, &FUNCTIONAL).expect("a loader");
    let image = image();
    let plan = Plan::new(board(), &image, loader.layout()).expect("fits");
    let mut steps = vec![];
    update(&mut loader, board(), &image, &mut |step| steps.push(step)).expect("done");
    let (pages, bytes) = (plan.erased.len(), plan.bytes());
    for last in [
        Step::Erased(pages, pages),
        Step::Written(bytes, bytes),
        Step::Compared(bytes, bytes),
    ] {
        assert!(steps.contains(&last), "{last:?}");
    }
}

#[test]
fn the_scripted_loader_forgives_nothing() {
    let mut device = Scripted::new(Faults::default());
    // Too early.
    device
        .write(request::DNLOAD, 0, &[0x41, 0, 0, 0, 8])
        .expect("taken");
    device.read(request::GETSTATUS, 0, 6).expect("busy");
    assert!(device.read(request::GETSTATUS, 0, 6).is_err());
    // A page that is not erased, and a block while it reads.
    let mut device = Scripted::new(Faults::default());
    device
        .read(request::UPLOAD, 2, TRANSFER as u16)
        .expect("read");
    assert!(device.write(request::DNLOAD, 2, &[0; 8]).is_err());
    let mut device = Scripted::new(Faults::default());
    let mut loader = Loader::open(&mut device, WORDS, &FUNCTIONAL).expect("a loader");
    assert!(loader.write(FLASH, &[0; 8]).is_err());
}
