//! embassy's USB stack and the link above it, with a host that follows a script, and with the
//! product's own client on the same cable.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Bulk, BulkEndpoints, Event, Session, Timeouts, is_hapterra};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::Source;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, InSession, SessionNumber};
use hapterra_firmware::usb::{INTERFACE_GUIDS, MSOS_VENDOR_CODE, PRODUCT, PRODUCT_ID, VENDOR_ID};
use hapterra_tests::usb::board::{Board, SERIAL};
use hapterra_tests::usb::host::{
    Failure, Found, PACKET, ScriptedPipes, control, control_in, descriptor, enumerate,
    fetch_packet, send_packet, string,
};
use hapterra_tests::usb::{Answer, Port};
use heightfield::Raster;
use nusb::descriptors::{ConfigurationDescriptor, DeviceDescriptor};

/// The link's endpoint in both directions.
const LINK: usize = 1;

fn endpoints(found: &Found) -> BulkEndpoints {
    let configuration = ConfigurationDescriptor::new(&found.configuration).expect("well formed");
    BulkEndpoints::find(&configuration).expect("the link's")
}

fn enumerated() -> (Board, Found) {
    let mut board = Board::plugged_in();
    let found = enumerate(&mut board).expect("enumerated");
    (board, found)
}

#[test]
fn board_is_enumerated_and_found_by_the_client() {
    let (mut board, found) = enumerated();
    let device = DeviceDescriptor::new(&found.device).expect("well formed");
    assert_eq!(
        (device.vendor_id(), device.product_id()),
        (VENDOR_ID, PRODUCT_ID)
    );
    let name = |board: &mut Board, index: Option<std::num::NonZeroU8>| {
        string(board, index.expect("has one").get()).expect("read")
    };
    let product = name(&mut board, device.product_string_index());
    assert_eq!(product, "hapterra");
    assert_eq!(
        name(&mut board, device.manufacturer_string_index()),
        "hapterra"
    );
    assert_eq!(
        name(&mut board, device.serial_number_string_index()),
        SERIAL
    );
    assert!(is_hapterra(
        device.vendor_id(),
        device.product_id(),
        Some(&product)
    ));
    let expected = BulkEndpoints {
        interface: 0,
        input: 0x80 | LINK as u8,
        output: LINK as u8,
    };
    assert_eq!(endpoints(&found), expected);
    let configuration = ConfigurationDescriptor::new(&found.configuration).expect("well formed");
    // 100 mA, and not self-powered.
    assert_eq!(
        (configuration.max_power(), configuration.attributes()),
        (50, 0x80)
    );
    for setting in configuration.interface_alt_settings() {
        assert!(setting.endpoints().all(|e| e.max_packet_size() == PACKET));
    }
}

#[test]
fn microsoft_os_descriptors_request_winusb() {
    let (mut board, found) = enumerated();
    let version = u16::from_le_bytes([found.device[2], found.device[3]]);
    assert!(version >= 0x0201, "a BOS is requested from 2.01 on");
    let head = descriptor(&mut board, 15, 0, 5).expect("BOS");
    let total = u16::from_le_bytes([head[2], head[3]]);
    let bos = descriptor(&mut board, 15, 0, total).expect("BOS");
    assert_eq!(bos.len(), usize::from(total));
    // The platform capability of Microsoft OS 2.0 descriptors (D8DD60DF-...).
    let uuid = [
        0xDF, 0x60, 0xDD, 0xD8, 0x89, 0x45, 0xC7, 0x4C, 0x9C, 0xD2, 0x65, 0x9D, 0x9E, 0x64, 0x8A,
        0x9F,
    ];
    let at = bos.windows(16).position(|w| w == uuid).expect("announced") + 16;
    let length = u16::from_le_bytes([bos[at + 4], bos[at + 5]]);
    assert_eq!(bos[at + 6], MSOS_VENDOR_CODE);
    let set = control_in(&mut board, (0xC0, MSOS_VENDOR_CODE, 0, 7), length).expect("the set");
    assert_eq!(set.len(), usize::from(length));
    let contains = |bytes: &[u8]| set.windows(bytes.len()).any(|w| w == bytes);
    assert!(contains(b"WINUSB\0\0"));
    let wide = |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    assert!(contains(&wide("DeviceInterfaceGUIDs\0")));
    assert!(contains(&wide(INTERFACE_GUIDS[0])));
}

