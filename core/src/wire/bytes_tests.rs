//! The bytes of messages, pinned: a type in a message may get another name or structure, but its
//! bytes stay the same.

use std::vec::Vec;

use glam::Vec3;
use serde::Serialize;

use super::hello::{DeviceHello, HostHello, PROTOCOL, SerialNumber};
use super::materials::{MAX_TABLE_BYTES, MaterialTile, TileMaterials, table_bytes};
use super::message::{Heights, Telemetry, TileMessage, ToDevice, ToHost};
use super::request::{Answer, Refusal, Request};
use super::session::{InSession, LastSession, SampleCount, SessionEnd, SessionNumber};
use crate::clutch::ClutchMode;
use crate::contact::{ContactState, Friction};
use crate::force::{
    Controller, Damping, Material, MaterialTable, Pattern, Shading, SurfaceParams, Texture,
};
use crate::grid::{Cell, GridPoint};
use crate::guard::{Fault, Limits, Mode};
use crate::scene::{ContactMap, Scene, SceneChange, Source, TickRecord};
use crate::terrain::{CoarseTile, Fallback, FieldSize, TileIndex, TileKey};

fn bytes<T: Serialize>(message: &T) -> Vec<u8> {
    let mut buffer = [0; 256];
    let bytes = postcard::to_slice(message, &mut buffer).expect("fits");
    bytes.to_vec()
}

/// An `f32` as bytes on the link.
fn float(x: f32) -> Vec<u8> {
    x.to_le_bytes().to_vec()
}

const FALLBACK: Fallback = Fallback {
    wide: CoarseTile {
        first: Cell::new(300, -1),
        shift: 4,
    },
    near: Some(CoarseTile {
        first: Cell::new(2, 3),
        shift: 2,
    }),
};

#[test]
fn scene_bytes() {
    let scene = Scene {
        epoch: 300,
        level: 2,
        size: FieldSize::new(640, 129),
        top: -3,
        fallback: Some(FALLBACK),
        cell_mm: 1.5,
        home: GridPoint::new([320, -7, 5], Vec3::new(0.25, 0.5, 0.0)),
        params: SurfaceParams {
            damping: Damping {
                ns_per_m: 2.0,
                controller: Controller::Off,
            },
            shading: Shading::Smooth,
            texture: Texture {
                pattern: Pattern::Grating,
                amplitude_mm: 0.125,
                wavelength_mm: 2.0,
                direction_deg: -45.0,
                seed: 300,
            },
            ..SurfaceParams::PREMIUM
        },
        source: Source::Points,
        hold_clock: true,
        materials: Some(300),
    };
    let expected = [
        std::vec![1, 0xAC, 0x02, 2],
        std::vec![0x80, 0x0A, 0x82, 0x02, 0x05],
        std::vec![1, 0xD8, 0x04, 0x01, 4],
        std::vec![1, 0x04, 0x06, 2],
        float(1.5),
        std::vec![0x80, 0x05, 0x0D, 0x0A],
        float(0.25),
        float(0.5),
        float(0.0),
        float(0.5),
        float(8.5),
        std::vec![0; 12],
        float(2.0),
        // Controller, shading; the texture; source, clock.
        std::vec![1, 1],
        std::vec![2],
        float(0.125),
        float(2.0),
        float(-45.0),
        std::vec![0xAC, 0x02],
        std::vec![1, 1],
        // The scene's materials.
        std::vec![1, 0xAC, 0x02],
    ];
    assert_eq!(bytes(&ToDevice::Scene(scene)), expected.concat());
}

#[test]
fn tick_record_bytes() {
    let sample = TickRecord {
        tick: 9,
        hip: GridPoint::new([1, 2, 3], Vec3::X * 0.5),
        proxy: GridPoint::new([1, 2, 4], Vec3::X * 0.5),
        force_n: Vec3::Z,
        view: 3,
        state: ContactState::Touching,
        missing_tile: Some(TileIndex::new(-1, 70)),
        mode: Mode::Armed,
        limits: Limits::TERRAIN_MISSING,
        fault: Some(Fault::Panicked),
        work: 200,
        cost: 1,
        worst_cost: 2,
        late: 3,
    };
    let place = [float(0.5), float(0.0), float(0.0)].concat();
    let expected = [
        std::vec![9, 2, 4, 6],
        place.clone(),
        std::vec![2, 4, 8],
        place,
        float(0.0),
        float(0.0),
        float(1.0),
        // Placement, state, tile, mode, limits, fault.
        std::vec![3, 2, 1, 0x01, 0x8C, 0x01, 4, 0x80, 0x01, 1, 13],
        std::vec![0xC8, 0x01, 1, 2, 3],
    ]
    .concat();
    assert_eq!(bytes(&sample), expected);
    let answer = ToHost::PointAnswer { seq: 5, sample };
    assert_eq!(bytes(&answer), [std::vec![4, 5], expected.clone()].concat());
    let telemetry = Telemetry {
        first: 6,
        dropped: 7,
        samples: core::iter::once(sample).collect(),
    };
    let telemetry = bytes(&ToHost::Telemetry(telemetry));
    assert_eq!(telemetry, [std::vec![3, 6, 7, 1], expected].concat());
}

