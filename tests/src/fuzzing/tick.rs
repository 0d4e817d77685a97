//! Arbitrary scenes, tiles, points and encoder counts as input of the tick.

use hapterra_core::Vec3;
use hapterra_core::clutch::ClutchMode;
use hapterra_core::contact::{Friction, WORK_PER_TICK};
use hapterra_core::force::{
    Controller, Damping, MaterialTable, Pattern, Shading, SurfaceParams, Texture,
};
use hapterra_core::grid::{Cell, GridPoint, MAX_CELL};
use hapterra_core::guard::{Fault, GuardInputs};
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{ContactMap, HipCommand, Scene, SceneChange, Source};
use hapterra_core::terrain::{CoarseTile, Fallback, FieldSize, Tile, TileKey};
use hapterra_core::tick::{Command, Haptics, Outcome};

use super::bytes::Bytes;
use super::materials;

/// Tiles along the side of the window.
const SIDE: usize = 2;
/// Additional buffers: one in transfer, and those that the fallbacks of a scene and of the next one
/// keep.
const SPARE_TILES: usize = 5;

/// Runs an input, and checks every tick.
///
/// # Panics
/// If a tick's output is invalid.
pub fn run(data: &[u8]) {
    let mut bytes = Bytes(data);
    let mut tiles = vec![Tile::VACANT; SIDE * SIDE + SPARE_TILES];
    let mut slots = tiles.iter_mut();
    let mut next = || slots.next().expect("one for each slot, and spare ones");
    let window = std::array::from_fn(|_| std::array::from_fn(|_| next()));
    let mut spare: Vec<&mut Tile> = (0..SPARE_TILES).map(|_| next()).collect();
    let mut haptics = Haptics::<SIDE>::new(window, TickRate::DEFAULT, None);
    haptics.configure(Kinematics::new(&Calibration::PREMIUM_1_5).expect("a preset"));
    let mut params = SurfaceParams::PREMIUM;
    let mut table = MaterialTable::EMPTY;
    // Ticks since the scene was set, if known.
    let mut ticks = Some(0);
    while !bytes.is_empty() {
        let kind = bytes.byte();
        match kind % 8 {
            _ if kind >= 252 => {
                let mut scene = scene(&mut bytes);
                if kind == 255 {
                    scene.materials = Some(table.check_sum());
                }
                let view = SceneChange {
                    number: kind,
                    scene,
                    hip: position(&mut bytes),
                    keeps_tiles: kind.is_multiple_of(2),
                    in_contact: (kind == 253).then(|| contact_map(&mut bytes)),
                };
                spare.extend(haptics.accept(Command::SceneChange(view)).ok().flatten());
                ticks = None;
            }
            // A table, and a scene that belongs to it or to another.
            _ if kind == 247 || kind == 246 => {
                let (reported, mut scene) = (materials::table(&mut bytes), scene(&mut bytes));
                // As on the link, which refuses a scene that cannot be rendered.
                if reported.is_valid() && scene.is_valid() {
                    haptics.set_materials(&reported);
                    table = reported;
                }
                scene.materials = Some(match kind {
                    247 => table.check_sum(),
                    _ => bytes.int().cast_unsigned(),
                });
                if is_taken(&scene, &table) {
                    (params, ticks) = (scene.params, Some(0));
                }
                spare.extend(haptics.accept(Command::Scene(scene)).ok().flatten());
            }
            _ if kind == 251 => {
                let held = bytes.byte().is_multiple_of(2);
                spare.extend(haptics.accept(Command::ClutchInput(held)).ok().flatten());
            }
            _ if kind >= 248 => {
                let holds = [
                    ClutchMode::Released,
                    ClutchMode::WithHand,
                    ClutchMode::InPlace,
                ];
                let hold = holds[usize::from(kind - 248)];
                spare.extend(haptics.accept(Command::Clutch(hold)).ok().flatten());
            }
            0 => {
                let scene = scene(&mut bytes);
                if scene.is_valid() {
                    (params, ticks) = (scene.params, Some(0));
                }
                spare.extend(haptics.accept(Command::Scene(scene)).ok().flatten());
            }
            1 | 2 => {
                let tile = spare.pop().expect("two fallbacks keep four at most");
                fill(tile, &mut bytes);
                if kind % 16 >= 8 {
                    materials::fill(tile, &table, &mut bytes);
                }
                spare.extend(haptics.accept(Command::Tile(tile)).ok().flatten());
            }
            3 => {
                let seen = haptics.report().fault;
                spare.extend(haptics.accept(Command::ClearFault(seen)).ok().flatten());
            }
            4 => {
                spare.extend(
                    haptics
                        .accept(Command::Trip(Fault::Hardware))
                        .ok()
                        .flatten(),
                );
            }
            5 => {
                let hip = position(&mut bytes);
                spare.extend(
                    haptics
                        .accept(Command::Hip(HipCommand { seq: 1, hip }))
                        .ok()
                        .flatten(),
                );
            }
            6 => {
                spare.extend(haptics.accept(Command::Arm).ok().flatten());
            }
            _ => {
                spare.extend(haptics.accept(Command::Zero([0; 3])).ok().flatten());
            }
        }
        spare.extend(std::iter::from_fn(|| haptics.take_spare()));
        let counts = [
            bytes.int(),
            i32::from(bytes.byte()),
            i32::from(bytes.byte()),
        ];
        let sense = GuardInputs {
            counts,
            dead_man: counts[2] % 2 == 0,
            emergency_stop: counts[1] == 255,
            hardware_failed: counts[1] == 254,
            outputs_not_as_set: counts[1] == 253,
            amplifier_not_ready: counts[1] == 252,
            measured_ma: (counts[2] > 128).then_some([counts[0] as i16, 0, 0]),
            clutch: false,
        };
        let outcome = haptics.tick(&sense, true);
        let is_next = ticks.is_none_or(|ticks: u32| outcome.sample.tick == ticks + 1);
        assert!(is_next, "{ticks:?}, then {outcome:?}");
        ticks = Some(outcome.sample.tick);
        // A change of placement may have waited for this tick.
        params = haptics.scene().map_or(params, |scene| scene.params);
        check(&outcome, &params);
    }
}