#[test]
fn invalid_control_request_stalls_and_next_one_is_answered() {
    let (mut board, _) = enumerated();
    for request in [(0x40, 0x77, 0, 0), (0x00, 9, 9, 0), (0x01, 11, 5, 3)] {
        let answer = control(&mut board, request);
        assert_eq!(answer, Err(Failure::Stalled), "{request:?}");
        assert_eq!(descriptor(&mut board, 1, 0, 18).map(|d| d.len()), Ok(18));
    }
}

/// Safety: 33.
#[test]
fn halting_a_missing_endpoint_has_no_effect() {
    let (mut board, _) = enumerated();
    for endpoint in [0x05, 0x85, 0x0F, 0x8F] {
        // Set, read, clear: the stack survives any answer.
        let _ = control(&mut board, (0x02, 3, 0, endpoint));
        let _ = control_in(&mut board, (0x82, 0, 0, endpoint), 2);
        let _ = control(&mut board, (0x02, 1, 0, endpoint));
        assert_eq!(descriptor(&mut board, 1, 0, 18).map(|d| d.len()), Ok(18));
    }
    send_packet(&mut board, LINK, &hello()).expect("taken");
    assert!(answers(&mut board));
}

fn hello() -> Vec<u8> {
    let message = ToDevice::Hello(HostHello {
        protocol: PROTOCOL,
        number: 1,
        silence_s: DEFAULT_SILENCE_S,
    });
    let session = SessionNumber::new(7);
    encode(&InSession { session, message }, &mut [0; MAX_FRAME])
        .expect("fits")
        .to_vec()
}

/// Returns true if the device answers an open.
fn answers(board: &mut Board) -> bool {
    let mut reader = FrameReader::<MAX_FRAME>::new();
    for _ in 0..20 {
        let Ok(packet) = fetch_packet(board, LINK) else {
            return false;
        };
        let mut bytes = packet.as_slice();
        while !bytes.is_empty() {
            let (consumed, frame) = reader.push(bytes);
            let framed = frame.map(|f| f.and_then(decode::<InSession<ToHost>>));
            if framed.is_some_and(|f| f.is_ok_and(|f| matches!(f.message, ToHost::Hello(_)))) {
                return true;
            }
            bytes = &bytes[consumed..];
        }
    }
    false
}

#[test]
fn packets_of_one_byte_and_of_none_make_the_same_message() {
    let (mut board, _) = enumerated();
    for byte in hello() {
        send_packet(&mut board, LINK, &[byte]).expect("taken");
        send_packet(&mut board, LINK, &[]).expect("taken");
    }
    assert!(answers(&mut board));
}

#[test]
fn oversized_packet_is_rejected_without_effect() {
    let (mut board, _) = enumerated();
    for _ in 0..3 {
        let babble = send_packet(&mut board, LINK, &[0xA5; PACKET + 1]);
        assert_eq!(babble, Err(Failure::Silence));
    }
    assert!(board.overlong_packets() > 3);
    // A zero ends any unfinished frame.
    send_packet(&mut board, LINK, &[0]).expect("taken");
    send_packet(&mut board, LINK, &hello()).expect("taken");
    assert!(answers(&mut board));
}

#[test]
fn device_packets_never_need_a_zero_length_packet() {
    let (mut board, _) = enumerated();
    send_packet(&mut board, LINK, &hello()).expect("taken");
    for _ in 0..500 {
        if let Answer::Data(packet) = board.take_in(LINK) {
            assert!((1..PACKET).contains(&packet.len()), "{}", packet.len());
        }
        board.wait().expect("it continues");
    }
}

/// A rough terrain, whose tiles are sent in full, for a session.
struct Visit {
    raster: Raster,
    scale: Scale,
}

impl Visit {
    fn new() -> Self {
        let height = |x: u32, y: u32| ((x * 7 + y * 13) % 11) as f32 * 0.1;
        Self {
            raster: Raster::from_fn(257, 257, height).expect("raster"),
            scale: Scale::new(1.0, 1.0).expect("scale"),
        }
    }

    fn terrain(&self) -> Terrain<'_> {
        Terrain::new(&self.raster, self.scale, 0).expect("terrain")
    }
}

fn link(board: &Rc<RefCell<Board>>, found: &Found) -> Box<Bulk<ScriptedPipes<Board>>> {
    Box::new(Bulk(ScriptedPipes::new(Rc::clone(board), endpoints(found))))
}

