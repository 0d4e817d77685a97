//! Halts of endpoints, which a host may request at any time: the boards' own images continue, and
//! lose at most the content of the endpoint.

use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, InSession, SessionNumber};
use hapterra_image_tests::device::{Device, machines, on_each_board, rough_ground};
use hapterra_image_tests::machine::Machine;
use hapterra_tests::usb::host::{
    Failure, control, control_in, descriptor, enumerate, fetch_packet, send_packet,
};
use hapterra_tests::usb::{Answer, Handshake, MOMENTS_A_MS, Port};

/// Standard requests to an endpoint: type, number, and the value for the halt's feature.
const CLEAR_HALT: (u8, u8, u16) = (0x02, 1, 0);
const SET_HALT: (u8, u8, u16) = (0x02, 3, 0);
const GET_STATUS: (u8, u8, u16) = (0x82, 0, 0);

/// The link's endpoint.
const LINK: usize = 1;
/// The control endpoint's two directions, and the link's.
const ADDRESSES: [u16; 4] = [0x00, 0x80, 0x01, 0x81];

fn send_request(
    machine: &mut Machine,
    (kind, number, value): (u8, u8, u16),
    address: u16,
) -> Result<(), Failure> {
    control(machine, (kind, number, value, address))
}

fn is_halted(machine: &mut Machine, address: u16) -> bool {
    let (kind, number, value) = GET_STATUS;
    let status = control_in(machine, (kind, number, value, address), 2);
    status.expect("an answer")[0] & 1 == 1
}

fn hello() -> Vec<u8> {
    let message = ToDevice::Hello(HostHello {
        protocol: PROTOCOL,
        number: 1,
        silence_s: DEFAULT_SILENCE_S,
    });
    let session = SessionNumber::new(1);
    let framed = InSession { session, message };
    let mut frame = [0; MAX_FRAME];
    encode(&framed, &mut frame).expect("fits").to_vec()
}

fn is_hello(content: &[u8]) -> bool {
    let message = decode::<InSession<ToHost>>(content).map(|framed| framed.message);
    matches!(message, Ok(ToHost::Hello(_)))
}

/// Sends an open in one packet. Returns true if an answer arrives. With a wrong toggle, either is
/// dropped.
fn responds(machine: &mut Machine) -> bool {
    send_packet(machine, LINK, &hello()).expect("taken");
    let mut reader = FrameReader::<MAX_FRAME>::new();
    for _ in 0..20 {
        let Ok(packet) = fetch_packet(machine, LINK) else {
            return false;
        };
        let mut bytes = packet.as_slice();
        while !bytes.is_empty() {
            let (taken, frame) = reader.push(bytes);
            if frame.is_some_and(|content| content.is_ok_and(is_hello)) {
                return true;
            }
            bytes = &bytes[taken..];
        }
    }
    false
}

/// Reads until the device has sent nothing for 5 ms.
fn drain(machine: &mut Machine) {
    let mut silent = 0;
    while silent < 5 * MOMENTS_A_MS {
        silent = match machine.take_in(LINK) {
            Answer::Data(_) => 0,
            _ => silent + 1,
        };
        machine.wait().expect("it continues");
    }
}

/// Safety: 33, images.
#[test]
fn clearing_no_halt_only_resets_the_toggle() {
    for mut machine in machines() {
        let board = machine.chip.board;
        enumerate(&mut machine).expect("enumerated");
        // An odd and an even number of packets before it, for both toggles.
        for packets in 1..4 {
            for address in ADDRESSES {
                for _ in 0..packets {
                    assert!(responds(&mut machine), "{board}");
                    drain(&mut machine);
                }
                let cleared = send_request(&mut machine, CLEAR_HALT, address);
                assert_eq!(cleared, Ok(()), "{board}: {address:#04x}");
                assert!(responds(&mut machine), "{board}: after {address:#04x}");
                drain(&mut machine);
                assert_eq!(descriptor(&mut machine, 1, 0, 18).map(|d| d.len()), Ok(18));
            }
        }
        assert_eq!(machine.bus().usb.discarded, 0, "{board}");
    }
}

/// Safety: 33.
#[test]
fn halted_endpoint_refuses_until_the_halt_is_cleared() {
    for mut machine in machines() {
        let board = machine.chip.board;
        enumerate(&mut machine).expect("enumerated");
        for _ in 0..3 {
            for address in [0x01, 0x81] {
                assert!(responds(&mut machine), "{board}");
                drain(&mut machine);
                send_request(&mut machine, SET_HALT, address).expect("done");
                assert!(is_halted(&mut machine, address), "{board}");
                let refused = match address {
                    0x01 => send_packet(&mut machine, LINK, &[0]),
                    _ => fetch_packet(&mut machine, LINK).map(|_| ()),
                };
                assert_eq!(refused, Err(Failure::Stalled), "{board}: {address:#04x}");
                send_request(&mut machine, CLEAR_HALT, address).expect("done");
                assert!(!is_halted(&mut machine, address), "{board}");
                assert!(responds(&mut machine), "{board}: after {address:#04x}");
                drain(&mut machine);
            }
        }
    }
}

#[test]
fn unused_endpoint_stays_unused() {
    for mut machine in machines() {
        let board = machine.chip.board;
        enumerate(&mut machine).expect("enumerated");
        // Removes the configuration.
        control(&mut machine, (0x00, 9, 0, 0)).expect("done");
        for address in [0x01, 0x81, 0x05, 0x8F] {
            send_request(&mut machine, CLEAR_HALT, address).expect("done");
        }
        assert_eq!(machine.out(LINK, &[0]), Handshake::Nak, "{board}");
        assert_eq!(machine.take_in(LINK), Answer::Nak, "{board}");
        control(&mut machine, (0x00, 9, 1, 0)).expect("configured again");
        assert!(responds(&mut machine), "{board}: with new toggles");
    }
}

#[test]
fn second_configuration_resets_the_toggles() {
    for mut machine in machines() {
        let board = machine.chip.board;
        enumerate(&mut machine).expect("enumerated");
        for packets in 1..4 {
            for _ in 0..packets {
                assert!(responds(&mut machine), "{board}");
                drain(&mut machine);
            }
            control(&mut machine, (0x00, 9, 1, 0)).expect("configured");
            assert!(responds(&mut machine), "{board}");
            drain(&mut machine);
        }
        assert_eq!(machine.bus().usb.discarded, 0, "{board}");
    }
}

/// Safety: 33, images.
#[test]
fn clearing_halts_costs_a_frame_but_no_session() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::arm(machine, terrain, scene);
        for round in 0..8 {
            device.move_to([40 * (round % 3), 0, 20 * (round % 2)]);
            for address in ADDRESSES {
                let cleared = send_request(&mut device.machine.borrow_mut(), CLEAR_HALT, address);
                assert_eq!(cleared, Ok(()), "{board}: {address:#04x}");
                device.run_ms(7);
            }
        }
        let before = device.latest.expect("samples").tick;
        device.run_ms(50);
        let sample = device.latest.expect("samples");
        assert!(sample.tick > before, "{board}: no packet arrives");
        assert_eq!(sample.fault, None, "{board}");
        assert!(device.machine.borrow().is_enabled(), "{board}: still on");
        assert_eq!(device.query_status().health.report.fault, None, "{board}");
    });
}
