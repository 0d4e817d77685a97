//! Hostile programs: one that sends to the device, and one that answers a host.

use hapterra_core::Vec3;
use hapterra_core::clutch::ClutchMode;
use hapterra_core::contact::Friction;
use hapterra_core::force::{Controller, Damping, Pattern, Shading, SurfaceParams, Texture};
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Report;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{ContactMap, HipCommand, Scene, SceneChange, Source, TickRecord};
use hapterra_core::terrain::{FieldSize, TileKey};
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL, SerialNumber};
use hapterra_core::wire::materials::{MaterialScene, MaterialTile, TileMaterials};
use hapterra_core::wire::message::{Heights, Telemetry, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{LastSession, SampleCount, SessionNumber};
use hapterra_core::wire::version::VersionCheck;

use super::frames;
use crate::random::Random;

/// Most bytes of a hostile program in a millisecond.
const BYTES_PER_MS: usize = 2_048;

/// Returns a hostile host's bytes of a millisecond.
pub fn host(random: &mut Random) -> Vec<u8> {
    match random.below(6) {
        0 => noise(random, BYTES_PER_MS),
        1 => vec![0; random.below(BYTES_PER_MS)],
        // The start of a frame without its end, or an end without a start.
        2 => {
            let frame = host_frame(random);
            let cut = random.below(frame.len().max(1));
            let part = if random.below(2) == 0 {
                &frame[..cut]
            } else {
                &frame[cut..]
            };
            part.to_vec()
        }
        _ => {
            let mut bytes = Vec::new();
            for _ in 0..1 + random.below(8) {
                bytes.extend(host_frame(random));
            }
            bytes.truncate(BYTES_PER_MS);
            bytes
        }
    }
}

fn noise(random: &mut Random, max_bytes: usize) -> Vec<u8> {
    let length = random.below(max_bytes);
    (0..length).map(|_| random.bits() as u8).collect()
}

/// Returns a well-formed frame of one of a few sessions.
fn host_frame(random: &mut Random) -> Vec<u8> {
    if random.below(12) == 0 {
        let protocol = random.bits() as u16;
        return frames::version_check(VersionCheck::Query { protocol });
    }
    let session = SessionNumber::new(1_000 * random.below(3) as u32);
    frames::from_host(session, &host_message(random))
}

/// Returns a well-formed message with invalid content. It is never a calibration that the device
/// may accept: while disarmed it accepts those from any host.
fn host_message<'b>(random: &mut Random) -> ToDevice<'b> {
    let words = [i32::MIN, -1, 0, 1, 1_000_000, i32::MAX];
    let word = |random: &mut Random| words[random.below(words.len())];
    let epoch = random.bits() as u32;
    match random.below(12) {
        0 | 1 => ToDevice::Hello(HostHello {
            protocol: [PROTOCOL, random.bits() as u16][random.below(2)],
            number: random.bits() as u8,
            silence_s: random.bits() as u16,
        }),
        2 => match random.below(2) {
            0 => ToDevice::Scene(host_scene(random, epoch)),
            _ => ToDevice::MaterialScene(MaterialScene {
                scene: host_scene(random, epoch),
                table: [&[][..], &[1], &[0xFF; 40]][random.below(3)],
            }),
        },
        3 => ToDevice::MaterialTile(MaterialTile {
            tile: TileMessage {
                epoch,
                key: TileKey::new(random.bits() as u8, word(random), word(random)),
                heights: Heights::NoData,
            },
            materials: TileMaterials::Runs(&[200, 255, 0, 0][..random.below(5)]),
        }),
        4 => ToDevice::Tile(TileMessage {
            epoch,
            key: TileKey::new(random.bits() as u8, word(random), word(random)),
            heights: Heights::Flat {
                base: word(random),
                height: f32::NAN,
            },
        }),
        5 => ToDevice::Hip(HipCommand {
            seq: random.bits() as u32,
            hip: GridPoint::default(),
        }),
        6 => ToDevice::Status { number: 0 },
        7 => match random.below(2) {
            0 => ToDevice::Heartbeat,
            _ => ToDevice::SceneChange(SceneChange {
                number: random.bits() as u8,
                scene: host_scene(random, epoch),
                hip: GridPoint::default(),
                keeps_tiles: random.below(2) == 0,
                in_contact: (random.below(2) == 0).then(|| ContactMap {
                    from: GridPoint::default(),
                    to: GridPoint::new([word(random), word(random), 0], Vec3::ZERO),
                    scale: Vec3::splat(f32::from_bits(random.bits() as u32)),
                }),
            }),
        },
        8 => {
            let number = 0;
            let question = ToDevice::GetCalibration { number };
            [question, ToDevice::Bye, ToDevice::Close][random.below(3)].clone()
        }
        _ => ToDevice::Request {
            number: random.bits() as u8,
            request: host_request(random),
        },
    }
}

/// Returns a scene that a device may refuse or accept.
fn host_scene(random: &mut Random, epoch: u32) -> Scene {
    let words = [i32::MIN, -1, 0, 1, 1_000_000, i32::MAX];
    let word = |random: &mut Random| words[random.below(words.len())];
    Scene {
        epoch,
        level: random.bits() as u8,
        size: FieldSize::new(word(random), word(random)),
        top: word(random),
        fallback: None,
        cell_mm: [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30, 0.5][random.below(6)],
        home: GridPoint::default(),
        params: SurfaceParams {
            stiffness_n_per_mm: [f32::NAN, -1.0, 1e30, 0.5][random.below(4)],
            max_force_n: [f32::INFINITY, -8.0, 8.5][random.below(3)],
            friction: Friction::coulomb([0.0, -1.0, f32::NAN][random.below(3)]),
            damping: Damping {
                ns_per_m: [0.0, -1.0, f32::NAN, 1e30][random.below(4)],
                controller: Controller::On,
            },
            shading: [Shading::None, Shading::Smooth][random.below(2)],
            texture: Texture {
                pattern: [Pattern::None, Pattern::Grain, Pattern::Grating][random.below(3)],
                amplitude_mm: [0.1, 0.0, -1.0, f32::NAN, 1e30][random.below(5)],
                wavelength_mm: [1.0, 0.0, f32::NAN, 1e30][random.below(4)],
                direction_deg: [0.0, 1e30, f32::NAN][random.below(3)],
                seed: random.bits() as u32,
            },
        },
        source: [Source::Encoders, Source::Points][random.below(2)],
        hold_clock: random.below(2) == 0,
        materials: [None, Some(random.bits() as u32)][random.below(2)],
    }
}

fn host_request(random: &mut Random) -> Request {
    let mut calibration = Calibration::PREMIUM_1_5;
    calibration.l1_mm = -1.0;
    [
        Request::Arm,
        Request::Disarm,
        Request::SetCalibration { calibration },
        Request::StoreCalibration,
        Request::DropScene,
        Request::ClearFault { fault: None },
        Request::Clutch {
            hold: ClutchMode::WithHand,
        },
        Request::Clutch {
            hold: ClutchMode::InPlace,
        },
        Request::Clutch {
            hold: ClutchMode::Released,
        },
    ][random.below(8)]
}

/// Behaviour of a program that is not a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Behaviour {
    /// It sends nothing.
    Mute,
    /// It sends noise without end.
    Noise,
    /// It sends one byte every half second.
    Drips,
    /// It answers each open, and sends nothing else.
    OpensOnly,
    /// It accepts every scene, then requests non-existent tiles as fast as it can.
    RequestsEverything,
    /// It accepts every scene, then refuses the protocol that both use, and others.
    RefusesLate,
    /// It accepts every scene and sends samples with random numbers.
    CountsWildly,
    /// It refuses the scene.
    RefusesScenes,
}