/// Opens a session of the client over the scripted USB; `then` receives both.
fn visit(then: impl FnOnce(&mut Session<'_>, &Rc<RefCell<Board>>)) {
    let visit = Visit::new();
    let terrain = visit.terrain();
    let home = visit
        .scale
        .to_grid([128.3, 128.6, 4.0])
        .expect("addressable");
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home);
    let (board, found) = enumerated();
    let board = Rc::new(RefCell::new(board));
    let opened = Session::open(
        &terrain,
        scene,
        None,
        link(&board, &found),
        Timeouts::EMULATED,
    );
    let (mut session, device) = opened.expect("opened");
    assert_eq!(device.board, "scripted");
    then(&mut session, &board);
}

/// Resumes the session over a new line.
fn resume(session: &mut Session<'_>, link: Box<Bulk<ScriptedPipes<Board>>>) -> DeviceHello {
    session
        .resume(link, &|| true, &mut |_| {})
        .expect("resumed")
}

/// Returns the ticks of the samples received in this many polls of a millisecond.
fn ticks(session: &mut Session<'_>, polls: usize) -> Vec<u32> {
    let mut ticks = vec![];
    for _ in 0..polls {
        let mut take = |event: Event<'_>| {
            if let Event::Sample(sample) = event {
                assert_eq!(sample.fault, None);
                ticks.push(sample.tick);
            }
        };
        session
            .poll(Duration::from_millis(1), &mut take)
            .expect("it continues");
    }
    ticks
}

#[test]
fn tiles_and_samples_transfer_without_loss() {
    visit(|session, _| {
        let ticks = ticks(session, 400);
        let gaps = ticks.windows(2).filter(|w| w[1] != w[0] + 1).count();
        assert!(ticks.len() > 100 && gaps == 0, "{} {gaps}", ticks.len());
        let stats = session.stats();
        assert_eq!((stats.bad_frames, stats.lost, stats.repeated), (0, 0, 0));
        // Each needs many packets, even when packed.
        assert!(
            stats.tiles >= 4 && stats.tile_bytes > 4 * 16 * PACKET as u64,
            "{stats:?}"
        );
    });
}

/// Sends the first half of a tile's worth of bytes, without a whole frame.
fn half_a_transfer(board: &Rc<RefCell<Board>>) {
    let mut board = board.borrow_mut();
    for _ in 0..30 {
        let _ = send_packet(&mut *board, LINK, &[0x5A; PACKET]);
    }
}

#[test]
fn bus_reset_during_transfer_keeps_scene_and_tiles() {
    visit(|session, board| {
        let before = *ticks(session, 200).last().expect("samples");
        let tiles = session.stats().tiles;
        half_a_transfer(board);
        let found = enumerate(&mut *board.borrow_mut()).expect("again");
        let device = resume(session, link(board, &found));
        assert_eq!(device.epoch, Some(session.scene().epoch), "still held");
        let after = ticks(session, 200);
        assert!(
            after.first().is_some_and(|tick| *tick > before),
            "no new start"
        );
        assert_eq!(session.stats().tiles, tiles, "nothing is sent again");
    });
}

#[test]
fn unplugged_board_keeps_ticking_and_resumes_its_session() {
    visit(|session, board| {
        let before = *ticks(session, 200).last().expect("samples");
        half_a_transfer(board);
        board.borrow_mut().unplug();
        // Two seconds without a read or a write.
        let mut unplugged = board.borrow_mut();
        for ms in 0..2000 {
            for _ in 0..hapterra_tests::usb::MOMENTS_A_MS {
                unplugged.wait().expect("it continues");
            }
            let alive = unplugged.is_alive();
            assert!(
                alive || ms == 0,
                "its watchdog would have starved at {ms} ms"
            );
        }
        drop(unplugged);
        let found = enumerate(&mut *board.borrow_mut()).expect("again");
        let device = resume(session, link(board, &found));
        assert_eq!(device.epoch, Some(session.scene().epoch), "still held");
        let after = *ticks(session, 200).first().expect("samples");
        assert!(after > before + 2000, "{before}, then {after}");
    });
}

#[test]
fn udev_rule_matches_the_usb_identity() {
    let rules = include_str!("../../../host-tools/udev/70-hapterra.rules");
    let rule = rules
        .lines()
        .find(|line| line.starts_with("SUBSYSTEM"))
        .expect("a rule");
    let has_value = |key: &str, value: &str| rule.contains(&format!("{key}==\"{value}\""));
    assert!(has_value("ATTR{idVendor}", &format!("{VENDOR_ID:04x}")));
    assert!(has_value("ATTR{idProduct}", &format!("{PRODUCT_ID:04x}")));
    assert!(has_value("ATTR{product}", &format!("{PRODUCT}*")));
    assert!(rule.contains("TAG+=\"uaccess\""));
}