#[test]
fn scene_change_and_clutch_bytes() {
    let scene = Scene {
        epoch: 7,
        level: 1,
        size: FieldSize::new(2, 3),
        top: 1,
        fallback: Some(FALLBACK),
        cell_mm: 1.5,
        home: GridPoint::default(),
        params: SurfaceParams::PREMIUM,
        source: Source::Encoders,
        hold_clock: false,
        materials: None,
    };
    let view = SceneChange {
        number: 200,
        scene,
        hip: GridPoint::new([1, 2, -1], Vec3::ZERO),
        keeps_tiles: true,
        in_contact: None,
    };
    let scene = bytes(&ToDevice::Scene(scene)).split_off(1);
    let expected = [
        std::vec![11, 200],
        scene,
        std::vec![2, 4, 1],
        [float(0.0), float(0.0), float(0.0)].concat(),
        std::vec![1, 0],
    ];
    assert_eq!(bytes(&ToDevice::SceneChange(view)), expected.concat());
    let place = |x| GridPoint::new([x, 0, 0], Vec3::ZERO);
    let in_contact = SceneChange {
        in_contact: Some(ContactMap {
            from: place(1),
            to: place(2),
            scale: Vec3::splat(2.0),
        }),
        ..view
    };
    let zeros = [float(0.0), float(0.0), float(0.0)].concat();
    let mut expected = expected.concat();
    expected.pop();
    expected.extend(
        [
            &[1, 2, 0, 0][..],
            &zeros,
            &[4, 0, 0],
            &zeros,
            &float(2.0).repeat(3),
        ]
        .concat(),
    );
    assert_eq!(bytes(&ToDevice::SceneChange(in_contact)), expected);
    let holds = [
        (ClutchMode::Released, 0),
        (ClutchMode::WithHand, 1),
        (ClutchMode::InPlace, 2),
    ];
    for (hold, byte) in holds {
        let request = Request::Clutch { hold };
        let query = ToDevice::Request { number: 4, request };
        assert_eq!(bytes(&query), [5, 4, 10, byte]);
    }
    let request = Request::CancelChange { epoch: 300 };
    let query = ToDevice::Request { number: 4, request };
    assert_eq!(bytes(&query), [5, 4, 12, 0xAC, 0x02]);
    let result = Err(Refusal::NoSuchChange);
    let answer = ToHost::Answer(Answer { number: 4, result });
    assert_eq!(bytes(&answer), [8, 4, 1, 11]);
}

#[test]
fn tile_and_tile_request_bytes() {
    let key = TileKey::new(1, -2, 100);
    let request = ToHost::TileRequest { epoch: 7, key };
    assert_eq!(bytes(&request), [2, 7, 1, 3, 0xC8, 0x01]);
    let tile = ToDevice::Tile(TileMessage {
        epoch: 7,
        key,
        heights: Heights::Flat {
            base: -1,
            height: 0.5,
        },
    });
    let expected = [std::vec![2, 7, 1, 3, 0xC8, 0x01, 1, 1], float(0.5)].concat();
    assert_eq!(bytes(&tile), expected);
    let heights = Heights::Packed {
        base: -3,
        bytes: &[9, 0, 7],
    };
    let tile = ToDevice::Tile(TileMessage {
        epoch: 7,
        key,
        heights,
    });
    let expected = [2, 7, 1, 3, 0xC8, 0x01, 3, 5, 3, 9, 0, 7];
    assert_eq!(bytes(&tile), expected);
}