impl Behaviour {
    /// All behaviours.
    pub const ALL: [Self; 8] = [
        Self::Mute,
        Self::Noise,
        Self::Drips,
        Self::OpensOnly,
        Self::RequestsEverything,
        Self::RefusesLate,
        Self::CountsWildly,
        Self::RefusesScenes,
    ];

    /// Returns its bytes in the millisecond `now` to a host that serves a scene and has sent an
    /// open with this number.
    pub fn bytes_to_send(
        self,
        now: u64,
        scene: &Scene,
        (session, number): (SessionNumber, u8),
        random: &mut Random,
    ) -> Vec<u8> {
        let often = now.is_multiple_of(10);
        let mut bytes = Vec::new();
        let mut send = |message: ToHost| bytes.extend(frames::from_device(session, &message));
        let greets = !matches!(self, Self::Mute | Self::Noise | Self::Drips);
        if greets && often {
            send(ToHost::Hello(hello(number)));
        }
        let epoch = scene.epoch;
        if greets && often && self != Self::OpensOnly {
            let accepted = self != Self::RefusesScenes;
            send(ToHost::SceneAck { epoch, accepted });
        }
        match self {
            Self::Noise => return noise(random, BYTES_PER_MS),
            Self::Drips if now.is_multiple_of(500) => return vec![random.bits() as u8],
            Self::RequestsEverything => {
                for _ in 0..20 {
                    let (level, row) = (random.bits() as u8, random.bits() as i32);
                    let key = TileKey::new(level, i32::MAX, row);
                    send(ToHost::TileRequest { epoch, key });
                }
            }
            Self::RefusesLate if now.is_multiple_of(100) => {
                let protocol = [PROTOCOL, PROTOCOL + 1][random.below(2)];
                bytes.extend(frames::version_check(VersionCheck::Refused { protocol }));
            }
            Self::CountsWildly => {
                send(ToHost::Telemetry(Telemetry {
                    first: random.bits() as u32,
                    dropped: random.bits() as u32,
                    samples: [TickRecord::default(); 8].into_iter().collect(),
                }));
                send(ToHost::Heartbeat {
                    epoch: Some(epoch),
                    count: count(random),
                    report: Report::default(),
                });
            }
            _ => {}
        }
        bytes
    }
}

fn count(random: &mut Random) -> SampleCount {
    SampleCount {
        sent: random.bits() as u32,
        dropped: random.bits() as u32,
    }
}

/// Returns a `DeviceHello` with control sequences for a terminal.
#[must_use]
pub fn hello(number: u8) -> DeviceHello {
    DeviceHello {
        protocol: PROTOCOL,
        number,
        board: "\x1b[2J\x1b]0;x\x07".try_into().unwrap_or_default(),
        serial: SerialNumber::new([0x1B; 12]),
        version: "\r\n\u{202e}".try_into().unwrap_or_default(),
        window: 0,
        tick_hz: 0,
        latency_us: 0,
        clock_hz: 0,
        epoch: None,
        opened_by: number,
        last: LastSession::default(),
    }
}