fn contact_map(bytes: &mut Bytes<'_>) -> ContactMap {
    ContactMap {
        from: position(bytes),
        to: position(bytes),
        scale: Vec3::new(bytes.float(), bytes.float(), bytes.float()),
    }
}

/// Returns true if the loop accepts a scene with its present table.
fn is_taken(scene: &Scene, table: &MaterialTable) -> bool {
    let is_here = |sum: u32| sum == table.check_sum() && table.is_valid();
    scene.is_valid() && scene.materials.is_none_or(is_here)
}

fn scene(bytes: &mut Bytes<'_>) -> Scene {
    let kind = bytes.byte();
    let mut scene = Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(64, 64),
        top: 1 << 20,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::new([30, 30, 2], Vec3::ZERO),
        params: SurfaceParams::PREMIUM,
        source: if kind & 2 == 0 {
            Source::Points
        } else {
            Source::Encoders
        },
        hold_clock: false,
        materials: None,
    };
    if kind & 4 != 0 {
        scene.size = FieldSize::new(bytes.int(), bytes.int());
        scene.top = bytes.int();
    }
    if kind & 6 == 2 {
        scene.fallback = fallback(bytes);
    }
    if kind & 8 != 0 {
        scene.cell_mm = bytes.float();
        scene.home = position(bytes);
        scene.params = SurfaceParams {
            stiffness_n_per_mm: bytes.float(),
            max_force_n: bytes.float(),
            ..SurfaceParams::PREMIUM
        };
    }
    if kind & 16 != 0 {
        let share = |byte: u8| f32::from(byte) / 64.0;
        let dynamic_mu = share(bytes.byte());
        scene.params.friction = Friction {
            dynamic_mu,
            static_mu: dynamic_mu + share(bytes.byte()),
            viscous_s: share(bytes.byte()) / 32.0,
        };
    }
    if kind & 32 != 0 {
        scene.params.damping = Damping {
            ns_per_m: f32::from(bytes.byte()) / 255.0 * Damping::MAX_NS_PER_M,
            controller: Controller::On,
        };
    }
    if kind & 64 != 0 {
        scene.params.shading = Shading::Smooth;
    }
    if kind & 128 != 0 {
        scene.params.texture = texture(bytes);
    }
    scene
}