#[test]
fn material_tile_and_table_bytes() {
    let tile = TileMessage {
        epoch: 7,
        key: TileKey::new(1, -2, 100),
        heights: Heights::NoData,
    };
    let plain = bytes(&ToDevice::Tile(tile)).split_off(1);
    for (materials, expected) in [
        (TileMaterials::One(3), std::vec![0, 3]),
        (TileMaterials::Runs(&[3, 255]), std::vec![1, 2, 3, 255]),
        (TileMaterials::Each(&[0x21]), std::vec![2, 1, 0x21]),
    ] {
        let tile = ToDevice::MaterialTile(MaterialTile { tile, materials });
        assert_eq!(
            bytes(&tile),
            [std::vec![13], plain.clone(), expected].concat()
        );
    }
    let material = Material {
        stiffness_n_per_mm: 0.5,
        friction: Friction {
            static_mu: 0.75,
            dynamic_mu: 0.5,
            viscous_s: 0.25,
        },
        damping_ns_per_m: 2.0,
        texture: Texture {
            pattern: Pattern::Grain,
            amplitude_mm: 0.125,
            wavelength_mm: 1.0,
            direction_deg: 0.0,
            seed: 300,
        },
    };
    let table = MaterialTable::new(&[material]).expect("one");
    let numbers = [0.5, 0.75, 0.5, 0.25, 2.0].map(float).concat();
    let texture = [0.125, 1.0, 0.0].map(float).concat();
    let expected = [
        std::vec![1],
        numbers,
        std::vec![1],
        texture,
        std::vec![0xAC, 0x02],
    ]
    .concat();
    let mut buffer = [0; MAX_TABLE_BYTES];
    assert_eq!(table_bytes(&table, &mut buffer), expected);
}

#[test]
fn host_hello_bytes() {
    let hello = InSession {
        session: SessionNumber::new(300),
        message: ToDevice::Hello(HostHello {
            protocol: PROTOCOL,
            number: 9,
            silence_s: 180,
        }),
    };
    // The session is 300 | 128; then variant, protocol, number, seconds.
    assert_eq!(bytes(&hello), [0xAC, 0x03, 0, 16, 9, 0xB4, 0x01]);
}

#[test]
fn device_hello_bytes() {
    let serial: [u8; 12] = core::array::from_fn(|i| 0xA0 + i as u8);
    let hello = ToHost::Hello(DeviceHello {
        protocol: PROTOCOL,
        number: 9,
        opened_by: 8,
        board: "b".try_into().expect("fits"),
        serial: SerialNumber::new(serial),
        version: "v1".try_into().expect("fits"),
        window: 4,
        tick_hz: 1000,
        latency_us: 190,
        clock_hz: 300,
        epoch: Some(7),
        last: LastSession {
            session: 300,
            opened_by: 6,
            end: SessionEnd::HostSilent,
            count: SampleCount {
                sent: 5,
                dropped: 1,
            },
        },
    });
    let expected = [
        std::vec![0, 16, 9, 8, 1, b'b'],
        serial.to_vec(),
        std::vec![2, b'v', b'1', 4, 0xE8, 0x07, 0xBE, 0x01, 0xAC, 0x02, 1, 7],
        std::vec![0xAC, 0x02, 6, 3, 5, 1],
    ];
    assert_eq!(bytes(&hello), expected.concat());
    let shown = std::format!("{}", SerialNumber::new(serial));
    assert_eq!(shown, "A0A1A2A3A4A5A6A7A8A9AAAB");
    assert!(SerialNumber::NONE.is_none() && !SerialNumber::new(serial).is_none());
}

#[test]
fn detach_and_answer_bytes() {
    assert_eq!(bytes(&ToDevice::Detach), [10]);
    assert_eq!(bytes(&ToHost::Detached), [11]);
}

#[test]
fn session_closed_bytes() {
    for (end, byte) in [(SessionEnd::Replaced, 2), (SessionEnd::HostSilent, 3)] {
        assert_eq!(
            bytes(&ToHost::SessionClosed { number: 9, end }),
            [12, 9, byte]
        );
    }
}

#[test]
fn query_and_answer_bytes() {
    let number = 200;
    assert_eq!(bytes(&ToDevice::Status { number }), [6, 200]);
    assert_eq!(bytes(&ToDevice::GetCalibration { number }), [7, 200]);
    let calibration = None;
    let answer = ToHost::Calibration {
        number,
        calibration,
    };
    assert_eq!(bytes(&answer), [7, 200, 0]);
}

#[test]
fn request_and_answer_bytes() {
    let request = Request::Zero {
        counts: [1, -1, 64],
    };
    let message = ToDevice::Request {
        number: 200,
        request,
    };
    assert_eq!(bytes(&message), [5, 200, 2, 2, 1, 0x80, 0x01]);
    let result = Err(Refusal::NotWhileArmed);
    let answer = ToHost::Answer(Answer {
        number: 200,
        result,
    });
    assert_eq!(bytes(&answer), [8, 200, 1, 1]);
    let (number, request) = (201, Request::Mark);
    let message = ToDevice::Request { number, request };
    assert_eq!(bytes(&message), [5, 201, 11]);
    let marked = ToHost::Marked { number, tick: 300 };
    assert_eq!(bytes(&marked), [13, 201, 0xAC, 0x02]);
    let count = SampleCount {
        sent: 300,
        dropped: 2,
    };
    assert_eq!(bytes(&ToHost::Goodbye(count)), [10, 0xAC, 0x02, 2]);
}