/// Returns a valid fallback, one of arbitrary numbers, or none.
fn fallback(bytes: &mut Bytes<'_>) -> Option<Fallback> {
    let kind = bytes.byte();
    let mut part = |shift: u8| match kind >= 250 {
        true => CoarseTile {
            first: Cell::new(bytes.int(), bytes.int()),
            shift: bytes.byte(),
        },
        false => CoarseTile {
            first: Cell::new(i32::from(kind % 32) - 16, i32::from(kind / 32)),
            shift,
        },
    };
    let (near, wide) = (part(2), part(3));
    let near = kind.is_multiple_of(2).then_some(near);
    (!kind.is_multiple_of(3)).then_some(Fallback { wide, near })
}

/// Returns a valid texture, or one of arbitrary numbers.
pub(super) fn texture(bytes: &mut Bytes<'_>) -> Texture {
    let (kind, share) = (bytes.byte(), f32::from(bytes.byte()) / 255.0);
    let pattern = [Pattern::Grain, Pattern::Grating][usize::from(kind % 2)];
    if kind >= 250 {
        return Texture {
            pattern,
            amplitude_mm: bytes.float(),
            wavelength_mm: bytes.float(),
            direction_deg: bytes.float(),
            seed: bytes.int() as u32,
        };
    }
    let (shortest, longest) = Texture::WAVELENGTHS_MM;
    let wavelength_mm = [shortest, 1.0, 7.0, longest][usize::from(kind / 2 % 4)];
    Texture {
        pattern,
        amplitude_mm: (share * wavelength_mm * Texture::STEEPEST).min(Texture::MAX_AMPLITUDE_MM),
        wavelength_mm,
        direction_deg: f32::from(kind),
        seed: u32::from(kind),
    }
}

fn fill(tile: &mut Tile, bytes: &mut Bytes<'_>) {
    // A level of the field, of a fallback, or neither.
    let level = [0, 0, 2, 3, 1][usize::from(bytes.byte() / 60)];
    let key = TileKey::new(
        level,
        i32::from(bytes.byte() % 4) - 1,
        i32::from(bytes.byte() % 4) - 1,
    );
    let base = if bytes.byte() == 255 { bytes.int() } else { 0 };
    let heights: Vec<f32> = (0..7).map(|_| bytes.height()).collect();
    // A refused tile stays vacant, and the loop refuses it.
    let _ = tile.fill(key, base, |col, row| heights[(3 * col + 5 * row) % 7]);
}

fn position(bytes: &mut Bytes<'_>) -> GridPoint {
    if bytes.byte() == 255 {
        let cell = [bytes.int(), bytes.int(), bytes.int()];
        return GridPoint::new(cell, Vec3::new(bytes.float(), bytes.float(), bytes.float()));
    }
    let cell = [bytes.byte() % 64, bytes.byte() % 64, bytes.byte() % 8];
    let mut part = || f32::from(bytes.byte()) / 128.0;
    let offset = Vec3::new(part(), part(), part());
    GridPoint::new(cell.map(i32::from), offset - Vec3::new(0.0, 0.0, 4.0))
}

/// Checks the output of one tick, rendered with `params`.
///
/// # Panics
/// If it is invalid.
pub fn check(outcome: &Outcome, params: &SurfaceParams) {
    let (sample, drive) = (&outcome.sample, &outcome.drive);
    let force = sample.force_n.as_dvec3().length();
    // A limit below the smallest normal number is only kept to that number.
    let limit = f64::from(params.max_force_n.max(f32::MIN_POSITIVE)) * (1.0 + 1e-6);
    assert!(sample.force_n.is_finite() && force <= limit, "{outcome:?}");
    assert!(drive.currents_a.is_finite(), "{outcome:?}");
    let max = Calibration::PREMIUM_1_5.peak_current_a;
    assert!(drive.currents_a.abs().cmple(max).all(), "{outcome:?}");
    let off = drive.currents_a == Vec3::ZERO;
    assert!(drive.enabled || off, "{outcome:?}");
    assert!(sample.fault.is_none() || !drive.enabled, "{outcome:?}");
    assert!(sample.work <= WORK_PER_TICK, "{outcome:?}");
    for point in [&sample.hip, &sample.proxy] {
        let (cell, frac) = (point.cell(), point.frac().to_array());
        assert!(cell.iter().all(|c| c.abs() <= MAX_CELL), "{outcome:?}");
        assert!(frac.iter().all(|f| (0.0..1.0).contains(f)), "{outcome:?}");
    }
}
